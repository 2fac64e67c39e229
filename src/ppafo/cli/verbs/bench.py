"""Command of the simulated test bench."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Folder, Name, Overrides, Whole, Word

if TYPE_CHECKING:
    from ppafo.cli.output import CommandOutput


def rig_simulate(
    experiment: Annotated[str, Word("EXPERIMENT")],
    *,
    preset: Annotated[str, Word("PRESET")] = "paper-bench",
    seed: Whole = 1,
    device: Annotated[str, Word("SET")] = "ppafo2011",
    valve: Name | None = None,
    overrides: Overrides = (),
    out: Folder = Path("out/rig"),
) -> CommandOutput:
    """Run an experiment on the simulated test bench, and write the recording of a laboratory, marked as synthetic.

    experiment: name of an experiment
    preset: preset or .toml file; default paper-bench
    seed: random seed of noise and offsets; default 1
    device: parameter set or .toml file; default ppafo2011
    valve: valve of the parameter set; default: its default valve
    out: folder of the recording and of rig.json with the true values; default out/rig

    >>> print(rig_simulate("valve-map", out=Path("rig")).text)
    valve-map: synthetic: made by the simulated test bench of ppafo in place of a measurement
    201 samples of command, mass_flow, upstream_pressure, downstream_pressure
    written: rig (valve-map.csv, rig.json)
    """
    from ppafo.cli.output import CommandOutput, blame_out_option
    from ppafo.rig.experiments import NOTICE, record
    from ppafo.rig.folder import check_rig_folder, write_rig_recording

    # A refused folder is told before anything runs.
    with blame_out_option():
        check_rig_folder(out, experiment)
    rig_recording = record(experiment, preset, seed, device, overrides, valve)
    files = write_rig_recording(out, rig_recording)
    recording = rig_recording.recording
    samples = f"{len(recording)} samples of {', '.join(recording.names)}"
    lines = [f"{experiment}: {NOTICE}", rig_recording.truth.get("replaced", ""), samples]
    if {"angle", "command"} <= set(recording.names):
        words = ["ppafo", "validate", device, str(out / files[0]), *(() if valve is None else ("--valve", valve))]
        lines.append(f"to compare: {shlex.join([*words, '--motion', rig_recording.motion])}")
    text = "\n".join((*filter(None, lines), f"written: {out} ({', '.join(files)})"))
    return CommandOutput(text, {"folder": str(out), "files": list(files), **rig_recording.truth})


def list_rig() -> CommandOutput:
    """List experiments and presets of the simulated bench with descriptions."""
    from ppafo.cli.output import CommandOutput
    from ppafo.rig.experiments import overview

    return CommandOutput(*overview())
