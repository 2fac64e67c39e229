"""The linear model of a scenario's plant near one point, with exact derivatives of the text that the lanes step."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.errors import ScenarioError
from ppafo.model.orifice import FlowCurve
from ppafo.questions.linearise.answer import ON_THE_EDGE, Delays, Edge, LinearModel, Variable
from ppafo.questions.linearise.point import (
    UNITS,
    VALVE,
    Plant,
    Point,
    answers_to_command,
    equilibrium,
    openings_at,
    plant_of,
    point_at,
)
from ppafo.simulation.loading import scenario_or_load
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.translation.plant_rates import check_without_opensim

EQUILIBRIUM = "equilibrium"
MISSING_CASADI = "a linear model needs CasADi: pip install ppafo[control]"
EQUAL = 1.0e-12
"""Two sides that differ by less than this, over the larger one, are equal."""
DEAF = "no small change of the command changes it (dead band, slew limit, beyond full): the command's column is 0"


def linearise(
    scenario: Scenario | str | Path, at: float | str = EQUILIBRIUM, overrides: Sequence[str] = ()
) -> LinearModel:
    """Return the linear model of a scenario's plant, without controller and sensors, at a time [s] or ``equilibrium``.

    The equilibrium is the steady state whose torque is the last value of the reference, or, where the controller is a
    constant command, whose command is that one; the ankle stands where the run leaves it. Derivatives are exact.
    ScenarioError for a time outside the run, where there is no equilibrium, and for a valve that is on or off.
    """
    if find_spec("casadi") is None:
        raise ScenarioError(MISSING_CASADI)
    check_without_opensim()
    chosen = scenario_or_load(scenario, overrides)
    run = plan_run(chosen)
    if chosen.supply_lines is not None:
        raise ScenarioError(f"{chosen.name}: linear models are for constant supplies; omit [supply_line]")
    chosen.device.check_vane("a linear model")
    if not answers_to_command(run):
        raise ScenarioError(
            f"{chosen.name}: valve '{chosen.device.valve_name}' is on or off: its flow has no derivative by the "
            "command; set device.valve to one that opens in proportion"
        )
    if at != EQUILIBRIUM and not isinstance(at, Real):
        raise ScenarioError(f"{chosen.name}: --at '{at}' is neither a time nor '{EQUILIBRIUM}'")
    point = equilibrium(chosen) if isinstance(at, str) else point_at(chosen, at)
    return _model(chosen, run, point)


class _Sides:
    """Decides every comparison at a point, one of them on its ``other_side``, and keeps those that lie on an edge.

    Of two equal numbers that one counts as larger which grows faster along one direction, so that all comparisons are
    decided as they are at one point nearby.
    """

    def __init__(self, values: Mapping[str, float], other_side: str = "") -> None:
        self._values, self._other_side = values, other_side
        self.edges: dict[str, Edge] = {}

    def __call__(self, sign: str, left: Any, right: Any, place: str) -> bool:
        import casadi

        one, other, ahead = self._evaluated(left, right, casadi.SX(left) - casadi.SX(right))
        larger = max(abs(one), abs(other))
        surplus = one - other if abs(one - other) > EQUAL * larger else ahead
        tests = {"<": surplus < 0.0, "<=": surplus <= 0.0, ">": surplus > 0.0, ">=": surplus >= 0.0}
        is_true = tests.get(sign, (one == other) == (sign == "=="))
        if sign in tests and abs(one - other) <= ON_THE_EDGE * larger:
            self.edges[place] = Edge(place, is_true)
        return is_true != (place == self._other_side)

    def _evaluated(self, left: Any, right: Any, surplus: Any) -> tuple[float, float, float]:
        """Both values at the point, and how fast the one grows beyond the other along the direction."""
        import casadi

        symbols = casadi.symvar(casadi.vertcat(left, right))
        known = [self._values[symbol.name()] for symbol in symbols]
        onward = casadi.DM([_direction(symbol.name(), self._values) for symbol in symbols])
        ahead = casadi.jtimes(surplus, casadi.vertcat(*symbols), onward) if symbols else 0.0
        found = casadi.Function("values", symbols, [casadi.vertcat(left, right, ahead)]).call(known)[0]
        one, other, growth = (float(item) for item in found.nonzeros())
        return one, other, growth


def _direction(name: str, values: Mapping[str, float]) -> float:
    """Where the point nearby lies: the command goes up, or back from full opening; the rest counts less."""
    if name == "command":
        return 1.0 if abs(values[name]) < 1.0 else -values[name]
    if name in (f"{VALVE}requested", f"{VALVE}opening"):
        return 1.0e-6 if values[name] < 1.0 else -1.0e-6
    first = ("pressure_1", "supply_pressure", "angle", "angular_velocity")
    return 1.0e-6 * max(1.0, abs(values[name])) * (1.0 if name in first else -0.5)


def _model(scenario: Scenario, run: Run, point: Point) -> LinearModel:
    """The linear model at a point, from the smooth piece that the point lies on."""
    values = dict(point.values)
    decided = _Sides(values)
    time = point.time or 0.0
    plant = plant_of(run, point.way, decided, time)
    matrices = _matrices(plant, values)
    edges = []
    for place, edge in decided.edges.items():
        others = _matrices(plant_of(run, point.way, _Sides(values, place), time), values)
        if any(_differs(one, other) for one, other in zip(matrices[:4], others[:4], strict=True)):
            edges.append(edge)
    a, b, c, d, found, shown = matrices
    sides = sides_of(run, point)
    if not np.any(b[:, 0]) and not np.any(d[:, 0]):
        sides["valve"] += f"; {DEAF}"
    return LinearModel(
        scenario=scenario,
        time=point.time,
        states=tuple(Variable(name, UNITS[name], values[name]) for name in plant.states),
        inputs=tuple(Variable(name, UNITS[name], values[name]) for name in plant.inputs),
        outputs=tuple(
            Variable(name, UNITS[name], float(value))
            for name, value in zip(plant.outputs, shown.ravel().tolist(), strict=True)
        ),
        a=a,
        b=b,
        c=c,
        d=d,
        rates=found.ravel(),
        sides=sides,
        edges=tuple(edges),
        delays=Delays(run.command_delay, run.signal_delay, run.period),
    )


def _matrices(plant: Plant, values: Mapping[str, float]) -> list[Floats]:
    """A, B, C and D of a plant at some values; then its rates and outputs there, as columns."""
    import casadi

    x, u = (casadi.vertcat(*(plant.symbols[name] for name in names)) for names in (plant.states, plant.inputs))
    rates, outputs = casadi.vertcat(*plant.rates.values()), casadi.vertcat(*plant.outputs.values())
    wanted = [casadi.jacobian(item, by) for item in (rates, outputs) for by in (x, u)]
    return [np.array(item) for item in plant.function([*wanted, rates, outputs])(values)]


def _differs(one: Floats, other: Floats) -> bool:
    """True for two matrices that are not the same to rounding, or of different states."""
    return one.shape != other.shape or not np.allclose(one, other, rtol=ON_THE_EDGE, atol=0.0, equal_nan=True)


def sides_of(run: Run, point: Point) -> dict[str, str]:
    """Which side of each limit the point lies on, in words by place."""
    at, plant, openings = point.values, run.plant, openings_at(run, point.values)
    room, first, second = plant.atmospheric_pressure, at["pressure_1"], at["pressure_2"]
    paths = {
        "source to chamber 1": (at["supply_pressure"], first, openings.source_1),
        "chamber 1 to atmosphere": (first, room, openings.vent_1),
        "source to chamber 2": (at["dorsiflexion_pressure"], second, openings.source_2),
        "chamber 2 to atmosphere": (second, room, openings.vent_2),
    }
    said = {name: _regime(plant.valve_curve, *values) for name, values in paths.items()}
    said["leak over the vane"] = _regime(plant.leak_curve, first, second, 1.0)
    motion = {None: "prescribed", 0.0: "held", 1.0: "slides in plantarflexion", -1.0: "slides in dorsiflexion"}
    vane = motion[point.way]
    if point.way == 0.0:
        is_at_stop = not plant.angle_min < at["angle"] < plant.angle_max
        vane = "held by a stop" if is_at_stop else "sticks: friction holds it"
    valve = f"feeds chamber {1 if openings.source_1 > 0.0 else 2}, open by {max(openings):.4g}" if any(openings) else ""
    return {"valve": valve or "closed", "ankle": vane, **said}


def _regime(curve: FlowCurve, pressure_a: float, pressure_b: float, opening: float) -> str:
    """How gas flows between two pressures [Pa]."""
    if opening == 0.0:
        return "closed"
    ratio = min(pressure_a, pressure_b) / max(pressure_a, pressure_b)
    if ratio <= curve.critical_ratio:
        return f"choked, pressure ratio {ratio:.3f}"
    near = ", on the straight line near equal pressures" if ratio > curve.linear_ratio else ""
    return f"below choking, pressure ratio {ratio:.4f}{near}"
