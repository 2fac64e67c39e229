"""No control of a sampled pair of solenoid valves is below its bound, and the bound is a run."""

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.errors import SimulationError
from ppafo.questions.league.sampled_bound import COMMANDS, SampledBound, sampled_bound
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

THERMAL = (
    *("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"),
    "gas_model.wall_area_per_volume=100 1/m",
)
SHORT = ("run.duration=0.3 s", "reference.ramp_time=0.1 s", "reference.level=3 N m")


class Decided:
    """A controller that gives commands which were decided before."""

    def __init__(self, commands: tuple[float, ...]) -> None:
        self.commands = commands
        self.left: Iterator[float] = iter(())

    def reset(self) -> None:
        self.left = iter(self.commands)

    def update(self, time: float, reference: float, measurement: object) -> float:
        return next(self.left, 0.0)


def played(words: tuple[str, ...], commands: tuple[float, ...]) -> float:
    scenario = load_scenario("torque-task-solenoid", words).controlled_by(Decided(commands))
    return simulate(scenario).metrics["rms_error"].value


@pytest.fixture(scope="module")
def short() -> SampledBound:
    return sampled_bound(load_scenario("torque-task-solenoid", SHORT))


def test_of_all_decisions_none_is_better_and_the_best_is_found(short: SampledBound) -> None:
    every = [played(SHORT, commands) for commands in itertools.product(COMMANDS, repeat=6)]
    assert min(every) == pytest.approx(short.found, rel=1.0e-9)
    assert 0.99 * min(every) < short.certified <= min(every) * (1.0 + 1.0e-12)


@pytest.mark.parametrize(
    "words",
    [("reference.level=4 N m",), ("valve.opening_delay=8 ms", "valve.closing_delay=5 ms", "run.duration=1 s")],
)
def test_the_decisions_that_were_found_are_a_run_with_that_error(words: tuple[str, ...]) -> None:
    bound = sampled_bound(load_scenario("torque-task-solenoid", words))
    assert played(words, bound.commands) == pytest.approx(bound.found, rel=1.0e-9)
    assert bound.certified <= bound.found


def test_the_figures_of_an_independent_search_with_two_commands_are_met() -> None:
    """A beam over both pressures at the held angle, in other code than this package: 0.920 and 0.823 N m."""
    at_six = sampled_bound(load_scenario("torque-task-solenoid"), (1.0, -1.0))
    at_four = sampled_bound(load_scenario("torque-task-solenoid", ["reference.level=4 N m"]), (1.0, -1.0))
    assert at_six.found == pytest.approx(0.920, abs=5.0e-4)
    assert at_four.found == pytest.approx(0.823, abs=5.0e-4)
    assert at_six.certified > 0.999 * at_six.found
    assert at_four.certified > 0.995 * at_four.found


def test_what_begins_between_two_states_stays_between_them() -> None:
    scenario = load_scenario("torque-task-solenoid", ["run.duration=0.05 s"]).controlled_by(Decided(()))
    batch = batch_of(plan_run(scenario))
    draw = np.random.default_rng(3)
    low = np.repeat(batch.states, 600, axis=1)
    numbered = row_numbers(batch.program.state_rows())
    masses = [numbered["state.mass_1"], numbered["state.mass_2"]]
    low[masses] *= draw.uniform(0.9, 4.4, (2, 600))
    high = low.copy()
    high[masses] *= 1.0 + draw.uniform(0.0, 1.0, (2, 600)) * draw.choice([1.0e-4, 1.0e-2, 0.3], (1, 600))
    middle = low.copy()
    middle[masses] += draw.uniform(0.0, 1.0, (2, 600)) * (high[masses] - low[masses])
    for command in COMMANDS:
        ends = []
        for states in (low, middle, high):
            begun = states.copy()
            begun[numbered["result.command"]] = command
            parameters = np.repeat(batch.parameters, 600, axis=1)
            ends.append(run_batch(Batch(batch.program, batch.clock, parameters, begun)).states[masses])
        slack = 1.0e-9 * ends[2]
        assert np.all(ends[0] <= ends[1] + slack)
        assert np.all(ends[1] <= ends[2] + slack)


@pytest.mark.parametrize(
    ("name", "words", "reason"),
    [
        ("torque-task-proportional", (), "the valve 'proportional' has no few commands"),
        ("torque-task-solenoid", ("run.duration=1.02 s",), "run.duration ends in a sample"),
        ("torque-task-solenoid", THERMAL, "the gas must be isothermal"),
        ("torque-task-moving-ankle", ("device.valve=solenoid",), "the ankle must be fixed"),
    ],
)
def test_what_it_cannot_do_is_refused(name: str, words: tuple[str, ...], reason: str) -> None:
    with pytest.raises(SimulationError, match=reason):
        sampled_bound(load_scenario(name, words))
