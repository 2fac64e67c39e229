"""Settings of a validation in SI units: compared channels, motion, initial values, delay limit and error limits."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from ppafo.errors import DataError, UnitError, refused_as
from ppafo.parameters.device import Device
from ppafo.simulation.recorded.usual_errors import ANGLE_ERRORS, PRESSURE_ERRORS
from ppafo.units import parse_quantity, split_quantity
from ppafo.wording import known_names, one_line

ANGLE = "angle"
PRESSURE_1 = "pressure_1"
PRESSURE_2 = "pressure_2"
PRESSURE_DIFFERENCE = "pressure_difference"
TORQUE = "torque"
ACCEPTABLE_FRACTION = 0.03
"""Largest RMS error of an acceptable model as a fraction of the full range [-].

The paper calls 10 % acceptable (page with figure 7); a lag of 10 ms of both pressures would pass there.
"""
EXPLAINED_FRACTION = 0.5
"""Least explained fraction of signal variance (R^2) [-] for an acceptable model; the mean explains 0."""
_FRACTION_UNITS = ("%", "percent")
DEFAULT_LIMIT = 0.02
"""Default limit of the estimated delay [s]; sensors, filters and valves lag less."""
LARGEST_DELAY = 1.0
"""Largest delay limit that a user may set [s]."""


class ComparedChannel(NamedTuple):
    """Channel compared between recording and model: SI unit of an error, kind of quantity, and label."""

    unit: str
    quantity: str
    title: str


COMPARED = {
    ANGLE: ComparedChannel("rad", "angle", "Vane angle"),
    PRESSURE_1: ComparedChannel("Pa_d", "pressure change", "Pressure in chamber 1"),
    PRESSURE_2: ComparedChannel("Pa_d", "pressure change", "Pressure in chamber 2"),
    PRESSURE_DIFFERENCE: ComparedChannel("Pa_d", "pressure change", "Pressure difference"),
    TORQUE: ComparedChannel("N m", "torque", "Actuator torque"),
}
"""Compared channels by name."""


def full_range(name: str, device: Device, gauge: float) -> float:
    """Return the full range of a channel [SI] for a gauge supply pressure [Pa]; in the paper 110 deg, 55 and 110 psi.

    A pressure difference ranges from full supply on one side to full supply on the other, the torque by equation (2).
    """
    if name == ANGLE:
        return device.actuator.angle_max - device.actuator.angle_min
    both_ways = {PRESSURE_DIFFERENCE: 2.0, TORQUE: 2.0 * device.actuator.torque_constant}
    return both_ways.get(name, 1.0) * gauge


def usual_zero(name: str, device: Device) -> float:
    """Return the usual zero error of a sensor, or its effect on a computed channel [SI unit of the channel]."""
    # Pressure difference and torque have the zeros of both sensors, as their full ranges have both pressures.
    return ANGLE_ERRORS.zero if name == ANGLE else full_range(name, device, PRESSURE_ERRORS.zero)


@dataclass(frozen=True, slots=True)
class ErrorLimit:
    """Largest RMS error: a fraction of the full range [-], or an error in the SI unit of the channel."""

    value: float
    is_fraction: bool


def _by_channel(noun: str, texts: Iterable[str], known: Collection[str]) -> dict[str, tuple[str, str]]:
    """Return texts ``CHANNEL=VALUE`` by channel, "" for a value alone: each as a refusal quotes it, and its value.

    Raises DataError for a channel that is not ``known``, or given twice.
    """
    read: dict[str, tuple[str, str]] = {}
    for text in texts:
        channel, equals, value = (part.strip() for part in text.rpartition("="))
        quoted = f"{noun} '{one_line(text)}'"
        if equals and channel not in known:
            raise DataError(f"{quoted}: there is no channel '{one_line(channel)}'{known_names(channel, known)}")
        if channel in read:
            raise DataError(f"{read[channel][0]} and '{one_line(text)}' set the same value; remove one of them")
        read[channel] = quoted, value
    return read


def parse_thresholds(texts: Iterable[str] = ()) -> dict[str, ErrorLimit]:
    """Parse thresholds such as ``angle=10%``, ``pressure_1=3.7 psi_d`` or ``5%`` to limits by channel, "" for others.

    Raises DataError for a channel that is not compared or given twice, or a limit that is not above 0.
    """
    limits = {}
    for channel, (where, value) in _by_channel("threshold", texts, COMPARED).items():
        with refused_as(DataError, where, UnitError):
            is_fraction = split_quantity(value)[1] in _FRACTION_UNITS
            number = parse_quantity(value, COMPARED[channel].unit if channel and not is_fraction else "")
        if not channel and not is_fraction:
            raise DataError(f"{where}: a limit for all channels must be in %")
        if number <= 0.0:
            raise DataError(f"{where}: must be above 0")
        limits[channel] = ErrorLimit(number, is_fraction)
    return limits


Motion = Literal["free", "measured", "locked", "leg"]
"""Motion of the vane in a replay: free, prescribed as recorded, locked, or with a foot."""
MOTIONS: tuple[Motion, ...] = ("free", "measured", "locked", "leg")
_UNITS = {ANGLE: "rad", PRESSURE_1: "Pa_a", PRESSURE_2: "Pa_a"}
"""Unit of an initial value by channel."""


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Settings of the replay and of the acceptance limits.

    ``motion`` is ``free`` for a vane that moves as the model demands, ``measured`` for the recorded angle as prescribed
    motion, ``locked`` for a vane fixed at its initial angle, or ``leg`` for a vane with the foot of figure 7. With a
    ``volume`` [m^3] chamber 1 is a fixed volume that the valve fills and vents, without a vane. ``initial`` values [SI]
    by channel override the first samples. ``longest_delay`` [s] limits the estimated delay.
    """

    motion: Motion = "free"
    initial: Mapping[str, float] = field(default_factory=dict)
    longest_delay: float = DEFAULT_LIMIT
    thresholds: Mapping[str, ErrorLimit] = field(default_factory=dict)
    volume: float | None = None


def parse_initial(texts: Iterable[str], atmosphere: float) -> dict[str, float]:
    """Parse initial values [SI] by channel, from texts such as ``pressure_1=0 psi_g``.

    Gauge pressures are relative to ``atmosphere`` [Pa absolute]. Raises DataError for an unknown or repeated channel,
    another unit or form.
    """
    values = {}
    for name, (where, value) in _by_channel("initial value", texts, _UNITS).items():
        if not name:
            raise DataError(f"{where} is not of the form CHANNEL=VALUE")
        with refused_as(DataError, where, UnitError):
            values[name] = parse_quantity(value, _UNITS[name], atmosphere)
    return values
