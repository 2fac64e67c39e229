"""Does the printed flow of a valve in the form of ISO 6358 follow from its sonic conductance?"""

from collections.abc import Iterator

from ppafo.model.orifice import iso6358_flow_function, sonic_conductance_mass
from ppafo.parameters.audit.evidence import Evidence, Interval
from ppafo.parameters.audit.finding import Finding, Side

_MODEL = 0.02
"""Relative room for the model itself: measured flow is rarely better."""


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for each valve whose printed flow its sonic conductance does not pass."""
    for name in evidence.parameter_set.valve_kinds:
        yield from _valve(evidence, name)


def _valve(evidence: Evidence, name: str) -> Iterator[Finding]:
    valve, reported = f"valves.{name}", f"reported.valves.{name}"
    size, flow = f"{valve}.sonic_conductance", f"{reported}.mass_flow"
    paths = (size, f"{valve}.critical_ratio", flow, f"{reported}.flow_pressure")
    gas, found = evidence.gas(), evidence.numbers(*paths)
    printed, given = evidence.magnitude(flow), evidence.magnitude(size)
    if gas is None or found is None or printed is None or given is None or min(found) <= 0.0 or found[1] >= 1.0:
        return
    conductance, critical_ratio, measured, pressure = found
    psi = iso6358_flow_function(min(evidence.atmosphere() / pressure, 1.0), critical_ratio)
    per_size = sonic_conductance_mass(1.0, gas.specific_gas_constant, gas.temperature) * pressure * psi
    room = Interval(per_size * (1.0 - _MODEL), per_size * (1.0 + _MODEL))
    if per_size <= 0.0 or given.times(room).meets(printed):
        return
    predicted, needed = conductance * per_size, measured / per_size
    yield Finding(
        id=f"flow-of-{name}",
        severity="error",
        title=f"the printed flow of valve '{name}' does not follow from its sonic conductance",
        values=evidence.values_of(*paths),
        sides=(
            Side("printed flow", measured, "kg/s"),
            Side("flow of the sonic conductance", predicted, "kg/s"),
            Side("sonic conductance that gives the printed flow", needed, "m^3/(s Pa)"),
        ),
        paragraph=(
            f"Fully open the valve '{name}' passes {evidence.in_set_unit(flow, predicted)} by its sonic conductance, "
            f"printed is {evidence.in_set_unit(flow, measured)}: a factor {predicted / measured:.3g}. Reconciled by a "
            f"sonic conductance of {evidence.in_set_unit(size, needed)}, or by the other flow."
        ),
    )
