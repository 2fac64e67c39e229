"""The paths that a study can vary: the numbers of a scenario and of its device, with their units and limits."""

import math
from dataclasses import dataclass, replace

from ppafo.errors import ScenarioError, UnitError, nearest_name
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import alternatives, is_within
from ppafo.simulation import declaration
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.reading import WRITTEN_UNITS
from ppafo.simulation.scenario import Scenario
from ppafo.units import from_si, parse_quantity, split_quantity

_UNIT_OF_DIFFERENCE = {"Pa_a": "Pa_d"}
_OFFSET_UNITS = ("degC", "°C")


@dataclass(frozen=True, slots=True)
class VariedPath:
    """A path with its declaration, and the pressure [Pa absolute] from which gauge pressures count."""

    path: str
    quantity: Quantity
    atmosphere: float

    def level(self, value: str | float) -> float:
        """Return a value of the path in SI; UnitError where the unit does not fit or the path does not allow it."""
        number = self._in_si(value, self.quantity)
        if not is_within(number, self.quantity):
            raise UnitError(f"{self.path} must be {self._limits()}")
        return number

    def distance(self, value: str | float) -> float:
        """Return a difference of two values of the path in SI, such as a standard deviation."""
        unit = _UNIT_OF_DIFFERENCE.get(self.quantity.unit, self.quantity.unit)
        if isinstance(value, str) and split_quantity(value)[1] in _OFFSET_UNITS:
            raise UnitError("a difference of temperatures is given in K")
        return self._in_si(value, replace(self.quantity, unit=unit))

    def shown(self, value: float) -> str:
        """Return a value of the path as messages write it."""
        unit = WRITTEN_UNITS.get(self.quantity.unit, self.quantity.unit) if self.quantity.unit != "Pa_a" else "Pa_a"
        return f"{from_si(value, unit, self.quantity.unit, self.atmosphere):.6g} {unit}".rstrip()

    def _in_si(self, value: str | float, quantity: Quantity) -> float:
        if isinstance(value, str):
            return _parsed(value, quantity, self.atmosphere)
        if quantity.unit not in declaration.PLAIN:
            raise UnitError(f"a number without a unit; give it as a text in {quantity.unit}")
        return float(value)

    def _limits(self) -> str:
        lowest, highest = self.quantity.minimum, self.quantity.maximum
        word = "at least" if self.quantity.minimum_allowed else "more than"
        parts = [f"{word} {self.shown(lowest)}"] if math.isfinite(lowest) else []
        return " and ".join([*parts, f"at most {self.shown(highest)}"] if math.isfinite(highest) else parts)


def _parsed(text: str, quantity: Quantity, atmosphere: float) -> float:
    """Return a text in SI, in any of the units that a parameter set may use too."""
    refused: UnitError | None = None
    for unit in alternatives(quantity):
        try:
            return parse_quantity(text, unit, atmosphere)
        except UnitError as error:
            refused = refused or error
    raise refused or UnitError(f"'{quantity.name}' has no unit")


def varied_path(path: str, scenario: Scenario) -> VariedPath:
    """Return a path of a scenario; ScenarioError with the nearest one where there is none."""
    known = declared_numbers(scenario)
    if path not in known:
        section = path.partition(".")[0]
        near = [name for name in known if name.startswith(f"{section}.")]
        hint = nearest_name(path, known) or f"; for example {', '.join(near[:6] or list(known)[:6])}"
        raise ScenarioError(f"scenario '{scenario.name}' has no number '{path}'{hint}")
    return VariedPath(path, known[path], scenario.device.supply.atmospheric_pressure)
