"""Finding of an audit with its compared numbers, and a parameter set as the questions of an audit read it."""

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from decimal import Decimal
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ParameterError, UnitError
from ppafo.model.declaration import Quantity
from ppafo.model.plant import chamber_1_volume
from ppafo.parameters.declaration import fits, is_within
from ppafo.parameters.device import Gas
from ppafo.parameters.graph import ATMOSPHERE_PATH, GAS_PATHS
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, in_first_unit, number_in_si
from ppafo.units import from_si
from ppafo.units.shown import shown_unit
from ppafo.units.spelling import DECIMALS

Severity = Literal["error", "warning", "note"]
# Limits of plausible SI magnitudes; products of larger numbers would overflow.
_SMALLEST = 1e-20
_LARGEST = 1e20


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
    """Parameter set as the questions of an audit read it; a question whose numbers it lacks is not asked."""

    parameter_set: ParameterSet

    @property
    def declared(self) -> Mapping[str, Quantity]:
        """Declarations of all numbers that the set may contain, by path."""
        return self.parameter_set.declarations()

    def number(self, path: str) -> float | None:
        """Return the value of a parameter [SI]; None if absent or with a magnitude outside 1e-20 to 1e20."""
        value = number_in_si(self.parameter_set, path)
        return value if value is None or value == 0.0 or _SMALLEST < abs(value) < _LARGEST else None

    def numbers(self, *paths: str) -> tuple[float, ...]:
        """Return the values of parameters [SI]. Raises ParameterError if the set lacks one."""
        values = tuple(value for path in paths if (value := self.number(path)) is not None)
        if len(values) < len(paths):
            raise ParameterError(f"not all are given: {', '.join(paths)}")
        return values

    def positive(self, *paths: str) -> tuple[float, ...]:
        """Return the values of parameters [SI]. Raises ParameterError if one is missing, or not above 0."""
        values = self.numbers(*paths)
        if min(values) <= 0.0:
            raise ParameterError(f"{' or '.join(paths)} is not above 0")
        return values

    def text(self, path: str) -> str:
        """Return the name or formula at a path; "" without one."""
        entry = self.parameter_set.texts.get(path)
        return "" if entry is None else str(entry.value)

    def magnitude(self, path: str) -> ReportedRange | None:
        """Return the interval of the magnitude of a parameter [SI]: its stated uncertainty, else its rounding."""
        value = self.number(path)
        entry = self.parameter_set.numbers.get(path)
        if value is None or entry is None or entry.value == 0.0:
            return None
        # Below 1: the digits of "2" leave open 1.5 to 2.5, and never 0 or another sign.
        half_width = _half_digit(entry.value) if entry.uncertainty is None else entry.uncertainty
        relative = min(half_width / abs(entry.value), 0.99)
        return ReportedRange(abs(value) * (1.0 - relative), abs(value) * (1.0 + relative))

    def in_set_unit(self, path: str, value: float) -> str:
        """Format an SI value in the unit of a parameter in the set, for example ``84 g m^2``."""
        entry = self.parameter_set.numbers.get(path)
        quantity = self.declared[path]
        with contextlib.suppress(UnitError):
            if entry is not None:
                room = atmospheric_pressure(self.parameter_set)
                given = entry.unit
                number = in_first_unit(quantity, lambda unit: from_si(value, given, unit, room))
                return f"{number:.4g} {given}".rstrip()
        return f"{value:.4g} {quantity.unit.removesuffix('_a')}".rstrip()

    def finding(
        self,
        identifier: str,
        title: str,
        paths: Sequence[str],
        sides: Mapping[str, tuple[float, str]] = MappingProxyType({}),
        why: str = "",
        severity: Severity = "error",
    ) -> AuditFinding:
        """Return a finding on the values at ``paths``, with number and SI unit of each side that it compares."""
        numbers = self.parameter_set.numbers
        texts = self.parameter_set.texts
        values = [NamedValue(p, numbers[p].value, numbers[p].unit, numbers[p].origin) for p in paths if p in numbers]
        values += [NamedValue(p, str(texts[p].value), "", texts[p].origin) for p in paths if p in texts]
        compared = tuple(ComparedNumber(label, value, unit) for label, (value, unit) in sides.items())
        return AuditFinding(id=identifier, severity=severity, title=title, values=(*values,), sides=compared, why=why)

    def gas(self) -> Gas:
        """Return the gas. Raises ParameterError if the set lacks one of its numbers or a number is out of range."""
        values = self.numbers(*GAS_PATHS)
        if not all(is_within(value, self.declared[path]) for path, value in zip(GAS_PATHS, values, strict=True)):
            raise ParameterError("the gas is out of range")
        return Gas(self.text("gas.species") or "gas", *values)

    def atmosphere(self) -> float:
        """Return the ambient pressure [Pa absolute]; the standard atmosphere if the set states none."""
        return self.number(ATMOSPHERE_PATH) or STANDARD_ATMOSPHERE

    def angle_range(self) -> tuple[str, float, str, float]:
        """Return path and value [rad] of the smallest and the largest angle in use, from reports or else the stops."""
        numbers = self.parameter_set.numbers
        low_path, high_path = (
            reported if reported in numbers else stop
            for reported, stop in (
                ("reported.smallest_angle", "actuator.angle_min"),
                ("reported.largest_angle", "actuator.angle_max"),
            )
        )
        low, high = self.numbers(low_path, high_path)
        return low_path, low, high_path, high

    def chamber_1_volume(self, angle: float) -> float:
        """Return the volume of chamber 1 [m^3] at an angle [rad]; a missing dead volume counts as 0."""
        slope, start = self.numbers("actuator.displacement_per_radian", "actuator.angle_min")
        volume = chamber_1_volume(angle, start, slope, self.number("actuator.dead_volume_1") or 0.0)
        if volume <= 0.0:
            raise ParameterError("chamber 1 has no volume")
        return volume


Question = Callable[[Evidence], Iterator[AuditFinding]]
"""Question of an audit to a parameter set."""


def of_each_valve(question: Callable[[Evidence, str], Iterator[AuditFinding]]) -> Question:
    """Decorate a question to a valve: it is asked of each valve of a set, but of one whose numbers are missing."""

    def asked(evidence: Evidence) -> Iterator[AuditFinding]:
        for valve in evidence.parameter_set.valve_kinds:
            with contextlib.suppress(ParameterError):
                yield from question(evidence, valve)

    return asked


def identifier_of(path: str) -> str:
    """Return the name of a finding on the value at a path."""
    return path.replace(".", "-").replace("_", "-")


def digits(value: float) -> ReportedRange:
    """Return the interval of the numbers that round to a reported positive number."""
    return ReportedRange(value - _half_digit(value), value + _half_digit(value))


def _half_digit(value: float) -> float:
    exponent = Decimal(repr(value)).normalize(DECIMALS).as_tuple().exponent
    return 0.5 * 10.0 ** min(int(exponent), 0)
