"""The smooth piece of the plant on which a point lies: how comparisons are decided there, and which side that is."""

from collections.abc import Mapping
from typing import Any

from ppafo.analyses.linearise.model import Edge
from ppafo.analyses.linearise.plant import VALVE
from ppafo.analyses.linearise.point import Point, settled
from ppafo.engine.run import Run
from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import Openings
from ppafo.parameters.joint import Joint

EQUAL = 1.0e-12
"""Two sides that differ by less than this, over the larger one, are equal."""
ON_THE_EDGE = 1.0e-6
"""Two sides of a comparison that differ by less than this, over the larger one, lie on an edge of the model."""


class Sides:
    """Decides every comparison at a point, one of them on its ``other_side``, and keeps those that lie on an edge.

    Of two equal numbers that one counts as larger which grows faster along one direction, so that all comparisons are
    decided as they are at one point nearby.
    """

    def __init__(self, values: Mapping[str, float], other_side: str = "") -> None:
        self._values, self._other_side = values, other_side
        self.edges: dict[str, Edge] = {}

    def __call__(self, sign: str, left: Any, right: Any, where: str) -> bool:
        """Return whether the comparison of two expressions that stands at a place counts as true."""
        import casadi

        # Both values at the point, and how fast the one grows beyond the other along the direction.
        symbols = casadi.symvar(casadi.vertcat(left, right))
        onward = casadi.DM([_direction(symbol.name(), self._values) for symbol in symbols])
        surplus = casadi.SX(left) - casadi.SX(right)
        growth = casadi.jtimes(surplus, casadi.vertcat(*symbols), onward) if symbols else 0.0
        known = [self._values[symbol.name()] for symbol in symbols]
        row = casadi.Function("values", symbols, [casadi.vertcat(left, right, growth)]).call(known)[0]
        left_value, right_value, ahead = (float(number) for number in row.nonzeros())
        larger, difference = max(abs(left_value), abs(right_value)), left_value - right_value
        beyond = difference if abs(difference) > EQUAL * larger else ahead
        tests = {"<": beyond < 0.0, "<=": beyond <= 0.0, ">": beyond > 0.0, ">=": beyond >= 0.0}
        # Signs that are not in the table are == and !=: they have no edge.
        is_true = tests.get(sign, (left_value == right_value) == (sign == "=="))
        if sign in tests and abs(difference) <= ON_THE_EDGE * larger:
            self.edges[where] = Edge(where, is_true)
        return is_true != (where == self._other_side)


def _direction(name: str, values: Mapping[str, float]) -> float:
    """Where the point nearby lies: the command goes up, or back from full opening; the rest counts less."""
    if name == "command":
        return 1.0 if abs(values[name]) < 1.0 else -values[name]
    if name in (f"{VALVE}requested", f"{VALVE}opening"):
        return 1.0e-6 if values[name] < 1.0 else -1.0e-6
    first = ("pressure_1", "supply_pressure", "angle", "angular_velocity")
    return 1.0e-6 * max(1.0, abs(values[name])) * (1.0 if name in first else -0.5)


def sides_of(run: Run, point: Point, joint: Joint) -> dict[str, str]:
    """Which side of each limit the point lies on, in words by place; ``joint`` names what moves."""
    at, plant = point.values, run.plant
    openings: Openings = run.program.valve.instant(run.valve, settled(run, at), at["command"])
    room, first, second = plant.atmospheric_pressure, at["pressure_1"], at["pressure_2"]
    paths = {
        "source to chamber 1": (at["supply_pressure"], first, openings.source_1),
        "chamber 1 to atmosphere": (first, room, openings.vent_1),
        "source to chamber 2": (at["dorsiflexion_pressure"], second, openings.source_2),
        "chamber 2 to atmosphere": (second, room, openings.vent_2),
    }
    said = {name: _regime(plant.valve_curve, *values) for name, values in paths.items()}
    said["leak over the vane"] = _regime(plant.leak_curve, first, second, 1.0)
    motion = {
        None: "prescribed",
        0.0: "at rest",
        1.0: f"slides in {joint.positive}",
        -1.0: f"slides in {joint.negative}",
    }
    vane = motion[point.way]
    if point.way == 0.0:
        is_at_stop = not plant.angle_min < at["angle"] < plant.angle_max
        vane = "against a stop" if is_at_stop else "sticks: friction holds it"
    valve = "closed"
    if any(openings):
        chamber = 1 if openings.source_1 > 0.0 else 2
        valve = f"feeds chamber {chamber}, open by {max(openings):.4g}"
    return {"valve": valve, joint.name: vane, **said}


def _regime(curve: FlowCurve, pressure_a: float, pressure_b: float, opening: float) -> str:
    """How gas flows between two pressures [Pa]."""
    if opening == 0.0:
        return "closed"
    ratio = min(pressure_a, pressure_b) / max(pressure_a, pressure_b)
    if ratio <= curve.critical_ratio:
        return f"choked, pressure ratio {ratio:.3f}"
    near = ", on the straight line near equal pressures" if ratio > curve.linear_ratio else ""
    return f"below choking, pressure ratio {ratio:.4f}{near}"
