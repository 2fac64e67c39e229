"""Verdict on a run: whether it follows its reference, the cause of a failure, and remedies that were tried."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED
from ppafo.simulation.tracking.case import Case, TrackingCause
from ppafo.simulation.tracking.causes import CAUSES_OF_TASK
from ppafo.simulation.tracking.load_causes import torque_beyond_reach
from ppafo.simulation.tracking.remedies import Remedy, change_text
from ppafo.simulation.tracking.rule import (
    LARGEST_SHARE,
    LARGEST_SHARE_OF_WAVE,
    REVERSALS,
    Failure,
    failure_of_task,
    failure_of_walk,
    is_noisy,
    largest_error,
    most_reversals,
    only_switches,
    settled_task,
    settled_walk,
    torque_limit,
)
from ppafo.simulation.tracking.walk_causes import CAUSES_OF_WALK
from ppafo.units.shown import in_units, units_in_force

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import RecordedResult

_FEWEST_SAMPLES = 8
"""Smallest number of samples of a recording for a verdict."""


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
    swings slowly, else 0.
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
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    def rests(self) -> bool:
        """True if the error is nearly constant over the settled part."""
        return abs(self.missing) > 0.9 * self.error

    @property
    def is_useless(self) -> bool:
        """False if the scenario declares its reference to be beyond reach."""
        return not self.accepted

    @property
    @in_units(lambda tracking: tracking.units)
    def sentence(self) -> str:
        """Verdict in one line."""
        remedies = " or ".join(remedy.text for remedy in self.remedies[:2])
        if self.accepted:
            last = f"; on purpose: {self.accepted}"
        elif self.tried or not remedies:
            last = f"; {self.tried or self.advice}" if self.tried or self.advice else ""
        else:
            last = f": {remedies}"
        return f"{self._found}; {self.cause}{last}"

    @property
    def _found(self) -> str:
        words = CONTROLLED[self.controlled].words
        error, wanted, moved = (change_text(self.controlled, each) for each in (self.error, self.wanted, self.moved))
        plain_error, plain_moved = error.partition(" ")[0], moved.partition(" ")[0]
        if self.kind == "does not move":
            return f"the {words} loop does not move: {plain_moved} of {wanted} wanted"
        if self.kind == "oscillates":
            if self.span:
                swing = change_text(self.controlled, self.span)
                return f"the {words} swings by {swing}, of {wanted} wanted{time_text(self.since)}"
            often = f"{self.reversals:.3g} reversals a {self.per}"
            return f"the {words} loop oscillates: {often}, RMS {plain_error} of {wanted} wanted{time_text(self.since)}"
        if self.kind == "overshoots":
            return f"the {words} overshoots: {plain_moved} of {wanted} wanted at most"
        if self.rests and self.at_rest:
            missing = change_text(self.controlled, abs(self.missing))
            side = "below" if self.missing < 0.0 else "above"
            return f"the {words} stays {missing} {side} its reference, of {wanted} wanted"
        return f"the {words} does not follow its reference: RMS {plain_error} of {wanted} wanted{time_text(self.since)}"


@in_units(lambda result: result.scenario.device.shown)
def tracking_in(result: "RecordedResult") -> Tracking | None:
    """Verdict on a result; None if the result follows its reference, or has none."""
    judged, scenario = _judged(result), result.scenario
    if judged is None or (failure := judged[0].failure) is None:
        return None
    case, turning, per_second, stride_time = judged
    settled, is_task = case.settled, scenario.follows_reference
    found = (find(case) for find in (CAUSES_OF_TASK if is_task else CAUSES_OF_WALK))
    cause, *others = (each for each in found if each is not None)
    # Reversals of the value where these fail, else of the command.
    if settled.turns and turning <= 1.0:
        per_second = settled.turns / settled.duration
    overshoots, is_of_walk = failure == "overshoots", stride_time > 0.0
    return Tracking(
        kind=failure,
        controlled=scenario.controlled,
        error=settled.error,
        wanted=torque_limit(scenario.controller.settings) if overshoots and not is_task else settled.wanted,
        missing=settled.missing,
        moved=settled.peak if overshoots else settled.moved,
        reversals=per_second * (stride_time if is_of_walk else 1.0),
        per="stride" if is_of_walk else "second",
        cause=cause.text,
        advice=cause.advice,
        remedies=cause.remedies,
        others=tuple(other for other in others if other.remedies),
        accepted=scenario.beyond_reach if cause.is_beyond_reach else "",
        at_rest=settled.rests,
        since=settled.start,
        span=settled.span if failure == "oscillates" and turning <= 1.0 and not settled.turns and settled.way else 0.0,
    )


@in_units(lambda result: result.scenario.device.shown)
def following_text(result: "RecordedResult") -> str:
    """Sentence on a result that follows its reference, with the RMS error; "" if not following or not judged."""
    judged, controlled = _judged(result), CONTROLLED[result.scenario.controlled]
    # On a ramp every loop is behind, and a walk whose law requests no torque has a peak alone.
    if judged is None or judged[0].failure is not None or controlled_in(result.recording) is None:
        return ""
    case = judged[0]
    settled = case.settled
    if settled.ends_on_ramp:
        return ""
    is_task = case.scenario.follows_reference
    largest = float(largest_error(settled, case.only_switches)) if is_task else LARGEST_SHARE_OF_WAVE * settled.wanted
    error, allowed = (change_text(controlled.name, each) for each in (settled.error, largest))
    since = time_text(settled.start)
    # A reference just beyond reach is missed by no more than is allowed.
    beyond = torque_beyond_reach(case) if is_task else None
    short = "" if beyond is None else f"; {beyond.text}"
    return f"the {controlled.words} follows its reference: RMS error {error}{since}, {allowed} allowed{short}"


def time_text(since: float) -> str:
    """Words for the settled part of a run, which starts at a time [s]."""
    return f" from {since:.3g} s on" if since > 0.0 else ""


def _judged(result: "RecordedResult") -> tuple[Case, float, float, float] | None:
    """Run with its kind of failure, if any; None if the run is not judged.

    The further numbers are the command reversals divided by the limit [-], the reversals per second, and the stride
    time [s], 0 for a task.
    """
    scenario, law, recording = result.scenario, result.scenario.law, result.recording
    is_task = scenario.follows_reference
    if (
        len(recording) < _FEWEST_SAMPLES
        or scenario.controller.is_open_loop
        or (is_task and controlled_in(recording) is None)
    ):
        return None
    limit = 0.0 if is_task else torque_limit(scenario.controller.settings)
    settled = settled_task(scenario, recording) if is_task else settled_walk(recording, limit)
    if settled is None:
        return None
    reversals, strides = (
        result.metrics[name].value if name in result.metrics else 0.0 for name in (REVERSALS, "strides")
    )
    stride_time = recording.duration / strides if strides > 0.0 else 0.0
    counted = settled.reversals * max(recording.duration, 1.0) if is_noisy(scenario) else reversals
    turning = counted / most_reversals(scenario, law, recording.duration, stride_time)
    if is_task:
        failure = failure_of_task(settled, turning, only_switches(scenario, law))
    else:
        failure = failure_of_walk(settled, turning, limit)
    case = Case(scenario=scenario, law=law, recording=recording, settled=settled, failure=failure)
    # A pair swings so far by design that the mean error tells more of a torque beyond reach than the RMS does.
    if failure is None and is_task and abs(settled.missing) > LARGEST_SHARE * settled.wanted:
        case = case._replace(failure="does not follow" if torque_beyond_reach(case) is not None else None)
    return case, turning, reversals / recording.duration, stride_time
