"""The lower bound on walking: below every controller, confirmed by the engine, and dearer the more is asked."""

import numpy as np
import pytest

from ppafo.errors import SimulationError
from ppafo.model.valves.kind import VENT
from ppafo.questions.league.walking import bound
from ppafo.questions.league.walking.bound import (
    Reached,
    SearchGrid,
    WalkingBound,
    play_stride,
    stride_command,
    walking_bound,
)
from ppafo.questions.league.walking.measures import walk_measures
from ppafo.questions.league.walking.solver import StrideOptimum
from ppafo.questions.league.walking.task import walking_task

pytestmark = pytest.mark.thorough

TASK = walking_task(minutes=0.1)
KINDS = ("event_proportional", "event_damped_learning", "event_feedback_linearisation")


@pytest.fixture(scope="module")
def walks() -> dict[str, dict[str, float]]:
    """Measures of three controllers on the proportional valve."""
    return {kind: walk_measures(TASK, TASK.configuration(kind, "proportional")) for kind in KINDS}


def small_bound(valve: str, reached: dict[str, Reached]) -> WalkingBound:
    """A bound on a coarse grid with few landings."""
    grid = SearchGrid(coarse=50, fine=80, landings=(0.14, 0.18), refinements=(0.01,), points=4)
    return walking_bound(TASK, valve, reached, grid=grid)


@pytest.fixture(scope="module")
def proportional(walks: dict[str, dict[str, float]]) -> WalkingBound:
    """The bound of the proportional valve, with the least gas for each controller."""
    pytest.importorskip("casadi", reason="the lower bound needs the extra 'optimal'")
    reached = {
        kind: Reached(found["lagged_error"], found["toe_height"], found["torque_lag"]) for kind, found in walks.items()
    }
    higher = Reached(1.0, 0.005)
    return small_bound("proportional", {**reached, "higher": higher, "lower": Reached(1.0, -0.02)})


def test_no_controller_is_below_the_bound(walks: dict[str, dict[str, float]], proportional: WalkingBound) -> None:
    for kind, found in walks.items():
        own = proportional.own[kind]
        assert own is not None
        assert own.gas < found["gas"]
        assert proportional.least_error.rms_error < found["torque_error"]


def test_more_error_takes_less_gas_and_higher_toes_take_more(proportional: WalkingBound) -> None:
    optima = (proportional.least_error, *proportional.curve)
    errors, gas = ([getattr(item, name) for item in optima] for name in ("rms_error", "gas"))
    assert (np.diff(errors) > 0.0).all()
    assert (np.diff(gas) < 0.0).all()
    higher, lower = proportional.own["higher"], proportional.own["lower"]
    assert higher is not None
    assert lower is not None
    assert lower.gas < higher.gas


def test_the_engine_confirms_the_optima_of_a_proportional_valve(proportional: WalkingBound) -> None:
    """Played open-loop: error within 10 mN m, gas within 2 %, toes within 5 mm of what was asked of them."""
    for optimum in (proportional.least_error, *proportional.curve[:-1]):
        run = play_stride(TASK, "proportional", optimum)
        assert run.rms_error == pytest.approx(optimum.rms_error, abs=0.01)
        assert run.gas == pytest.approx(optimum.gas, rel=0.02)
        assert run.height > optimum.height - 0.005


def test_a_solenoid_pair_needs_more_gas_and_the_engine_confirms_it(proportional: WalkingBound) -> None:
    found = small_bound("solenoid", {})
    optimum = found.curve[1]
    run = play_stride(TASK, "solenoid", optimum)
    assert run.rms_error == pytest.approx(optimum.rms_error, abs=0.01)
    assert run.gas == pytest.approx(optimum.gas, rel=0.02)
    assert found.least_error.rms_error > proportional.least_error.rms_error
    assert optimum.gas > np.interp(
        optimum.rms_error, [item.rms_error for item in proportional.curve], [item.gas for item in proportional.curve]
    )


def test_ways_of_the_valve_are_shared_out_over_the_steps(proportional: WalkingBound) -> None:
    first = proportional.curve[0]
    shares = np.tile([0.3, 0.2, 0.5], (first.times.size, 1))
    mixed = StrideOptimum(0.0, 0.0, 0.0, 0.0, first.period, first.times, shares, first.strike, first.guess)
    for valve in ("proportional", "solenoid"):
        command = stride_command(mixed, valve, 1e-4, 2000, 0.0)
        assert np.mean(command == VENT) == pytest.approx(0.5, abs=0.01)
        spool = np.where(command == VENT, 0.0, command)
        assert np.mean(np.maximum(spool, 0.0)) == pytest.approx(0.3, abs=0.01)
        assert np.mean(np.maximum(-spool, 0.0)) == pytest.approx(0.2, abs=0.01)


def test_a_valve_or_an_extra_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bound, "find_spec", lambda _: None)
    with pytest.raises(SimulationError, match=r"ppafo\[optimal\]"):
        walking_bound(TASK, "proportional", {})
    monkeypatch.setattr(bound, "find_spec", lambda _: object())
    with pytest.raises(SimulationError, match="no lower bound for valve 'servo'"):
        walking_bound(TASK, "servo", {})
