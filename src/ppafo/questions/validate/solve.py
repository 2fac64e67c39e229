"""A parameter set compared with recordings."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ppafo.answers import Solved
from ppafo.errors import DataError, nearest_name, one_line
from ppafo.parameters import load_device
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.storage.column_map import ColumnMap, load_column_map
from ppafo.validation.agreement import RecordingAgreement, ReplaySettings, compare_recording
from ppafo.validation.alignment import DEFAULT_LIMIT
from ppafo.validation.compared import parse_thresholds
from ppafo.validation.measured import read_measured
from ppafo.validation.replay import MOTIONS, Motion, parse_initial

LARGEST_DELAY = 1.0
"""Seconds; a recording that is later than this was not recorded with its command."""


@dataclass(frozen=True, slots=True)
class Validation(Solved):
    """A parameter set and what each recording reports of it."""

    parameter_set: str
    device: Device
    overrides: tuple[str, ...]
    settings: ReplaySettings
    recordings: tuple[RecordingAgreement, ...]

    @property
    def passes(self) -> bool:
        """True where every channel of every recording is within its limit."""
        return all(recording.passes for recording in self.recordings)


def validate(
    parameter_set: str | Path,
    recordings: Sequence[str | Path],
    valve: str | None = None,
    overrides: Sequence[str] = (),
    motion: str = "free",
    volume: float | None = None,
    initial: Sequence[str] = (),
    thresholds: Sequence[str] = (),
    longest_delay: float = DEFAULT_LIMIT,
    columns: ColumnMap | str | Path | None = None,
    progress: Report | None = None,
) -> Validation:
    """Return the errors (model less measured) of the model with a parameter set against each recording.

    ``recordings`` are CSV or NetCDF files or result folders. The model is run on the recorded command, supply pressure
    and external torque; ``motion`` is ``free``, ``measured`` (the recorded angle is prescribed) or ``held``. With a
    ``volume`` [m^3] there is no vane and chamber 1 is a fixed volume. ``initial`` are texts such as
    ``pressure_2=0 psi_g`` for channels that were not recorded, ``thresholds`` texts such as ``5%`` or ``angle=2 deg``:
    the largest RMS errors that pass, of the full range or in a unit, 10 % by default. ``longest_delay`` [s], at most
    1 s, limits the delay of the measurement that is taken out. ``columns`` is a column map, or ``FILE.toml[:NAME]``.

    The result has ``passes`` and, in ``recordings``, one ``RecordingAgreement`` each: ``measured`` and ``model`` are
    recordings, their channels of shape (samples,) in SI; ``channels`` has RMS error, bias, largest error and delay [s]
    of each channel in its SI unit (rad, Pa, N m). ``to_dict``, ``plot`` and ``save`` give JSON, figure and page.

    DataError for a recording or an argument that cannot be used, ParameterError for a parameter set, a valve or an
    override, SimulationError where the model diverges.
    """
    report = progress or report_nothing
    device = load_device(parameter_set, valve, overrides)
    device.check_vane("a replay of recordings")
    settings = ReplaySettings(
        motion=_motion(motion),
        initial=parse_initial(initial, device.supply.atmospheric_pressure),
        longest_delay=_valid_delay(longest_delay),
        thresholds=parse_thresholds(thresholds),
        volume=_valid_volume(volume),
    )
    if not recordings:
        raise DataError("no recording was given; name at least one .csv or .nc file or result folder")
    column_map = columns if columns is None or isinstance(columns, ColumnMap) else _column_map(str(columns))
    read = [read_measured(path, device, column_map) for path in recordings]
    agreements = []
    for measured in read:
        report(Progress(f"replaying {measured.file}"))
        agreements.append(compare_recording(measured, device, settings))
    return Validation(str(parameter_set), device, tuple(overrides), settings, tuple(agreements))


def _motion(text: str) -> Motion:
    for motion in MOTIONS:
        if motion == text:
            return motion
    raise DataError(f"motion '{one_line(text)}' is not one of {', '.join(MOTIONS)}{nearest_name(text, MOTIONS)}")


def _valid_volume(volume: float | None) -> float | None:
    if volume is not None and not volume > 0.0:
        raise DataError(f"volume of {volume:g} m^3: must be above 0")
    return volume


def _valid_delay(delay: float) -> float:
    if not 0.0 <= delay <= LARGEST_DELAY:
        raise DataError(f"longest delay of {delay:g} s: must be from 0 to {LARGEST_DELAY:g} s")
    return delay


def _column_map(text: str) -> ColumnMap:
    """Return the map that is named as a file, and by name where the file has several."""
    path, separator, name = text.rpartition(".toml:")
    return load_column_map(f"{path}.toml", name) if separator and name else load_column_map(text)
