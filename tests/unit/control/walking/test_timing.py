"""The time in the stride: known delays taken off, events predicted, and an estimate that brute force confirms."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.control.walking import estimated_timing, fractional_timing, phases
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.control.walking.estimated_timing import EstimatedRules, LearntStride, Window
from ppafo.control.walking.phases import PhaseRules
from ppafo.control.walking.timing import TimingKind
from ppafo.control.walking.timings import TIMINGS, keeps_time, with_timing
from ppafo.engine.rows import rebuilt
from ppafo.errors import ScenarioError
from ppafo.model.helping import LANDING, MID_STANCE, PUSH_OFF
from ppafo.model.sensors import GaitMeasurement
from tests.settings_of_laws import settings_of_law

Floats = NDArray[np.float64]
PERIOD = 1.0e-3
RULES = PhaseRules(60.0, 30.0, 0.01, 1.0, 0.3, 0.4)
GIVEN = {"sensor_lag": 0.0, "valve_delay": 0.0}
TRUE = {"strike": 0.0, "toes_on": 0.1, "heel_off": 0.4, "toes_off": 0.62}
RAMP = 6.0e3
"""How fast the forces of the made-up gait rise and fall [N/s]."""


def forces(phase: Floats, stride_time: float) -> tuple[Floats, Floats]:
    """Heel and toe force [N] of a gait whose loads rise and fall in straight lines from and to its events."""
    time = phase * stride_time
    at = {name: share * stride_time for name, share in TRUE.items()}
    heel = np.minimum(RAMP * time, RAMP * (at["heel_off"] - time)).clip(0.0, 500.0)
    toe = np.minimum(RAMP * (time - at["toes_on"]), RAMP * (at["toes_off"] - time)).clip(0.0, 600.0)
    return heel, toe


def angles(phase: Floats) -> Floats:
    return np.asarray(1.6 + 0.12 * np.sin(2.0 * np.pi * phase) + 0.08 * np.cos(4.0 * np.pi * phase))


def settings(kind: TimingKind, **changed: float) -> Any:
    values = {item.name: item.default for item in kind.quantities} | GIVEN
    rates = dict.fromkeys((name for name in values if name.endswith("_rate")), RAMP)
    return rebuilt(kind.parameters, list((values | rates | changed).values()))


def followed(kind: TimingKind, phase: Floats, stride_time: float = 1.0, **changed: float) -> list[Any]:
    """The clocks of a timing, sample by sample, on a gait at these phases [turns]."""
    rules, clock, seen, found = settings(kind, **changed), kind.initial, phases.START, []
    heel, toe = forces(phase % 1.0, stride_time)
    for angle, on_heel, on_toe in zip(angles(phase % 1.0).tolist(), heel.tolist(), toe.tolist(), strict=True):
        after = phases.timed_phase_state(RULES, seen, on_heel, on_toe, seen.since_strike + PERIOD, PERIOD)
        measurement = GaitMeasurement(angle, 1.0e5, 1.0e5, 0.0, on_heel, on_toe)
        clock = kind.follow(rules, RULES, clock, seen, after, measurement, PERIOD)
        seen = after
        found.append(clock)
    return found


def late(clocks: list[Any], phase: Floats) -> Floats:
    """By how many turns the clock is behind the gait; never more than half a stride."""
    fractions = np.array([getattr(clock, "clock", clock).fraction for clock in clocks])
    return np.asarray((phase - fractions + 0.5) % 1.0 - 0.5)


def test_a_force_that_rises_evenly_is_detected_as_late_as_the_known_delays_say() -> None:
    late_by = fractional_timing.detection_delays(settings(fractional_timing.FRACTIONAL).delays, RULES, PERIOD)
    heel, toe = forces(np.arange(0.0, 1.0, PERIOD), 1.0)
    seen, times = phases.START, {}
    for sample, (on_heel, on_toe) in enumerate(zip(heel.tolist(), toe.tolist(), strict=True)):
        after = phases.timed_phase_state(RULES, seen, on_heel, on_toe, seen.since_strike + PERIOD, PERIOD)
        marks = fractional_timing.detected_events(seen, after)
        times |= {name: sample * PERIOD for name, mark in marks._asdict().items() if mark > 0.5}
        seen = after
    for name, time in times.items():
        assert time - TRUE[name] == pytest.approx(getattr(late_by, name), abs=1.1 * PERIOD)
    assert set(times) == set(TRUE)


def test_percent_of_gait_is_right_once_two_strides_were_seen() -> None:
    phase = np.arange(0.5, 8.0, PERIOD)
    assert np.abs(late(followed(fractional_timing.FRACTIONAL, phase), phase)[3000:]).max() < 0.003


def test_events_are_known_when_they_happen_and_not_when_they_are_detected() -> None:
    phase = np.arange(0.5, 8.0, PERIOD)
    event = np.array([clock.event for clock in followed(fractional_timing.FRACTIONAL, phase)])
    for number, share in enumerate(TRUE.values()):
        known = np.flatnonzero((event[1:] == number) & (event[:-1] != number)) + 1
        true = np.flatnonzero(np.diff(np.floor(phase - share))) + 1
        errors = [PERIOD * float(known[np.argmin(np.abs(known - sample))] - sample) for sample in true[3:]]
        assert max(map(abs, errors)) < 0.004


def test_the_clock_waits_for_who_stands() -> None:
    walking = np.arange(0.5, 5.25, PERIOD)
    phase = np.concatenate([walking, np.full(3000, 5.25)])
    clock = followed(fractional_timing.FRACTIONAL, phase)[-1]
    assert clock.fraction == pytest.approx(clock.event_fractions.heel_off + fractional_timing.WAITS)


def test_a_strike_that_does_not_come_is_no_landing_for_ever() -> None:
    walking = np.arange(0.5, 5.9, PERIOD)
    clocks = followed(fractional_timing.FRACTIONAL, np.concatenate([walking, np.full(500, 5.9)]))
    swing = phases.START._replace(stride_time=1.0)
    rules = settings(fractional_timing.FRACTIONAL)
    lands = [fractional_timing.fractional_time(rules, clock, swing).lands for clock in clocks[-500:]]
    assert lands[-1] == 0.0
    assert sum(lands) * PERIOD == pytest.approx(fractional_timing.WAITS, abs=2.0 * PERIOD)


def test_the_delay_of_the_valve_is_a_lead() -> None:
    rules, clock = (
        settings(fractional_timing.FRACTIONAL, valve_delay=0.03),
        fractional_timing.CLOCK_START._replace(fraction=0.5),
    )
    stance = phases.START._replace(phase=MID_STANCE, stride_time=1.2)
    assert fractional_timing.fractional_time(rules, clock, stance).since_strike == pytest.approx(0.5 * 1.2 + 0.03)


@pytest.mark.parametrize("even", [0.0, 1.0])
def test_a_slow_valve_makes_no_strike_of_a_foot_that_hangs_after_an_odd_stride(even: float) -> None:
    """At 0.95 the clock waits there; 60 ms ahead is beyond the strike."""
    strides = fractional_timing.CLOCK_START.strides._replace(even=even)
    clock = fractional_timing.CLOCK_START._replace(fraction=0.95, strides=strides)
    found = fractional_timing.phase_time(clock, 0.06, phases.START._replace(stride_time=1.1))
    assert found.lands == even
    assert (found.since_strike < 0.1) == (even > 0.5)


@pytest.mark.parametrize("pace", [0.4, 0.5, 1.1, 2.4])
@pytest.mark.parametrize("before", [0, 5])
def test_the_second_stride_of_any_pace_sets_it_and_the_first_does_not(before: int, pace: float) -> None:
    strides, found = fractional_timing.CLOCK_START.strides, []
    for taken in [1.1] * before + [pace, pace, pace]:
        strides = fractional_timing.next_strides(strides, True, True, True, taken, 1.1, 0.2)
        found.append(strides.mean_time)
    assert found[-3] == pytest.approx(1.1)
    assert found[-2:] == pytest.approx([pace, pace])
    assert strides.even == 1.0, "the third is like the two before"


@pytest.mark.parametrize("kind", list(TIMINGS.values())[1:], ids=lambda timing: timing.name)
def test_the_time_since_a_strike_is_never_below_0_when_strides_become_quicker(kind: TimingKind) -> None:
    phase = np.concatenate([np.arange(0.5, 9.1, PERIOD), 9.1 + np.arange(0.0, 1.8, 1.1 * PERIOD)])
    rules = settings(kind)
    times = [kind.gait_time(rules, clock, phases.START._replace(stride_time=1.0)) for clock in followed(kind, phase)]
    assert min(time.since_strike for time in times) >= 0.0


def test_a_clock_that_a_strike_left_before_it_is_not_moved_where_nothing_is_estimated() -> None:
    rules, fraction = (
        settings(estimated_timing.ESTIMATED),
        fractional_timing.struck_fraction(0.9, 0.025, estimated_timing.KEEPS),
    )
    assert fraction == pytest.approx(-0.075)
    clock, at = (
        estimated_timing.START._replace(next_knot=29.0),
        fractional_timing.CLOCK_START._replace(fraction=fraction),
    )
    measurement = GaitMeasurement(1.6, 1.0e5, 1.0e5, 0.0, 0.0, 0.0)
    found = estimated_timing.passed_knot(rules, clock, at, 0.0, measurement)
    assert (found.clock.fraction, found.moved) == (fraction, 0.0)
    assert estimated_timing.gait_time(rules, found, phases.START._replace(phase=LANDING)).since_strike == 0.0


def rules_of(**changed: float) -> EstimatedRules:
    """Rules of the estimation whose estimates count in full, and that learn nothing anew."""
    rules: EstimatedRules = settings(estimated_timing.ESTIMATED)
    return rules._replace(relearning=0.0, estimate_weight=1.0, **changed)


def learnt(shape: Floats) -> LearntStride:
    """A learnt stride from values (3, knots) of angle and forces."""
    return LearntStride(*(tuple(row.tolist()) for row in shape))


def brute_force(stride: Floats, window: Floats, scales: Floats, trust: float) -> float:
    """Shift [knots] with the least sum of squares, on a fine grid of the stride as a trigonometric polynomial."""
    knots = stride.shape[1]
    shifts = np.arange(-3.5, 3.5, 0.01)
    spectrum = np.fft.rfft(stride, axis=1)
    order = np.arange(spectrum.shape[1])
    costs = []
    for shift in shifts:
        moved = np.fft.irfft(spectrum * np.exp(2j * np.pi * order * shift / knots), knots, axis=1)
        missed = (window - moved[:, -window.shape[1] :]) / scales[:, np.newaxis]
        costs.append(float((missed**2).sum()) + trust * shift**2)
    return float(shifts[int(np.argmin(costs))])


@pytest.mark.parametrize("trust", [0.0, 4.0])
@pytest.mark.parametrize("ahead", [-2.6, -1.0, -0.4, 0.0, 0.3, 1.2, 2.5])
def test_the_estimated_shift_is_that_of_brute_force(ahead: float, trust: float) -> None:
    """Smooth signals, so that both see the same stride between its knots."""
    turns = np.arange(1, estimated_timing.KNOTS + 1) / estimated_timing.KNOTS

    def shape(phase: Floats) -> Floats:
        heel = 200.0 + 200.0 * np.sin(2.0 * np.pi * phase) + 60.0 * np.cos(4.0 * np.pi * phase)
        toe = 250.0 - 220.0 * np.cos(2.0 * np.pi * phase + 0.4)
        return np.stack([angles(phase), heel, toe])

    stride = shape(turns)
    window = shape(turns + ahead / estimated_timing.KNOTS)[:, -estimated_timing.WINDOW :]
    rules = rules_of(largest_misfit=100.0, clock_trust=trust)
    moved = (0.0,) * estimated_timing.WINDOW
    found = estimated_timing.estimated_shift(
        learnt(stride), Window(*(tuple(row.tolist()) for row in window), moved), rules
    )
    expected = brute_force(stride, window, np.array([0.1, 150.0, 150.0]), trust)
    assert trust > 0.0 or expected == pytest.approx(ahead, abs=0.02), "without trust in the clock it is the true shift"
    assert abs(expected) <= abs(ahead) + 0.02, "which pulls it to 0"
    assert found * estimated_timing.KNOTS == pytest.approx(expected, abs=0.12)


def test_nothing_is_estimated_from_what_is_no_stride() -> None:
    stride = learnt(np.zeros((3, estimated_timing.KNOTS)))
    window = Window(*((9.0,) * estimated_timing.WINDOW for _ in range(3)), (0.0,) * estimated_timing.WINDOW)
    rules = rules_of(largest_misfit=1.0, clock_trust=2.0)
    assert estimated_timing.estimated_shift(stride, window, rules) == 0.0


def test_an_estimate_follows_a_stride_that_becomes_quicker_before_it_ends() -> None:
    """From one sample on strides are 6 % quicker: percent of gait runs behind until the next strike is detected."""
    steady = np.arange(0.5, 9.1, PERIOD)
    phase = np.concatenate([steady, 9.1 + np.arange(0.0, 0.85, 1.06 * PERIOD)])
    errors = {}
    for kind in (fractional_timing.FRACTIONAL, estimated_timing.ESTIMATED):
        errors[kind.name] = float(np.abs(late(followed(kind, phase, anchor_weight=0.0), phase)[-150:]).mean())
    assert errors["estimated"] < 0.7 * errors["fractional"]


def test_the_learnt_stride_is_the_gait_at_the_knots() -> None:
    phase = np.arange(0.5, 10.0, PERIOD)
    clock = followed(estimated_timing.ESTIMATED, phase)[-1]
    assert clock.learnt == settings(estimated_timing.ESTIMATED).learning_strides
    knots = (clock.next_knot + np.arange(estimated_timing.KNOTS)) % estimated_timing.KNOTS / estimated_timing.KNOTS
    assert np.abs(np.array(clock.stride.angle) - angles(knots)).max() < 0.01
    assert np.abs(np.array(clock.stride.heel_force) - forces(knots, 1.0)[0]).max() < 30.0


def test_a_timing_changes_no_controller_without_a_time_in_the_stride() -> None:
    assert not keeps_time(WALKING_CONTROLLERS["off"])
    with pytest.raises(ScenarioError, match="uses no gait phase"):
        with_timing(WALKING_CONTROLLERS["off"], fractional_timing.FRACTIONAL)
    for kind in WALKING_CONTROLLERS.values():
        if keeps_time(kind):
            timed = [with_timing(kind, timing) for timing in TIMINGS.values()]
            assert timed[0] is kind
            assert len({len(item.quantities) for item in timed}) == 3


@pytest.mark.parametrize("timing", list(TIMINGS.values())[1:], ids=lambda timing: timing.name)
@pytest.mark.parametrize("name", ["event_on_off", "event_pid"])
def test_nothing_pushes_on_a_loaded_heel_whatever_is_predicted(timing: TimingKind, name: str) -> None:
    kind = with_timing(WALKING_CONTROLLERS[name], timing)
    values = settings_of_law(kind) | GIVEN
    parameters, state = rebuilt(kind.parameters, list(values.values())), kind.initial
    phase = np.concatenate([np.arange(0.5, 5.2, PERIOD), np.full(600, 5.2), np.arange(5.2, 7.3, 1.3 * PERIOD)])
    heel, toe = forces(phase % 1.0, 1.0)
    noise = 1.0 + 1.0e-6 * np.random.default_rng(3).standard_normal((phase.size, 3))
    pushed = 0
    for angle, on_heel, on_toe, wrong in zip(angles(phase % 1.0), heel, toe, noise, strict=True):
        measurement = GaitMeasurement(angle * wrong[0], 1.4e5, 1.4e5, 0.0, on_heel * wrong[1], on_toe * wrong[2])
        command, state = kind.update(parameters, state, 0.0, measurement, PERIOD)
        pushed += command > 0.0 and command <= 1.0 and state.phase.phase == PUSH_OFF
        assert state.phase.heel.loaded < 0.5 or not 0.0 < command <= 1.0
    assert pushed > 100
