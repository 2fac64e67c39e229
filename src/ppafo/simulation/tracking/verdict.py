"""Verdict on a run: whether it follows its reference, the cause of a failure, and remedies that were tried."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.case import Case, TrackingCause
from ppafo.simulation.tracking.causes import CAUSES_OF_TASK
from ppafo.simulation.tracking.load_causes import cuts_wave, torque_beyond_reach
from ppafo.simulation.tracking.remedies import Remedy, change_text
from ppafo.simulation.tracking.rule import (
    CRITERION_TEXTS,
    LARGEST_MEAN_SWITCHED,
    LARGEST_SHARE,
    LARGEST_SHARE_OF_WAVE,
    LEAST_PEAK_WALK,
    REVERSALS,
    Criterion,
    Failure,
    deviation_limit,
    failure_of_task,
    failure_of_walk,
    is_noisy,
    most_reversals,
    only_switches,
    rms_error_limit,
)
from ppafo.simulation.tracking.settled import settled_task, settled_walk
from ppafo.simulation.tracking.shortfall import shortfall
from ppafo.simulation.tracking.walk_causes import CAUSES_OF_WALK
from ppafo.units.shown import in_units, units_in_force
from ppafo.wording import override_text, without_exponent

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import RecordedResult

_FEWEST_SAMPLES, _SAMPLES_ADVISED = 8, 100
"""Smallest number of samples of a recording for a verdict, and number of samples that a remedy gives it."""
_QUIET = 0.2
"""Command reversals per second at the end of a run, divided by those of the whole run, below which a loop is quiet."""
_MOST_DOUBLINGS = 11
"""Number of durations that are looked at for a reference that rests, each twice the one before."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """Verdict on a run whose controlled quantity does not follow its reference.

    ``kind`` is the kind of failure. ``error`` is the RMS error of the settled part, ``wanted`` the wanted change,
    ``missing`` the mean error and ``moved`` the range of the value, all in SI of the ``controlled`` quantity.
    ``reversals`` is the number of command reversals per stride or second, as ``per`` says. ``cause`` is the cause, with
    ``advice``; ``remedies`` are the remedies, most promising first; ``others`` are further, less certain causes;
    ``tried`` is the result of tried remedies, and ``mended`` the overrides with which the run follows. ``accepted`` is
    the scenario's reason for a reference beyond reach, else "". ``at_rest`` is true if reference and joint stand still.
    ``since`` [s] is the start of the settled part, 0 for a walk. ``span`` is the range of the error of an angle that
    swings slowly, or of on/off valves whose RMS error alone is within its limit, else 0. ``criterion`` names the number
    ``worst`` of the settled part that is above its limit ``allowed``; other kinds of failure leave all three empty.
    """

    kind: Failure
    controlled: str
    error: float
    wanted: float
    missing: float
    moved: float
    reversals: float
    per: str
    cause: str
    advice: str
    remedies: tuple[Remedy, ...] = ()
    others: tuple[TrackingCause, ...] = ()
    accepted: str = ""
    tried: str = ""
    mended: tuple[str, ...] = ()
    at_rest: bool = True
    since: float = 0.0
    span: float = 0.0
    criterion: Criterion | Literal[""] = ""
    worst: float = 0.0
    allowed: float = 0.0
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    def is_useless(self) -> bool:
        """False if the scenario declares its reference to be beyond reach."""
        return not self.accepted

    @property
    @in_units(lambda tracking: tracking.units)
    def sentence(self) -> str:
        """Verdict in one line."""
        remedies = [remedy.text for remedy in self.remedies[:2]]
        order = ", the more promising one first" if len(remedies) > 1 else ""
        untried = f"to try{order}: {'; '.join(remedies)}" if remedies else self.advice
        last = f"intended: {self.accepted}" if self.accepted else self.tried or untried
        return "; ".join(filter(None, (self.found, self.cause, last)))

    @property
    @in_units(lambda tracking: tracking.units)
    def found(self) -> str:
        """Failure with the number that decided, without cause and remedy."""
        words, since = CONTROLLED[self.controlled].words, time_text(self.since)
        numbers = (self.error, self.wanted, self.moved, self.span)
        error, wanted, moved, swing = (change_text(self.controlled, each) for each in numbers)
        plain_moved = moved.partition(" ")[0]
        if self.kind == "does not move":
            return f"the {words} loop does not move: {plain_moved} of the requested {wanted}"
        if self.kind == "oscillates":
            if self.span:
                return f"the {words} swings by {swing} (requested change {wanted}){since}"
            often = f"{without_exponent(self.reversals, '.3g')} reversals a {self.per}"
            return f"the {words} loop oscillates: {often}, RMS error {error} (requested {wanted}){since}"
        if self.kind == "overshoots":
            return f"the {words} overshoots: {plain_moved} instead of at most {wanted}"
        is_constant = abs(self.missing) > max(0.9 * self.error, self.allowed)
        if is_constant and self.at_rest and self.criterion in ("RMS error", "mean error"):
            side = "below" if self.missing < 0.0 else "above"
            missing, allowed = _error_and_limit(self.controlled, abs(self.missing), self.allowed)
            return f"the {words} stays {missing} {side} its reference ({allowed} allowed)"
        worst, allowed = _error_and_limit(self.controlled, self.worst, self.allowed)
        criterion = CRITERION_TEXTS.get(self.criterion, self.criterion)
        return f"the {words} does not follow its reference: {criterion} {worst} ({allowed} allowed){since}"


def _error_and_limit(controlled: str, error: float, limit: float) -> tuple[str, str]:
    """Error and limit with their unit, in three digits, or in as many as distinguish the two."""
    pairs = [(change_text(controlled, error, count), change_text(controlled, limit, count)) for count in range(3, 17)]
    return next((pair for pair in pairs if pair[0] != pair[1]), pairs[0])


@in_units(lambda result: result.scenario.device.shown)
def tracking_in(result: "RecordedResult") -> Tracking | None:
    """Verdict on a result; None if the result follows its reference, or has none."""
    judged, scenario = _judged(result), result.scenario
    if judged is None or (failure := judged[0].failure) is None:
        return None
    case, turning, per_second = judged
    settled, is_task = case.settled, scenario.follows_reference
    found = (find(case) for find in (CAUSES_OF_TASK if is_task else CAUSES_OF_WALK))
    cause, *others = (each for each in found if each is not None)
    # Reversals of the value where these fail, else of the command, as also of a controller that declares nothing.
    if settled.error_reversals and turning <= 1.0 and (case.law is not None or per_second == 0.0):
        per_second = settled.error_reversals / settled.duration
    overshoots, stride_time = failure == "overshoots", scenario.motion.stride_time
    # A loop that is quiet at the end reversed before the part whose error is stated.
    is_over = turning > 1.0 and settled.command_reversal_rate < _QUIET * per_second
    interval = "second of the whole run" if is_over else "second"
    criteria = _criteria(case)
    is_within = is_task and not criteria[0][1] > criteria[0][2]
    decided = next((each for each in criteria if each[1] > each[2]), criteria[-1])
    criterion, worst, allowed = decided
    fails = failure == "does not follow"
    is_slow_swing = settled.reference_range > 0.0 and not settled.error_reversals
    is_swing = is_slow_swing or (is_within and case.only_switches and settled.error_range > criteria[2][2])
    return Tracking(
        kind=failure,
        controlled=scenario.controlled,
        error=settled.rms_error,
        wanted=scenario.controller.settings["largest_torque"] if overshoots and not is_task else settled.wanted_change,
        missing=settled.mean_error,
        moved=settled.peak if overshoots else settled.value_range,
        reversals=per_second * (stride_time or 1.0),
        per="stride" if stride_time else interval,
        cause=cause.text,
        advice=cause.advice,
        remedies=cause.remedies,
        others=tuple(other for other in others if other.remedies and other.text != cause.text),
        accepted=scenario.beyond_reach if cause.is_beyond_reach else "",
        at_rest=settled.rests and not case.is_approaching,
        since=settled.start,
        criterion=criterion if fails else "",
        worst=worst if fails else 0.0,
        allowed=allowed if fails else 0.0,
        span=settled.error_range if failure == "oscillates" and turning <= 1.0 and is_swing else 0.0,
    )


@in_units(lambda result: result.scenario.device.shown)
def following_text(result: "RecordedResult") -> str:
    """Sentence on a result that follows its reference, with errors and their limits, or the reason for no verdict.

    Returns "" for a result that does not follow, and for one without a reference.
    """
    scenario, controlled = result.scenario, CONTROLLED[result.scenario.controlled]
    if scenario.controller.is_open_loop or controlled_in(result.recording) is None:
        return ""
    judged = _judged(result)
    # A walk without a requested torque has nothing to follow.
    if judged is None:
        reason = f"{len(result.recording)} samples are too few"
        return _undecided_text(scenario, reason) if scenario.follows_reference else ""
    case, settled = judged[0], judged[0].settled
    if case.failure is not None:
        return ""
    if settled.is_undecided:
        left = f"with an RMS error of {change_text(controlled.name, settled.rms_error)}{time_text(settled.start)}"
        if settled.ends_on_ramp:
            return _undecided_text(scenario, f"the run ends on the ramp of its reference, {left}")
        short = f"the second half of the run has only {settled.reference_periods:.2g} periods of the reference"
        longer = override_text([f"run.duration={2.0 * scenario.run.duration / settled.reference_periods:.3g} s"])
        return f"no verdict on the {controlled.words}: {short}, {left}; not tried: {longer} should give one"

    errors = []
    for number, (name, error, limit) in enumerate(_criteria(case)[:3:2]):
        # The limit of on/off valves is several times wider, so the swing is reported beside the error.
        is_widened = case.only_switches and scenario.follows_reference and number == 0
        reason = ", because the valves are either open or shut" if is_widened else ""
        error_text, limit_text = _error_and_limit(controlled.name, error, limit)
        if name == "swing" and case.only_switches:
            error_text += f", {100.0 * error / settled.wanted_change:.0f} % of the requested change"
        errors.append(f"{name} {error_text}" + ("" if math.isinf(limit) else f" ({limit_text} allowed{reason})"))
    # The interval stands before the errors: metrics of the same names cover the whole run.
    verdict = f"the {controlled.words} follows its reference;{time_text(settled.start)}: {', '.join(errors)}"
    # A reference just beyond reach is missed by no more than is allowed.
    beyond = torque_beyond_reach(case) if scenario.follows_reference else None
    return verdict if beyond is None else f"{verdict}; {beyond.text}"


def _criteria(case: Case) -> tuple[tuple[Criterion, float, float], ...]:
    """Errors of the settled part that may be above their limits: name, number and limit [SI], most telling first."""
    scenario, settled, switches = case.scenario, case.settled, case.only_switches
    mean, wanted, asked = abs(settled.mean_error), settled.wanted_change, settled.requested_peak
    if not scenario.follows_reference:
        return (
            ("RMS error", settled.rms_error, LARGEST_SHARE_OF_WAVE * wanted),
            ("missing peak torque", asked - settled.given_peak, (1.0 - LEAST_PEAK_WALK) * asked),
        )
    beyond = float(np.max(shortfall(scenario)))
    deviation = settled.error_range if settled.rests else settled.largest_error
    is_cut = beyond > mean and not settled.rests
    reach: Criterion = "any reach" if scenario.motion.locked_angle is None else "reach"
    return (
        ("RMS error", settled.rms_error, float(rms_error_limit(settled, switches))),
        ("mean error", mean, LARGEST_MEAN_SWITCHED * wanted if switches and settled.rests else math.inf),
        ("swing" if settled.rests else "largest error", deviation, float(deviation_limit(settled, switches))),
        (reach if is_cut else "mean error", beyond if is_cut else mean, LARGEST_SHARE * wanted),
    )


def is_undecided(result: "RecordedResult") -> bool:
    """True if the settled part of a result is no basis for the verdict that the result follows its reference."""
    judged = _judged(result)
    return judged is not None and bool(judged[0].settled.is_undecided)


def _undecided_text(scenario: Scenario, reason: str) -> str:
    """Reason why a task has no verdict, and untried times with which its reference rests before the end."""
    run, choice, count = scenario.run, scenario.reference, _SAMPLES_ADVISED
    longer = [2.0**power * run.duration for power in range(1, _MOST_DOUBLINGS)]
    trials = [(run.duration, choice, list[str]())]
    trials += [(duration, choice, [f"run.duration={duration:.12g} s"]) for duration in longer]
    if "ramp_time" in choice.settings:
        ramp = float(f"{0.25 * run.duration:.12g}")
        shorter = replace(choice, settings={**choice.settings, "ramp_time": ramp})
        trials.append((run.duration, shorter, [f"reference.ramp_time={ramp!r} s"]))
    remedy = "a reference that rests before the end of the run"
    for duration, tried, changes in trials:
        reference = profile_values(tried, np.linspace(0.0, duration, count))[0]
        ways = np.diff(reference) * (reference[-1] - reference[0])
        if duration >= count * run.step and not (np.all(ways >= 0.0) and ways[count // 2 :].any()):
            finer = [f"run.output_interval={duration / count:.12g} s"] if run.output_interval > duration / count else []
            remedy = override_text([*changes, *finer])
            break
    return f"no verdict on the {CONTROLLED[scenario.controlled].words}: {reason}; not tried: {remedy} should give one"


def time_text(since: float) -> str:
    """Words for the judged part: of a task from a time [s] on, of a walk, with 0, where a torque is requested."""
    return f" from {since:.3g} s on" if since > 0.0 else " where a torque is requested"


def _judged(result: "RecordedResult") -> tuple[Case, float, float] | None:
    """Run with its tracking failure, if any, and rates of command reversals; None if the run is not judged.

    The further numbers are the command reversals divided by the limit [-], and the reversals per second.
    """
    scenario, law, recording = result.scenario, result.scenario.law, result.recording
    is_task = scenario.follows_reference
    is_unknown = is_task and controlled_in(recording) is None
    if len(recording) < _FEWEST_SAMPLES or scenario.controller.is_open_loop or is_unknown:
        return None
    limit = 0.0 if is_task else float(scenario.controller.settings.get("largest_torque", 0.0))
    settled = settled_task(scenario, recording) if is_task else settled_walk(recording, limit)
    if settled is None:
        return None
    reversals = result.metrics[REVERSALS].value if REVERSALS in result.metrics else 0.0
    counted = settled.command_reversal_rate * max(recording.duration, 1.0) if is_noisy(scenario) else reversals
    turning = counted / most_reversals(scenario, recording.duration)
    if is_task:
        failure = failure_of_task(settled, turning, only_switches(scenario, law))
    else:
        failure = failure_of_walk(settled, turning, limit)
    case = Case(scenario=scenario, law=law, recording=recording, settled=settled, failure=failure)
    # No oscillation: an error at the cut peaks of a wave, which reverses more often than the wave, and a slow approach.
    if failure == "oscillates" and turning <= 1.0 and is_task and (cuts_wave(case) or case.is_approaching):
        return case._replace(failure="does not follow"), turning, reversals / recording.duration
    # A run that ends on its ramp has not yet requested its largest torque.
    beyond = float(np.max(shortfall(scenario))) if is_task and not settled.ends_on_ramp else 0.0
    # A pair swings by design, so that a torque beyond reach shows in the mean error rather than in the RMS error. The
    # mean error of a wave does not show its peaks.
    missing = abs(settled.mean_error) if settled.rests else max(abs(settled.mean_error), beyond)
    if failure is None and beyond > 0.0 and missing > LARGEST_SHARE * settled.wanted_change:
        case = case._replace(failure="does not follow")
    return case, turning, reversals / recording.duration
