"""Checks of the reported flows of valves against their orifices. Equations (6) and (7), and ISO 6358."""

from collections.abc import Iterator
from dataclasses import dataclass

from ppafo.model.gas import choked_flow_constant
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function, sonic_conductance_mass
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, ReportedRange

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
            consistent = flow.measured / flow.per_area
            reported = evidence.in_set_unit(flow_path, flow.measured)
            pressure = evidence.in_set_unit(pressure_path, evidence.number(pressure_path) or 0.0)
            yield AuditFinding(
                id=f"flow-of-{flow.name}",
                title=f"the reported flow of valve '{flow.name}' does not follow from Cd A",
                values=evidence.values_of(*_paths(flow.name)),
                sides=(
                    ComparedNumber("reported flow", flow.measured, "kg/s"),
                    ComparedNumber("Cd A C1 P", flow.predicted, "kg/s"),
                    ComparedNumber("Cd A that gives the reported flow", consistent, "m^2"),
                ),
                paragraph=(
                    f"Fully open at {pressure}, valve '{flow.name}' passes "
                    f"{evidence.in_set_unit(flow_path, flow.predicted)} with Cd A = {flow.coefficient:.4g} x "
                    f"{evidence.in_set_unit(area_path, flow.area)}, but the reported flow is {reported}: a factor of "
                    f"{flow.predicted / flow.measured:.3g}. Consistent would be Cd A = "
                    f"{1e6 * consistent:.4g} mm^2, which is Cd = {consistent / flow.area:.3g} with the reported "
                    f"area, or {evidence.in_set_unit(area_path, consistent / flow.coefficient)} with the reported "
                    f"Cd; or a flow of {evidence.in_set_unit(flow_path, flow.predicted)}."
                ),
            )
    yield from _check_shared_coefficient(evidence, flows)


def _paths(name: str) -> tuple[str, ...]:
    valve, reported = f"valves.{name}", f"reported.valves.{name}"
    return (f"{valve}.area", f"{valve}.discharge_coefficient", f"{reported}.mass_flow", f"{reported}.flow_pressure")


def _flow(evidence: Evidence, name: str) -> _ValveFlow | None:
    gas, numbers = evidence.gas(), evidence.numbers(*_paths(name))
    # Reported digits are ranges: a contradiction must hold for all numbers in them.
    ranges = [interval for path in _paths(name)[:3] if (interval := evidence.magnitude(path)) is not None]
    if gas is None or numbers is None or len(ranges) < 3 or min(numbers) <= 0.0:
        return None
    area, coefficient, measured, pressure = numbers
    k = gas.heat_capacity_ratio
    psi = isentropic_flow_function(min(evidence.atmosphere() / pressure, 1.0), k)
    per_area = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature) * pressure * psi
    if per_area <= 0.0:
        return None
    model = ReportedRange(per_area * (1.0 - _MODEL), per_area * (1.0 + _MODEL))
    agrees = ranges[0].times(ranges[1]).times(model).meets(ranges[2])
    return _ValveFlow(name, area, coefficient, measured, coefficient * area * per_area, per_area, agrees)


def _check_shared_coefficient(evidence: Evidence, flows: list[_ValveFlow]) -> Iterator[AuditFinding]:
    """Yield an error if two valves of equal Cd have reported flows that are not in the ratio of their areas."""
    for other in flows[1:]:
        first = flows[0]
        area_ratio = first.area / other.area
        flow_ratio = (first.measured / first.per_area) / (other.measured / other.per_area)
        if first.coefficient != other.coefficient or abs(area_ratio / flow_ratio - 1.0) < 2.0 * _MODEL:
            continue
        yield AuditFinding(
            id=f"one-coefficient-{first.name}-{other.name}",
            title=f"the reported flows of '{first.name}' and '{other.name}' contradict their common Cd",
            values=evidence.values_of(*_paths(first.name)[:3], *_paths(other.name)[:3]),
            sides=(
                ComparedNumber("ratio of the areas", area_ratio, ""),
                ComparedNumber("ratio of the reported flows", flow_ratio, ""),
            ),
            paragraph=(
                f"With the common discharge coefficient {first.coefficient:.4g}, flow is proportional to area: "
                f"'{first.name}' must pass {area_ratio:.3g} times the flow of '{other.name}', but the reported flows "
                f"have a ratio of {flow_ratio:.3g}. Consistent would be discharge coefficients of "
                f"{first.measured / first.per_area / first.area:.3g} "
                f"and {other.measured / other.per_area / other.area:.3g}, or other flows, measured separately."
            ),
        )


def check_sonic_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each valve whose reported flow contradicts its sonic conductance."""
    gas = evidence.gas()
    for name in evidence.parameter_set.valve_kinds:
        valve, entry = f"valves.{name}", f"reported.valves.{name}"
        size, flow = f"{valve}.sonic_conductance", f"{entry}.mass_flow"
        paths = (size, f"{valve}.critical_ratio", flow, f"{entry}.flow_pressure")
        numbers, flow_range, size_range = evidence.numbers(*paths), evidence.magnitude(flow), evidence.magnitude(size)
        if gas is None or numbers is None or flow_range is None or size_range is None:
            continue
        conductance, critical_ratio, measured, pressure = numbers
        if min(numbers) <= 0.0 or critical_ratio >= 1.0:
            continue
        psi = iso6358_flow_function(min(evidence.atmosphere() / pressure, 1.0), critical_ratio)
        per_size = sonic_conductance_mass(1.0, gas.specific_gas_constant, gas.temperature) * pressure * psi
        model = ReportedRange(per_size * (1.0 - _MODEL), per_size * (1.0 + _MODEL))
        if per_size <= 0.0 or size_range.times(model).meets(flow_range):
            continue
        predicted, consistent = conductance * per_size, measured / per_size
        yield AuditFinding(
            id=f"flow-of-{name}",
            title=f"the reported flow of valve '{name}' does not follow from its sonic conductance",
            values=evidence.values_of(*paths),
            sides=(
                ComparedNumber("reported flow", measured, "kg/s"),
                ComparedNumber("flow of the sonic conductance", predicted, "kg/s"),
                ComparedNumber("sonic conductance that gives the reported flow", consistent, "m^3/(s Pa)"),
            ),
            paragraph=(
                f"Fully open, valve '{name}' passes {evidence.in_set_unit(flow, predicted)} with its sonic "
                f"conductance, but the reported flow is {evidence.in_set_unit(flow, measured)}: a factor of "
                f"{predicted / measured:.3g}. Consistent would be a sonic conductance of "
                f"{evidence.in_set_unit(size, consistent)}, or a flow of {evidence.in_set_unit(flow, predicted)}."
            ),
        )
