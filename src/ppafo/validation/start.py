"""The state in which a replay starts: the first samples, averaged where the recording begins at rest."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.parameters.device import Device
from ppafo.units import parse_quantity
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.validation.measured import COMMAND, Measured

REST_WINDOW = 0.05
"""Seconds before the first command over which the start is averaged; short, so that no leak shows in it."""

_UNITS = {ANGLE: "rad", PRESSURE_1: "Pa_a", PRESSURE_2: "Pa_a"}
_EXAMPLES = {ANGLE: "angle=75 deg", PRESSURE_1: "pressure_1=0 psi_g", PRESSURE_2: "pressure_2=50 psi_g"}
_BEYOND_STOPS = 0.05
"""Share of the full range by which a measured angle may be beyond a stop before it is refused; then it is the stop."""


@dataclass(frozen=True, slots=True)
class Start:
    """Angle [rad], angular velocity [rad/s] and pressures [Pa absolute] at the first sample."""

    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float


def parse_initial(texts: "list[str] | tuple[str, ...]", atmosphere: float) -> dict[str, float]:
    """Return initial values in SI by channel from texts such as ``pressure_1=0 psi_g``."""
    values = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if name not in _UNITS:
            hint = nearest_name(name, _UNITS)
            raise DataError(
                f"initial value '{one_line(text)}': give {', '.join(_UNITS)}{hint}, as '{_EXAMPLES[ANGLE]}'"
            )
        try:
            values[name] = parse_quantity(value, _UNITS[name], atmosphere)
        except UnitError as error:
            raise DataError(f"initial value '{one_line(text)}': {error}") from error
    return values


def start_of(measured: Measured, device: Device, given: Mapping[str, float]) -> Start:
    """Return where the replay of a recording starts; ``given`` values [SI] go before those of the recording."""
    count = _samples_at_rest(measured)
    values = {name: given[name] if name in given else _first(measured, name, count) for name in _UNITS}
    rate = _first(measured, "angular_velocity", count) if measured.has("angular_velocity") else 0.0
    angle = float(between_stops(np.array([values[ANGLE]]), device, measured.file)[0])
    return Start(angle, rate, values[PRESSURE_1], values[PRESSURE_2])


def between_stops(angles: "np.ndarray[tuple[int], np.dtype[np.float64]]", device: Device, file: str) -> np.ndarray:
    """Return angles [rad] as they are or, slightly beyond a stop, as the stop; DataError for those far beyond."""
    lowest, highest = device.actuator.angle_min, device.actuator.angle_max
    margin = _BEYOND_STOPS * (highest - lowest)
    worst = angles[int(np.argmax(np.maximum(lowest - angles, angles - highest)))]
    if not lowest - margin <= worst <= highest + margin:
        shown, low, high = np.degrees([worst, lowest, highest])
        raise DataError(
            f"{file}: '{ANGLE}' is {shown:.4g} deg, beyond the stops of {device.name}, {low:g} to {high:g} deg"
        )
    return np.clip(angles, lowest, highest)


def _samples_at_rest(measured: Measured) -> int:
    """Samples before the first command, at most those of the rest window; 1 where the valve is open from the start."""
    command, time = measured.recording[COMMAND], measured.recording.time
    if command[0] != 0.0:
        return 1
    quiet = command.size if not command.any() else int(np.argmax(command != 0.0))
    return max(1, min(quiet, int((time < time[0] + REST_WINDOW).sum())))


def _first(measured: Measured, name: str, count: int) -> float:
    if not measured.has(name):
        raise DataError(
            f"{measured.file}: there is no channel '{name}' to start from; say where it starts, --initial "
            f'"{_EXAMPLES[name]}"'
        )
    return float(np.mean(measured.recording[name][:count]))
