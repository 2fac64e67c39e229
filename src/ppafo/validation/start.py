"""The state in which a replay starts: the first samples, averaged where the recording begins at rest."""

from collections.abc import Mapping

import numpy as np

from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.parameters.device import Device
from ppafo.simulation.recorded.inputs import between_stops
from ppafo.simulation.recorded.start import Start, samples_at_rest
from ppafo.units import parse_quantity
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.validation.measured import Measured

_UNITS = {ANGLE: "rad", PRESSURE_1: "Pa_a", PRESSURE_2: "Pa_a"}
_EXAMPLES = {ANGLE: "angle=75 deg", PRESSURE_1: "pressure_1=0 psi_g", PRESSURE_2: "pressure_2=50 psi_g"}


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


def of_fixed_volume(device: Device, given: Mapping[str, float]) -> dict[str, float]:
    """Return where the replay of a fixed volume starts beside its pressure, which nothing else touches."""
    beside = {ANGLE: device.actuator.angle_min, PRESSURE_2: device.supply.atmospheric_pressure}
    return {**given, **beside}


def start_of(measured: Measured, device: Device, given: Mapping[str, float]) -> Start:
    """Return where the replay of a recording starts; ``given`` values [SI] go before those of the recording."""
    count = samples_at_rest(measured.recording)
    values = {name: given[name] if name in given else _first(measured, name, count) for name in _UNITS}
    rate = _first(measured, "angular_velocity", count) if measured.has("angular_velocity") else 0.0
    angle = float(between_stops(np.array([values[ANGLE]]), device, measured.file)[0])
    return Start(angle, rate, values[PRESSURE_1], values[PRESSURE_2])


def _first(measured: Measured, name: str, count: int) -> float:
    if not measured.has(name):
        raise DataError(
            f"{measured.file}: there is no channel '{name}' to start from; say where it starts, --initial "
            f'"{_EXAMPLES[name]}"'
        )
    return float(np.mean(measured.recording[name][:count]))
