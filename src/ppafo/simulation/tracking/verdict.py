"""Verdict on a run: whether what is controlled follows its reference, what hinders it, and what was seen to help."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ppafo.control.kind import ControllerKind
from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.case import Case, TrackingCause
from ppafo.simulation.tracking.causes import causes_of_task
from ppafo.simulation.tracking.load_causes import torque_beyond_reach
from ppafo.simulation.tracking.remedies import Remedy, change_text
from ppafo.simulation.tracking.rule import (
    LARGEST_SHARE,
    REVERSALS,
    Failure,
    SettledPart,
    failure_of_task,
    failure_of_walk,
    is_noisy,
    most_reversals,
    settled_task,
    settled_walk,
    torque_limit,
)
from ppafo.simulation.tracking.walk_causes import causes_of_walk
from ppafo.units.shown import in_units, units_in_force

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import RecordedResult

_FEWEST_SAMPLES = 8
"""Samples of a recording below which nothing is judged."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """Verdict on a run whose controlled quantity does not follow its reference.

    ``error`` and ``wanted`` are the RMS error of the settled part and the change wanted, ``missing`` the mean error,
    ``moved`` how far the value went, all in SI of what is ``controlled``. ``reversals`` are the command's ``per``
    stride or second. ``cause`` says what hinders it, ``remedies`` what might help, the likeliest first, ``others`` what
    else applies, less surely, ``tried`` what did help; ``span`` is the range of the error of an angle that swings where
    neither it nor its command turns often, else 0; ``accepted`` is the reason that the scenario gives for a reference
    beyond reach, "" without one. The settled part begins at ``since`` [s], 0 for a walk.
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
    at_rest: bool = True
    since: float = 0.0
    span: float = 0.0
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    def rests(self) -> bool:
        """True where nearly the same error is left for all of the settled part."""
        return abs(self.missing) > 0.9 * self.error

    @property
    def is_useless(self) -> bool:
        """False where the scenario itself says that its reference lies beyond reach."""
        return not self.accepted

    @property
    @in_units(lambda tracking: tracking.units)
    def sentence(self) -> str:
        """Verdict in one line."""
        return f"{self._found}; {self.cause}{self._help}"

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
                return f"the {words} swings by {swing}, of {wanted} wanted{self.time_text}"
            often = f"{self.reversals:.3g} reversals a {self.per}"
            return f"the {words} loop oscillates: {often}, RMS {plain_error} of {wanted} wanted{self.time_text}"
        if self.kind == "overshoots":
            return f"the {words} overshoots: {plain_moved} of {wanted} wanted at most"
        if self.rests and self.at_rest:
            missing = change_text(self.controlled, abs(self.missing))
            side = "below" if self.missing < 0.0 else "above"
            return f"the {words} stays {missing} {side} its reference, of {wanted} wanted"
        return f"the {words} does not follow its reference: RMS {plain_error} of {wanted} wanted{self.time_text}"

    @property
    def time_text(self) -> str:
        """Settled part of the run, in words; its error is less than the error of the whole run in the metrics."""
        return f" from {self.since:.3g} s on" if self.since > 0.0 else ""

    @property
    def _help(self) -> str:
        if self.accepted:
            return f"; on purpose: {self.accepted}"
        if self.tried:
            return f"; {self.tried}"
        if self.remedies:
            return f": {' or '.join(remedy.text for remedy in self.remedies[:2])}"
        return f"; {self.advice}" if self.advice else ""


def tracking_in(result: "RecordedResult") -> Tracking | None:
    """Verdict on a result; None where it follows its reference, or has none."""
    return tracking_of(result.scenario, result.scenario.law, result.recording, *_reversals_and_stride(result))


@in_units(lambda result: result.scenario.device.shown)
def following_text(result: "RecordedResult") -> str:
    """Sentence on a result that follows its reference, with its RMS error; "" where it does not, or is not judged."""
    scenario = result.scenario
    judged = _judged(scenario, scenario.law, result.recording, *_reversals_and_stride(result))
    if judged is None or judged[0].failure is not None:
        return ""
    settled, controlled = judged[0].settled, CONTROLLED[scenario.controlled]
    # On a ramp every loop is behind, and a walk whose law requests no torque has a peak alone.
    if settled.ends_on_ramp or controlled_in(result.recording) is None:
        return ""
    error, wanted = (change_text(controlled.name, each) for each in (settled.error, settled.wanted))
    since = f" from {settled.start:.3g} s on" if settled.start > 0.0 else ""
    return f"the {controlled.words} follows its reference: RMS {error} of {wanted} wanted{since}"


def _reversals_and_stride(result: "RecordedResult") -> tuple[float, float]:
    """Reversals of the command in a result, and the duration of its strides [s], 0 for a task."""
    metrics = {name: metric.value for name, metric in result.metrics.items()}
    strides, time = metrics.get("strides", 0.0), result.recording.time
    return metrics.get(REVERSALS, 0.0), float(time[-1] - time[0]) / strides if strides > 0.0 else 0.0


def _judged(
    scenario: Scenario, law: ControllerKind | None, recording: Recording, reversals: float, stride_time: float
) -> tuple[Case, float] | None:
    """Run with its kind of failure, if any, and its command reversals over the most; None where nothing is judged."""
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
    duration = float(np.ptp(recording.time[[0, -1]]))
    counted = settled.reversals * max(duration, 1.0) if is_noisy(scenario) else reversals
    turning = counted / most_reversals(scenario, law, duration, stride_time)
    if is_task:
        failure = failure_of_task(settled, turning, law is not None and law.only_switches)
    else:
        failure = failure_of_walk(settled, turning, limit)
    case = Case(scenario=scenario, law=law, recording=recording, settled=settled, failure=failure)
    # A pair swings so far by design that the mean error tells more of a torque beyond reach than the RMS does.
    if failure is None and is_task and abs(settled.missing) > LARGEST_SHARE * settled.wanted:
        failure = "does not follow" if torque_beyond_reach(case) is not None else None
        case = case._replace(failure=failure)
    return case, turning


@in_units(lambda scenario, *_, **__: scenario.device.shown)
def tracking_of(
    scenario: Scenario, law: ControllerKind | None, recording: Recording, reversals: float, stride_time: float = 0.0
) -> Tracking | None:
    """Verdict on a recording whose command reversed so often; None where it follows its reference, or has none.

    ``stride_time`` [s] is the duration of a stride of a walk, 0 for a task.
    """
    judged = _judged(scenario, law, recording, reversals, stride_time)
    if judged is None or (failure := judged[0].failure) is None:
        return None
    case, turning = judged
    settled, is_task = case.settled, scenario.follows_reference
    limit = 0.0 if is_task else torque_limit(scenario.controller.settings)
    duration = float(np.ptp(recording.time[[0, -1]]))
    cause, *others = causes_of_task(case) if is_task else causes_of_walk(case)
    return Tracking(
        kind=failure,
        controlled=scenario.controlled,
        error=settled.error,
        wanted=limit if failure == "overshoots" and not is_task else settled.wanted,
        missing=settled.missing,
        moved=settled.peak if failure == "overshoots" else settled.moved,
        reversals=_rate(settled, turning > 1.0, reversals / duration) * (stride_time if stride_time > 0.0 else 1.0),
        per="stride" if stride_time > 0.0 else "second",
        cause=cause.text,
        advice=cause.advice,
        remedies=cause.remedies,
        others=tuple(other for other in others if other.remedies),
        accepted=scenario.beyond_reach if cause.is_beyond_reach else "",
        at_rest=settled.rests,
        since=settled.start,
        span=settled.span if failure == "oscillates" and turning <= 1.0 and not settled.turns and settled.way else 0.0,
    )


def _rate(settled: SettledPart, is_restless: bool, of_command: float) -> float:
    """Reversals a second of the value where these fail, else of the command."""
    return settled.turns / settled.duration if settled.turns and not is_restless else of_command
