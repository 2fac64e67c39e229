"""Claims that the paper's own numbers decide: constants from the gas data, products, and flow through an orifice."""

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio, subsonic_flow_constant
from ppafo.model.orifice import isentropic_flow_function
from ppafo.parameters.audit.evidence import Interval
from ppafo.questions.reproduce.claim import Claim, Verdict
from ppafo.questions.reproduce.printed import Printed

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


def _flow_constants(printed: Printed) -> list[Claim]:
    gas = printed.gas()
    k, constant, temperature = gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    found = (
        (
            "c1",
            "C1 of choked flow",
            "reported.choked_flow_constant",
            choked_flow_constant(k, constant, temperature),
            " With the exponent (k + 1)/(k - 1) under the root, not the printed one: see the audit.",
        ),
        (
            "c2",
            "C2 of subsonic flow",
            "reported.subsonic_flow_constant",
            subsonic_flow_constant(k, constant, temperature),
            "",
        ),
        (
            "critical_pressure_ratio",
            "the pressure ratio where flow chokes",
            "reported.critical_pressure_ratio",
            1.0 / critical_pressure_ratio(k),
            "",
        ),
    )
    return [_from_gas(printed, *each) for each in found]


def _from_gas(printed: Printed, identifier: str, name: str, path: str, value: float, remark: str) -> Claim:
    holds = printed.range(path).meets(Interval(value, value))
    statement = f"{name[0].upper()}{name[1:]} follows from the gas: k, molar mass and temperature as printed."
    note = f"{'Agrees' if holds else 'Does not agree'} {_DIGITS}.{remark}"
    return _claim(printed, identifier, statement, path, value, holds, note)


def _product(printed: Printed, identifier: str, path: str, rate_path: str, rate_name: str) -> Claim:
    """Compare a printed product with inertia times the printed rate; a rate in 1/s is one, whatever it is called."""
    name = identifier.replace("_", " ")
    holds = printed.range(_INERTIA).times(printed.range(rate_path)).meets(printed.range(path))
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
    return _claim(printed, identifier, statement, path, value, holds, note)


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
    return _claim(
        printed, f"discharge_coefficient_{valve}", statement, coefficient, value, holds, note, assumptions, "-"
    )


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
