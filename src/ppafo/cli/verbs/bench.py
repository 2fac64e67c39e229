"""From bench to model: recordings of a bench, real or simulated, a parameter set from them, and how well it agrees."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.cli.arguments import Count, File, Folder, Name, Overrides, Patience, Port, Time, Volume, Whole, Word
from ppafo.progress import Report, report_nothing

if TYPE_CHECKING:
    from ppafo.analyses.identify.answer import Identification
    from ppafo.analyses.validate.solve import Validation
    from ppafo.cli.output import Said
    from ppafo.report.finding import Finding
    from ppafo.storage.foreign import ColumnMap

Problem = Annotated["str | Path", Word("PROBLEM", Path)]
Set = Annotated["str | Path", Word("PARAMETERS")]
Recording = Annotated["str | Path", Word("RECORDING")]
Motion = Annotated[str, Word("free|measured|locked|leg")]
Initial = Annotated[str, Word("CHANNEL=VALUE")]
Limits = Annotated[Sequence[str], Word("[CHANNEL=]LIMIT", option="--threshold")]
Columns = Annotated["ColumnMap | str | Path", Word("FILE.toml[:NAME]")]


def rig_simulate(
    experiment: Annotated[str, Word("EXPERIMENT")],
    *,
    preset: Annotated[str, Word("PRESET")] = "paper-bench",
    seed: Whole = 1,
    device: Annotated[str, Word("SET")] = "ppafo2011",
    valve: Name | None = None,
    overrides: Overrides = (),
    out: Folder = Path("out/rig"),
) -> Said:
    """Run an experiment on the simulated test bench, and write the recording of a laboratory, marked as synthetic.

    experiment: name of an experiment
    preset: preset or .toml file; default paper-bench
    seed: random seed of noise and offsets; default 1
    device: parameter set or .toml file; default ppafo2011
    valve: valve of the parameter set; default: its default valve
    out: folder of the recording and of rig.json with the true values; default out/rig
    """
    from ppafo.cli.output import Said, blame_out_option
    from ppafo.rig.experiments import NOTICE, check_rig_folder, find_experiment, record, write_rig_recording

    # An unknown name and a refused folder are told before anything runs.
    find_experiment(experiment)
    with blame_out_option():
        check_rig_folder(out, experiment)
    made = record(experiment, preset, seed, device, overrides, valve)
    files = write_rig_recording(out, made)
    counted = f"{len(made.recording)} samples of {', '.join(made.recording.names)}"
    text = f"{experiment}: {NOTICE}\n{counted}\nwritten: {out} ({', '.join(files)})"
    return Said(text, {"folder": str(out), "files": list(files), **made.truth})


def rig_record(
    *, port: Port, baud: Count = 921600, duration: Time | None = None, patience: Patience = 5.0, out: File
) -> Said:
    """Record a bench that speaks the protocol of 'ppafo hil'.

    Exit code 1 where the port broke, 130 where Ctrl-C stopped it.

    port: where the bench sends: udp:HOST:PORT or serial:DEVICE (extra 'hil'); UDP listens at the address
    baud: bits per second of a serial line; default 921600
    duration: end after this time of the bench, for example '10 s'
    patience: end, or give up, after this time without a sample; default '5 s'
    out: the .csv file to write
    """
    from ppafo.cli import output
    from ppafo.errors import DataError

    if duration is not None and duration <= 0.0:
        raise DataError("--duration: must be above 0 s")
    output.check_new_file(out)
    if out.suffix != ".csv":
        raise DataError(f"--out {out}: must end in .csv")
    from ppafo.storage.files import check_files_can_be_added

    # What a bench did cannot be recorded a second time.
    with output.blame_out_option():
        check_files_can_be_added(out.parent, [out.name])
    from ppafo.exports.hil.loop import stop_by_interrupt
    from ppafo.exports.hil.recording import kept_aside, record
    from ppafo.exports.hil.wire import open_port
    from ppafo.storage.comma_separated import write_csv

    wire = open_port(port, baud, listens=True)
    try:
        output.tell(f"listening at {port}")
        with stop_by_interrupt() as is_stopped, kept_aside(out) as keep:
            found = record(wire, out.stem, duration, patience, is_stopped, keep=keep)
            write_csv(out, found.recording)
        is_broken = bool(wire.failure)
    finally:
        wire.close()
    code = output.EXIT_INTERRUPTED if found.is_stopped else output.EXIT_CHECK_FAILED if is_broken else output.EXIT_GOOD
    aside = f"stopped; {out} is whole" if found.is_stopped else ""
    document = {"file": str(out), **found.document()}
    return output.Said(f"{found.text()}\nwritten: {out}", document, exit_code=code, aside=aside)


def list_rig() -> Said:
    """Return the experiments and the presets with what they are."""
    from ppafo.cli.output import Said
    from ppafo.rig.experiments import overview

    return Said(*overview())


def identify(
    problem: Problem,
    *,
    progress: Report = report_nothing,
) -> Finding[Identification]:
    """Identify a parameter set, with uncertainty, from bench recordings.

    The procedures of the problem file run in the recommended order; the trajectory fit comes last and starts from what
    they found. Estimates are in SI units. IdentificationError for a problem that makes no sense, ParameterError for a
    set that does not, and DataError for a recording that cannot be read; each in one line that begins with the file.

    problem: a problem file (.toml); see 'ppafo doctor --schema identification'
    """
    from ppafo.analyses.identify.solve import identify

    return identify(problem, progress)


def validate(
    parameter_set: Set,
    recordings: Sequence[Recording],
    *,
    valve: Name | None = None,
    overrides: Overrides = (),
    motion: Motion = "free",
    volume: Volume | None = None,
    initial: Sequence[Initial] = (),
    thresholds: Limits = (),
    longest_delay: Time = 0.02,
    columns: Columns | None = None,
    progress: Report | None = None,
) -> Finding[Validation]:
    """Compare a parameter set with recordings, channel by channel.

    The model is run on the recorded command, supply pressure and external torque; residuals are measured - model. With
    no threshold it is 10 % of full range, at least half of the variance of a signal beside its noise is explained, and
    no single change of record, set or model may explain the recordings; what no change explains may be 3 %. The
    result's ``found`` has ``passes`` and, in ``recordings``, one ``RecordingAgreement`` each: ``measured`` and
    ``model`` are recordings, their channels of shape (samples,) in SI; ``channels`` has RMS error, bias, largest error
    and delay [s] of each channel in its SI unit (rad, Pa, N m). DataError, ParameterError or SimulationError for bad
    input.

    parameter_set: name of a parameter set, or a .toml file
    recordings: a .csv or .nc file, or a result folder; several may be given
    valve: valve of the parameter set; default: its default valve
    motion: free: the model moves the vane; measured: the vane follows the recorded angle; locked: the vane stays at
        its initial angle; leg: the model moves vane and foot on the fixture of step-response (default free)
    volume: no vane: the valve fills and vents chamber 1 of this fixed volume, for example '60 cm^3'; pressure_1 is
        compared
    initial: initial value of a channel that was not recorded, for example 'pressure_2=0 psi_g'
    thresholds: maximum RMS error, as a fraction of full range or with a unit: 5%, angle=10%, 'pressure_1=3.7 psi_d';
        default: 10%, and half of the variance of the signal is explained
    longest_delay: maximum delay of the measurement to estimate; default '20 ms', '0 s' for none
    columns: file with a column map [columns.NAME], for recordings with other column names; a problem file may contain
        it
    """
    from ppafo.analyses.validate.solve import validate

    return validate(
        parameter_set,
        recordings,
        valve,
        overrides,
        motion,
        volume,
        initial,
        thresholds,
        longest_delay,
        columns,
        progress,
    )
