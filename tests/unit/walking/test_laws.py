"""Every law on a walking leg: it follows its torque, leaves the foot free in mid-stance, and lifts the toes."""

from collections.abc import Callable
from functools import lru_cache

import pytest

from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.model.helping import MID_STANCE
from ppafo.model.valves.kind import VENT
from ppafo.walking import WalkResult, load_walk, walk

MINUTES = 0.25
LARGEST_ERROR = {
    "event_on_off_dead_zone": 0.3,
    "event_proportional": 0.5,
    "event_pid": 0.25,
    "event_pid_feedforward": 0.25,
    "event_sliding_mode": 0.25,
    "event_feedback_linearisation": 0.15,
}
"""RMS torque error in push-off [N m] that a law keeps below, of a peak of 5 N m."""


@pytest.fixture(scope="module")
def walked() -> Callable[[str], WalkResult]:
    def run(name: str) -> WalkResult:
        return walk(load_walk("proportional", [f"controller.kind={name}"]), minutes=MINUTES)

    return lru_cache(run)


def test_every_law_that_wants_a_torque_is_walked_here() -> None:
    wanting = {name for name, kind in WALKING_CONTROLLERS.items() if hasattr(kind.initial, "request")}
    assert wanting == set(LARGEST_ERROR)


@pytest.mark.parametrize("name", LARGEST_ERROR)
def test_a_law_walks_and_follows_its_torque_in_push_off(walked: Callable[[str], WalkResult], name: str) -> None:
    result = walked(name)
    assert result.status.is_completed
    assert result.metrics["strides"].value >= 10
    assert result.metrics["push_off_error"].value < LARGEST_ERROR[name]
    assert result.metrics["net_push_off_work"].value > 1.0
    assert result.metrics["toe_landing"].value == 0.0


@pytest.mark.parametrize("name", LARGEST_ERROR)
def test_the_foot_is_free_in_mid_stance_and_clears_the_ground_in_mid_swing(
    walked: Callable[[str], WalkResult], name: str
) -> None:
    result = walked(name)
    free = result.recording["controller_phase"] == MID_STANCE
    assert free.any()
    assert (result.recording["command"][free] == VENT).all()
    assert result.metrics["lowest_toes"].value > 0.0


def test_solenoid_valves_lift_the_toes_higher_where_the_push_off_ends_in_time() -> None:
    in_time, late = (
        walk(load_walk("solenoid", given), minutes=MINUTES) for given in ([], ["controller.push_off_end=0.65"])
    )
    early, behind = (result.metrics["lowest_toes"].value for result in (in_time, late))
    # With dead volumes of 36 cm^3 the toes drag in both: by 4.8 mm and by 17.3 mm.
    assert early > behind + 0.01
    assert early == pytest.approx(-0.0048, abs=0.002)
    assert in_time.metrics["net_push_off_work"].value > 0.8


@pytest.mark.parametrize("zone", [[], ["controller.dead_zone=1 N m", "controller.release=0.3 N m"]])
def test_the_dead_zone_works_on_solenoid_valves(zone: list[str]) -> None:
    result = walk(load_walk("solenoid", ["controller.kind=event_on_off_dead_zone", *zone]), minutes=MINUTES)
    assert result.status.is_completed
    assert result.metrics["net_push_off_work"].value > 0.8
    assert result.metrics["toe_landing"].value == 0.0
