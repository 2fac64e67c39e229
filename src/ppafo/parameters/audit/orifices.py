"""Questions on the orifices: one form, flow of the open valves against reports, areas that are bores of tubes.

Equations (6) and (7), and ISO 6358.
"""

import contextlib
import math
from collections.abc import Iterator
from typing import NamedTuple

from ppafo.errors import ParameterError
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.parameters.audit.evidence import AuditFinding, Evidence, ReportedRange, of_each_valve
from ppafo.parameters.building import both_forms, orifice_form
from ppafo.parameters.declaration import AREA_FORM
from ppafo.parameters.device import Orifice, SonicOrifice
from ppafo.parameters.plant import restriction

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
    """Valve that is fully open: paths and numbers of its form, conductance [kg/(s Pa)], and flow [kg/s]."""

    paths: tuple[str, ...]
    numbers: tuple[float, ...]
    is_area: bool
    conductance: float
    flow: float


def _open_valve(evidence: Evidence, valve: str, upstream: float, downstream: float) -> _OpenValve:
    """Return a valve between two pressures [Pa absolute]. Raises ParameterError without a gas, one form or a flow."""
    gas = evidence.gas()
    form = orifice_form(evidence.parameter_set, f"valves.{valve}")
    paths = tuple(f"valves.{valve}.{quantity.name}" for quantity in form)
    is_area = form is AREA_FORM
    numbers = evidence.positive(*paths)
    if not upstream > downstream > 0.0 or not (is_area or numbers[1] < 1.0):
        raise ParameterError(f"valve '{valve}' passes nothing")
    ratio = downstream / upstream
    psi = (
        isentropic_flow_function(ratio, gas.heat_capacity_ratio)
        if is_area
        else iso6358_flow_function(ratio, numbers[1])
    )
    conductance = restriction((Orifice if is_area else SonicOrifice)(*numbers), gas, 0.0).conductance
    return _OpenValve(paths, numbers, is_area, conductance, conductance * upstream * psi)


def forms(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each orifice that is given in two forms."""
    for section in ("actuator.leak", *(f"valves.{name}" for name in evidence.parameter_set.valve_kinds)):
        if names := both_forms(evidence.parameter_set, section):
            yield evidence.finding(
                f"forms-of-{section.rpartition('.')[2]}",
                f"{section} is given in two forms",
                [f"{section}.{name}" for name in names],
                why=f"{section} has {', '.join(names)}, which specify one orifice twice.",
            )


@of_each_valve
def open_flow(evidence: Evidence, valve: str) -> Iterator[AuditFinding]:
    """Note the flow of a valve with the gas of the set."""
    (supply,) = evidence.numbers("supply.pressure")
    atmosphere = evidence.atmosphere()
    opened = _open_valve(evidence, valve, max(supply, atmosphere), min(supply, atmosphere))
    gas = evidence.gas().species
    way = "atmosphere to vacuum" if supply < atmosphere else "supply to atmosphere"
    is_converted = not opened.is_area and gas != "air"
    yield evidence.finding(
        f"open-flow-of-{valve}",
        f"valve '{valve}' passes {1e3 * opened.flow:#.3g} g/s of {gas}",
        [*opened.paths, "supply.pressure"],
        {f"flow from {way}": (opened.flow, "kg/s"), "conductance": (opened.conductance, "kg/(s Pa)")},
        f"C of ISO 6358 counts for air and is converted to {gas}." if is_converted else "",
        "note",
    )


def flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each valve whose reported flow contradicts its orifice, and two whose flows contradict their common Cd."""
    measured: dict[str, tuple[float, float, float]] = {}
    for valve in evidence.parameter_set.valve_kinds:
        paths = f"reported.valves.{valve}.mass_flow", f"reported.valves.{valve}.flow_pressure"
        with contextlib.suppress(ParameterError):
            reported, pressure = evidence.positive(*paths)
            opened = _open_valve(evidence, valve, pressure, min(evidence.atmosphere(), pressure))
            sizes = opened.numbers if opened.is_area else opened.numbers[:1]
            # Reported digits are ranges: a contradiction must hold for all numbers in them.
            possible = ReportedRange(1.0 - _MODEL, 1.0 + _MODEL)
            for path in opened.paths[: len(sizes)]:
                possible = possible.times(evidence.magnitude(path) or ReportedRange(1.0, 1.0))
            per_size = opened.flow / math.prod(sizes)
            needed = reported / per_size
            kind = "sonic conductance"
            formula = "flow of the sonic conductance"
            if opened.is_area:
                kind = "Cd A"
                formula = "Cd A C1 P"
                measured[valve] = sizes[0], sizes[1], needed
            sides = {
                "reported flow": (reported, "kg/s"),
                formula: (opened.flow, "kg/s"),
                f"{kind} that gives the reported flow": (needed, "m^2" if opened.is_area else "m^3/(s Pa)"),
            }
            if opened.is_area:
                sides["Cd with the reported area"] = (needed / sizes[0], "")
                sides["area with the reported Cd"] = (needed / sizes[1], "m^2")
            stated = evidence.magnitude(paths[0])
            if stated is not None and not possible.times(ReportedRange(per_size, per_size)).meets(stated):
                source = kind if opened.is_area else f"its {kind}"
                title = f"the reported flow of valve '{valve}' does not follow from {source}"
                yield evidence.finding(f"flow-of-{valve}", title, [*opened.paths[: len(sizes)], *paths], sides)
    for other, (other_area, other_coefficient, other_size) in [*measured.items()][1:]:
        first, (area, coefficient, size) = next(iter(measured.items()))
        area_ratio = area / other_area
        flow_ratio = size / other_size
        if coefficient == other_coefficient and abs(area_ratio / flow_ratio - 1.0) >= 2.0 * _MODEL:
            parts = "valves.{}.area", "valves.{}.discharge_coefficient", "reported.valves.{}.mass_flow"
            yield evidence.finding(
                f"one-coefficient-{first}-{other}",
                f"the reported flows of '{first}' and '{other}' contradict their common Cd",
                [part.format(valve) for valve in (first, other) for part in parts],
                {
                    "ratio of the areas": (area_ratio, ""),
                    "ratio of the reported flows": (flow_ratio, ""),
                    f"Cd that gives the flow of '{first}'": (size / area, ""),
                    f"Cd that gives the flow of '{other}'": (other_size / other_area, ""),
                },
            )


@of_each_valve
def bores(evidence: Evidence, valve: str) -> Iterator[AuditFinding]:
    """Note an area that is the bore of a tube: its Cd then describes no orifice."""
    path = f"valves.{valve}.area"
    (area,) = evidence.numbers(path)
    for name, diameter in _TUBES.items():
        bore = 0.25 * math.pi * diameter * diameter
        if abs(area / bore - 1.0) <= _SAME_BORE:
            yield evidence.finding(
                f"bore-of-{valve}",
                f"the area of valve '{valve}' is the bore of a {name} tube",
                [path, f"valves.{valve}.discharge_coefficient"],
                {"area": (area, "m^2"), f"bore of {name}": (bore, "m^2")},
                "The orifice in a valve is smaller than its ports: only the product of Cd and area is meaningful.",
                "note",
            )
