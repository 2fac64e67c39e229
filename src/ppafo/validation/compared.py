"""The channels in which a recording is compared with a model, their full ranges, and how large an error may be."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from ppafo.errors import DataError, UnitError
from ppafo.parameters.device import Device
from ppafo.simulation.recorded.usual_errors import ANGLE_ERRORS, PRESSURE_ERRORS
from ppafo.units import parse_quantity, split_quantity
from ppafo.wording import nearest_name, one_line

ANGLE, PRESSURE_1, PRESSURE_2 = "angle", "pressure_1", "pressure_2"
PRESSURE_DIFFERENCE, TORQUE = "pressure_difference", "torque"


@dataclass(frozen=True, slots=True)
class ComparedChannel:
    """A channel that is compared: the SI unit and the kind of quantity of an error in it, its title, its full range.

    ``Pa_d`` is a difference of pressures. ``full_range(device, gauge)`` is in the SI unit, of a device whose supply
    stands at a gauge pressure [Pa].
    """

    unit: str
    quantity: str
    title: str
    full_range: Callable[[Device, float], float]

    def usual_zero(self, device: Device) -> float:
        """Return by how much the zeros of sensors of any bench move it [its SI unit]."""
        # Pressure difference and torque have the zeros of both sensors, as their full ranges have both pressures.
        return ANGLE_ERRORS.zero if self.quantity == "angle" else self.full_range(device, PRESSURE_ERRORS.zero)


COMPARED: dict[str, ComparedChannel] = {
    ANGLE: ComparedChannel(
        "rad", "angle", "Vane angle", lambda device, _: device.actuator.angle_max - device.actuator.angle_min
    ),
    PRESSURE_1: ComparedChannel("Pa_d", "pressure change", "Pressure in chamber 1", lambda _, gauge: gauge),
    PRESSURE_2: ComparedChannel("Pa_d", "pressure change", "Pressure in chamber 2", lambda _, gauge: gauge),
    PRESSURE_DIFFERENCE: ComparedChannel(
        "Pa_d", "pressure change", "Pressure difference", lambda _, gauge: 2.0 * gauge
    ),
    TORQUE: ComparedChannel(
        "N m", "torque", "Actuator torque", lambda device, gauge: 2.0 * gauge * device.actuator.torque_constant
    ),
}
"""Full ranges as the paper has them: 110 deg, 55 psi, 55 psi and 110 psi; the torque follows by equation (2).

A difference goes from full supply on one side to full supply on the other.
"""

ACCEPTABLE_FRACTION = 0.03
"""RMS error over full range up to which a model agrees, for no model has all that a device has.

The paper calls 10 % acceptable (page with figure 7); a lag of 10 ms of both pressures would pass there.
"""

EXPLAINED_FRACTION = 0.5
"""Fraction of the variance of a signal that a model explains at least (R^2); its mean would explain none."""

_FRACTION_UNITS = ("%", "percent")
_EXAMPLES = "a threshold is written 'angle=10%', 'pressure_1=3.7 psi_d' or '5%' for all channels"


@dataclass(frozen=True, slots=True)
class ErrorLimit:
    """Largest RMS error: a fraction of the full range [-], or an error in the SI unit of the channel."""

    value: float
    is_fraction: bool

    def fraction_of(self, full_range: float) -> float:
        """The limit as a fraction [-] of a full range in the SI unit of the channel."""
        return self.value if self.is_fraction else self.value / full_range


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The limit of every channel that has one of its own, and the others' limit; None where none was given."""

    others: ErrorLimit | None
    channels: Mapping[str, ErrorLimit]

    def limit(self, channel: str) -> ErrorLimit | None:
        """The limit that was given for a channel; None for one that is judged by what its signal goes through."""
        return self.channels.get(channel, self.others)


def parse_thresholds(texts: Iterable[str] = ()) -> Thresholds:
    """Return the thresholds of texts such as ``angle=10%``, ``pressure_1=3.7 psi_d`` or ``5%``; later ones win.

    DataError where a text names no channel that is compared, or no limit above 0.
    """
    others = None
    channels: dict[str, ErrorLimit] = {}
    for text in texts:
        name, separator, value = text.rpartition("=")
        if separator:
            channel = name.strip()
            if channel not in COMPARED:
                hint, known = nearest_name(channel, COMPARED), ", ".join(COMPARED)
                raise DataError(
                    f"threshold '{one_line(text)}': there is no channel '{one_line(channel)}'{hint}; available: {known}"
                )
            channels[channel] = _limit(value, text, COMPARED[channel].unit)
        else:
            others = _limit(value, text, "")
    return Thresholds(others, channels)


def _limit(value: str, text: str, unit: str) -> ErrorLimit:
    """The limit that a value states, in an SI unit or in percent; messages show the whole ``text`` of the threshold."""
    try:
        is_fraction = split_quantity(value)[1] in _FRACTION_UNITS
        number = parse_quantity(value, "" if is_fraction else unit)
    except UnitError as error:
        raise DataError(f"threshold '{one_line(text)}': {error}; {_EXAMPLES}") from error
    if not unit and not is_fraction:
        raise DataError(f"threshold '{one_line(text)}': a limit for all channels is a percentage of the full range")
    if number <= 0.0:
        raise DataError(f"threshold '{one_line(text)}': must be above 0; {_EXAMPLES}")
    return ErrorLimit(number, is_fraction)
