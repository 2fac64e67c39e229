"""Checks of the orifices of a set: a single form for each, flow of the open valves, areas that are bores of tubes.

Equations (6) and (7), and ISO 6358.
"""

import math
from collections.abc import Iterator

from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence
from ppafo.parameters.building import both_forms
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import Orifice, SonicOrifice
from ppafo.parameters.plant import orifice_conductance

_SUPPLY = "supply.pressure"
_GRAMS = 1e3
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
_SAME_BORE = 0.005
"""Relative difference of an area and a bore [-] due to rounding to three digits."""


def check_orifices(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for an orifice in two forms, and a note on the flow of each valve with the gas of the set."""
    valves = {name: f"valves.{name}" for name in evidence.parameter_set.valve_kinds}
    for section in ("actuator.leak", *valves.values()):
        names = both_forms(evidence.parameter_set, section)
        if names:
            yield AuditFinding(
                id=f"forms-of-{section.rpartition('.')[2]}",
                title=f"{section} is given in two forms",
                values=evidence.values_of(*(f"{section}.{name}" for name in names)),
                paragraph=(
                    f"{section} has {', '.join(names)}, which specify one orifice twice, so no device can be built. "
                    "Give area and discharge_coefficient alone, or sonic_conductance and critical_ratio alone."
                ),
            )
    for name, section in valves.items():
        yield from _open_flow(evidence, name, section)


def _open_flow(evidence: Evidence, name: str, section: str) -> Iterator[AuditFinding]:
    """Yield a note on the flow of a fully open valve between supply and atmosphere."""
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
        form, origin = AREA_FORM, "according to Cd A"
    elif sonic is not None and min(sonic) > 0.0 and sonic[1] < 1.0:
        conductance = orifice_conductance(SonicOrifice(*sonic), gas)
        flow = conductance * upstream * iso6358_flow_function(ratio, sonic[1])
        form = SONIC_FORM
        origin = (
            f"of {gas.species} according to the sonic conductance, which counts for air as in ISO 6358 and is "
            "converted: the mass flow of another gas is sqrt(R_air / R) times the flow of air at the same temperature"
        )
    else:
        return
    pressure = evidence.in_set_unit(_SUPPLY, supply)
    is_vacuum = supply < atmosphere
    direction = "from atmosphere to vacuum" if is_vacuum else "from supply to atmosphere"
    pressures = f"the atmosphere to {pressure}" if is_vacuum else f"{pressure} to the atmosphere"
    yield AuditFinding(
        id=f"open-flow-of-{name}",
        severity="note",
        title=f"valve '{name}' passes {_GRAMS * flow:#.3g} g/s of {gas.species}",
        values=evidence.values_of(*(f"{section}.{quantity.name}" for quantity in form), _SUPPLY),
        sides=(
            ComparedNumber(f"flow {direction}", flow, "kg/s"),
            ComparedNumber("conductance", conductance, "kg/(s Pa)"),
        ),
        paragraph=(
            f"Fully open from {pressures}, valve '{name}' passes {_GRAMS * flow:#.3g} g/s {origin}. Compare this flow "
            "with the data sheet."
        ),
    )


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
                    f"A bore of {name} has {1e6 * bore:.4g} mm^2, the valve {1e6 * area:.4g} mm^2. The orifice in a "
                    "valve is smaller than the ports: the discharge coefficient then includes all losses between the "
                    "ports, and only the product of coefficient and area is meaningful."
                ),
            )
