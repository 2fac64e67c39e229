"""``ppafo rig simulate``: what the simulated test bench can do, and synthetic recordings from it."""

from collections.abc import Sequence
from pathlib import Path

from ppafo.cli import output
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


def simulate_bench(
    experiment: str, preset: str, seed: int, device: str, valve: str | None, overrides: Sequence[str], out: Path
) -> Said:
    """Record one experiment and write the recording, marked as synthetic, with the true values beside it."""
    from ppafo.rig.experiments import NOTICE, check_rig_folder, find_experiment, record, write_rig_recording

    find_experiment(experiment)
    with output.blame_out_option():
        check_rig_folder(out, experiment)
    made = record(experiment, preset, seed, device, overrides, valve)
    files = write_rig_recording(out, made)
    counted = f"{len(made.recording)} samples of {', '.join(made.recording.names)}"
    text = f"{experiment}: {NOTICE}\n{counted}\nwritten: {out} ({', '.join(files)})"
    document = {"folder": str(out), "files": list(files), **made.truth}
    return Said(text, document)
