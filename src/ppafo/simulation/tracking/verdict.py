"""Verdict on a run: whether it follows its reference, the cause of a failure, remedies; and remarks beside it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.documents.json_text import plain
from ppafo.metrics.metric import controlled_in, extent
from ppafo.metrics.settled import (
    IN_PUSH_OFF,
    LARGEST_EXCUSED,
    LARGEST_SHARE,
    LARGEST_SHARE_OF_WAVE,
    MOST_REVERSALS,
    SettledPart,
)
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.model.plant import gravity_torque
from ppafo.parameters.overrides import read_overrides
from ppafo.parameters.reach import torque_reach
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.tracking.case import Case, change_text, level_text
from ppafo.simulation.tracking.evidence import (
    ON_STOP,
    Evidence,
    cuts_wave,
    evidence_in,
    stop_of,
    torque_beyond_reach,
    torque_peaks,
)
from ppafo.simulation.tracking.rule import (
    CRITERION_TEXTS,
    LARGEST_PEAK,
    LARGEST_PEAK_WALK,
    LEAST_PEAK_WALK,
    ON_PURPOSE,
    REVERSALS,
    SMALLEST_MOVE,
    Criterion,
    Failure,
    available_torque,
    excess_of_part,
    failure_of_task,
    failure_of_walk,
    is_noisy,
    misses_for_reach,
    most_reversals,
    only_switches,
    part_limits,
    settled_walk,
    task_parts,
)
from ppafo.units.shown import in_units
from ppafo.wording import override_text, without_exponent

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import RecordedResult

# Smallest number of samples of a recording for a verdict, and number of samples that a remedy gives it.
_FEWEST_SAMPLES = 8
_SAMPLES_ADVISED = 100
_UNLIMITED = 1.0
"""Limit divided by the wanted change, from which it is none to speak of [-]."""
_LEAST = 1.0e-9
"""Smallest weight of an error, and limit [SI], by which something is divided."""
_MOST_DOUBLINGS = 11
"""Number of durations that are looked at for a reference that rests, each twice the one before."""


# Reasons for no verdict.
OPEN_LOOP = "open loop"
NO_REFERENCE = "no reference"
TOO_SHORT = "too short"
_LOCKED = ("motion.kind=locked",)
"""Remedy for a free joint that nothing resists."""
_Judged = tuple[Criterion, float, float]
"""Criterion, number and limit [SI; of reversals per second or stride]."""
NOTHING_TO_FOLLOW = (OPEN_LOOP, NO_REFERENCE)
"""Reasons of runs that have nothing to follow."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """Verdict on a run: whether its controlled quantity follows its reference.

    ``follows`` is None for a run that is not judged, for the ``reason``; it is False, here and in every study, also for
    a run that misses its reference because that is beyond reach on purpose. ``kind`` is the kind of failure of a run
    that does not follow, else "". ``criterion`` names the ``number`` that decided, with its ``limit``; both are None
    without it. ``said`` is the sentence on a run that follows or is not judged.

    Of a run that does not follow, ``found`` is the failure with the number that decided and its limit. ``error`` is
    the RMS error of the judged part, ``wanted`` the wanted change, ``missing`` the mean error and ``moved`` the range
    of the value, all in SI of the ``controlled`` quantity. In the time ``per`` reversals are counted. ``since`` [s] is
    the start of the judged part, below 0 for a walk, and ``until`` [s] its end, 0 for the end of the run; ``when`` says
    it. ``evidence`` are numbers of the run, each with the changes that would make it a cause. ``cause`` are the changes
    with which further runs follow, ``tried`` is the remedy among them, and ``mended`` its overrides, all of which
    ``ppafo.counterfactuals`` finds. ``accepted`` is the scenario's reason for a torque beyond reach, if that alone
    keeps the run from its reference, else "".
    """

    follows: bool | None
    controlled: str
    reason: str = ""
    said: str = ""
    kind: Failure | Literal[""] = ""
    criterion: Criterion | Literal[""] = ""
    number: float | None = None
    limit: float | None = None
    found: str = ""
    error: float = 0.0
    wanted: float = 0.0
    missing: float = 0.0
    moved: float = 0.0
    per: str = ""
    since: float = 0.0
    until: float = 0.0
    when: str = ""
    evidence: tuple[Evidence, ...] = ()
    cause: str = ""
    accepted: str = ""
    tried: str = ""
    mended: tuple[str, ...] = ()

    @property
    def fails(self) -> bool:
        """True if the run does not follow its reference."""
        return self.follows is False

    @property
    def is_useless(self) -> bool:
        """True if the run does not follow its reference, which its scenario does not declare to be beyond reach."""
        return self.fails and not self.accepted

    @property
    def passes(self) -> bool:
        """True if the run follows its reference, misses it on purpose, or has nothing to follow."""
        return bool(self.follows or self.accepted) or self.reason in NOTHING_TO_FOLLOW

    def json_document(self) -> dict[str, Any]:
        """Verdict as plain data, with its sentence, and the third state by the name that studies have for it."""
        numbers = {field.name: plain(getattr(self, field.name)) for field in fields(self)}
        return {**numbers, ON_PURPOSE: bool(self.accepted), "sentence": self.sentence}

    @property
    def sentence(self) -> str:
        """Verdict in one line; "" if there is nothing to follow."""
        if not self.fails:
            return self.said
        last = f"intended: {self.accepted}" if self.accepted else self.tried
        return "; ".join(filter(None, (self.found, self.cause, last)))


def _distinct(form: Callable[[float, int], Any], number: float, limit: float) -> tuple[Any, Any]:
    """Number and limit by ``form`` in three digits, or in as many as distinguish the two."""
    pairs = [(form(number, digits), form(limit, digits)) for digits in range(3, 17)]
    return next((pair for pair in pairs if pair[0] != pair[1]), pairs[0])


@in_units(lambda result: result.scenario.device.shown)
def tracking_in(result: "RecordedResult") -> Tracking:
    """Verdict on a result: it follows its reference, does not, or is not judged, for a reason."""
    scenario = result.scenario
    name = result.scenario.controlled
    if scenario.controller.is_open_loop:
        return Tracking(None, name, OPEN_LOOP)
    if not result.status.is_completed and result.status.kind == "diverged":
        return Tracking(None, name, "diverged")
    if scenario.follows_reference and controlled_in(result.recording) is None:
        return Tracking(None, name, NO_REFERENCE)
    if len(result.recording) < _FEWEST_SAMPLES:
        reason = f"{len(result.recording)} samples are too few"
        return Tracking(None, name, TOO_SHORT, _undecided_text(scenario, reason) if scenario.follows_reference else "")
    judged = _judged(result)
    # A walk without a requested torque has nothing to follow.
    if judged is None:
        return Tracking(None, name, NO_REFERENCE)
    return _following(*judged) if judged[0].failure is None else _failing(*judged)


def _failing(case: Case, turning: float, rate: float) -> Tracking:
    """Verdict on a run that does not follow; ``turning`` and ``rate`` [1/s] as of ``_judged``."""
    assert case.failure is not None
    criterion, number, limit, found = _decided(case, turning, rate)
    settled = case.settled
    walks = not case.scenario.follows_reference
    settings = case.scenario.controller.settings
    wanted = settings["largest_torque"] if case.overshoots and walks else settled.wanted_change
    return Tracking(
        follows=False,
        controlled=case.scenario.controlled,
        kind=case.failure,
        criterion=criterion,
        number=number,
        limit=limit,
        found=found,
        error=settled.rms_error,
        wanted=wanted if walks else min(wanted, extent(case.recording)),
        missing=settled.mean_error,
        moved=settled.peak if case.overshoots else settled.value_range,
        per="stride" if case.scenario.motion.stride_time else "second",
        since=settled.start,
        until=settled.end,
        when=_time_text(settled),
        evidence=tuple(evidence_in(case)),
        cause=torque_beyond_reach(case) if case.is_for_reach else "",
        accepted=case.scenario.beyond_reach if case.is_for_reach else "",
    )


def _decided(case: Case, turning: float, rate: float) -> tuple[Criterion, float, float, str]:
    """Criterion of a failure, number and limit that decided [SI; of reversals per second or stride], all in words."""
    scenario = case.scenario
    settled = case.settled
    when = _time_text(case.settled)
    walks = not scenario.follows_reference
    text = partial(change_text, scenario.controlled)
    words = CONTROLLED[scenario.controlled].words
    change = settled.wanted_change
    wanted = text(change if walks else min(change, extent(case.recording)))
    if case.failure == "does not move":
        moved = text(settled.value_range).partition(" ")[0]
        at = when if settled.end > 0.0 else ""
        found = f"the {words} loop does not move: {moved} of the requested {wanted}{at}"
        return "movement", settled.value_range, SMALLEST_MOVE * change, found
    if case.overshoots:
        largest = scenario.controller.settings["largest_torque"] if walks else change
        limit = (LARGEST_PEAK_WALK if walks else LARGEST_PEAK) * largest
        peak = text(settled.peak).partition(" ")[0]
        most = text(largest) if walks else wanted
        allowed = _distinct(text, settled.peak, limit)[1]
        return (
            "peak",
            settled.peak,
            limit,
            f"the {words} overshoots: {peak} instead of at most {most} ({allowed} allowed)",
        )
    criteria = _criteria(case)
    criterion, number, limit = next((each for each in criteria if each[1] > each[2]), criteria[-1])
    if case.oscillates:
        swing = next((each for each in criteria if each[0] == "swing"), criteria[0])
        is_swing = swing[1] > swing[2] and (not case.only_switches or criteria[0][1] <= criteria[0][2])
        reverses = settled.error_reversals > MOST_REVERSALS and not is_swing and not case.only_switches
        if turning > 1.0 or reverses:
            is_of_command = turning > 1.0 and not is_noisy(scenario)
            criterion = "command reversals" if is_of_command else "reversals"
            per = scenario.motion.stride_time or 1.0
            number, limit = (
                (rate * per, rate / turning * per)
                if turning > 1.0
                else (settled.error_reversals / settled.duration, MOST_REVERSALS / settled.duration)
            )
            rounded = _distinct(lambda each, digits: float(f"{each:.{digits}g}"), number, limit)
            often, most = (without_exponent(each, ".3g") for each in rounded)
            unit = "stride" if scenario.motion.stride_time else "second"
            span = f"a {unit} of the whole run" if is_of_command else f"a {unit}"
            found = f"{often} {criterion} {span} ({most} allowed), RMS error {text(settled.rms_error)}"
            return criterion, number, limit, f"the {words} loop oscillates: {found} (requested {wanted}){when}"
        criterion, number, limit = swing if is_swing else (criterion, number, limit)
    found, allowed = _distinct(text, number, limit)
    if case.oscillates and criterion == "swing":
        said = f"the {words} swings by {found} ({allowed} allowed; requested change {wanted}){when}"
    elif case.oscillates:
        said = f"the {words} loop oscillates: {criterion} {found} ({allowed} allowed){when}"
    else:
        name = CRITERION_TEXTS.get(criterion, criterion)
        said = f"the {words} does not follow its reference: {name} {found} ({allowed} allowed){when}"
    missing = settled.mean_error
    is_at_rest = settled.rests and not case.is_approaching
    is_constant = abs(missing) > max(0.9 * settled.rms_error, limit) and criterion in ("RMS error", "mean error")
    if not case.oscillates and is_at_rest and is_constant:
        found, allowed = _distinct(text, abs(missing), limit)
        begins = f"{when.strip()} " if settled.end > 0.0 else ""
        side = "below" if missing < 0.0 else "above"
        said = f"{begins}the {words} stays {found} {side} its reference ({allowed} allowed)"
    return criterion, number, limit, said


def _following(case: Case, _turning: float, _rate: float) -> Tracking:
    """Verdict on a run that follows its reference, or that says too little for a verdict."""
    scenario = case.scenario
    settled = case.settled
    controlled = CONTROLLED[case.scenario.controlled]
    criteria = _criteria(case)
    name, number, limit = max(criteria, key=lambda each: each[1] / max(each[2], _LEAST))
    verdict = Tracking(True, controlled.name, "", "", "", name, number, limit, since=settled.start)
    since = _time_text(settled)
    if settled.is_undecided:
        left = f"with an RMS error of {change_text(controlled.name, settled.rms_error)}{since}"
        if settled.ends_on_ramp:
            said = _undecided_text(scenario, f"the run ends on the ramp of its reference, {left}")
        else:
            short = f"the judged part has only {settled.reference_periods:.2g} periods of the reference"
            duration = 2.0 * scenario.run.duration / settled.reference_periods
            longer = override_text([f"run.duration={duration:.3g} s"])
            said = f"no verdict on the {controlled.words}: {short}, {left}; not tried: {longer} should give one"
        return replace(verdict, follows=None, reason=TOO_SHORT, said=said)

    errors = []
    for each, error, limit in criteria:
        shown = "RMS error", "missing peak torque", "excess peak torque", "swing" if settled.rests else "largest error"
        if each not in shown:
            continue
        # The limit of on/off valves is several times wider, so the swing is reported beside the error.
        is_widened = case.only_switches and scenario.follows_reference and each == "RMS error"
        reason = ", because the valves are either open or shut" if is_widened else ""
        error_text, limit_text = _distinct(partial(change_text, controlled.name), error, limit)
        if each == "swing" and case.only_switches:
            error_text += f", {100.0 * error / settled.wanted_change:.0f} % of the requested change"
        is_limited = limit < _UNLIMITED * settled.wanted_change
        errors.append(f"{each} {error_text}" + (f" ({limit_text} allowed{reason})" if is_limited else ""))
    overshoot = settled.peak - settled.wanted_change
    way = ""
    if scenario.follows_reference and not case.only_switches and overshoot > LARGEST_SHARE * settled.wanted_change:
        way = f"; on the way it overshoots by {change_text(controlled.name, overshoot)}"
    # The interval stands before the errors: metrics of the same names cover the whole run.
    said = f"the {controlled.words} follows its reference;{since}: {', '.join(errors)}{way}"
    # A reference just beyond reach is missed by no more than is allowed.
    beyond = torque_beyond_reach(case) if scenario.follows_reference else ""
    return replace(verdict, said="; ".join(filter(None, (said, beyond))))


def _criteria(case: Case) -> tuple[_Judged, ...]:
    """Errors of the judged part that may be above their limits: name, number and limit [SI], most telling first."""
    scenario = case.scenario
    settled = case.settled
    switches = case.only_switches
    mean = abs(settled.mean_error)
    wanted = settled.wanted_change
    asked = settled.requested_peak
    if not scenario.follows_reference:
        missing = asked - settled.given_peak
        peak: _Judged = ("missing peak torque", missing, (1.0 - LEAST_PEAK_WALK) * asked)
        if missing < 0.0 < asked:
            peak = ("excess peak torque", -missing, (LARGEST_PEAK_WALK - 1.0) * asked)
        of_request: _Judged = ("RMS error", settled.rms_error, LARGEST_SHARE_OF_WAVE * wanted)
        return (peak,) if settled.start == IN_PUSH_OFF else (of_request, peak)
    reach: Criterion = "any reach" if scenario.motion.locked_angle is None else "reach"
    # On a quick ramp an error is allowed that would be none at rest.
    weight = max(float(settled.weight * settled.share), _LEAST)
    rms, of_mean, swing, largest = (float(limit) / weight for limit in part_limits(settled, switches))
    return (
        ("RMS error", settled.rms_error, rms),
        ("mean error", mean, of_mean),
        ("swing", settled.error_range, swing),
        ("largest error", settled.largest_error, min(largest, LARGEST_EXCUSED * settled.way)),
        *([(reach, settled.beyond_reach, LARGEST_SHARE * wanted)] if settled.beyond_reach > 0.0 else []),
    )


def _undecided_text(scenario: Scenario, reason: str) -> str:
    """Reason why a task has no verdict, and untried times with which its reference rests before the end."""
    run = scenario.run
    choice = scenario.reference
    count = _SAMPLES_ADVISED
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


def _time_text(settled: SettledPart) -> str:
    """Words for the judged part: of a task its times, of a walk where a torque is requested."""
    since = f" from {settled.start:.3g} s"
    if settled.end > 0.0:
        return f"{since} to {settled.end:.3g} s"
    where = " in push-off" if settled.start == IN_PUSH_OFF else " where a torque is requested"
    return f"{since} on" if settled.start >= 0.0 else where


def _judged(result: "RecordedResult") -> tuple[Case, float, float] | None:
    """Run with its tracking failure, if any, and its command reversals; None for a walk that requests no torque.

    The case is that of the last part of the reference, or of the worst earlier one if it fails more. The further
    numbers are the command reversals divided by the limit [-], and the reversals per second that were counted.
    """
    scenario = result.scenario
    recording = result.recording
    reversals = result.metrics[REVERSALS].value if REVERSALS in result.metrics else 0.0
    per = max(recording.duration, 1.0)
    most = most_reversals(scenario, recording.duration)
    if not scenario.follows_reference:
        limit = float(scenario.controller.settings.get("largest_torque", 0.0))
        settled = settled_walk(recording, limit, float(np.max(available_torque(scenario)[1])))
        if settled is None:
            return None
        turning = reversals / most
        rate = reversals / recording.duration
        failure = failure_of_walk(settled, turning, limit)
        return Case(scenario, recording, settled, failure), turning, rate
    parts = task_parts(scenario, recording)
    counted = parts[0].command_reversal_rate * per if is_noisy(scenario) else reversals
    turning = counted / most
    switches = only_switches(scenario, scenario.law)
    ratios = [excess_of_part(part, switches) for part in parts]
    # An earlier part decides where it fails and the last one does not, or fails less. The reach is that of all parts.
    errors = [float(np.nan_to_num(np.max(each[:-1]))) for each in ratios]
    largest = [errors[0], *((error if error > 1.0 else 0.0) for error in errors[1:])]
    place = int(np.argmax(largest))
    excess = ratios[place]
    settled = parts[place]
    failure = failure_of_task(excess, turning)
    is_for_reach = bool(misses_for_reach(scenario, parts, turning))
    case = Case(scenario, recording, settled, failure, is_for_reach)
    if largest[place] <= 1.0 < excess.reach and max(peak.lacking for peak in torque_peaks(case)) <= 0.0:
        # Another part asks for it.
        settled = settled._replace(first=0.0, last=len(recording) - 1.0, start=float(recording.time[0]), end=0.0)
        case = replace(case, settled=settled)
    # No oscillation: an error at the cut peaks of a wave, which reverses more often than the wave, and a slow approach.
    if failure == "oscillates" and turning <= 1.0 and (cuts_wave(case) or case.is_approaching):
        case = replace(case, failure="does not follow")
    return case, turning, counted / per


def remarks_on(result: "RecordedResult", follows: bool) -> Iterator[str]:
    """Yield remarks on rest, stops, sensor values without effect, and replaced values.

    ``follows``: True if the run follows its reference; a stop may then bear the torque that the reference asks for.
    """
    scenario = result.scenario
    recording = result.recording
    motion = scenario.motion
    actuator = scenario.device.actuator
    reached = []
    yield standing_still(result, follows)
    if isinstance(motion, FreeMotion):
        for side, stop in (("lower", actuator.angle_min), ("upper", actuator.angle_max)):
            rests = np.abs(recording["angle"] - stop) <= ON_STOP
            # A start on a stop is the scenario's, unless the joint never leaves the stop.
            at = np.flatnonzero(rests & ~np.concatenate([[not rests.all()], rests[:-1]]))
            name = f"its {side} stop ({level_text('rad', stop)})"
            share = f"{100.0 * np.mean(rests):.0f} % of the run"
            lies = "" if share.startswith("0 ") else f" and lies on it for {share}"
            reached += [f"{name} at {recording.time[index]:.3g} s{lies}" for index in at[:1]]
        if reached and follows and scenario.controlled != ANGLE and motion.leg is None:
            reached[-1] += (
                f": there the stop bears the torque; not tried: lock the joint ({override_text(_LOCKED)}) or add a load"
            )
    yield from (f"the joint reaches {text}" for text in reached)
    yield _without_effect(scenario)
    yield scenario.origin.replaced


def standing_still(result: "RecordedResult", follows: bool) -> str:
    """Remark on a free joint that friction holds for the whole run while no angle is controlled; "" for other runs.

    ``follows``: as for ``remarks_on``; without it the verdict has the remedy, unless the loop is open.
    """
    scenario = result.scenario
    angle = result.recording["angle"]
    motion = result.scenario.motion
    if not isinstance(motion, FreeMotion) or scenario.controlled == ANGLE or not result.status.is_completed:
        return ""
    if np.ptp(angle) > 0.0 or stop_of(scenario, angle):
        return ""
    load = motion.outside_torque + gravity_torque(float(angle[0]), scenario.device.foot_plate.gravity_torque)
    holding = float(scenario.device.friction.static_torque)
    most = float(np.abs(result.recording["torque"] - load).max())
    exceeds = f"exceeds the largest torque of actuator and load, {level_text('N m', most)}"
    text = f"the joint does not move: static friction of {level_text('N m', holding)} {exceeds}"
    if follows or scenario.controller.is_open_loop:
        text += f"; not tried: reduce `friction.static_torque`, or lock the joint ({override_text(_LOCKED)})"
    # A joint on which no torque acts is at rest without friction.
    return text if most > SMALLEST_MOVE * holding else ""


def _without_effect(scenario: Scenario) -> str:
    """Overridden sensor values that the controller does not read in this scenario, as text; "" without any."""
    sensors = scenario.sensors
    law = scenario.law
    actuator = scenario.device.actuator
    unread = "sensors.angle_"
    read = "the measured pressure"
    if scenario.controller.is_open_loop:
        unread = "sensors."
        read = "no sensor"
    elif law is None or not scenario.follows_reference or len(law.controls) < 2:
        # Only laws of several quantities are declared to read nothing but the controlled one.
        return ""
    elif scenario.controlled == ANGLE:
        unread = "sensors.pressure_"
        read = "the measured angle"
    elif scenario.controlled == TORQUE:
        angles = np.linspace(actuator.angle_min, actuator.angle_max, 4).tolist()
        depends = len({torque_reach(scenario.device, angle) for angle in angles}) > 1
        unread = "none" if depends else unread
        read = "a torque computed from the measured pressures"
    names = [override.typed for override in read_overrides(scenario.origin.overrides)]
    is_quiet = not (sensors.angle_noise or sensors.pressure_noise)
    names = [name for name in names if name.startswith(unread) or (is_quiet and name == "sensors.seed")]
    return f"without effect here: {', '.join(names)}; the controller reads {read}" if names else ""
