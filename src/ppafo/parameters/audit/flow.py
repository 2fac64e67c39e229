"""Checks of flows and flow constants against orifices and gas. Equations (6) and (7), and ISO 6358."""

import ast
import math
import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio, subsonic_flow_constant
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function, sonic_conductance_mass
from ppafo.parameters.audit.evidence import GAS_PATHS, AuditFinding, ComparedNumber, Evidence, ReportedRange
from ppafo.parameters.building import both_forms
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import Gas, Orifice, SonicOrifice
from ppafo.parameters.plant import orifice_conductance

# Is every orifice given in one form, and what does each valve pass? Equations (6) and (7), ISO 6358.

_SUPPLY = "supply.pressure"
_GRAMS = 1e3


def check_orifices(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for an orifice in two forms, and a note on each valve's flow with the gas of the set."""
    valves = {name: f"valves.{name}" for name in evidence.parameter_set.valve_kinds}
    for section in ("actuator.leak", *valves.values()):
        names = both_forms(evidence.parameter_set, section)
        if names:
            yield AuditFinding(
                id=f"forms-of-{section.rpartition('.')[2]}",
                severity="error",
                title=f"{section} is given in two forms",
                values=evidence.values_of(*(f"{section}.{name}" for name in names)),
                sides=(),
                paragraph=(
                    f"{section} has {', '.join(names)}, which specify one orifice twice, so no device can be built. "
                    "Give area and discharge_coefficient alone, or sonic_conductance and critical_ratio alone."
                ),
            )
    for name, section in valves.items():
        yield from _open_flow(evidence, name, section)


# Are areas of valves the bores of tubes?

_INCH = 25.4e-3
_TUBES = {
    "4 mm": 4.0e-3,
    "6 mm": 6.0e-3,
    "8 mm": 8.0e-3,
    "10 mm": 10.0e-3,
    "1/8 inch": _INCH / 8.0,
    "1/4 inch": _INCH / 4.0,
    "3/8 inch": 3.0 * _INCH / 8.0,
}
"""Standard inner diameters [m] of tubes and ports."""
# Areas are reported to three digits.
_SAME_BORE = 0.005


def check_bores(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a note for each valve whose area is the bore of a tube: its Cd then describes no orifice."""
    for valve in evidence.parameter_set.valve_kinds:
        path = f"valves.{valve}.area"
        area = evidence.number(path) or 0.0
        for name, diameter in _TUBES.items():
            bore = 0.25 * math.pi * diameter * diameter
            if abs(area / bore - 1.0) > _SAME_BORE:
                continue
            yield AuditFinding(
                id=f"bore-of-{valve}",
                severity="note",
                title=f"the area of valve '{valve}' is the bore of a {name} tube",
                values=evidence.values_of(path, f"valves.{valve}.discharge_coefficient"),
                sides=(ComparedNumber("area", area, "m^2"), ComparedNumber(f"bore of {name}", bore, "m^2")),
                paragraph=(
                    f"A bore of {name} has {1e6 * bore:.4g} mm^2, the valve {1e6 * area:.4g} mm^2. An orifice within a "
                    "valve is smaller than its ports: the discharge coefficient stands for everything between them, "
                    "and only its product with the area has a meaning."
                ),
            )


def _open_flow(evidence: Evidence, name: str, section: str) -> Iterator[AuditFinding]:
    gas, supply, atmosphere = evidence.gas(), evidence.number(_SUPPLY), evidence.atmosphere()
    if gas is None or supply is None or both_forms(evidence.parameter_set, section):
        return
    upstream, downstream = max(supply, atmosphere), min(supply, atmosphere)
    if not upstream > downstream > 0.0:
        return
    ratio = downstream / upstream
    area = evidence.numbers(*(f"{section}.{quantity.name}" for quantity in AREA_FORM))
    sonic = evidence.numbers(*(f"{section}.{quantity.name}" for quantity in SONIC_FORM))
    if area is not None and min(area) > 0.0:
        conductance = orifice_conductance(Orifice(*area), gas)
        flow = conductance * upstream * isentropic_flow_function(ratio, gas.heat_capacity_ratio)
        form, origin = AREA_FORM, "by its Cd A"
    elif sonic is not None and min(sonic) > 0.0 and sonic[1] < 1.0:
        conductance = orifice_conductance(SonicOrifice(*sonic), gas)
        flow = conductance * upstream * iso6358_flow_function(ratio, sonic[1])
        form, origin = (
            SONIC_FORM,
            (
                f"of {gas.species} by its sonic conductance, which counts for air as in ISO 6358 and is converted: "
                "another gas passes sqrt(R_air / R) times as much mass at the same temperature"
            ),
        )
    else:
        return
    shown = evidence.in_set_unit(_SUPPLY, supply)
    is_vacuum = supply < atmosphere
    way = "from atmosphere to vacuum" if is_vacuum else "from supply to atmosphere"
    ends = f"the atmosphere to {shown}" if is_vacuum else f"{shown} to the atmosphere"
    yield AuditFinding(
        id=f"open-flow-of-{name}",
        severity="note",
        title=f"valve '{name}' passes {_GRAMS * flow:#.3g} g/s of {gas.species}",
        values=evidence.values_of(*(f"{section}.{quantity.name}" for quantity in form), _SUPPLY),
        sides=(ComparedNumber(f"flow {way}", flow, "kg/s"), ComparedNumber("conductance", conductance, "kg/(s Pa)")),
        paragraph=(
            f"Fully open from {ends} it passes {_GRAMS * flow:#.3g} g/s {origin}. Compare this with the data sheet."
        ),
    )


_LONGEST = 80
_LARGEST = 1e3
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def evaluate(formula: str, heat_capacity_ratio: float) -> float | None:
    """Return the value of a formula such as ``(k + 1)/(k - 1)``; None for any other text."""
    # The formula comes from a file: neither its length nor its value may hold up the audit.
    if len(formula) > _LONGEST:
        return None
    try:
        # Parsed and walked, never evaluated by Python: a set is data.
        value = _value(ast.parse(formula, mode="eval").body, heat_capacity_ratio)
    except (SyntaxError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return value if abs(value) < _LARGEST else None


def _value(node: ast.expr, k: float) -> float:
    match node:
        case ast.BinOp(left, operation, right) if type(operation) in _BINARY:
            return _BINARY[type(operation)](_value(left, k), _value(right, k))
        case ast.UnaryOp(ast.USub(), operand):
            return -_value(operand, k)
        case ast.Name("k"):
            return k
        case ast.Constant(int() | float() as number) if not isinstance(number, bool):
            return float(number)
    raise ValueError("not plain arithmetic in k")


# Do the reported constants of orifice flow follow from the gas data? Equations (6) and (7).

_C1 = "reported.choked_flow_constant"
_EXPONENT = "reported.choked_flow_exponent"
_ROUNDING = 1e-3
"""Relative tolerance beyond the reported digits, for other values of R, M and 273 or 273.15 K."""


def check_choked_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a finding for each reported constant, a note if it agrees, and a finding for the reported exponent."""
    gas = evidence.gas()
    if gas is None:
        return
    k, constant = gas.heat_capacity_ratio, gas.specific_gas_constant
    # The paper gives the critical ratio upstream over downstream.
    expected = {
        _C1: choked_flow_constant(k, constant, gas.temperature),
        "reported.subsonic_flow_constant": subsonic_flow_constant(k, constant, gas.temperature),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    for path, value in expected.items():
        reported, digits = evidence.number(path), evidence.magnitude(path)
        if reported is None or digits is None:
            continue
        holds = digits.low * (1.0 - _ROUNDING) <= value <= digits.high * (1.0 + _ROUNDING)
        quantity = evidence.declared[path]
        verdict = "agree to the reported digits" if holds else f"differ by {100.0 * (reported / value - 1.0):+.2g} %"
        remedy = "" if holds else f" Would be consistent with {value:.5g}, or with other gas data."
        yield AuditFinding(
            id=path.rpartition(".")[2].replace("_", "-"),
            severity="note" if holds else "error",
            title=f"{quantity.summary} {'follows' if holds else 'does not follow'} from the gas data",
            values=evidence.values_of(path, *GAS_PATHS),
            sides=(
                ComparedNumber("reported", reported, quantity.unit),
                ComparedNumber("from the gas data", value, quantity.unit),
            ),
            paragraph=(
                f"Reported is {evidence.in_set_unit(path, reported)}; the gas data give {value:.5g} "
                f"{quantity.unit}".rstrip()
                + f". The two {verdict}.{remedy}"
            ),
        )
    yield from _exponent(evidence, gas)


def _exponent(evidence: Evidence, gas: Gas) -> Iterator[AuditFinding]:
    """Compare C1 with the reported exponent to C1 with (k + 1)/(k - 1)."""
    formula = evidence.text(_EXPONENT)
    k = gas.heat_capacity_ratio
    exponent = None if formula is None else evaluate(formula, k)
    right = (k + 1.0) / (k - 1.0)
    if formula is None or (exponent is not None and math.isclose(exponent, right, rel_tol=1e-9)):
        return
    correct = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature)
    values = evidence.values_of(_EXPONENT, _C1, *GAS_PATHS)
    title = "the reported exponent inside C1 is not the exponent of choked flow"
    if exponent is None:
        text = f"The formula '{formula}' cannot be read as arithmetic in k; the right exponent is (k + 1)/(k - 1)."
        yield AuditFinding("choked-flow-exponent", "warning", title, values, (), text)
        return
    # C1 is the root of a power: half the difference of exponents is left.
    literal = correct * (2.0 / (k + 1.0)) ** (0.5 * (exponent - right))
    reported, agreement = evidence.number(_C1), ""
    if reported is not None:
        nearer = "second" if abs(reported - correct) < abs(reported - literal) else "first"
        agreement = f", and the reported C1 of {reported:.4g} s/m is the {nearer} of the two"
    yield AuditFinding(
        id="choked-flow-exponent",
        severity="error",
        title=title,
        values=values,
        sides=(
            ComparedNumber("C1 with the reported exponent", literal, "s/m"),
            ComparedNumber("C1 with (k+1)/(k-1)", correct, "s/m"),
        ),
        paragraph=(
            f"The reported exponent {formula} is {exponent:.4g} and gives C1 = {literal:.4g} s/m; the exponent "
            f"(k + 1)/(k - 1) = {right:.4g} gives {correct:.4g} s/m{agreement}. "
            f"Would be consistent with the exponent (k + 1)/(k - 1)."
        ),
    )


# Do the reported flows follow from discharge coefficient and area? Equations (6) and (7).

_MODEL = 0.02
"""Relative tolerance of the flow model, about the accuracy of a flow measurement."""


@dataclass(frozen=True, slots=True)
class _ValveFlow:
    """Reported and computed flow of a valve, in SI; ``per_area`` is the flow of an orifice with Cd A = 1 m^2."""

    name: str
    area: float
    coefficient: float
    measured: float
    predicted: float
    per_area: float
    agrees: bool


def check_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each valve whose reported flow contradicts its Cd A, and for an impossible common Cd."""
    flows = [flow for name in evidence.parameter_set.valve_kinds if (flow := _flow(evidence, name)) is not None]
    for flow in flows:
        if not flow.agrees:
            area_path, _, flow_path, pressure_path = _paths(flow.name)
            needed = flow.measured / flow.per_area
            reported = evidence.in_set_unit(flow_path, flow.measured)
            pressure = evidence.in_set_unit(pressure_path, evidence.number(pressure_path) or 0.0)
            yield AuditFinding(
                id=f"flow-of-{flow.name}",
                severity="error",
                title=f"the reported flow of valve '{flow.name}' does not follow from Cd A",
                values=evidence.values_of(*_paths(flow.name)),
                sides=(
                    ComparedNumber("reported flow", flow.measured, "kg/s"),
                    ComparedNumber("Cd A C1 P", flow.predicted, "kg/s"),
                    ComparedNumber("Cd A that gives the reported flow", needed, "m^2"),
                ),
                paragraph=(
                    f"Fully open at {pressure} the valve '{flow.name}' passes "
                    f"{evidence.in_set_unit(flow_path, flow.predicted)} by Cd A = {flow.coefficient:.4g} x "
                    f"{evidence.in_set_unit(area_path, flow.area)}, reported is {reported}: a factor "
                    f"{flow.predicted / flow.measured:.3g}. Would be consistent with Cd A = {1e6 * needed:.4g} mm^2, "
                    f"that is Cd = {needed / flow.area:.3g} with the reported area, or "
                    f"{evidence.in_set_unit(area_path, needed / flow.coefficient)} with the reported Cd; or with "
                    f"{evidence.in_set_unit(flow_path, flow.predicted)} as the flow."
                ),
            )
    yield from _check_shared_coefficient(evidence, flows)


def _paths(name: str) -> tuple[str, ...]:
    valve, reported = f"valves.{name}", f"reported.valves.{name}"
    return (
        f"{valve}.area",
        f"{valve}.discharge_coefficient",
        f"{reported}.mass_flow",
        f"{reported}.flow_pressure",
    )


def _flow(evidence: Evidence, name: str) -> _ValveFlow | None:
    gas, numbers = evidence.gas(), evidence.numbers(*_paths(name))
    # Reported digits leave ranges open: a contradiction must hold for all numbers in them.
    ranges = [interval for path in _paths(name)[:3] if (interval := evidence.magnitude(path)) is not None]
    if gas is None or numbers is None or len(ranges) < 3 or min(numbers) <= 0.0:
        return None
    area, coefficient, measured, pressure = numbers
    k = gas.heat_capacity_ratio
    psi = isentropic_flow_function(min(evidence.atmosphere() / pressure, 1.0), k)
    per_area = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature) * pressure * psi
    room = ReportedRange(per_area * (1.0 - _MODEL), per_area * (1.0 + _MODEL))
    if per_area <= 0.0:
        return None
    agrees = ranges[0].times(ranges[1]).times(room).meets(ranges[2])
    return _ValveFlow(name, area, coefficient, measured, coefficient * area * per_area, per_area, agrees)


def _check_shared_coefficient(evidence: Evidence, flows: list[_ValveFlow]) -> Iterator[AuditFinding]:
    """Compare the first valve with every other of the same Cd: their flows must then be in the ratio of the areas."""
    for other in flows[1:]:
        first = flows[0]
        areas = first.area / other.area
        measured = (first.measured / first.per_area) / (other.measured / other.per_area)
        if first.coefficient != other.coefficient or abs(areas / measured - 1.0) < 2.0 * _MODEL:
            continue
        yield AuditFinding(
            id=f"one-coefficient-{first.name}-{other.name}",
            severity="error",
            title=f"one Cd cannot give the reported flows of '{first.name}' and '{other.name}'",
            values=evidence.values_of(*_paths(first.name)[:3], *_paths(other.name)[:3]),
            sides=(
                ComparedNumber("ratio of the areas", areas, ""),
                ComparedNumber("ratio of the reported flows", measured, ""),
            ),
            paragraph=(
                f"With one discharge coefficient {first.coefficient:.4g} flow goes as area: '{first.name}' must pass "
                f"{areas:.3g} times what '{other.name}' passes, the reported flows are as {measured:.3g} to 1. "
                "Would be consistent with a coefficient of its own for each: "
                f"{first.measured / first.per_area / first.area:.3g} "
                f"and {other.measured / other.per_area / other.area:.3g}; or with two flows, measured one by one."
            ),
        )


# Does the reported flow of a valve in the form of ISO 6358 follow from its sonic conductance?


def check_sonic_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each valve whose reported flow contradicts its sonic conductance."""
    gas = evidence.gas()
    for name in evidence.parameter_set.valve_kinds:
        valve, entry = f"valves.{name}", f"reported.valves.{name}"
        size, flow = f"{valve}.sonic_conductance", f"{entry}.mass_flow"
        paths = (size, f"{valve}.critical_ratio", flow, f"{entry}.flow_pressure")
        numbers, reported, size_reported = evidence.numbers(*paths), evidence.magnitude(flow), evidence.magnitude(size)
        if (
            gas is None
            or numbers is None
            or reported is None
            or size_reported is None
            or min(numbers) <= 0.0
            or numbers[1] >= 1.0
        ):
            continue
        conductance, critical_ratio, measured, pressure = numbers
        psi = iso6358_flow_function(min(evidence.atmosphere() / pressure, 1.0), critical_ratio)
        per_size = sonic_conductance_mass(1.0, gas.specific_gas_constant, gas.temperature) * pressure * psi
        room = ReportedRange(per_size * (1.0 - _MODEL), per_size * (1.0 + _MODEL))
        if per_size <= 0.0 or size_reported.times(room).meets(reported):
            continue
        predicted, needed = conductance * per_size, measured / per_size
        yield AuditFinding(
            id=f"flow-of-{name}",
            severity="error",
            title=f"the reported flow of valve '{name}' does not follow from its sonic conductance",
            values=evidence.values_of(*paths),
            sides=(
                ComparedNumber("reported flow", measured, "kg/s"),
                ComparedNumber("flow of the sonic conductance", predicted, "kg/s"),
                ComparedNumber("sonic conductance that gives the reported flow", needed, "m^3/(s Pa)"),
            ),
            paragraph=(
                f"Fully open the valve '{name}' passes {evidence.in_set_unit(flow, predicted)} by its sonic "
                f"conductance, reported is {evidence.in_set_unit(flow, measured)}: a factor "
                f"{predicted / measured:.3g}. Would be consistent with a sonic conductance of "
                f"{evidence.in_set_unit(size, needed)}, or with the other flow."
            ),
        )
