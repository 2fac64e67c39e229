"""Commands for test benches: simulated experiments, and recording of a bench over a link."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Count, File, Folder, Name, Overrides, Patience, Port, Time, Whole, Word
from ppafo.progress import Report, report_nothing

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
    progress: Report = report_nothing,
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
    from ppafo.rig.experiments import NOTICE, find_experiment, record
    from ppafo.rig.folder import check_rig_folder, write_rig_recording

    # An unknown name and a refused folder are told before anything runs.
    find_experiment(experiment)
    with blame_out_option():
        check_rig_folder(out, experiment)
    rig_recording = record(experiment, preset, seed, device, overrides, valve, progress)
    files = write_rig_recording(out, rig_recording)
    recording = rig_recording.recording
    samples = f"{len(recording)} samples of {', '.join(recording.names)}"
    lines = [f"{experiment}: {NOTICE}", rig_recording.truth.get("replaced", ""), samples]
    if {"angle", "command"} <= set(recording.names):
        words = ["ppafo", "validate", device, str(out / files[0]), *(() if valve is None else ("--valve", valve))]
        lines.append(f"to compare: {shlex.join([*words, '--motion', rig_recording.motion])}")
    text = "\n".join((*filter(None, lines), f"written: {out} ({', '.join(files)})"))
    return CommandOutput(text, {"folder": str(out), "files": list(files), **rig_recording.truth})


def rig_record(
    *, port: Port, baud: Count = 921600, duration: Time | None = None, patience: Patience = 5.0, out: File
) -> CommandOutput:
    """Record a bench that speaks the protocol of 'ppafo hil'.

    Exit code 1 where the port failed, 130 where Ctrl-C stopped it.

    port: where the bench sends: udp:HOST:PORT or serial:DEVICE (extra 'hil'); UDP listens at the address
    baud: bits per second of a serial line; default 921600
    duration: end after this time of the bench, for example '10 s'
    patience: end, or give up, after this time without a sample; default '5 s'
    out: the .csv file to write

    >>> rig_record(port="udp:127.0.0.1:49317", patience=0.2, out=Path("bench.csv"))  # no bench sends there
    Traceback (most recent call last):
    ...
    ppafo.errors.DataError: no sample arrived within 0.2 s; received: nothing; check the connection and the sender
    """
    from ppafo.cli import output
    from ppafo.errors import DataError

    if duration is not None and duration <= 0.0:
        raise DataError("--duration: must be above 0 s")
    if out.suffix != ".csv":
        raise DataError(f"--out {out}: the name must end in .csv")
    # What a bench did cannot be recorded a second time.
    output.check_new_file(out)
    from ppafo.exports.hil.ports import open_port
    from ppafo.exports.hil.recording import kept_aside, record
    from ppafo.interrupts import stop_by_interrupt
    from ppafo.storage.comma_separated import write_csv

    link = open_port(port, baud, listens=True)
    try:
        output.tell(f"listening at {port}")
        with stop_by_interrupt() as is_stopped, kept_aside(out) as keep:
            collected = record(link, out.stem, duration, patience, is_stopped, keep=keep)
            write_csv(out, collected.recording)
        is_broken = bool(link.failure)
    finally:
        link.close()
    code, aside = output.EXIT_CHECK_FAILED if is_broken else output.EXIT_GOOD, ""
    if collected.is_stopped:
        code, aside = output.EXIT_INTERRUPTED, f"stopped; {out} is complete"
    document = {"file": str(out), **collected.document()}
    return output.CommandOutput(f"{collected.text()}\nwritten: {out}", document, exit_code=code, aside=aside)


def list_rig() -> CommandOutput:
    """List experiments and presets of the simulated bench with descriptions."""
    from ppafo.cli.output import CommandOutput
    from ppafo.rig.experiments import overview

    return CommandOutput(*overview())
