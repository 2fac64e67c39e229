"""What torque is wanted in each phase, and what a law forgets where another task begins."""

from typing import Any

import numpy as np
import pytest

from ppafo.control.controllers.model_based import FeedbackLinearisationState, linearising_restart
from ppafo.control.walking import assistance
from ppafo.control.walking.assistance import Assistance, TorqueProfile, profile_torque
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.control.walking.phases import DebouncedSensor, PhaseState
from ppafo.engine.rows import rebuilt
from ppafo.model.helping import LANDING, MID_STANCE, PUSH_OFF, SWING
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT
from tests.settings_of_laws import settings_of_law

PERIOD = 1.0e-3
PROFILE = TorqueProfile(4.0, 0.5, 0.2, 0.1)
RULES = Assistance(
    *(1.5, 10.0, 0.5, 0.0),
    landing=TorqueProfile(1.0, 0.05, 0.05, 0.1),
    push_off=PROFILE,
    swing=TorqueProfile(2.0, 0.8, 0.1, 0.3),
    largest_torque=5.0,
)
FOLLOWING = [
    name for name, kind in WALKING_CONTROLLERS.items() if "peak_time" in {item.name for item in kind.quantities}
]


def wanted(phase: PhaseState, angle: float, rate: float, rules: Assistance = RULES) -> float:
    return assistance.requested_torque(rules, phase, angle, rate)


def at(phase: float, share: float) -> PhaseState:
    """The wearer in a phase at a share of a stride of 1.2 s."""
    off = DebouncedSensor(0.0, 0.0)
    return PhaseState(phase, off, off, 0.1, 1.2 * share, 1.2, 3.0)


def test_a_profile_rises_from_zero_to_its_peak_and_falls_to_zero() -> None:
    assert [profile_torque(PROFILE, phase) for phase in (0.0, 0.3, 0.6, 1.0)] == pytest.approx([0.0] * 4)
    assert profile_torque(PROFILE, 0.5) == pytest.approx(4.0)
    assert profile_torque(PROFILE, 0.4) == pytest.approx(2.0), "half way up"
    assert profile_torque(PROFILE, 0.55) == pytest.approx(2.0), "half way down"
    phase = np.linspace(0.0, 1.0, 2001)
    torque = np.array([profile_torque(PROFILE, float(value)) for value in phase])
    assert np.abs(np.diff(torque)).max() < 1.5 * 4.0 / 0.1 * 0.0005 + 1e-9, "no jump"
    assert np.all(np.diff(torque)[phase[1:] <= 0.5] >= 0.0)
    assert np.all(np.diff(torque)[phase[:-1] >= 0.5] <= 0.0)


def test_each_phase_wants_its_own_torque() -> None:
    angle = RULES.swing_angle
    assert wanted(at(PUSH_OFF, 0.5), angle, 0.0) == pytest.approx(4.0)
    assert wanted(at(MID_STANCE, 0.5), angle, 9.0) == 0.0
    assert wanted(at(LANDING, 0.05), angle, 0.0) == pytest.approx(-1.0)
    assert wanted(at(SWING, 0.8), angle, 0.0) == pytest.approx(-2.0)


def test_a_lifted_foot_is_held_by_a_spring_and_a_damper_up_to_the_largest_torque() -> None:
    bare = RULES._replace(swing=PROFILE._replace(peak_torque=0.0))
    assert wanted(at(SWING, 0.8), 1.6, 0.0, bare) == pytest.approx(-1.0)
    assert wanted(at(SWING, 0.8), 1.5, 2.0, bare) == pytest.approx(-1.0)
    assert wanted(at(SWING, 0.8), 3.0, 0.0, bare) == -5.0
    assert wanted(at(SWING, 0.8), 1.45, 0.0, bare) == pytest.approx(0.5)
    assert wanted(at(SWING, 0.8), 0.5, 0.0, bare) == assistance.LARGEST_PRESS


def test_nothing_presses_the_toes_down_while_the_foot_stands_on_its_heel() -> None:
    for angle, rate in ((0.5, 0.0), (1.5, -9.0)):
        assert wanted(at(SWING, 0.05), angle, rate) > 0.0
        assert wanted(at(LANDING, 0.05), angle, rate) == 0.0


def test_landing_and_swing_are_one_task_and_the_others_are_not() -> None:
    assert assistance.same_task(SWING, LANDING)
    assert assistance.same_task(PUSH_OFF, PUSH_OFF)
    changes = [(LANDING, MID_STANCE), (MID_STANCE, PUSH_OFF), (PUSH_OFF, SWING), (MID_STANCE, SWING)]
    assert not any(assistance.same_task(before, after) for before, after in changes)


def test_the_rate_of_the_angle_is_filtered_and_has_no_kick_at_the_start() -> None:
    rules = RULES._replace(rate_filter=0.006)
    first = assistance.next_request(rules, assistance.START, at(SWING, 0.8), 1.6, PERIOD)
    assert first.rate == 0.0
    second = assistance.next_request(rules, first, at(SWING, 0.8), 1.601, PERIOD)
    assert second.rate == pytest.approx(0.001 / (PERIOD + 0.006))


def one_stride() -> list[GaitMeasurement]:
    """Landing, mid-stance, push-off and swing, with readings that change as those of sensors do."""
    loads = [(250.0, 0.0)] * 60 + [(250.0, 250.0)] * 500 + [(0.0, 250.0)] * 90 + [(0.0, 0.0)] * 350
    return [
        seen(
            1.7 + 1e-5 * sample + (0.1 if heel == toe == 0.0 else 0.0),
            1.0,
            heel * (1.0 + 1e-5 * sample),
            toe * (1.0 + 1e-5 * sample),
        )
        for sample, (heel, toe) in enumerate(loads)
    ]


@pytest.mark.parametrize("name", FOLLOWING)
def test_a_law_acts_in_its_phases_and_leaves_the_foot_free_in_mid_stance(name: str) -> None:
    kind = WALKING_CONTROLLERS[name]
    parameters, state = default_parameters(name), kind.initial
    found: dict[float, list[float]] = {}
    for measurement in one_stride():
        command, state = kind.update(parameters, state, 0.0, measurement, PERIOD)
        if state.phase.strikes > 0.5:
            found.setdefault(state.phase.phase, []).append(command)
    assert set(found) == {SWING, LANDING, MID_STANCE, PUSH_OFF}
    assert set(found[MID_STANCE]) == {VENT}
    for phase in (SWING, LANDING, PUSH_OFF):
        assert all(-1.0 <= command <= 1.0 for command in found[phase])
    assert min(found[LANDING]) < 0.0, "the foot is below the swing angle and is lifted"


@pytest.mark.parametrize("name", [name for name in FOLLOWING if name != "event_feedback_linearisation"])
def test_a_law_forgets_where_another_task_begins(name: str) -> None:
    kind = WALKING_CONTROLLERS[name]
    parameters, state = default_parameters(name), kind.initial
    changes = 0
    for measurement in one_stride():
        before = state
        command, state = kind.update(parameters, before, 0.0, measurement, PERIOD)
        if not assistance.same_task(before.phase.phase, state.phase.phase):
            changes += 1
            fresh = kind.initial._replace(phase=before.phase, request=before.request)
            assert command == kind.update(parameters, fresh, 0.0, measurement, PERIOD)[0]
    assert changes == 3


def test_a_new_task_has_no_rate_of_the_torque_wanted_for_the_inverted_chambers() -> None:
    law = FeedbackLinearisationState(4.0, 1.6, 0.3, 1.0)
    assert linearising_restart(law, -2.0, 0.0) == FeedbackLinearisationState(-2.0, 1.6, 0.3, 1.0)
    assert linearising_restart(law, -2.0, 1.0) == law


@pytest.mark.parametrize("name", ["event_pid", "event_on_off"])
def test_the_device_vents_until_the_first_heel_strike_and_where_the_next_event_does_not_come(name: str) -> None:
    kind = WALKING_CONTROLLERS[name]
    parameters, state = default_parameters(name), kind.initial
    sent = []
    for sample in range(1800):
        # In the air, 100 samples on the heel, and in the air for good: the assumed stride lasts 1.1 s.
        heel = 250.0 if 100 <= sample < 200 else 0.0
        command, state = kind.update(parameters, state, 0.0, seen(1.9, 0.0, heel, 0.0), PERIOD)
        sent.append(command)
    acts = np.flatnonzero(np.array(sent) != VENT)
    assert 100 < acts[0] < 120, "after the debounce of the heel strike"
    lifted = acts[-1] - 200
    assert 1.2 * 1100 <= lifted < 1.2 * 1100 + 20
    assert np.ptp(acts) == acts.size - 1


def default_parameters(name: str) -> Any:
    """Parameters of a controller at their defaults."""
    kind = WALKING_CONTROLLERS[name]
    return rebuilt(kind.parameters, map(float, list(settings_of_law(kind).values())))


def seen(angle: float, torque: float, heel: float, toe: float) -> GaitMeasurement:
    """A measurement with an angle [rad], a torque [N m] and forces [N]."""
    above = torque / 1.451e-5
    return GaitMeasurement(angle, 1.01325e5 + max(above, 0.0), 1.01325e5 + max(-above, 0.0), torque, heel, toe)
