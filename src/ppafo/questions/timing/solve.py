"""Walks of a healthy and an impaired wearer, each with every timing of the stride: how far its events are off."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ppafo.control.walking.catalog import TIMINGS
from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, batch_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.timing.answer import STEADY, UNEVEN, WEARERS, TimedWay, Timing
from ppafo.questions.timing.slap import slap_study
from ppafo.simulation.scenario import Scenario
from ppafo.walking.course import Segment, WalkingCourse, list_courses, load_course
from ppafo.walking.events import EVENTS, EventErrors, event_errors, known_events, true_events, within
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import course_of_walk, plan_walk
from ppafo.walking.result import REMEDY
from ppafo.walking.walk import lasting

SETTLED = 6.0
"""Time [s] from which events count: strides are learnt by then."""
LONGEST = 2.0
UNEVEN_STRIDES = 24
VARIATION = 0.025
"""Standard deviation of stride times over their mean in steady walking, as published for healthy adults (Hausdorff
et al. 1995, J Appl Physiol 78:349, and later: 1 to 3 %)."""
SEED = 20110501


def event_timing(
    configuration: str | Path = "solenoid",
    gait: str | Path | None = None,
    minutes: float | None = None,
    overrides: Sequence[str] = (),
    progress: Report | None = None,
) -> Timing:
    """How far a controller is off in time at heel strike, toes on, heel off and toes off, with every timing.

    ``configuration`` is the name of a walk or a file, with another ``gait`` and ``overrides`` as for a walk. A healthy
    and an impaired wearer walk ``minutes`` [min] (default 1, at most 2) steadily, unevenly and on the courses that come
    with the package. The result has ``ways``, each with errors [s] by event, and ``slap``, what the foot's slap comes
    from. ScenarioError, ParameterError or DataError for bad input, SimulationError where a walk diverges.
    """
    tell, length = progress or report_nothing, 1.0 if minutes is None else minutes
    if not 0.2 <= length <= LONGEST:
        raise ScenarioError(f"{length:g} minutes: events are timed over 0.2 to {LONGEST:g} minutes")
    if any(text.partition("=")[0].strip() in ("timing.kind", "wearer.keeps_gait") for text in overrides):
        raise ScenarioError("timing.kind and wearer.keeps_gait: every timing and both wearers are tried")
    ways = ways_of(load_walk(configuration, overrides, gait))
    found: list[TimedWay] = []
    for timing in TIMINGS:
        for wearer, own in WEARERS.items():
            for way, course in ways.items():
                tell(Progress(f"{timing}, {wearer}, {way}", len(found), len(TIMINGS) * len(WEARERS) * len(ways)))
                walk = load_walk(configuration, (*overrides, *own, f"timing.kind={timing}"), gait)
                walk = replace(walk, motion=replace(walk_of(walk), course=course))
                found.append(TimedWay(wearer, way, timing, timed_events(walk, length)))
    slap = slap_study(str(configuration), (*overrides, *WEARERS["impaired"]), gait, tell)
    return Timing(str(configuration), tuple(overrides), length, tuple(found), slap)


def ways_of(configuration: Scenario) -> dict[str, WalkingCourse | None]:
    """The ways to walk: steadily, unevenly, and the courses that come with the package."""
    if walk_of(configuration).course is not None:
        raise ScenarioError(f"{configuration.origin.file}: course: event timing uses its own courses; remove this one")
    if walk_of(configuration).bottle is not None:
        raise ScenarioError(f"{configuration.origin.file}: bottle: events are timed at one supply pressure; remove it")
    if configuration.control.is_fixed:
        raise ScenarioError(
            f"{configuration.origin.file}: controller.arithmetic = 'fixed': events are timed for controllers in "
            "floats; remove it"
        )
    cadence = 2.0 / walk_of(configuration).gait.stride_time
    return {STEADY: None, UNEVEN: uneven_course(cadence)} | {name: load_course(name) for name in list_courses()}


def uneven_course(cadence: float) -> WalkingCourse:
    """Strides whose times vary as those of people do, about a cadence [1/s] of steps."""
    generator = np.random.default_rng(SEED)
    paces = cadence / (1.0 + VARIATION * np.clip(generator.standard_normal(UNEVEN_STRIDES), -2.0, 2.0))
    strides = (Segment("walk", {"cadence": pace, "strides": 1.0}) for pace in paces.tolist())
    begin = (Segment("start", {"strides": 1.0}), Segment("walk", {"strides": 6.0}))
    return WalkingCourse("uneven", "Strides of uneven time.", (*begin, *strides), "uneven")


def timed_events(configuration: Scenario, minutes: float) -> dict[str, EventErrors]:
    """Errors of the events of one walk of at most so many minutes; SimulationError where it diverges."""
    course = course_of_walk(configuration)
    longest = lasting(configuration, minutes).duration if course is None else float(course.duration)
    run = plan_walk(replace(configuration, duration=min(longest, 60.0 * minutes), output_interval=1.0e-3))
    outcome = run_batch(batch_of(run))
    rows = row_numbers(run.program.state_rows())
    if outcome.states[rows["result.failure_time"], 0] < NEVER_FAILED or not np.isfinite(outcome.states).all():
        raise SimulationError(f"{configuration.name} diverged; {REMEDY}")
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    interval = run.step * run.record_every
    settled = slice(round(SETTLED / interval), outcome.record.shape[0])
    true = within(true_events(record["walk.contact"]), settled)
    known = within(known_events(record), settled)
    if not known:
        raise ScenarioError(
            f"{configuration.origin.file}: controller.kind '{configuration.control.kind}' knows no events"
        )
    stride_time = walk_of(configuration).gait.stride_time
    return {name: event_errors(true[name], known[name], interval, stride_time) for name in EVENTS}
