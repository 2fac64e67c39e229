"""Checks of the orifices of a set: one form, flow of the open valves against reports, areas that are bores of tubes.

Equations (6) and (7), and ISO 6358.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, ReportedRange
from ppafo.parameters.building import both_forms
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import Orifice, SonicOrifice
from ppafo.parameters.plant import restriction

_SUPPLY = "supply.pressure"
_GRAMS = 1e3
_MODEL = 0.02
"""Relative tolerance of the flow model, about the accuracy of a flow measurement."""
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


class _OpenValve(NamedTuple):
    """Valve that is fully open: numbers of its form, Cd A [m^2] or C [m^3/(s Pa)], conductance, and flow [kg/s]."""

    form: tuple[Quantity, ...]
    size: float
    conductance: float
    flow: float


def _open_valve(evidence: Evidence, section: str, upstream: float, downstream: float) -> _OpenValve | None:
    """Return an open valve between two pressures [Pa absolute]; None without a gas, or without one form."""
    gas = evidence.gas()
    if gas is None or both_forms(evidence.parameter_set, section) or not upstream > downstream > 0.0:
        return None
    ratio = downstream / upstream
    for form in (AREA_FORM, SONIC_FORM):
        numbers = evidence.numbers(*(f"{section}.{quantity.name}" for quantity in form))
        if numbers is not None and min(numbers) > 0.0 and (form is AREA_FORM or numbers[1] < 1.0):
            is_area = form is AREA_FORM
            conductance = restriction(Orifice(*numbers) if is_area else SonicOrifice(*numbers), gas, 0.0).conductance
            psi = isentropic_flow_function(ratio, gas.heat_capacity_ratio) if is_area else None
            flow = conductance * upstream * (iso6358_flow_function(ratio, numbers[1]) if psi is None else psi)
            return _OpenValve(form, numbers[0] * numbers[1] if is_area else numbers[0], conductance, flow)
    return None


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
                why=f"{section} has {', '.join(names)}, which specify one orifice twice.",
            )
    supply, atmosphere = evidence.number(_SUPPLY), evidence.atmosphere()
    for name, section in valves.items():
        if supply is None:
            return
        opened = _open_valve(evidence, section, max(supply, atmosphere), min(supply, atmosphere))
        if opened is None:
            continue
        gas, is_vacuum = evidence.text("gas.species") or "gas", supply < atmosphere
        yield AuditFinding(
            id=f"open-flow-of-{name}",
            severity="note",
            title=f"valve '{name}' passes {_GRAMS * opened.flow:#.3g} g/s of {gas}",
            values=evidence.values_of(*(f"{section}.{quantity.name}" for quantity in opened.form), _SUPPLY),
            sides=(
                ComparedNumber(
                    f"flow from {'atmosphere to vacuum' if is_vacuum else 'supply to atmosphere'}", opened.flow, "kg/s"
                ),
                ComparedNumber("conductance", opened.conductance, "kg/(s Pa)"),
            ),
            why=f"C of ISO 6358 counts for air and is converted to {gas}."
            if opened.form is not AREA_FORM and gas != "air"
            else "",
        )


def check_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each valve whose reported flow contradicts its orifice, and for an impossible common Cd."""
    measured: dict[str, tuple[float, float, float]] = {}
    for name in evidence.parameter_set.valve_kinds:
        section, reported = f"valves.{name}", f"reported.valves.{name}"
        paths = (f"{reported}.mass_flow", f"{reported}.flow_pressure")
        numbers, flow_range = evidence.numbers(*paths), evidence.magnitude(paths[0])
        if numbers is None or flow_range is None or min(numbers) <= 0.0:
            continue
        opened = _open_valve(evidence, section, numbers[1], min(evidence.atmosphere(), numbers[1]))
        if opened is None:
            continue
        is_area = opened.form is AREA_FORM
        sizes = [f"{section}.{quantity.name}" for quantity in opened.form[: 2 if is_area else 1]]
        # Reported digits are ranges: a contradiction must hold for all numbers in them.
        possible = ReportedRange(1.0 - _MODEL, 1.0 + _MODEL)
        for interval in map(evidence.magnitude, sizes):
            possible = possible if interval is None else possible.times(interval)
        per_size, values = opened.flow / opened.size, evidence.values_of(*sizes, *paths)
        size, predicted = ("Cd A", "Cd A C1 P") if is_area else ("sonic conductance", "flow of the sonic conductance")
        needed = numbers[0] / per_size
        sides = [
            ComparedNumber("reported flow", numbers[0], "kg/s"),
            ComparedNumber(predicted, opened.flow, "kg/s"),
            ComparedNumber(f"{size} that gives the reported flow", needed, opened.form[0].unit),
        ]
        if is_area:
            area, coefficient = (evidence.number(path) or math.nan for path in sizes)
            measured[name] = area, coefficient, needed
            sides += [ComparedNumber("Cd with the reported area", needed / area, "")]
            sides += [ComparedNumber("area with the reported Cd", needed / coefficient, "m^2")]
        if not possible.times(ReportedRange(per_size, per_size)).meets(flow_range):
            title = f"the reported flow of valve '{name}' does not follow from {size if is_area else f'its {size}'}"
            yield AuditFinding(id=f"flow-of-{name}", title=title, values=values, sides=tuple(sides))
    yield from _check_shared_coefficient(evidence, measured)


def _check_shared_coefficient(
    evidence: Evidence, measured: dict[str, tuple[float, float, float]]
) -> Iterator[AuditFinding]:
    """Yield an error if two valves of equal Cd have reported flows that are not in the ratio of their areas.

    ``measured`` has the area, Cd, and the Cd A of the reported flow by valve.
    """
    for name, other in [*measured.items()][1:]:
        first_name, first = next(iter(measured.items()))
        area_ratio, flow_ratio = first[0] / other[0], first[2] / other[2]
        if first[1] != other[1] or abs(area_ratio / flow_ratio - 1.0) < 2.0 * _MODEL:
            continue
        numbers = ("area", "discharge_coefficient")
        paths = (
            path
            for valve in (first_name, name)
            for path in (*(f"valves.{valve}.{number}" for number in numbers), f"reported.valves.{valve}.mass_flow")
        )
        yield AuditFinding(
            id=f"one-coefficient-{first_name}-{name}",
            title=f"the reported flows of '{first_name}' and '{name}' contradict their common Cd",
            values=evidence.values_of(*paths),
            sides=(
                ComparedNumber("ratio of the areas", area_ratio, ""),
                ComparedNumber("ratio of the reported flows", flow_ratio, ""),
                ComparedNumber(f"Cd that gives the flow of '{first_name}'", first[2] / first[0], ""),
                ComparedNumber(f"Cd that gives the flow of '{name}'", other[2] / other[0], ""),
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
                why="The orifice in a valve is smaller than its ports: only the product of Cd and area is meaningful.",
            )
