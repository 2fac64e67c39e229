"""Reads single values of a scenario document: text with a unit in, SI float out, or one clear line why not."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import quote
from ppafo.errors import ScenarioError, UnitError, one_line
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import is_within
from ppafo.simulation.declaration import PLAIN, value_at
from ppafo.units import format_quantity, from_si, parse_quantity

WRITTEN_UNITS = {"rad": "deg", "rad/s": "deg/s", "Pa_a": "psi_g", "Pa_d": "psi_d"}
_ROUND = 1.0e-9


@dataclass(frozen=True, slots=True)
class Reading:
    """A document with what messages call it; ``overridden`` are the paths that an override has set."""

    file: str
    document: Mapping[str, Any]
    overridden: frozenset[str] = frozenset()

    def quote(self, path: str) -> str:
        """Return file, key and value, as they were given."""
        value = value_at(self.document, path)
        if path in self.overridden:
            return f"{self.file}: override {path}={one_line(value)}"
        return f"{self.file}: {path} = {quote(value)}"

    def refusal(self, path: str, reason: str) -> ScenarioError:
        """Return the error that says why the value at a path is not usable."""
        return ScenarioError(f"{self.quote(path)}: {reason}")

    def number(self, path: str, quantity: Quantity, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
        """Return the value at a path in the quantity's SI unit; its default where nothing is given.

        ScenarioError where it is no number, has another unit or is out of range.
        """
        value = value_at(self.document, path)
        if value is None:
            if quantity.default is None:
                raise ScenarioError(f"{self.file}: '{path}' is missing: {quantity.summary or quantity.name}")
            return quantity.default
        result = self._in_si(path, value, quantity, atmosphere)
        if not is_within(result, quantity):
            raise self.refusal(path, f"{quantity.summary or quantity.name} must be {limits(quantity, atmosphere)}")
        return result

    def section(self, section: str, quantities: tuple[Quantity, ...]) -> dict[str, float]:
        """Return all values of a section by name, in SI."""
        return {item.name: self.number(f"{section}.{item.name}", item) for item in quantities}

    def _in_si(self, path: str, value: object, quantity: Quantity, atmosphere: float) -> float:
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.refusal(path, f"must be {_form(quantity, 1.0)}")
        try:
            if isinstance(value, str):
                return parse_quantity(value, quantity.unit, atmosphere)
            number = float(value)
        except (UnitError, OverflowError) as error:
            raise self.refusal(path, str(error)) from error
        if not math.isfinite(number):
            raise self.refusal(path, "is not a finite number")
        if quantity.unit not in PLAIN:
            raise self.refusal(path, f"a number without a unit; must be {_form(quantity, number)}")
        return number


def quantity_text(value: float, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> str:
    """Return an SI value in the unit in which people write it: degrees, psi; rounding errors are left out."""
    unit = WRITTEN_UNITS.get(si_unit, "" if si_unit in PLAIN else si_unit)
    number = from_si(value, unit, si_unit, atmosphere)
    return format_quantity(round(number, 9) if abs(number) > _ROUND else number, unit)


def short_quantity_text(value: float, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> str:
    """Return an SI value as ``quantity_text`` does, with six digits, for a message."""
    unit = WRITTEN_UNITS.get(si_unit, "" if si_unit in PLAIN else si_unit)
    return f"{from_si(value, unit, si_unit, atmosphere):.6g} {unit}".rstrip()


def _form(quantity: Quantity, number: float) -> str:
    if quantity.unit in PLAIN:
        return "a number"
    unit = WRITTEN_UNITS.get(quantity.unit, quantity.unit)
    return f"a text with its unit, for example '{format_quantity(number, unit)}'"


def limits(quantity: Quantity, atmosphere: float) -> str:
    """Return the range of a value as text, in the unit in which people write it: ``at least 0 deg``.

    ``atmosphere`` [Pa absolute] is what gauge pressures are measured from.
    """
    unit = WRITTEN_UNITS.get(quantity.unit, quantity.unit) if quantity.unit != "Pa_a" else "Pa_a"
    unit = "" if unit in PLAIN else unit
    lower, upper = (
        f"{from_si(limit, unit, quantity.unit, atmosphere):.6g} {unit}".rstrip() if math.isfinite(limit) else ""
        for limit in (quantity.minimum, quantity.maximum)
    )
    parts = [f"{'at least' if quantity.minimum_allowed else 'more than'} {lower}"] if lower else []
    parts += [f"at most {upper}"] if upper else []
    return " and ".join(parts)
