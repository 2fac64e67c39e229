"""The experiments and presets of the simulated bench, in words and as data."""

from typing import Any

from ppafo.rig.experiments import EXPERIMENTS
from ppafo.rig.preset import list_presets, load_preset


def overview() -> tuple[str, dict[str, Any]]:
    """Return the experiments and the presets with what they are, as text and as plain data."""
    experiments = {item.name: item.summary for item in EXPERIMENTS.values()}
    presets = {name: load_preset(name).title for name in list_presets()}
    width = max(map(len, [*experiments, *presets]))
    lines = ["experiments (recordings are synthetic):"]
    lines += [f"  {name:<{width}}  {summary}" for name, summary in experiments.items()]
    lines += ["presets:"]
    lines += [f"  {name:<{width}}  {title}" for name, title in presets.items()]
    document = {
        "experiments": [{"name": name, "summary": summary} for name, summary in experiments.items()],
        "presets": [{"name": name, "title": title} for name, title in presets.items()],
    }
    return "\n".join(lines), document
