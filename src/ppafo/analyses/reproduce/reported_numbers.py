"""Claims of the paper that its reported numbers decide by arithmetic, and statements that no published data decide."""

from collections.abc import Callable
from typing import TypeVar

from ppafo.analyses.reproduce.claim import Claim, Verdict
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import isentropic_flow_function, subsonic_flow_constant
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit.evidence import Evidence, ReportedRange, digits
from ppafo.parameters.publications.publication import paper_entries
from ppafo.report.writing import quantity

T = TypeVar("T")
REPORTED_SET = "ppafo2011-printed"
INERTIA = "foot_plate.inertia"
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


def load_reported() -> Evidence:
    """Return the paper's parameter set, exactly as reported."""
    parameter_set = load_parameter_set(REPORTED_SET)
    return Evidence(parameter_set, parameter_set.declarations())


def known(value: T | None) -> T:
    """Return a number of the paper's set, which has all that the claims need."""
    assert value is not None, "a number of the paper's set"
    return value


def arithmetic_claims(reported: Evidence) -> list[Claim]:
    """Return the claims that follow from the reported numbers alone."""
    claims = []
    for identifier, test in _TESTS.items():
        entry, (holds, found) = paper_entries()[identifier], test(reported)
        verdict: Verdict = "consistent" if holds else "inconsistent_as_reported"
        claims.append(Claim(entry, verdict, None, entry.note, entry.assumed, found))
    return claims


def _text(reported: Evidence, path: str, value: float, significant: int = 3) -> str:
    """Return a value [SI] in the reported unit of a path, one without offset, as displayed text."""
    entry = reported.parameter_set.numbers[path]
    return quantity(value * entry.value / known(reported.number(path)), entry.unit or "-", significant)


def _orifice_constants(reported: Evidence) -> tuple[bool, str]:
    """Compare C1, C2 and the critical pressure ratio with the reported gas properties; equations (6), (7)."""
    gas = known(reported.gas())
    k, constant, temperature = gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    constants = {
        "reported.choked_flow_constant": choked_flow_constant(k, constant, temperature),
        "reported.subsonic_flow_constant": subsonic_flow_constant(k, constant, temperature),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    # The reported digits leave a range open; what is computed from the gas does not.
    holds = all(known(reported.magnitude(path)).meets(ReportedRange(value, value)) for path, value in constants.items())
    return holds, ", ".join(_text(reported, path, value, 4) for path, value in constants.items())


def _step_percentages(_reported: Evidence) -> tuple[bool, str]:
    """Compare the reported percentages of the step response with reported errors divided by reported ranges."""
    entries, holds, percentages = paper_entries(), True, []
    for name, full in STEP_ERRORS.items():
        error, percent = (entries[f"step_{kind}_{name}"].published or 0.0 for kind in ("rms", "percent"))
        # Both numbers are rounded: their ranges have to meet.
        holds &= ReportedRange(*(100.0 * end / full for end in digits(error))).meets(digits(percent))
        percentages.append(f"{100.0 * error / full:.2f}")
    return holds, f"{', '.join(percentages)} %"


def _damping_and_friction(reported: Evidence) -> tuple[bool, str]:
    """Compare damping and dynamic friction with inertia times the reported rates, which one inertia must satisfy."""
    inertia, holds, products = known(reported.magnitude(INERTIA)), True, []
    for path, rate in _RATES.items():
        holds &= inertia.times(known(reported.magnitude(rate))).meets(known(reported.magnitude(path)))
        # The slope of acceleration over velocity is reported with its sign, the damping without.
        product = known(reported.number(INERTIA)) * abs(known(reported.number(rate)))
        products.append(_text(reported, path, product))
    return holds, ", ".join(products)


def _discharge_coefficient(reported: Evidence) -> tuple[bool, str]:
    """Compare the reported Cd with the value needed for the reported flow through each area; equation (6)."""
    gas, holds, coefficients = known(reported.gas()), True, []
    choked = choked_flow_constant(gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature)
    for valve in ("solenoid", "proportional"):
        flow, area = f"reported.valves.{valve}.mass_flow", f"valves.{valve}.area"
        # Flow of Cd A = 1 m^2 into the atmosphere [kg/(s m^2)]; equations (6), (7).
        pressure = known(reported.number(f"reported.valves.{valve}.flow_pressure"))
        psi = isentropic_flow_function(min(STANDARD_ATMOSPHERE / pressure, 1.0), gas.heat_capacity_ratio)
        per_area = choked * pressure * psi
        # The product Cd A follows from the flow; each area asks for a coefficient of its own.
        needed = known(reported.magnitude(flow)).over(known(reported.magnitude(area)))
        stated = known(reported.magnitude(f"valves.{valve}.discharge_coefficient"))
        holds &= needed.over(ReportedRange(per_area, per_area)).meets(stated)
        coefficients.append(f"{known(reported.number(flow)) / (per_area * known(reported.number(area))):.3g}")
    return holds, " and ".join(coefficients)


def _swept_volume(reported: Evidence) -> tuple[bool, str]:
    """Compare displacement per radian with torque constant, which are equal by the principle of virtual work."""
    path, constant = "actuator.displacement_per_radian", "actuator.torque_constant"
    holds = known(reported.magnitude(constant)).meets(known(reported.magnitude(path)))
    return holds, _text(reported, path, known(reported.number(constant)))


_TESTS: dict[str, Callable[[Evidence], tuple[bool, str]]] = {
    "orifice_constants": _orifice_constants,
    "step_percentages": _step_percentages,
    "damping_and_friction": _damping_and_friction,
    "discharge_coefficient": _discharge_coefficient,
    "swept_volume": _swept_volume,
}
"""Test of each claim by its entry in the file of the paper: returns whether the claim holds, and our numbers."""
