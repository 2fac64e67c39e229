"""The channels in which a model and a recording are compared, their full ranges, and how large an error may be."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.parameters.device import Device
from ppafo.units import parse_quantity, split_quantity

ANGLE, PRESSURE_1, PRESSURE_2 = "angle", "pressure_1", "pressure_2"
PRESSURE_DIFFERENCE, TORQUE = "pressure_difference", "torque"


@dataclass(frozen=True, slots=True)
class Compared:
    """A channel: unit of an error in it (``Pa_d``: a pressure difference), kind of quantity of its errors, full range.

    ``full_range(device, gauge)`` takes the gauge pressure of the supply [Pa].
    """

    unit: str
    quantity: str
    title: str
    full_range: Callable[[Device, float], float]


def angle_range(device: Device, gauge: float) -> float:  # noqa: ARG001  # all ranges share one signature
    """Angle between the stops [rad]."""
    return device.actuator.angle_max - device.actuator.angle_min


def pressure_range(device: Device, gauge: float) -> float:  # noqa: ARG001
    """Gauge pressure of the supply [Pa]."""
    return gauge


def difference_range(device: Device, gauge: float) -> float:  # noqa: ARG001
    """Twice the gauge pressure of the supply [Pa]: from full supply on one side to full supply on the other."""
    return 2.0 * gauge


def torque_range(device: Device, gauge: float) -> float:
    """Torque from full supply on one side to full supply on the other [N m]. Equation (2)."""
    return 2.0 * gauge * device.actuator.torque_constant


COMPARED: dict[str, Compared] = {
    ANGLE: Compared("rad", "angle", "Vane angle", angle_range),
    PRESSURE_1: Compared("Pa_d", "pressure change", "Pressure in chamber 1", pressure_range),
    PRESSURE_2: Compared("Pa_d", "pressure change", "Pressure in chamber 2", pressure_range),
    PRESSURE_DIFFERENCE: Compared("Pa_d", "pressure change", "Pressure difference", difference_range),
    TORQUE: Compared("N m", "torque", "Actuator torque", torque_range),
}
"""As the paper has them: 110 deg, 55 psi, 55 psi and 110 psi; the torque follows from the pressure difference."""

ACCEPTABLE_FRACTION = 0.10
"""RMS error over full range that the paper calls acceptable (page with figure 7)."""

_FRACTION_UNITS = ("%", "percent")
_EXAMPLES = "a threshold is written 'angle=10%', 'pressure_1=3.7 psi_d' or '5%' for all channels"


@dataclass(frozen=True, slots=True)
class Limit:
    """Largest RMS error: a fraction of the full range [-], or an error in the SI unit of the channel."""

    value: float
    is_fraction: bool

    def fraction_of(self, full_range: float) -> float:
        """The limit as a fraction [-] of a full range in the SI unit of the channel."""
        return self.value if self.is_fraction else self.value / full_range


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The limit of every channel that has one of its own, and that of the others."""

    others: Limit
    channels: Mapping[str, Limit]

    def limit(self, channel: str) -> Limit:
        """The limit that holds for a channel."""
        return self.channels.get(channel, self.others)


def parse_thresholds(texts: Iterable[str] = ()) -> Thresholds:
    """Return the thresholds of texts such as ``angle=10%``, ``pressure_1=3.7 psi_d`` or ``5%``; later ones win."""
    others = Limit(ACCEPTABLE_FRACTION, is_fraction=True)
    channels: dict[str, Limit] = {}
    for text in texts:
        name, separator, value = text.rpartition("=")
        if separator:
            channel = _channel(name.strip(), text)
            channels[channel] = _limit(value, text, COMPARED[channel].unit)
        else:
            others = _limit(value, text, "")
    return Thresholds(others, channels)


def _channel(name: str, text: str) -> str:
    if name not in COMPARED:
        hint = nearest_name(name, COMPARED)
        known = ", ".join(COMPARED)
        raise DataError(
            f"threshold '{one_line(text)}': there is no channel '{one_line(name)}'{hint}; available: {known}"
        )
    return name


def _limit(value: str, text: str, unit: str) -> Limit:
    try:
        is_fraction = split_quantity(value)[1] in _FRACTION_UNITS
        number = parse_quantity(value, "" if is_fraction else unit)
    except UnitError as error:
        raise DataError(f"threshold '{one_line(text)}': {error}; {_EXAMPLES}") from error
    if not unit and not is_fraction:
        raise DataError(f"threshold '{one_line(text)}': a limit for all channels is a percentage of the full range")
    if number <= 0.0:
        raise DataError(f"threshold '{one_line(text)}': must be above 0; {_EXAMPLES}")
    return Limit(number, is_fraction)
