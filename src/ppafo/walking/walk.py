"""Runs a walk."""

from collections.abc import Callable, Iterable
from pathlib import Path

from ppafo.engine.lanes import STEPS_PER_CALL, Batch, BatchResult, begin_block
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError
from ppafo.simulation.sampled import run_sampled
from ppafo.simulation.scenario import Scenario
from ppafo.walking.contradictions import check_no_bottle
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.on_bottle import run_on_bottle
from ppafo.walking.planning import plan_walk
from ppafo.walking.result import WalkResult, result_of_walk
from ppafo.walking.varying import duration_problems, with_duration

Progress = Callable[[float, float], None]


def silent(done: float, total: float) -> None:  # both are there for those who listen
    """Ignore the progress."""


def walk(
    scenario: Scenario | str | Path,
    minutes: float | None = None,
    overrides: Iterable[str] = (),
    gait: str | Path | None = None,
    progress: Progress = silent,
    course: str | Path | None = None,
    bottle: str | Path | None = None,
) -> WalkResult:
    """Walk for ``minutes`` [min]: a scenario that is a walk, the name of a shipped one, or a file.

    Unless ``minutes`` are given it is as long as the file says, or the whole course, or one minute where there is none,
    and up to ten on a bottle, which may end it before. With a name or a file go overrides as for the command, and a
    ``gait``, ``course`` or ``bottle`` in place of its own. A walk that diverges is a result with that status, up to
    the time of failure. ScenarioError or ParameterError for bad input. ``progress`` gets the minutes done and those in
    all, part by part.
    """
    if isinstance(scenario, Scenario):
        if any(item is not None for item in (gait, course, bottle)) or tuple(overrides):
            raise ScenarioError(
                "overrides, a gait, a course and a bottle go with a name or a file; a Scenario takes them in load_walk"
            )
        chosen = scenario
    else:
        chosen = load_walk(scenario, overrides, gait, course, bottle)
    chosen = lasting(chosen, minutes)
    run, carried = plan_walk(chosen), walk_of(chosen).bottle
    custom = chosen.control.custom
    if custom is not None:
        check_no_bottle(chosen)
        return result_of_walk(chosen, run, run_sampled(batch_of(run), custom), None)
    if carried is None:
        return result_of_walk(chosen, run, _run_in_parts(batch_of(run), run.step, progress), None)
    outcome, supply = run_on_bottle(run, carried, walk_of(chosen).gait.stride_time, progress)
    return result_of_walk(chosen, run, outcome, supply)


def lasting(scenario: Scenario, minutes: float | None) -> Scenario:
    """A walk of some minutes [min], of its own length unless given; ScenarioError if too short or too long."""
    if minutes is None:
        return scenario
    for is_bad, line in duration_problems(scenario, 60.0 * minutes):
        if is_bad:
            raise ScenarioError(line(0))
    return with_duration(scenario, 60.0 * minutes)


def _run_in_parts(batch: Batch, step: float, progress: Progress) -> BatchResult:
    """Run in parts short enough for an interrupt to be seen and for progress to be told."""
    block = begin_block(batch)
    count = batch.clock.step_count
    for done in range(0, count, STEPS_PER_CALL):
        block.advance(min(STEPS_PER_CALL, count - done))
        progress(min(done + STEPS_PER_CALL, count) * step / 60.0, count * step / 60.0)
    return block.result()
