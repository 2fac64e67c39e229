"""Causes are runs: the table agrees with runs of their own, and nothing is named that its own run does not confirm."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.counterfactuals import table, verdict_of
from ppafo.counterfactuals.changes import Change, changes_of
from ppafo.counterfactuals.table import excesses
from ppafo.loading import load_scenario
from ppafo.running import simulate
from ppafo.simulation.clock import TIMES
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.evidence import delays_of, most_of

TASK = "torque-task-proportional"
LATE = [
    "sensors.delay=20 ms",
    "controller.rate=1 kHz",
    "reference.level=3 N m",
    "controller.integral_gain=20 1/(N m s)",
]


class Proportional:
    """Python object that opens the valve by the error of the torque."""

    def __init__(self, gain: float) -> None:
        self.gain = gain

    def reset(self) -> None:
        """Start anew."""

    def update(self, time: float, reference: float, measurement: object) -> float:
        """Return the command."""
        return max(-1.0, min(1.0, self.gain * (reference - measurement.torque)))  # type: ignore[attr-defined]


def controlled_by(gain: float, *changes: str) -> Scenario:
    """A torque task that a Python object controls."""
    return load_scenario(TASK, ["reference.level=3 N m", *changes]).controlled_by(Proportional(gain))


def test_the_table_says_of_each_change_what_a_run_of_its_own_does() -> None:
    scenario = load_scenario(TASK, [*LATE, "sensors.pressure_noise=0.3 psi_d"])
    changes = [
        change for change in changes_of(scenario) if change.base is scenario and not set(TIMES) & set(change.numbers)
    ]
    some = [Change("as it is", "task", {}, scenario), *changes[::4]]
    alone = [simulate(with_numbers(scenario, change.numbers)).tracking.follows for change in some]
    assert [left <= 1.0 for left in excesses(some)] == alone
    assert len(set(alone)) == 2


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_most_of_a_delay_is_more_than_half_of_all(delays: list[float]) -> None:
    path = most_of({f"d{number}": delay for number, delay in enumerate(delays)})
    halves = [f"d{number}" for number, delay in enumerate(delays) if delay > 0.5 * math.fsum(delays)]
    assert [path] == (halves or [""])


def test_each_delay_of_a_loop_is_in_one_list() -> None:
    late = load_scenario(TASK, [*LATE, "valve.delay=3 ms", "valve.slew_limit=50 1/s", "valve.spool_frequency=100 Hz"])
    delays = {path: delay for path, delay in delays_of(late).items() if delay}
    spool = 2.0 * 0.7 / (2.0 * math.pi * 100.0)
    expected = {"sensors.delay": 0.02, "valve.delay": 0.003, "controller.rate": 0.0015}
    assert delays == pytest.approx({**expected, "valve.spool_frequency": spool, "valve.slew_limit": 0.01})


@pytest.mark.parametrize(
    ("scenario", "cause", "other"),
    [
        # The rate gives 1.5 of 21.5 ms.
        (
            load_scenario("cylinder-servo", ["sensors.delay=20 ms"]),
            "without `sensors.delay = 20 ms`",
            "faster controller",
        ),
        (controlled_by(-1.0), "with the sign of the command reversed", "without"),
        # A command of 0.03 opens nothing of a valve with a dead band of 0.1.
        (controlled_by(0.008, "valve.dead_band=0.1"), "64 times the command", "do not explain"),
    ],
    ids=["late sensor", "wrong sign", "soft object"],
)
def test_what_is_named_makes_the_run_follow(
    scenario: Scenario, cause: str, other: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a slow computer too, all changes of a Python object are tried.
    monkeypatch.setattr(table, "_TIME_OF_OBJECT", 60.0)
    verdict = verdict_of(simulate(scenario))
    assert cause in verdict.cause
    assert other not in verdict.cause
