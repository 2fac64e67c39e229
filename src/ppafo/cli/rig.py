"""``ppafo rig simulate --list``: experiments and presets of the simulated test bench."""

from ppafo.cli.output import Said


def list_rig() -> Said:
    """Return the experiments and the presets with what they are."""
    from ppafo.rig import list_presets, load_preset
    from ppafo.rig.experiments import EXPERIMENTS

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
    return Said("\n".join(lines), document)
