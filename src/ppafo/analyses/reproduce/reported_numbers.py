"""Claims of the paper that its reported numbers decide by arithmetic, and claims that no published data decide."""

from dataclasses import dataclass
from typing import TypeVar

from ppafo.analyses.reproduce.claim import Claim, Verdict
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ParameterError
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import isentropic_flow_function, subsonic_flow_constant
from ppafo.parameters import ParameterSet, load_parameter_set
from ppafo.parameters.audit.evidence import Evidence, ReportedRange, digits
from ppafo.parameters.device import Gas
from ppafo.parameters.parameter_set import Entry
from ppafo.parameters.publications.publication import ClaimEntry, paper_entries
from ppafo.report.writing import quantity

T = TypeVar("T")
REPORTED_SET = "ppafo2011-printed"
_INERTIA = "foot_plate.inertia"
STEP_ERRORS = {"position": 110.0, "pressure_1": 55.0, "pressure_2": 55.0, "pressure_difference": 110.0}
"""Reported errors of the step response, and the full ranges [deg, psi] by which the paper divides them."""
_RATES = {
    "friction.viscous_damping": "reported.velocity_over_acceleration",
    "friction.dynamic_torque": "reported.stopping_deceleration",
}
"""Path of the reported rate [1/s] or [1/s^2] that gives each friction parameter when multiplied by the inertia."""
NOT_PUBLISHED = (
    "k_actuator",
    "static_friction",
    "leak_area",
    *(f"step_rms_{name}" for name in STEP_ERRORS),
    "large_and_heavy",
    "unmodelled_dynamics",
    "temperature_would_help",
)
"""Statements that only unpublished recordings or masses could test."""


@dataclass(frozen=True, slots=True)
class ReportedSet:
    """Parameter set with the paper's numbers as reported; every requested entry must exist."""

    parameter_set: ParameterSet
    evidence: Evidence

    def entry(self, path: str) -> Entry:
        """Return the entry at a path: reported number and unit, and its location in the paper."""
        return self._known(path, self.parameter_set.numbers.get(path))

    def quotation(self, path: str) -> str:
        """Return reported number and unit for use in a sentence, for example ``8.4 g m^2``."""
        entry = self.entry(path)
        return f"{entry.value:g} {entry.unit}".rstrip()

    def in_si(self, path: str) -> float:
        """Return the reported value at a path in SI units."""
        return self._known(path, self.evidence.number(path))

    def in_reported_unit(self, path: str, value: float) -> float:
        """Return an SI value converted to the paper's unit for the quantity at a path (a unit without offset)."""
        return value * self.entry(path).value / self.in_si(path)

    def text(self, path: str, value: float, digits: int = 4) -> str:
        """Return a value in the reported unit of a path, as displayed text."""
        return quantity(value, self.entry(path).unit or "-", digits)

    def range(self, path: str) -> ReportedRange:
        """Return the range [SI] of values that round to the reported digits, without sign."""
        return self._known(path, self.evidence.magnitude(path))

    def gas(self) -> Gas:
        """Return the gas properties as reported in the paper."""
        return self._known("gas", self.evidence.gas())

    def _known(self, path: str, value: T | None) -> T:
        if value is None:
            raise ParameterError(f"{self.parameter_set.file}: '{path}' is missing; the claims of the paper need it")
        return value


def load_reported() -> ReportedSet:
    """Return the paper's parameter set, exactly as reported."""
    parameter_set = load_parameter_set(REPORTED_SET)
    return ReportedSet(parameter_set, Evidence(parameter_set, parameter_set.declarations()))


def arithmetic_claims(reported: ReportedSet) -> list[Claim]:
    """Return the claims that follow from the reported numbers alone."""
    return [
        _orifice_constants(reported),
        _step_percentages(),
        _damping_and_friction(reported),
        _discharge_coefficient(reported),
        _swept_volume(reported),
    ]


def _verdict(holds: bool) -> Verdict:
    return "consistent" if holds else "inconsistent_as_reported"


def _orifice_constants(reported: ReportedSet) -> Claim:
    """Compare C1, C2 and the critical pressure ratio with the reported gas properties; equations (6), (7)."""
    gas = reported.gas()
    k, constant, temperature = gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    constants = {
        "reported.choked_flow_constant": choked_flow_constant(k, constant, temperature),
        "reported.subsonic_flow_constant": subsonic_flow_constant(k, constant, temperature),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    # The reported digits leave a range open; what is computed from the gas does not.
    holds = all(reported.range(path).meets(ReportedRange(value, value)) for path, value in constants.items())
    return Claim(
        ClaimEntry(
            id="orifice_constants",
            statement="C1, C2 and the critical pressure ratio follow from k, molar mass and temperature of the gas.",
            where=", ".join(reported.entry(path).source for path in constants),
            words=", ".join(reported.quotation(path) for path in constants),
        ),
        verdict=_verdict(holds),
        note="To the reported digits, with the exponent (k + 1)/(k - 1) under the root of C1 and not the reported one.",
        found=", ".join(reported.text(path, value) for path, value in constants.items()),
    )


def _step_percentages() -> Claim:
    """Compare the reported percentages of the step response with reported errors divided by reported ranges."""
    entries = paper_entries()
    errors = [entries[f"step_rms_{name}"].published or 0.0 for name in STEP_ERRORS]
    percents = [entries[f"step_percent_{name}"].published or 0.0 for name in STEP_ERRORS]
    ranges = list(STEP_ERRORS.values())
    # Both numbers are rounded: their ranges have to meet.
    holds = all(
        ReportedRange(*(100.0 * end / full for end in digits(error))).meets(digits(percent))
        for error, full, percent in zip(errors, ranges, percents, strict=True)
    )
    percentages = [100.0 * error / full for error, full in zip(errors, ranges, strict=True)]
    return Claim(
        ClaimEntry(
            id="step_percentages",
            statement="The errors of the step response in percent of the full ranges of 110 deg, 55 psi and 110 psi.",
            unit="%",
            where=entries["step_percent_position"].where,
            words=f"{', '.join(f'{percent:g}' for percent in percents)} %",
        ),
        verdict=_verdict(holds),
        note="Reported errors over reported ranges; nothing is simulated.",
        found=f"{', '.join(f'{percent:.2f}' for percent in percentages)} %",
    )


def _damping_and_friction(reported: ReportedSet) -> Claim:
    """Compare damping and dynamic friction with inertia times the reported rates.

    A single inertia must satisfy both relations.
    """
    inertia = reported.range(_INERTIA)
    # The slope of acceleration over velocity is reported with its sign, the damping without.
    rates = {path: abs(reported.in_si(rate)) for path, rate in _RATES.items()}
    holds = all(inertia.times(reported.range(rate)).meets(reported.range(path)) for path, rate in _RATES.items())
    friction = {path: reported.in_reported_unit(path, reported.in_si(_INERTIA) * rate) for path, rate in rates.items()}
    needed = [reported.in_reported_unit(_INERTIA, reported.in_si(path) / rate) for path, rate in rates.items()]
    unit = reported.entry(_INERTIA).unit
    return Claim(
        ClaimEntry(
            id="damping_and_friction",
            statement=f"Damping and dynamic friction are the inertia, {reported.quotation(_INERTIA)}, "
            "times measured rates.",
            where=reported.entry("friction.viscous_damping").source,
            words=", ".join(reported.quotation(path) for path in friction),
        ),
        verdict=_verdict(holds),
        note="The products hold to the reported digits."
        if holds
        else f"The reported products need inertias of {' and '.join(f'{value:.2g}' for value in needed)} {unit}: "
        f"one slip, a factor of ten in the inertia, explains both, so that it counts once.",
        found=", ".join(reported.text(path, value, 3) for path, value in friction.items()),
    )


def _discharge_coefficient(reported: ReportedSet) -> Claim:
    """Compare the reported Cd with the value needed for the reported flow through each area; equation (6)."""
    coefficients, flows, agreements, gas = [], [], [], reported.gas()
    choked = choked_flow_constant(gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature)
    for valve in ("solenoid", "proportional"):
        coefficient, area = f"valves.{valve}.discharge_coefficient", f"valves.{valve}.area"
        flow = f"reported.valves.{valve}.mass_flow"
        # Flow of Cd A = 1 m^2 into the atmosphere [kg/(s m^2)]; equations (6), (7).
        pressure = reported.in_si(f"reported.valves.{valve}.flow_pressure")
        psi = isentropic_flow_function(min(STANDARD_ATMOSPHERE / pressure, 1.0), gas.heat_capacity_ratio)
        per_area = choked * pressure * psi
        # The product Cd A follows from the flow; each area asks for a coefficient of its own.
        needed = reported.range(flow).over(reported.range(area)).over(ReportedRange(per_area, per_area))
        agreements.append(needed.meets(reported.range(coefficient)))
        coefficients.append(reported.in_si(flow) / (per_area * reported.in_si(area)))
        flows.append(1e3 * reported.in_si(coefficient) * reported.in_si(area) * per_area)
    stated = [reported.quotation(f"reported.valves.solenoid.{name}") for name in ("mass_flow", "flow_pressure")]
    areas = " and ".join(reported.quotation(f"valves.{valve}.area") for valve in ("solenoid", "proportional"))
    path = "valves.solenoid.discharge_coefficient"
    return Claim(
        ClaimEntry(
            id="discharge_coefficient",
            statement=f"One discharge coefficient gives {' at '.join(stated)} through {areas}.",
            published=reported.entry(path).value,
            where=reported.entry(path).source,
        ),
        verdict=_verdict(all(agreements)),
        note="Agrees to the reported digits."
        if all(agreements)
        else f"No one coefficient gives the same flow through both areas; {reported.entry(path).value:g} passes "
        f"{' and '.join(f'{value:.3g}' for value in flows)} g/s. It is a plain number: the reported unit "
        f"{reported.entry(path).unit} does not fit equation (6).",
        assumptions=(
            f"supply.atmospheric_pressure = {STANDARD_ATMOSPHERE:g} Pa_a: not reported; the standard atmosphere",
            "the measured flow leaves into the atmosphere through one opening of the reported area",
        ),
        found=" and ".join(f"{value:.3g}" for value in coefficients),
    )


def _swept_volume(reported: ReportedSet) -> Claim:
    """Compare displacement per radian with torque constant, which are equal by the principle of virtual work."""
    path, constant = "actuator.displacement_per_radian", "actuator.torque_constant"
    needed = reported.in_si(constant)
    share = 100.0 * needed / reported.in_si(path)
    return Claim(
        ClaimEntry(
            id="swept_volume",
            statement="The vane has this displacement per radian, from the data sheet of the actuator.",
            published=reported.entry(path).value,
            unit=reported.entry(path).unit,
            where=reported.entry(path).source,
        ),
        verdict=_verdict(reported.range(constant).meets(reported.range(path))),
        note=f"Virtual work with the reported torque constant, which is free of friction as the mean of rising and "
        f"falling readings. {reported.quotation(path)} would give the shaft {share:.0f} % of the "
        "work of the gas. Equation (5) is negative beyond 90 deg; figure 7 goes to 130.",
        found=reported.text(path, reported.in_reported_unit(path, needed), 3),
    )


NOT_PUBLISHED_CLAIM = Claim(
    ClaimEntry(
        id="not_published",
        statement="Torque constant, static friction, leak, the four RMS errors of the step response with what explains "
        "them (dynamics beyond the model, temperature), and size and weight of the proportional valve.",
        where="sections 'Identification', 'PPAFO Model Validation' and 'Discussion'",
        words=f"{len(NOT_PUBLISHED)} statements",
    ),
    verdict="not_testable",
    note="The recordings, masses and sizes are not published. Tests show that the procedures recover known values from "
    "synthetic recordings, which says nothing about the paper's device.",
)
"""Claim that summarises all statements that no published data can test."""
