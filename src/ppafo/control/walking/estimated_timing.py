"""State estimation of the gait phase: a window of ankle angle, heel and toe force is fitted to a learnt stride.

The stride is learnt at equally spaced fractions ("knots") from the first good strides, by fractional timing. Then, at
each knot, the recent readings are compared with the learnt stride at the fractions given by the clock, and with the
learnt stride shifted by some knots in both directions. The shift with the least sum of squares is the error of the
clock, refined to a fraction of a knot by one Gauss-Newton step. The clock is corrected by a part of this error. If even
the best shift fits badly, the wearer does not walk, and the clock is not corrected. Li et al. (2011) correlate a window
in the same way.

The learnt stride is a ring buffer: its first knot is the next one, its last knot the one just passed.
"""

from typing import Annotated, NamedTuple

from ppafo.control.walking.fractional_timing import CLOCK_START, AnchorWeight, Delays, GaitClock, next_clock, phase_time
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.timing import GaitTime, TimingKind
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.sensors import GaitMeasurement

KNOTS = 32
WINDOW = 8
FURTHEST = 3
"""Number of knots of a stride, number of knots in the window, and largest shift of the learnt stride in knots."""


EVEN = 0.05
"""Largest relative deviation of a stride time from recent ones for which the stride is learnt."""


KEEPS = 0.2
"""Correction of the clock per detected strike after a stride is learnt [-], which prevents drift."""


class EstimatedRules(NamedTuple):
    """Estimator parameters: known delays, correction per detected event before a stride is learnt [-], adaptation.

    ``clock_trust`` is the sum of squares that a shift by one knot costs. The measured misfit has to outweigh this cost:
    rising and falling forces do, the ankle angle of the swing alone hardly does.
    """

    delays: Delays
    anchor_weight: AnchorWeight
    learning_strides: Annotated[
        float, Number("1", "number of consecutive valid strides from which the mean stride is learnt", 3.0, 1.0, 100.0)
    ]
    relearning: Annotated[float, Number("1", "weight of each later stride in the learnt mean stride", 0.1, 0.0, 1.0)]
    angle_scale: Annotated[
        float, Number("rad", "angle residual that counts as 1 in the sum of squares", 0.1, 1.0e-3, 10.0)
    ]
    force_scale: Annotated[
        float, Number("N", "force residual that counts as 1 in the sum of squares", 150.0, 1.0, 1.0e5)
    ]
    largest_misfit: Annotated[
        float, Number("1", "mean square residual above which the estimate is discarded", 1.0, 0.0, 1.0e3)
    ]
    clock_trust: Annotated[float, Number("1", "penalty in the sum of squares for a shift by one knot", 4.0, 0.0, 1.0e6)]
    estimate_weight: Annotated[
        float, Number("1", "weight of an estimate in the phase correction, 1: full correction", 0.5, 0.0, 1.0)
    ]


_NO_STRIDE, _NO_WINDOW = (0.0,) * KNOTS, (0.0,) * WINDOW


class LearntStride(NamedTuple):
    """Ankle angle [rad], heel force and toe force [N] at the knots of a stride, starting with the next knot."""

    angle: Annotated[tuple[float, ...], KNOTS] = _NO_STRIDE
    heel_force: Annotated[tuple[float, ...], KNOTS] = _NO_STRIDE
    toe_force: Annotated[tuple[float, ...], KNOTS] = _NO_STRIDE


class Window(NamedTuple):
    """Ankle angle [rad] and forces [N] at recent knots, oldest first, and sum of clock corrections then [turns]."""

    angle: Annotated[tuple[float, ...], WINDOW] = _NO_WINDOW
    heel_force: Annotated[tuple[float, ...], WINDOW] = _NO_WINDOW
    toe_force: Annotated[tuple[float, ...], WINDOW] = _NO_WINDOW
    moved: Annotated[tuple[float, ...], WINDOW] = _NO_WINDOW


class _EstimatedClock(NamedTuple):
    """Estimated gait phase: fractional clock, learnt stride, window of recent knots.

    ``next_knot`` is the number of the next knot, ``filled`` the number of knots in the window, ``learnt`` the number of
    strides in the learnt stride, and ``moved`` the sum of all corrections of the clock by estimates [turns].
    """

    clock: GaitClock = CLOCK_START
    stride: LearntStride = LearntStride()
    window: Window = Window()
    next_knot: float = 0.0
    filled: float = 0.0
    learnt: float = 0.0
    moved: float = 0.0


START = _EstimatedClock()


def misfit(stride: LearntStride, window: Window, rules: EstimatedRules, shift: int) -> float:
    """Mean square misfit [-] between the window and the learnt stride shifted by ``shift`` knots."""
    total = 0.0
    for back in range(WINDOW):
        index, knot = WINDOW - 1 - back, (KNOTS - 1 - back + shift) % KNOTS
        angle = (window.angle[index] - stride.angle[knot]) / rules.angle_scale
        heel = (window.heel_force[index] - stride.heel_force[knot]) / rules.force_scale
        toe = (window.toe_force[index] - stride.toe_force[knot]) / rules.force_scale
        total += angle * angle + heel * heel + toe * toe
    return total / (3.0 * WINDOW)


def finer_shift(stride: LearntStride, window: Window, rules: EstimatedRules, shift: int) -> float:
    """Correction of a whole-knot shift [knots], by one Gauss-Newton step of at most one knot."""
    # The cost of a shift is one more residual; 1e-12 avoids a division by 0 for a flat stride without trust.
    gradient, curvature = -rules.clock_trust * shift, 1.0e-12 + rules.clock_trust
    for back in range(WINDOW):
        index, knot = WINDOW - 1 - back, (KNOTS - 1 - back + shift) % KNOTS
        after, before = (knot + 1) % KNOTS, (knot + KNOTS - 1) % KNOTS
        angle_slope = 0.5 * (stride.angle[after] - stride.angle[before]) / rules.angle_scale
        heel_slope = 0.5 * (stride.heel_force[after] - stride.heel_force[before]) / rules.force_scale
        toe_slope = 0.5 * (stride.toe_force[after] - stride.toe_force[before]) / rules.force_scale
        angle = (window.angle[index] - stride.angle[knot]) / rules.angle_scale
        heel = (window.heel_force[index] - stride.heel_force[knot]) / rules.force_scale
        toe = (window.toe_force[index] - stride.toe_force[knot]) / rules.force_scale
        gradient += angle_slope * angle + heel_slope * heel + toe_slope * toe
        curvature += angle_slope * angle_slope + heel_slope * heel_slope + toe_slope * toe_slope
    return max(-1.0, min(1.0, gradient / curvature))


def estimated_shift(stride: LearntStride, window: Window, rules: EstimatedRules) -> float:
    """Estimated lead of the wearer over the clock [turns]; 0 if no shift fits well."""
    least, best = misfit(stride, window, rules, 0), 0
    for distance in range(1, FURTHEST + 1):
        # Small shifts first, and only a better one replaces the best: ties stay near the clock.
        for side in range(2):
            shift = distance if side == 0 else -distance
            # The trust in the clock is a cost of shifts, so that a flat misfit moves nothing.
            cost = misfit(stride, window, rules, shift) + rules.clock_trust * shift * shift / (3.0 * WINDOW)
            best = shift if cost < least else best
            least = min(cost, least)
    fits = least < rules.largest_misfit
    return (best + finer_shift(stride, window, rules, best)) / KNOTS if fits else 0.0


def next_stride(stride: LearntStride, measurement: GaitMeasurement, weight: float) -> LearntStride:
    """Learnt stride advanced by one knot; the passed knot moves towards the measurement with a weight [-]."""
    angle = stride.angle[0] + weight * (measurement.angle - stride.angle[0])
    heel = stride.heel_force[0] + weight * (measurement.heel_force - stride.heel_force[0])
    toe = stride.toe_force[0] + weight * (measurement.toe_force - stride.toe_force[0])
    return LearntStride((*stride.angle[1:], angle), (*stride.heel_force[1:], heel), (*stride.toe_force[1:], toe))


def knots_passed(fraction: float, next_knot: float) -> float:
    """Distance in knots from the next knot to a fraction of the stride [turns], from minus to plus half a stride."""
    in_stride = fraction - 1.0 if fraction >= 1.0 else fraction
    ahead = in_stride * KNOTS - next_knot
    ahead = ahead - KNOTS if ahead > 0.5 * KNOTS else ahead
    return ahead + KNOTS if ahead <= -0.5 * KNOTS else ahead


def is_learnt(rules: EstimatedRules, clock: _EstimatedClock) -> bool:
    """Return whether enough strides were learnt to estimate the gait phase."""
    return clock.learnt >= rules.learning_strides


def passed_knot(
    rules: EstimatedRules, clock: _EstimatedClock, gait_clock: GaitClock, learnt: float, measurement: GaitMeasurement
) -> _EstimatedClock:
    """Clock after passing a knot: the stride is learnt, and the clock corrected by a part of the estimated shift."""
    ready = is_learnt(rules, clock)
    # The first strides are averaged evenly, later ones fade in.
    stride = next_stride(clock.stride, measurement, rules.relearning if ready else 1.0 / (clock.learnt + 1.0))
    window = Window(
        angle=(*clock.window.angle[1:], measurement.angle),
        heel_force=(*clock.window.heel_force[1:], measurement.heel_force),
        toe_force=(*clock.window.toe_force[1:], measurement.toe_force),
        moved=(*clock.window.moved[1:], clock.moved),
    )
    # After a correction by more than a knot the readings of the window are not consecutive.
    is_consecutive = knots_passed(gait_clock.fraction, clock.next_knot) < 1.0
    filled = clock.filled + 1.0 if is_consecutive else 0.0
    # The mean correction of the clock since the readings of the window is part of the shift already.
    corrected = 0.0
    for index in range(WINDOW):
        corrected += window.moved[WINDOW - 1] - window.moved[index]
    corrected = corrected / WINDOW
    shift = estimated_shift(stride, window, rules) - corrected if ready & (filled >= WINDOW) else 0.0
    # No further back than the strike; a clock that is still before a detected strike is not moved back at all.
    moved = max(rules.estimate_weight * shift, min(0.0, -gait_clock.fraction))
    next_knot = clock.next_knot + 1.0
    return _EstimatedClock(
        clock=gait_clock._replace(fraction=gait_clock.fraction + moved),
        stride=stride,
        window=window,
        next_knot=next_knot - KNOTS if next_knot >= KNOTS else next_knot,
        filled=filled,
        learnt=learnt,
        moved=clock.moved + moved,
    )


def follow(
    rules: EstimatedRules,
    phase_rules: PhaseRules,
    clock: _EstimatedClock,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> _EstimatedClock:
    """Clock after a sample taken every ``period`` [s]: fractional timing until a stride is learnt, then estimated."""
    ready = is_learnt(rules, clock) & (clock.filled >= WINDOW)
    # An estimated clock is not corrected by events other than the strike, and by this only a little.
    weight, strike_weight = 0.0 if ready else rules.anchor_weight, KEEPS if ready else 1.0
    gait_clock = next_clock(rules.delays, phase_rules, clock.clock, before, phase, weight, strike_weight, period)
    # Strides count from the second known stride time on: before, the clock may have waited.
    ends = (before.strikes < phase.strikes) & (clock.clock.strides.counted > 1.5)
    time = clock.clock.strides.mean_time
    is_good = (abs(before.since_strike - time) < EVEN * time) & (phase.heel.loaded > 0.5)
    # Learning restarts after a bad stride, until enough strides are learnt.
    counted = (clock.learnt + 1.0 if is_good else 0.0) if ends else clock.learnt
    learnt = clock.learnt if is_learnt(rules, clock) else counted
    if knots_passed(gait_clock.fraction, clock.next_knot) >= 0.0:
        return passed_knot(rules, clock, gait_clock, learnt, measurement)
    return clock._replace(clock=gait_clock, learnt=learnt)


def gait_time(rules: EstimatedRules, clock: _EstimatedClock, phase: PhaseState) -> GaitTime:
    """Time since the heel strike [s], advanced by the delay of the valve."""
    return phase_time(clock.clock, rules.delays.valve_delay, phase)


ESTIMATED = TimingKind(
    name="estimated",
    summary="State estimation: a window of angle and forces fitted to a learnt stride by least squares.",
    source="Li, Becker, Shorter, Bretl, Hsiao-Wecksler, IEEE/ASME Trans Mechatronics 16 (2011) 835",
    quantities=quantities_of(EstimatedRules),
    parameters=EstimatedRules,
    initial=START,
    follow=follow,
    gait_time=gait_time,
)
