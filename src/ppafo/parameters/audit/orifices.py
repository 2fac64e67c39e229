"""Is every orifice given in one form, and what does each valve pass? Equations (6) and (7), ISO 6358."""

from collections.abc import Iterator

from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Side
from ppafo.parameters.building import both_forms
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import Gas, Orifice, SonicOrifice
from ppafo.parameters.plant import orifice_conductance

_SUPPLY = "supply.pressure"
_GRAMS = 1e3


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for an orifice in two forms, and a note with the flow of each valve in the set's gas."""
    valves = {name: f"valves.{name}" for name in evidence.parameter_set.valve_kinds}
    for section in ("actuator.leak", *valves.values()):
        names = both_forms(evidence.parameter_set, section)
        if names:
            yield _two_forms(evidence, section, names)
    for name, section in valves.items():
        yield from _open_flow(evidence, name, section)


def _two_forms(evidence: Evidence, section: str, names: tuple[str, ...]) -> Finding:
    return Finding(
        id=f"forms-of-{section.rpartition('.')[2]}",
        severity="error",
        title=f"{section} is given in two forms",
        values=evidence.values_of(*(f"{section}.{name}" for name in names)),
        sides=(),
        paragraph=(
            f"{section} has {', '.join(names)}, which specify one orifice twice, so no device can be built. "
            "Reconciled by area and discharge_coefficient alone, or by sonic_conductance and critical_ratio alone."
        ),
    )


def _open_flow(evidence: Evidence, name: str, section: str) -> Iterator[Finding]:
    gas, supply, atmosphere = evidence.gas(), evidence.number(_SUPPLY), evidence.atmosphere()
    if gas is None or supply is None or supply <= atmosphere or both_forms(evidence.parameter_set, section):
        return
    ratio = atmosphere / supply
    area = evidence.numbers(*(f"{section}.{item.name}" for item in AREA_FORM))
    sonic = evidence.numbers(*(f"{section}.{item.name}" for item in SONIC_FORM))
    if area is not None and min(area) > 0.0:
        conductance = orifice_conductance(Orifice(*area), gas)
        flow = conductance * supply * isentropic_flow_function(ratio, gas.heat_capacity_ratio)
        form, origin = AREA_FORM, "by its Cd A"
    elif sonic is not None and min(sonic) > 0.0 and sonic[1] < 1.0:
        conductance = orifice_conductance(SonicOrifice(*sonic), gas)
        flow = conductance * supply * iso6358_flow_function(ratio, sonic[1])
        form, origin = SONIC_FORM, _of_sonic_form(gas)
    else:
        return
    yield Finding(
        id=f"open-flow-of-{name}",
        severity="note",
        title=f"valve '{name}' passes {_GRAMS * flow:#.3g} g/s of {gas.species}",
        values=evidence.values_of(*(f"{section}.{item.name}" for item in form), _SUPPLY),
        sides=(Side("flow from supply to atmosphere", flow, "kg/s"), Side("conductance", conductance, "kg/(s Pa)")),
        paragraph=(
            f"Fully open from {evidence.in_set_unit(_SUPPLY, supply)} to the atmosphere it passes "
            f"{_GRAMS * flow:#.3g} g/s "
            f"{origin}. Compare this with the data sheet."
        ),
    )


def _of_sonic_form(gas: Gas) -> str:
    """Return the words that say what the sonic conductance counts for."""
    return (
        f"of {gas.species} by its sonic conductance, which counts for air as in ISO 6358 and is converted: another "
        "gas passes sqrt(R_air / R) times as much mass at the same temperature"
    )
