"""Claims of the paper beside our numbers, the paper's numbers as printed, and the claims that are arithmetic."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

from ppafo.answers.writing import format_printed_quantity, quantity
from ppafo.constants import STANDARD_ATMOSPHERE, UNIVERSAL_GAS_CONSTANT
from ppafo.errors import ParameterError
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio, subsonic_flow_constant
from ppafo.model.orifice import isentropic_flow_function
from ppafo.parameters import ParameterSet, load_parameter_set
from ppafo.parameters.audit.evidence import Evidence, Interval
from ppafo.parameters.device import Gas
from ppafo.parameters.publications.publication import paper_entries

Verdict = Literal["reproduced", "reproduced_with_assumptions", "shown_on_synthetic", "contradicted", "not_testable"]
VERDICTS: dict[Verdict, str] = {
    "reproduced": "reproduced",
    "reproduced_with_assumptions": "reproduced with assumptions",
    "shown_on_synthetic": "shown on synthetic data",
    "contradicted": "contradicted",
    "not_testable": "not testable",
}
"""Every verdict in words, from good to unknown."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A number that the paper states and ours, both in ``unit``; ``value`` None where there is nothing to compute.

    ``paper`` is None where the paper says it in ``words``, which are empty where only ``own`` arithmetic gives it.
    ``left_open`` are the ends of what is open about our number, ``open_by`` says by what.

    ``source`` is where the paper says it, ``assumptions`` what our number rests on beside the paper, ``note`` why the
    verdict is what it is. A claim that has to hold for this package to be sound has a window that it must fall into.
    ``is_synthetic`` says that our number comes from a measurement on the virtual rig, with the paper's values planted.
    Such a claim is at best ``shown_on_synthetic``: the procedure works, which says nothing about the paper's device.
    """

    id: str
    statement: str
    paper: float | None
    value: float | None
    unit: str
    verdict: Verdict
    source: str
    note: str
    assumptions: tuple[str, ...] = ()
    window: tuple[float, float] | None = None
    is_synthetic: bool = False
    words: str = ""
    own: str = ""
    left_open: tuple[float, float] | None = None
    open_by: str = ""

    def __post_init__(self) -> None:
        if (self.is_synthetic and self.verdict.startswith("reproduced")) or (
            self.verdict == "shown_on_synthetic" and not self.is_synthetic
        ):
            raise ValueError(f"{self.id}: '{self.verdict}' does not match synthetic = {self.is_synthetic}")

    @property
    def verdict_words(self) -> str:
        """The verdict in words, and that it rests on a synthetic measurement where the verdict does not say so."""
        words = VERDICTS[self.verdict]
        is_plain = not self.is_synthetic or self.verdict == "shown_on_synthetic"
        return words if is_plain else f"{words}, synthetic"

    @property
    def published(self) -> str:
        """What the paper says, as it is shown; empty where only own arithmetic gives it."""
        return self.words if self.paper is None else format_printed_quantity(self.paper, self.unit)

    @property
    def open_range(self) -> str:
        """What is open about our number, as it is shown."""
        return range_text(self.left_open, self.unit)

    @property
    def is_missed(self) -> bool:
        """True where the claim has a window and our number is not in it."""
        if self.window is None:
            return False
        return self.value is None or not self.window[0] <= self.value <= self.window[1]

    def document(self) -> dict[str, Any]:
        """Return the claim as plain data for ``claims.json``."""
        return {
            "id": self.id,
            "statement": self.statement,
            "paper": self.paper,
            "words": self.words,
            "own": self.own,
            "value": self.value,
            "left_open": None if self.left_open is None else list(self.left_open),
            "open_by": self.open_by,
            "unit": self.unit,
            "verdict": self.verdict,
            "synthetic": self.is_synthetic,
            "assumptions": list(self.assumptions),
            "source": self.source,
            "note": self.note,
        }


def range_text(ends: tuple[float, float] | None, unit: str) -> str:
    """Return a range as it is shown; empty where there is none."""
    if ends is None:
        return ""
    low, high = (quantity(end, "-", 3) for end in ends)
    return f"{low} to {high}{'' if unit == '-' else f' {unit}'}".rstrip()


@dataclass(frozen=True, slots=True)
class Observation:
    """What the text tells, whether the simulated recording shows it, and the numbers that decide it.

    ``difference`` says what the recording shows beyond the sentence, where that is not what the paper tells.
    """

    id: str
    statement: str
    holds: bool
    evidence: str
    source: str
    difference: str = ""


def stated_claim(
    identifier: str,
    value: float | None,
    verdict: Verdict,
    note: str,
    assumptions: tuple[str, ...] = (),
    window: tuple[float, float] | None = None,
    is_synthetic: bool = False,
) -> Claim:
    """Return the claim of an entry of the paper's file with our number and the verdict on it."""
    entry = paper_entries()[identifier]
    return Claim(
        id=identifier,
        statement=entry.statement,
        paper=entry.published,
        value=value,
        unit=entry.unit or "-",
        verdict=verdict,
        source=entry.where,
        note=note,
        assumptions=assumptions,
        window=window,
        is_synthetic=is_synthetic,
        words=entry.words,
        own=entry.own,
    )


def observation(identifier: str, holds: bool, evidence: str, difference: str = "") -> Observation:
    """Return what an entry of the paper's file tells, with whether the recording shows it."""
    entry = paper_entries()[identifier]
    return Observation(identifier, entry.statement, holds, evidence, entry.where, difference)


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Return how many claims have each verdict, in the order of ``VERDICTS``."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in VERDICTS}


def count_sentence(claims: Sequence[Claim]) -> str:
    """Return how many claims have each verdict, for example ``18 claims: 3 reproduced, 4 contradicted``."""
    return count_words([claim.verdict for claim in claims])


def count_words(verdicts: Sequence[Verdict]) -> str:
    """Return the same of verdicts alone."""
    found = ", ".join(f"{count} {words}" for key, words in VERDICTS.items() if (count := verdicts.count(key)))
    return f"{len(verdicts)} claims: {found}"


PRINTED_SET = "ppafo2011-printed"
PRINTED_DIGITS = "the printed digits"


@dataclass(frozen=True, slots=True)
class Printed:
    """Read access to the printed set; every requested value has to be there."""

    parameter_set: ParameterSet
    evidence: Evidence

    def number(self, path: str) -> float:
        """Return the number as printed, in its printed unit."""
        return self._entry_of(path)[0]

    def unit(self, path: str) -> str:
        """Return the printed unit, ``-`` for a plain number."""
        return self._entry_of(path)[1] or "-"

    def source(self, path: str) -> str:
        """Return where the paper prints it."""
        self._entry_of(path)
        return self.parameter_set.numbers[path].source

    def quotation(self, path: str) -> str:
        """Return number and unit for a sentence, for example ``8.4 g m^2``."""
        number, unit = self._entry_of(path)
        return f"{number:g} {unit}".rstrip()

    def in_si(self, path: str) -> float:
        """Return the value in SI units."""
        value = self.evidence.number(path)
        if value is None:
            raise self._lack(path)
        return value

    def in_printed_unit(self, path: str, value: float) -> float:
        """Return an SI value in the unit in which the paper prints the quantity at a path (a unit without offset)."""
        return value * self.number(path) / self.in_si(path)

    def range(self, path: str) -> Interval:
        """Return the range in SI that the printed digits leave open, without sign."""
        interval = self.evidence.magnitude(path)
        if interval is None:
            raise self._lack(path)
        return interval

    def gas(self) -> Gas:
        """Return the printed gas."""
        gas = self.evidence.gas()
        if gas is None:
            raise self._lack("gas")
        return gas

    def _entry_of(self, path: str) -> tuple[float, str]:
        entry = self.parameter_set.numbers.get(path)
        if entry is None:
            raise self._lack(path)
        return entry.value, entry.unit

    def _lack(self, path: str) -> ParameterError:
        return ParameterError(f"{self.parameter_set.file}: '{path}' is missing; the claims of the paper need it")


def load_printed() -> Printed:
    """Return the paper's numbers, exactly as printed."""
    parameter_set = load_parameter_set(PRINTED_SET)
    return Printed(parameter_set, Evidence(parameter_set, parameter_set.declarations()))


_INERTIA = "foot_plate.inertia"
_DIGITS = "to the printed digits"


def arithmetic_claims(printed: Printed) -> list[Claim]:
    """Return the claims on C1, C2, the critical ratio, damping, dynamic friction and both discharge coefficients."""
    return [
        *_flow_constants(printed),
        _product(
            printed, "rotary_damping", "friction.viscous_damping", "reported.velocity_over_acceleration", "decay rate"
        ),
        _product(
            printed, "dynamic_friction", "friction.dynamic_torque", "reported.stopping_deceleration", "deceleration"
        ),
        _coefficient(printed, "solenoid"),
        _coefficient(printed, "proportional"),
    ]


_GAS_NUMBERS = ("gas.heat_capacity_ratio", "gas.molar_mass", "gas.temperature")


def _flow_constants(printed: Printed) -> list[Claim]:
    gas = printed.gas()
    printed_gas = gas.heat_capacity_ratio, gas.molar_mass, gas.temperature
    found: tuple[tuple[str, str, str, Callable[[float, float, float], float], str], ...] = (
        (
            "c1",
            "C1 of choked flow",
            "reported.choked_flow_constant",
            lambda k, mass, temperature: choked_flow_constant(k, UNIVERSAL_GAS_CONSTANT / mass, temperature),
            " With the exponent (k + 1)/(k - 1) under the root, not the printed one: see the audit.",
        ),
        (
            "c2",
            "C2 of subsonic flow",
            "reported.subsonic_flow_constant",
            lambda k, mass, temperature: subsonic_flow_constant(k, UNIVERSAL_GAS_CONSTANT / mass, temperature),
            "",
        ),
        (
            "critical_pressure_ratio",
            "the pressure ratio where flow chokes",
            "reported.critical_pressure_ratio",
            lambda k, _mass, _temperature: 1.0 / critical_pressure_ratio(k),
            "",
        ),
    )
    claims = []
    for identifier, name, path, computed, remark in found:
        value = computed(*printed_gas)
        # Each rises or falls with every number of the gas, so that its ends are at ends of theirs.
        ends = [computed(*corner) for corner in product(*(printed.range(number) for number in _GAS_NUMBERS))]
        holds = printed.range(path).meets(Interval(value, value))
        statement = f"{name[0].upper()}{name[1:]} follows from the gas: k, molar mass and temperature as printed."
        note = f"{'Agrees' if holds else 'Does not agree'} {_DIGITS}.{remark}"
        claim = _claim(printed, identifier, statement, path, value, holds, note)
        claims.append(replace(claim, left_open=(min(ends), max(ends)), open_by=f"{PRINTED_DIGITS} of the gas"))
    return claims


def _product(printed: Printed, identifier: str, path: str, rate_path: str, rate_name: str) -> Claim:
    """Compare a printed product with inertia times the printed rate; a rate in 1/s is one, whatever it is called."""
    name = identifier.replace("_", " ")
    implied_range = printed.range(_INERTIA).times(printed.range(rate_path))
    holds = implied_range.meets(printed.range(path))
    value = printed.in_printed_unit(path, printed.in_si(_INERTIA) * abs(printed.in_si(rate_path)))
    rate = f"{abs(printed.number(rate_path)):g} {printed.unit(rate_path)}"
    implied = printed.in_printed_unit(_INERTIA, printed.in_si(path) / abs(printed.in_si(rate_path)))
    statement = f"The {name} is the inertia, {printed.quotation(_INERTIA)}, times the measured {rate_name}, {rate}."
    note = (
        f"The printed product holds {_DIGITS}."
        if holds
        else f"The product is {value:.3g} {printed.unit(path)}; the printed {printed.quotation(path)} would need an "
        f"inertia of {implied:.2g} {printed.unit(_INERTIA)}. The measured {rate_name} itself cannot be tested here."
    )
    claim = _claim(printed, identifier, statement, path, value, holds, note)
    low, high = (printed.in_printed_unit(path, end) for end in implied_range)
    return replace(claim, left_open=(low, high), open_by=PRINTED_DIGITS)


def _coefficient(printed: Printed, valve: str) -> Claim:
    """Compare a printed Cd with the one that the printed flow needs through the printed area; equation (6)."""
    coefficient, area = f"valves.{valve}.discharge_coefficient", f"valves.{valve}.area"
    flow, pressure = f"reported.valves.{valve}.mass_flow", f"reported.valves.{valve}.flow_pressure"
    per_area = _flow_per_area(printed, pressure)
    value = printed.in_si(flow) / (per_area * printed.in_si(area))
    needed = printed.range(flow).over(printed.range(area)).over(Interval(per_area, per_area))
    holds = needed.meets(printed.range(coefficient))
    stated = 1e3 * printed.in_si(coefficient) * printed.in_si(area) * per_area
    through = f"{printed.quotation(area)} and {printed.quotation(flow)} at {printed.quotation(pressure)}"
    statement = f"The discharge coefficient of the {valve} valve follows from its area and flow: {through}."
    note = (
        f"Agrees {_DIGITS}."
        if holds
        else f"The printed flow needs Cd = {value:.3g} (a plain number: the printed unit {printed.unit(coefficient)} "
        f"does not fit equation (6)); the printed {printed.number(coefficient):g} would pass {stated:.3g} g/s."
    )
    assumptions = (
        f"supply.atmospheric_pressure = {STANDARD_ATMOSPHERE:g} Pa_a: not printed; the standard atmosphere",
        "the measured flow is choked or leaves into the atmosphere through one opening of the printed area",
    )
    claim = _claim(
        printed, f"discharge_coefficient_{valve}", statement, coefficient, value, holds, note, assumptions, "-"
    )
    return replace(claim, left_open=(needed.low, needed.high), open_by=PRINTED_DIGITS)


def _flow_per_area(printed: Printed, pressure_path: str) -> float:
    """Flow of Cd A = 1 m^2 into the atmosphere [kg/(s m^2)]; equations (6), (7)."""
    gas, pressure = printed.gas(), printed.in_si(pressure_path)
    k = gas.heat_capacity_ratio
    psi = isentropic_flow_function(min(STANDARD_ATMOSPHERE / pressure, 1.0), k)
    return choked_flow_constant(k, gas.specific_gas_constant, gas.temperature) * pressure * psi


def _claim(
    printed: Printed,
    identifier: str,
    statement: str,
    path: str,
    value: float,
    holds: bool,
    note: str,
    assumptions: tuple[str, ...] = (),
    unit: str | None = None,
) -> Claim:
    verdict: Verdict = "reproduced" if holds else "contradicted"
    if holds and assumptions:
        verdict = "reproduced_with_assumptions"
    return Claim(
        id=identifier,
        statement=statement,
        paper=printed.number(path),
        value=value,
        unit=printed.unit(path) if unit is None else unit,
        verdict=verdict,
        source=printed.source(path),
        note=note,
        assumptions=assumptions,
    )
