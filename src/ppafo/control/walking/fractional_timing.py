"""Fractional timing: a clock of the stride that is corrected at each detected event.

A force sensor detects an event some known time after (or, for a falling force, before) the event: the force has to
cross its threshold, the sensor lags, the change has to last, samples are taken. Fractional timing subtracts these
delays. Its clock runs at the pace of recent strides. At each detected event (heel strike, toes on the ground, heel off,
toes off) the clock is corrected to the fraction at which the event occurred in recent strides, plus the delay. An event
is thus known when the clock passes its fraction, before the sensors detect it.

The clock waits for an event that does not occur: toe contact, heel-off, toe-off or the next strike. In standing
there is no percent of gait. If heel and toes leave the ground late, the stride takes longer, and the clock continues at
the pace of this stride. After an irregular stride, as at starts, stops and stairs, nothing is predicted: events are
known when they are detected.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import FORCE_LAG, VALVE_DELAY
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.timing import GaitTime, TimingKind
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.helping import LANDING, SWING
from ppafo.model.sensors import GaitMeasurement

WAITS = 0.05
"""Fraction of the stride by which the clock passes an undetected event before it waits."""

TOO_FAR = 0.15
"""Largest deviation of an event from its fraction in recent strides that corrects the clock [turns]."""

EVEN = 0.1
"""Largest relative deviation of a regular stride from recent ones; after an irregular one nothing is predicted."""

FASTER = 0.3
"""Largest relative change of the stride time that is predicted when the foot rises."""

STRUCK, TOES_ON, HEEL_OFF, TOES_OFF = 0.0, 1.0, 2.0, 3.0
"""Events of the stride in their order, as numbers in the state of a run."""


class Delays(NamedTuple):
    """Loading and unloading rates of the forces at each event [N/s], and lags of force sensor and valve [s]."""

    heel_loading_rate: Annotated[float, Number("N/s", "loading rate of the heel at heel strike", 5.6e3, 100.0, 1.0e6)]
    toe_loading_rate: Annotated[float, Number("N/s", "loading rate of the toes at contact", 4.0e4, 100.0, 1.0e6)]
    heel_unloading_rate: Annotated[
        float, Number("N/s", "unloading rate of the heel before heel-off", 1.3e3, 100.0, 1.0e6)
    ]
    toe_unloading_rate: Annotated[
        float, Number("N/s", "unloading rate of the toes before toe-off", 7.0e3, 100.0, 1.0e6)
    ]
    sensor_lag: Annotated[
        float,
        Number(
            "s",
            "lag of the force sensors; from their bandwidth unless given",
            None,
            0.0,
            0.2,
            follows=(FORCE_LAG,),
        ),
    ]
    valve_delay: Annotated[
        float,
        Number("s", "dead time of the valve", None, 0.0, 0.2, follows=(VALVE_DELAY,)),
    ]


class Events(NamedTuple):
    """Values for the events of a stride: heel strike, toes on the ground, heel off, toes off."""

    strike: float = 0.0
    toes_on: float = 0.0
    heel_off: float = 0.0
    toes_off: float = 0.0


class _StrideTiming(NamedTuple):
    """Stride times: mean of recent strides and their number, last stride, and prediction for the present stride.

    ``mean_time``, ``last`` and ``this_time`` in [s]; ``counted`` is the number of strides in the mean; ``even`` is 1 if
    the last stride was regular. ``this_time`` is updated when heel and toes leave the ground.
    """

    mean_time: float = 0.0
    counted: float = 0.0
    last: float = 0.0
    even: float = 0.0
    this_time: float = 0.0


class GaitClock(NamedTuple):
    """Fraction of the stride [turns], last event that the clock has passed, and fractions of recent events.

    ``event_fractions`` are the fractions of the events in recent strides, 0 for an event not seen yet; ``strides`` are
    the stride times.
    """

    fraction: float = 0.0
    event: float = TOES_OFF
    event_fractions: Events = Events()
    strides: _StrideTiming = _StrideTiming()


CLOCK_START = GaitClock()


def detection_delays(delays: Delays, phase_rules: PhaseRules, period: float) -> Events:
    """Detection delay of each event [s]; negative if the force falls below its threshold before the event.

    A first-order sensor lags behind a ramp by its time constant; on average an event occurs half a period before its
    sample.
    """
    delay = delays.sensor_lag + phase_rules.debounce + 0.5 * period
    return Events(
        strike=delay + phase_rules.load_threshold / delays.heel_loading_rate,
        toes_on=delay + phase_rules.load_threshold / delays.toe_loading_rate,
        heel_off=delay - phase_rules.unload_threshold / delays.heel_unloading_rate,
        toes_off=delay - phase_rules.unload_threshold / delays.toe_unloading_rate,
    )


def detected_events(before: PhaseState, phase: PhaseState) -> Events:
    """1 for each event that is detected at this sample, else 0; heel and toes count only where possible."""
    strikes = (before.phase == SWING) & (phase.phase != SWING)
    toes_on = (before.toe.loaded < 0.5) & (phase.toe.loaded > 0.5) & (before.phase == LANDING)
    # Only with loaded toes: without them the foot leaves the ground.
    heel_off = (before.heel.loaded > 0.5) & (phase.heel.loaded < 0.5) & (phase.toe.loaded > 0.5)
    leaves = (before.phase != SWING) & (phase.phase == SWING)
    return Events(
        strike=1.0 if strikes else 0.0,
        toes_on=1.0 if toes_on else 0.0,
        heel_off=1.0 if heel_off else 0.0,
        toes_off=1.0 if leaves else 0.0,
    )


def learnt_fraction(recent: float, is_seen: float, detected: float, weight: float) -> float:
    """Updated fraction of a gait event [strides], given an optional detection (``is_seen`` 1) at ``detected``.

    ``recent`` is the fraction in recent strides, 0 for an event not seen yet.
    """
    # Limited, so that one stumble moves the fraction no further than a usual stride.
    deviation = max(-TOO_FAR, min(TOO_FAR, detected - recent))
    updated = recent + weight * deviation if recent > 0.0 else detected
    return updated if (is_seen > 0.5) & (detected > 0.0) & (detected < 1.0) else recent


def anchored_fraction(fraction: float, is_seen: float, recent: float, delay: float, weight: float) -> float:
    """Fraction [turns] corrected by an optional event, which occurred at ``recent`` in recent strides.

    ``delay`` [turns] is the detection delay of the event.
    """
    deviation = recent + delay - fraction
    # A large deviation is another event, or another gait.
    is_usable = (is_seen > 0.5) & (recent > 0.0) & (abs(deviation) < TOO_FAR)
    return fraction + weight * deviation if is_usable else fraction


def latest_fraction(phase: PhaseState, recent: Events, predicts: bool) -> float:
    """Fraction [turns] at which the clock waits for the next event to be detected.

    ``recent`` are the fractions of the events in recent strides. The clock stops before a strike that it does not
    predict.
    """
    on_ground = recent.toes_off if phase.heel.loaded < 0.5 else recent.heel_off
    on_ground = recent.toes_on if phase.phase == LANDING else on_ground
    # An event that was never seen is awaited at the end of the stride.
    awaited = on_ground if on_ground > 0.0 else 1.0
    strike = 1.0 + WAITS if predicts else 1.0 - WAITS
    return strike if phase.phase == SWING else awaited + WAITS


def last_event(clock: GaitClock, fraction: float, predicted: Events, seen: Events, phase: PhaseState) -> float:
    """Last event that has been passed; an event of unknown fraction (0) is passed when it is detected."""
    # A foot that lands on its toes has them on the ground at once.
    toes_on = (
        (seen.toes_on > 0.5)
        | ((predicted.toes_on <= 0.0) & (phase.toe.loaded > 0.5))
        | ((predicted.toes_on > 0.0) & (fraction >= predicted.toes_on))
    )
    heel_off = (seen.heel_off > 0.5) & (predicted.heel_off <= 0.0) | (
        (predicted.heel_off > 0.0) & (fraction >= predicted.heel_off)
    )
    toes_off = (seen.toes_off > 0.5) | ((predicted.toes_off > 0.0) & (fraction >= predicted.toes_off))
    in_stance = max(clock.event, TOES_ON) if toes_on else clock.event
    in_stance = max(in_stance, HEEL_OFF) if heel_off else in_stance
    in_stance = TOES_OFF if toes_off else in_stance
    is_swing = phase.phase == SWING
    struck = (seen.strike > 0.5) | (is_swing & (clock.event == TOES_OFF) & (fraction >= 1.0))
    # A clock that has passed the strike in the swing waits for it: no event of the stance comes before.
    passed = clock.event if is_swing & (clock.event == STRUCK) else in_stance
    return STRUCK if struck else passed


def next_strides(
    strides: _StrideTiming, strikes: bool, ends: bool, on_heel: bool, duration: float, first_time: float, weight: float
) -> _StrideTiming:
    """Stride times after a sample at which a stride of some ``duration`` [s] may end.

    The first strides have equal weights, later ones ``weight``. An irregular stride does not count until a second
    stride has a similar duration, which indicates a new pace. A stride that starts with the toes, or does not end, is
    not regular.
    """
    mean = strides.mean_time if strides.counted > 0.5 else first_time
    # The first stride sets the mean if it is within half and twice the setting.
    is_first = (strides.counted < 0.5) & (duration > 0.5 * mean) & (duration < 2.0 * mean)
    is_near = abs(duration - mean) < EVEN * mean
    repeats = abs(duration - strides.last) < EVEN * strides.last
    share = max(weight, 1.0 / (strides.counted + 1.0))
    # A stride near the mean is averaged; one near the last stride only is a new pace.
    updated = mean + share * (duration - mean) if is_near else 0.5 * (duration + strides.last)
    updated = duration if is_first else updated
    counts = ends & (is_first | is_near | repeats)
    mean_time = updated if counts else mean
    is_regular = counts & on_heel & (not is_first)
    return _StrideTiming(
        mean_time=mean_time,
        counted=strides.counted + 1.0 if counts else strides.counted,
        last=duration if ends else strides.last,
        even=(1.0 if is_regular else 0.0) if strikes else strides.even,
        this_time=mean_time if strikes | (strides.this_time <= 0.0) else strides.this_time,
    )


def predicted_time(strides: _StrideTiming, seen: Events, detected: Events, recent: Events, weight: float) -> float:
    """Predicted duration of the present stride [s], corrected by an early or late heel-off or toe-off.

    ``detected`` are the fractions of the events in the mean stride, ``recent`` their fractions in recent strides.
    """
    heel = (seen.heel_off > 0.5) & (recent.heel_off > 0.0)
    toes = (seen.toes_off > 0.5) & (recent.toes_off > 0.0)
    # Toe-off comes later and is more precise: it replaces the prediction by heel-off.
    pace = detected.heel_off / recent.heel_off if heel else 1.0
    pace = detected.toes_off / recent.toes_off if toes else pace
    corrected = strides.mean_time * (1.0 + weight * (max(1.0 - FASTER, min(1.0 + FASTER, pace)) - 1.0))
    return corrected if heel | toes else strides.this_time


def struck_fraction(fraction: float, target: float, weight: float) -> float:
    """Fraction [turns] at a detected strike: moved towards ``target`` by a weight, or set to it if far off."""
    deviation = target + 1.0 - fraction
    return fraction + weight * deviation - 1.0 if abs(deviation) < TOO_FAR else target


def next_clock(
    delays: Delays,
    phase_rules: PhaseRules,
    clock: GaitClock,
    before: PhaseState,
    phase: PhaseState,
    weight: float,
    strike_weight: float,
    period: float,
) -> GaitClock:
    """Clock after a sample; a detected strike corrects it by ``strike_weight``, later events by ``weight``."""
    delay, seen = detection_delays(delays, phase_rules, period), detected_events(before, phase)
    strikes = seen.strike > 0.5
    # The first strike ends no stride, because a walk may begin in mid-stance.
    ends = strikes & (before.strikes > 1.5)
    duration = before.since_strike + period
    on_heel, usual = phase.heel.loaded > 0.5, phase_rules.stride_weight
    strides = next_strides(clock.strides, strikes, ends, on_heel, duration, phase.stride_time, usual)

    # The strike itself was detected late, which adds its delay to the time since the strike.
    since_strike = phase.since_strike + delay.strike
    detected = Events(
        toes_on=(since_strike - delay.toes_on) / strides.mean_time,
        heel_off=(since_strike - delay.heel_off) / strides.mean_time,
        toes_off=(since_strike - delay.toes_off) / strides.mean_time,
    )
    last = clock.event_fractions
    stride, predicts = predicted_time(strides, seen, detected, last, weight), strides.even > 0.5
    # Fractions are learnt only in strides of a known time.
    learns = predicts | (strides.counted < 1.5) & (strides.counted > 0.5)
    share = max(usual, 1.0 / max(strides.counted, 1.0))
    recent = Events(
        toes_on=learnt_fraction(last.toes_on, seen.toes_on, detected.toes_on, share) if learns else last.toes_on,
        heel_off=learnt_fraction(last.heel_off, seen.heel_off, detected.heel_off, share) if learns else last.heel_off,
        toes_off=learnt_fraction(last.toes_off, seen.toes_off, detected.toes_off, share) if learns else last.toes_off,
    )

    # The fraction after the sample, corrected by the events detected in it.
    fraction = clock.fraction + period / stride
    fraction = anchored_fraction(fraction, seen.toes_on, last.toes_on, delay.toes_on / stride, weight)
    fraction = anchored_fraction(fraction, seen.heel_off, last.heel_off, delay.heel_off / stride, weight)
    fraction = anchored_fraction(fraction, seen.toes_off, last.toes_off, delay.toes_off / stride, weight)
    at_strike = struck_fraction(fraction, delay.strike / stride, strike_weight)
    fraction = at_strike if strikes else min(fraction, latest_fraction(phase, recent, predicts))
    predicted = Events(
        toes_on=recent.toes_on if predicts else 0.0,
        heel_off=recent.heel_off if predicts else 0.0,
        toes_off=recent.toes_off if predicts else 0.0,
    )
    event = last_event(clock, fraction, predicted, seen, phase)
    return GaitClock(fraction=fraction, event=event, event_fractions=recent, strides=strides._replace(this_time=stride))


def phase_time(clock: GaitClock, lead: float, phase: PhaseState) -> GaitTime:
    """Gait time of a clock, advanced by a ``lead`` [s]; after a regular stride the next strike is anticipated.

    After an irregular stride the strike is awaited. The time is the fraction times the stride time of the phases,
    because the law divides by that stride time again; 0 s at the start, and where a detected strike is ahead of the
    clock.
    """
    stride_time = phase.stride_time if phase.stride_time > 0.0 else 1.0
    ahead = clock.fraction + lead / stride_time
    comes = (phase.phase == SWING) & (ahead >= 1.0) & (clock.fraction < 1.0 + WAITS)
    expected = comes & (clock.strides.even > 0.5)
    fraction = ahead - 1.0 if expected else ahead
    time = max(0.0, fraction) * stride_time
    return GaitTime(time, 1.0 if (phase.phase == LANDING) | expected else 0.0)


AnchorWeight = Annotated[
    float, Number("1", "weight of events after heel strike in the phase correction, 1: full correction", 0.8, 0.0, 1.0)
]


class _FractionalRules(NamedTuple):
    """Known delays, and correction of the clock per event after the strike [-]."""

    delays: Delays
    anchor_weight: AnchorWeight


def follow_fraction(
    rules: _FractionalRules,
    phase_rules: PhaseRules,
    clock: GaitClock,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> GaitClock:
    """Clock after a sample taken every ``period`` [s]; a detected strike resets it."""
    return next_clock(rules.delays, phase_rules, clock, before, phase, rules.anchor_weight, 1.0, period)


def fractional_time(rules: _FractionalRules, clock: GaitClock, phase: PhaseState) -> GaitTime:
    """Time since the heel strike [s], advanced by the delay of the valve."""
    return phase_time(clock, rules.delays.valve_delay, phase)


FRACTIONAL = TimingKind(
    name="fractional",
    summary="Percent of gait: time since the heel strike over recent stride times, known delays taken off.",
    source="fractional timing, usual in the field; anchored anew at each detected event",
    quantities=quantities_of(_FractionalRules),
    parameters=_FractionalRules,
    initial=CLOCK_START,
    follow=follow_fraction,
    gait_time=fractional_time,
)
