"""A linear model of the plant of a scenario, at an instant of its run or at its steady state."""

from collections.abc import Mapping
from importlib.util import find_spec
from numbers import Real

import numpy as np

from ppafo.analyses.linearise.model import Delays, LinearModel, Variable
from ppafo.analyses.linearise.plant import UNITS, Plant, opens_in_proportion, plant_of
from ppafo.analyses.linearise.point import Point, equilibrium, point_at
from ppafo.analyses.linearise.sides import ON_THE_EDGE, Sides, sides_of
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.errors import ScenarioError, UnitError, refused_as
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.units import parse_quantity

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
