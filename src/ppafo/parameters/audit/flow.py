"""Do the printed flows follow from discharge coefficient and area? Equations (6) and (7)."""

from collections.abc import Iterator
from dataclasses import dataclass

from ppafo.model.gas import choked_flow_constant
from ppafo.model.orifice import isentropic_flow_function
from ppafo.parameters.audit.evidence import Evidence, Interval
from ppafo.parameters.audit.finding import Finding, Side

_MODEL = 0.02
"""Relative room for the model itself: measured flow is rarely better."""


@dataclass(frozen=True, slots=True)
class _ValveFlow:
    """A measured flow beside what the set's orifice passes, SI; ``per_area`` is the flow of Cd A = 1 m^2."""

    name: str
    area: float
    coefficient: float
    measured: float
    predicted: float
    per_area: float
    agrees: bool


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for each valve whose printed flow its Cd A does not pass, and for a shared Cd that cannot be."""
    flows = [flow for name in evidence.parameter_set.valve_kinds if (flow := _flow(evidence, name)) is not None]
    for flow in flows:
        if not flow.agrees:
            yield _contradiction(evidence, flow)
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
    gas, found = evidence.gas(), evidence.numbers(*_paths(name))
    ranges = [interval for path in _paths(name)[:3] if (interval := evidence.magnitude(path)) is not None]
    if gas is None or found is None or len(ranges) < 3 or min(found) <= 0.0:
        return None
    area, coefficient, measured, pressure = found
    k = gas.heat_capacity_ratio
    psi = isentropic_flow_function(min(evidence.atmosphere() / pressure, 1.0), k)
    per_area = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature) * pressure * psi
    room = Interval(per_area * (1.0 - _MODEL), per_area * (1.0 + _MODEL))
    if per_area <= 0.0:
        return None
    agrees = ranges[0].times(ranges[1]).times(room).meets(ranges[2])
    return _ValveFlow(name, area, coefficient, measured, coefficient * area * per_area, per_area, agrees)


def _contradiction(evidence: Evidence, flow: _ValveFlow) -> Finding:
    area_path, _, flow_path, pressure_path = _paths(flow.name)
    needed = flow.measured / flow.per_area
    printed = evidence.in_set_unit(flow_path, flow.measured)
    pressure = evidence.in_set_unit(pressure_path, evidence.number(pressure_path) or 0.0)
    return Finding(
        id=f"flow-of-{flow.name}",
        severity="error",
        title=f"the printed flow of valve '{flow.name}' does not follow from Cd A",
        values=evidence.values_of(*_paths(flow.name)),
        sides=(
            Side("printed flow", flow.measured, "kg/s"),
            Side("Cd A C1 P", flow.predicted, "kg/s"),
            Side("Cd A that gives the printed flow", needed, "m^2"),
        ),
        paragraph=(
            f"Fully open at {pressure} the valve '{flow.name}' passes "
            f"{evidence.in_set_unit(flow_path, flow.predicted)} by Cd A = {flow.coefficient:.4g} x "
            f"{evidence.in_set_unit(area_path, flow.area)}, printed is {printed}: a factor "
            f"{flow.predicted / flow.measured:.3g}. Reconciled by Cd A = {1e6 * needed:.4g} mm^2, that is "
            f"Cd = {needed / flow.area:.3g} with the printed area, or "
            f"{evidence.in_set_unit(area_path, needed / flow.coefficient)} with the printed Cd; or by "
            f"{evidence.in_set_unit(flow_path, flow.predicted)} as the flow."
        ),
    )


def _check_shared_coefficient(evidence: Evidence, flows: list[_ValveFlow]) -> Iterator[Finding]:
    """Compare the first valve with every other one that has the same Cd; then flows must be as areas."""
    for other in flows[1:]:
        first = flows[0]
        areas = first.area / other.area
        measured = (first.measured / first.per_area) / (other.measured / other.per_area)
        if first.coefficient != other.coefficient or abs(areas / measured - 1.0) < 2.0 * _MODEL:
            continue
        yield Finding(
            id=f"one-coefficient-{first.name}-{other.name}",
            severity="error",
            title=f"one Cd cannot give the printed flows of '{first.name}' and '{other.name}'",
            values=evidence.values_of(*_paths(first.name)[:3], *_paths(other.name)[:3]),
            sides=(Side("ratio of the areas", areas, ""), Side("ratio of the printed flows", measured, "")),
            paragraph=(
                f"With one discharge coefficient {first.coefficient:.4g} flow goes as area: '{first.name}' must pass "
                f"{areas:.3g} times what '{other.name}' passes, the printed flows are as {measured:.3g} to 1. "
                f"Reconciled by a coefficient of its own for each: {first.measured / first.per_area / first.area:.3g} "
                f"and {other.measured / other.per_area / other.area:.3g}; or by two flows, measured one by one."
            ),
        )
