"""A parameter set held against recordings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.parameters import load_device
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.inputs import SUPPLY, regular_interval
from ppafo.simulation.recorded.scenario import fixed_volume
from ppafo.storage.column_map import ColumnMap
from ppafo.units import parse_quantity
from ppafo.validation.agreement import ChannelAgreement, Comparison, RecordingAgreement, channel_agreement, common_delay
from ppafo.validation.alignment import DEFAULT_LIMIT, Curve, Delay
from ppafo.validation.compared import ANGLE, COMPARED, PRESSURE_1, PRESSURE_2, PRESSURE_DIFFERENCE
from ppafo.validation.measured import Measured, read_measured, supply_gauge
from ppafo.validation.replay import Motion, Replayed, replay_recording
from ppafo.validation.start import of_fixed_volume, start_of
from ppafo.validation.thresholds import Thresholds, parse_thresholds

_OTHER_SUPPLY = 0.05
"""Share of the set's gauge pressure by which a recorded supply may differ before it is remarked on."""
_AT_LIMIT = "model and measurement are further apart in time than a delay of {:g} s; no delay was taken out"
_CHANNEL_AT_LIMIT = (
    "own delay of {} is at the limit of {:g} s that was looked for: no delay of a sensor, another course"
)
MOTIONS: tuple[Motion, ...] = ("free", "measured", "held")


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """How recordings are replayed and judged.

    ``motion`` ``free`` lets the vane move as the model demands, ``measured`` leads it along the recorded angle,
    ``held`` holds it where it starts. With a ``volume`` [m^3] there is no vane: chamber 1 is a fixed volume that the
    valve fills and vents. ``initial`` values [SI] by channel go before the first samples; ``longest_delay`` [s] limits
    the delay looked for.
    """

    motion: Motion = "free"
    initial: Mapping[str, float] = field(default_factory=dict)
    longest_delay: float = DEFAULT_LIMIT
    thresholds: Thresholds = field(default_factory=parse_thresholds)
    volume: float | None = None


@dataclass(frozen=True, slots=True)
class Validation:
    """A parameter set and what each recording says of it."""

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
    settings: ReplaySettings | None = None,
    tell: Callable[[str], None] = lambda _text: None,
    columns: ColumnMap | None = None,
) -> Validation:
    """Return how far the model with a parameter set is from each recording (a CSV or NetCDF file, or a result folder).

    Files with columns of their own are read through a column map, ``columns``.
    ``tell`` is called with what is being done. DataError, ParameterError or SimulationError for bad input.
    """
    device = load_device(parameter_set, valve, overrides)
    chosen = settings or ReplaySettings()
    if not recordings:
        raise DataError("no recording was given; name at least one .csv or .nc file or result folder")
    read = [read_measured(path, device, columns) for path in recordings]
    agreements = []
    for measured in read:
        tell(f"replaying {measured.file}")
        agreements.append(compare_recording(measured, device, chosen))
    return Validation(str(parameter_set), device, tuple(overrides), chosen, tuple(agreements))


def compare_recording(measured: Measured, device: Device, settings: ReplaySettings) -> RecordingAgreement:
    """Return how far the model of a device is from one recording, on the inputs of that recording."""
    if settings.volume is not None:
        device = fixed_volume(device, settings.volume)
        settings = replace(settings, motion="held", initial=of_fixed_volume(device, settings.initial))
    _check_angle(measured, settings.motion)
    start = start_of(measured, device, settings.initial)
    replayed = replay_recording(measured, device, start, settings.motion, settings.longest_delay)
    items = _comparisons(measured, replayed, device, settings)
    delay = common_delay(items, settings.longest_delay)
    channels = tuple(channel_agreement(item, delay.taken_out, settings.longest_delay) for item in items)
    late = _late_remarks(delay, channels, settings.longest_delay)
    return RecordingAgreement(
        file=measured.file,
        sha256=measured.sha256,
        measured=measured.recording,
        model=replayed.recording,
        motion=settings.motion,
        inputs=replayed.inputs,
        step=replayed.step,
        delay=delay,
        channels=channels,
        remarks=(*measured.remarks, *_remarks(measured, device, settings), *late),
    )


def _late_remarks(delay: Delay, channels: Sequence[ChannelAgreement], longest: float) -> tuple[str, ...]:
    """Say where the search for a delay ended at its limit, for all channels together or for some alone."""
    if delay.is_at_limit:
        return (_AT_LIMIT.format(longest),)
    alone = [channel.channel for channel in channels if channel.delay_is_at_limit]
    return (_CHANNEL_AT_LIMIT.format(", ".join(alone), longest),) if alone else ()


def measured_values(recording: Recording, name: str) -> Floats | None:
    """The values of a channel to compare; the pressure difference follows from both pressures where they are there."""
    if name == PRESSURE_DIFFERENCE and PRESSURE_1 in recording and PRESSURE_2 in recording:
        return np.asarray(recording[PRESSURE_1] - recording[PRESSURE_2])
    if name not in recording:
        return None
    return recording[name]


def check_motion(text: str) -> Motion:
    """Return the way in which the vane moves in a replay: ``free``, ``measured`` or ``held``."""
    for motion in MOTIONS:
        if motion == text:
            return motion
    raise DataError(f"motion '{one_line(text)}' is none of {', '.join(MOTIONS)}{nearest_name(text, MOTIONS)}")


def parse_volume(text: str | None) -> float | None:
    """Return a fixed volume [m^3] in the place of chamber 1; None where there is a vane."""
    if text is None:
        return None
    try:
        volume = parse_quantity(text, "m^3")
    except UnitError as error:
        raise DataError(f"volume '{one_line(text)}': {error}") from error
    if not volume > 0.0:
        raise DataError(f"volume '{one_line(text)}' must be above zero")
    return volume


def _check_angle(measured: Measured, motion: Motion) -> None:
    if motion == "measured" and not measured.has(ANGLE):
        raise DataError(f"{measured.file}: there is no channel '{ANGLE}' to lead the vane along (--motion measured)")


def _comparisons(measured: Measured, replayed: Replayed, device: Device, settings: ReplaySettings) -> list[Comparison]:
    """The channels that the recording has and that the model was not given."""
    gauge = supply_gauge(measured.recording, device)
    items = []
    for name, kind in COMPARED.items():
        values = measured_values(measured.recording, name)
        if values is None or name in replayed.inputs or name in _not_of_motion(settings):
            continue
        full_range = kind.full_range(device, gauge)
        model = replayed.recording
        curve = Curve(measured.recording.time, values, model.time, model[name], full_range)
        items.append(Comparison(name, kind.unit, curve, settings.thresholds.limit(name).share_of(full_range)))
    if not items:
        word = "pressure_1" if settings.volume is not None else "anything beside the angle that the vane was led along"
        raise DataError(f"{measured.file}: has nothing to compare; it needs {word}")
    return items


def _not_of_motion(settings: ReplaySettings) -> tuple[str, ...]:
    """The channels that say nothing where the vane is held, or where there is none."""
    if settings.volume is not None:
        return tuple(name for name in COMPARED if name != PRESSURE_1)
    return (ANGLE,) if settings.motion == "held" else ()


def _remarks(measured: Measured, device: Device, settings: ReplaySettings) -> tuple[str, ...]:
    remarks = []
    own = device.supply.pressure - device.supply.atmospheric_pressure
    followed = supply_gauge(measured.recording, device)
    if measured.has(SUPPLY) and abs(followed - own) > _OTHER_SUPPLY * own:
        other = f"{followed / own:.3g} times the gauge pressure of the set" if own > 0.0 else "pressure, the set's none"
        remarks.append(f"the recorded supply has {other}; it was followed")
    if not measured.has(SUPPLY):
        remarks.append("the supply pressure was not recorded; that of the set was taken")
    if regular_interval(measured.recording.time) is None:
        remarks.append("samples are not regular in time; changes of the command were placed on the nearest step")
    if settings.volume is not None:
        remarks.append(f"chamber 1 was taken as a fixed volume of {settings.volume * 1e6:.4g} cm^3 without a vane")
    elif settings.motion == "held":
        remarks.append("the vane was held where it starts; the angle is not compared")
    if settings.motion == "measured":
        remarks.append("the vane was led along the recorded angle, which is therefore not compared")
    return tuple(remarks)
