"""A linear model of the plant of a scenario, at an instant of its run or at its steady state."""

from collections.abc import Mapping
from importlib.util import find_spec
from numbers import Real
from typing import Any

import numpy as np

from ppafo.analyses.linearise.model import Delays, Edge, LinearModel, Variable
from ppafo.analyses.linearise.plant import UNITS, VALVE, Plant, opens_in_proportion, plant_of
from ppafo.analyses.linearise.point import Point, equilibrium, point_at, settled
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.errors import ScenarioError, UnitError, refused_as
from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import Openings
from ppafo.parameters.joint import Joint
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.units import parse_quantity

# The smooth piece of the plant on which a point lies: how comparisons are decided there, and which side that is.

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


EQUILIBRIUM = "equilibrium"
MISSING_CASADI = "a linear model needs CasADi: pip install ppafo[control]"
DEAF = "no small change of the command changes it (dead band, slew limit, beyond full): the command's column is 0"


def linear_model(scenario: Scenario, at: float | str) -> LinearModel:
    """Return the linear model of a scenario at a time [s] of its run, a number or a text, or at ``EQUILIBRIUM``.

    ScenarioError without CasADi, for regulated supplies, a valve that is on or off, and a point that is not there.
    """
    if find_spec("casadi") is None:
        raise ScenarioError(MISSING_CASADI)
    run = plan_run(scenario)
    if scenario.supply_lines is not None:
        raise ScenarioError(f"{scenario.name}: linear models are for constant supplies; omit [supply_line]")
    if not opens_in_proportion(run):
        raise ScenarioError(
            f"{scenario.name}: valve '{scenario.device.valve_name}' is on or off, or moves at one speed: its flow "
            "has no derivative by the command; set device.valve to one that opens in proportion"
        )
    if at == EQUILIBRIUM:
        return model_at(scenario, run, equilibrium(scenario))
    if isinstance(at, Real):
        return model_at(scenario, run, point_at(scenario, float(at)))
    problem = f"{scenario.name}: --at '{at}' is neither a time nor '{EQUILIBRIUM}'"
    with refused_as(ScenarioError, problem, UnitError):
        time = parse_quantity(str(at), "s")
    return model_at(scenario, run, point_at(scenario, time))


def model_at(scenario: Scenario, run: Run, point: Point) -> LinearModel:
    """The linear model at a point, from the smooth piece that the point lies on."""
    values = dict(point.values)
    decided = Sides(values)
    time = point.time or 0.0
    plant = plant_of(run, point.way, decided, time)
    matrices = _matrices(plant, values)
    edges = []
    for comparison, edge in decided.edges.items():
        others = _matrices(plant_of(run, point.way, Sides(values, comparison), time), values)
        # An edge counts only where the linear model on its other side is another one, or of other states.
        pairs = list(zip(matrices[:4], others[:4], strict=True))
        is_same = all(here.shape == beyond.shape for here, beyond in pairs) and all(
            np.allclose(here, beyond, rtol=ON_THE_EDGE, atol=0.0, equal_nan=True) for here, beyond in pairs
        )
        if not is_same:
            edges.append(edge)
    a, b, c, d, rates, outputs = matrices
    sides = sides_of(run, point, scenario.device.joint)
    if not np.any(b[:, 0]) and not np.any(d[:, 0]):
        sides["valve"] += f"; {DEAF}"
    return LinearModel(
        scenario=scenario,
        time=point.time,
        states=tuple(Variable(name, UNITS[name], values[name]) for name in plant.states),
        inputs=tuple(Variable(name, UNITS[name], values[name]) for name in plant.inputs),
        outputs=tuple(
            Variable(name, UNITS[name], float(value))
            for name, value in zip(plant.outputs, outputs.ravel().tolist(), strict=True)
        ),
        a=a,
        b=b,
        c=c,
        d=d,
        rates=rates.ravel(),
        sides=sides,
        edges=tuple(edges),
        delays=Delays(run.command_delay, run.signal_delay, run.period),
    )


def _matrices(plant: Plant, values: Mapping[str, float]) -> list[Floats]:
    """A, B, C and D of a plant at some values; then its rates and outputs there, as columns."""
    import casadi

    x, u = (casadi.vertcat(*(plant.symbols[name] for name in names)) for names in (plant.states, plant.inputs))
    rates, outputs = casadi.vertcat(*plant.rates.values()), casadi.vertcat(*plant.outputs.values())
    jacobians = [casadi.jacobian(column, by) for column in (rates, outputs) for by in (x, u)]
    return [np.array(matrix) for matrix in plant.function([*jacobians, rates, outputs])(values)]
