"""Audit finding with its compared numbers, and access of the checks to a parameter set."""

import contextlib
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from decimal import Decimal
from typing import Any, Literal, NamedTuple

from ppafo.constants import STANDARD_ATMOSPHERE, UNIVERSAL_GAS_CONSTANT
from ppafo.errors import UnitError
from ppafo.model.declaration import Quantity
from ppafo.model.gas import specific_gas_constant
from ppafo.model.plant import chamber_1_volume
from ppafo.parameters.declaration import alternatives, fits, is_within
from ppafo.parameters.device import Gas
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, number_in_si
from ppafo.units import from_si
from ppafo.units.shown import shown_in, shown_unit, shown_value
from ppafo.units.spelling import DECIMALS

Severity = Literal["error", "warning", "note"]
GAS_PATHS = ("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature")
_SMALLEST, _LARGEST = 1e-20, 1e20
"""Limits of plausible SI magnitudes; products of larger numbers would overflow."""


@dataclass(frozen=True, slots=True)
class NamedValue:
    """Value of a parameter set that a finding refers to, in the unit of the set."""

    path: str
    value: float | str
    unit: str
    origin: str


@dataclass(frozen=True, slots=True)
class ComparedNumber:
    """Number compared in a finding, in SI units, pressures absolute."""

    label: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditFinding:
    """Finding of an audit: a contradiction (error), a caveat for users of results (warning), or a passed check (note).

    ``sides`` are the numbers compared and those that would be consistent, ``why`` says in words what they leave open.
    ``accepted`` is the reason why the author of the set keeps a contradiction; it lowers an error to a warning and is
    empty otherwise.
    """

    id: str
    severity: Severity = "error"
    title: str
    values: tuple[NamedValue, ...] = ()
    sides: tuple[ComparedNumber, ...] = ()
    why: str = ""
    accepted: str = ""

    @property
    def paragraph(self) -> str:
        """The compared numbers in words, in units of the values where they fit, and the reason."""
        units = [value.unit for value in self.values]
        numbers = []
        for side in (side for side in self.sides if math.isfinite(side.value)):
            unit = next((unit for unit in units if fits(unit, side.unit)), shown_unit(side.unit))
            unit = "" if unit == "1" else unit
            numbers.append(f"{side.label}: {from_si(side.value, unit, side.unit):.4g} {unit}".rstrip())
        return " ".join(filter(None, (f"{'; '.join(numbers)}." if numbers else "", self.why)))

    def document(self) -> dict[str, Any]:
        """Return the finding as plain data for JSON; infinite numbers become null."""
        plain = {**asdict(self), "paragraph": self.paragraph}
        for side in plain["sides"]:
            side["value"] = side["value"] if math.isfinite(side["value"]) else None
        return plain


class ReportedRange(NamedTuple):
    """Interval of the positive numbers [SI] that round to a reported number."""

    low: float
    high: float

    def times(self, other: "ReportedRange") -> "ReportedRange":
        """Return the interval of the product of two reported numbers."""
        return ReportedRange(self.low * other.low, self.high * other.high)

    def over(self, other: "ReportedRange") -> "ReportedRange":
        """Return the interval of the quotient of two reported numbers."""
        return ReportedRange(self.low / other.high, self.high / other.low)

    def meets(self, other: "ReportedRange") -> bool:
        """Return True if two intervals overlap."""
        return self.low <= other.high and other.low <= self.high


@dataclass(frozen=True, slots=True)
class Evidence:
    """Parameter set and declarations, as read by the checks of an audit."""

    parameter_set: ParameterSet
    declared: Mapping[str, Quantity]

    def number(self, path: str) -> float | None:
        """Return the value of a parameter [SI]; None if absent or with a magnitude outside 1e-20 to 1e20."""
        value = number_in_si(self.parameter_set, path)
        return value if value is None or value == 0.0 or _SMALLEST < abs(value) < _LARGEST else None

    def numbers(self, *paths: str) -> tuple[float, ...] | None:
        """Return the values of all parameters [SI]; None if any is missing."""
        values = [self.number(path) for path in paths]
        present = tuple(value for value in values if value is not None)
        return present if len(present) == len(paths) else None

    def text(self, path: str) -> str | None:
        """Return the name or formula at a path."""
        entry = self.parameter_set.texts.get(path)
        return None if entry is None else str(entry.value)

    def magnitude(self, path: str) -> ReportedRange | None:
        """Return the interval of the magnitude of a parameter [SI]: its stated uncertainty, else its rounding."""
        value, entry = self.number(path), self.parameter_set.numbers.get(path)
        if value is None or entry is None or entry.value == 0.0:
            return None
        # Below 1: the digits of "2" leave open 1.5 to 2.5, and never 0 or another sign.
        half_width = _half_digit(entry.value) if entry.uncertainty is None else entry.uncertainty
        relative = min(half_width / abs(entry.value), 0.99)
        return ReportedRange(abs(value) * (1.0 - relative), abs(value) * (1.0 + relative))

    def in_set_unit(self, path: str, value: float) -> str:
        """Format an SI value in the unit of a parameter in the set, for example ``84 g m^2``."""
        entry, quantity = self.parameter_set.numbers.get(path), self.declared[path]
        if entry is not None:
            for unit in alternatives(quantity):
                with contextlib.suppress(UnitError):
                    converted = from_si(value, entry.unit, unit, atmospheric_pressure(self.parameter_set))
                    return f"{converted:.4g} {entry.unit}".rstrip()
        return f"{value:.4g} {quantity.unit.removesuffix('_a')}".rstrip()

    def torque(self, value: float, form: str = ".3g") -> str:
        """Format a torque [N m] in the torque unit of the set, for example ``550 N cm``."""
        with shown_in(self.parameter_set.shown):
            number, unit = f"{shown_value(value, 'N m'):{form}}", shown_unit("N m")
        # A form that keeps zeros makes "550." of 550.
        return f"{number.removesuffix('.')} {unit}"

    def values_of(self, *paths: str) -> tuple[NamedValue, ...]:
        """Return the values of parameters, as stated in the set; missing values are omitted."""
        numbers, texts = self.parameter_set.numbers, self.parameter_set.texts
        values = [NamedValue(p, numbers[p].value, numbers[p].unit, numbers[p].origin) for p in paths if p in numbers]
        return (*values, *(NamedValue(p, str(texts[p].value), "", texts[p].origin) for p in paths if p in texts))

    def gas(self) -> Gas | None:
        """Return the gas; None if the set lacks one of its numbers or a number is out of range."""
        values = self.numbers(*GAS_PATHS)
        if values is None or not all(is_within(values[i], self.declared[path]) for i, path in enumerate(GAS_PATHS)):
            return None
        return Gas(self.text("gas.species") or "gas", *values)

    def atmosphere(self) -> float:
        """Return the ambient pressure [Pa absolute]; the standard atmosphere if the set states none."""
        return self.number(ATMOSPHERE_PATH) or STANDARD_ATMOSPHERE

    def angle_range(self) -> tuple[str, float, str, float] | None:
        """Return path and value [rad] of the smallest and the largest angle in use, from reports or else the stops."""
        numbers = self.parameter_set.numbers
        low_path, high_path = (
            reported if reported in numbers else stop
            for reported, stop in (
                ("reported.smallest_angle", "actuator.angle_min"),
                ("reported.largest_angle", "actuator.angle_max"),
            )
        )
        ends = self.numbers(low_path, high_path)
        return None if ends is None else (low_path, ends[0], high_path, ends[1])

    def single_fill_gas(self) -> str | None:
        """Return the path of the first reported gas use of a single filling."""
        paths = (f"reported.valves.{name}.single_fill_gas" for name in self.parameter_set.valve_kinds)
        return next((path for path in paths if self.number(path)), None)

    def chamber_1_volume(self, angle: float) -> float | None:
        """Return the volume of chamber 1 [m^3] at an angle [rad]; a missing dead volume counts as 0."""
        values = self.numbers("actuator.displacement_per_radian", "actuator.angle_min")
        dead_volume = self.number("actuator.dead_volume_1") or 0.0
        return None if values is None else chamber_1_volume(angle, values[1], values[0], dead_volume)


def digits(value: float) -> ReportedRange:
    """Return the interval of the numbers that round to a reported positive number."""
    return ReportedRange(value - _half_digit(value), value + _half_digit(value))


def _half_digit(value: float) -> float:
    exponent = Decimal(repr(value)).normalize(DECIMALS).as_tuple().exponent
    return 0.5 * 10.0 ** min(int(exponent), 0)


def density_change(gas: Gas, pressure_change: float) -> float:
    """Return the change of density [kg/m^3] of an ideal gas with pressure [Pa] at its temperature; equation (3)."""
    return pressure_change / (specific_gas_constant(UNIVERSAL_GAS_CONSTANT, gas.molar_mass) * gas.temperature)
