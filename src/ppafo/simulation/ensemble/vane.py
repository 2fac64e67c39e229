"""Checks for ensembles of a vane alone: clocks, contradictory numbers, metrics that do not apply."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError
from ppafo.metrics.metric import MetricKind
from ppafo.model.columns import Problem, at
from ppafo.model.controlled import CONTROLLED
from ppafo.signals.meter import LED_SHANK, WALK
from ppafo.simulation.clock import MAXIMUM_STEPS_OF_DELAY, clock_with, time_texts
from ppafo.simulation.declaration import LOCKED_ANGLE
from ppafo.simulation.motion_kind import RunTimes
from ppafo.simulation.numbers import path_of_locked_angle
from ppafo.simulation.profiles import (
    Limits,
    disordered_knots,
    limits_of,
    profile_bounds,
    profile_problem,
    profiles_of,
    stops_of,
)
from ppafo.simulation.scenario import ProfileChoice, Scenario, vane_motion
from ppafo.units.shown import shown_text


def contradictory_numbers(scenario: Scenario) -> tuple[Problem, ...]:
    """Problems of a scenario of a vane alone: knots not in order, angle or profile beyond a limit, delay too long."""
    disordered = tuple(disordered_knots(choice, section) for section, choice in profiles_of(scenario).items())
    # The bounds of a curve need its knots in order.
    if any(np.any(is_bad) for is_bad, _ in disordered):
        return disordered
    delay, step, device = scenario.sensors.delay, scenario.run.step, scenario.device
    motion, followed = vane_motion(scenario), CONTROLLED[scenario.controlled]
    profile = ProfileChoice("constant", {"level": motion.angle}) if motion.profile is None else motion.profile
    stops = stops_of(device)

    def angle_line(run: int) -> str:
        low, high = (shown_text(at(stop, run), "rad") for stop in (stops.lowest, stops.highest))
        path, angle = path_of_locked_angle(scenario) or LOCKED_ANGLE, shown_text(at(profile.level, run), "rad")
        return f"{path} = {angle}: must be between the stops of {device.name}, {low} to {high}"

    def delay_line(run: int) -> str:
        longest = shown_text(MAXIMUM_STEPS_OF_DELAY * at(step, run), "s")
        return f"sensors.delay = {at(delay, run):.9g} s: must be at most {longest}, {MAXIMUM_STEPS_OF_DELAY:.0e} steps"

    if profile.kind == "constant":
        angle_problem: Problem = (_is_beyond(stops, profile), angle_line)
    else:
        angle_problem = _beyond(scenario, stops, profile, "motion.profile")
    problems = [
        (
            delay > scenario.run.duration,
            lambda run: f"sensors.delay = {at(delay, run):.9g} s: must not be longer than run.duration",
        ),
        (delay / step > MAXIMUM_STEPS_OF_DELAY, delay_line),
    ]
    if followed.reach is not None and scenario.follows_reference:
        problems.insert(0, _beyond(scenario, limits_of(device, followed), scenario.reference, "reference"))
    return angle_problem, *problems


def _is_beyond(limits: Limits, profile: ProfileChoice) -> NDArray[np.bool_]:
    """Tell for each run (runs,) whether a profile leaves its limits at any time."""
    lowest, highest = profile_bounds(profile)
    lower, upper = limits.allowed
    return np.atleast_1d(np.logical_or(lowest < lower, highest > upper))


def _beyond(scenario: Scenario, limits: Limits, profile: ProfileChoice, section: str) -> Problem:
    """Problem of a profile that exceeds its limits; ``section`` is the profile's section of the file."""
    outside = _is_beyond(limits, profile)
    # The bounds hold for all time; a run that may leave them is checked at its own times.
    problems: dict[int, str] = {}
    for run in np.flatnonzero(outside).tolist():
        settings = {name: at(value, run) for name, value in profile.settings.items()}
        duration, step = at(scenario.run.duration, run), at(scenario.run.step, run)
        profile_of_run = ProfileChoice(profile.kind, settings)
        lowest, highest, room = (at(number, run) for number in (limits.lowest, limits.highest, limits.room))
        limits_of_run = limits._replace(lowest=lowest, highest=highest, room=room)
        problems[run] = profile_problem(limits_of_run, profile_of_run, duration, step, section)
        outside[run] = bool(problems[run])
    return outside, lambda run: problems[run]


def clock(base: Scenario, times: Mapping[str, Any]) -> tuple[RunTimes, tuple[Problem, ...]]:
    """Return the run times for columns of times [s] by path, and the problems of contradictory times.

    Times are read as in a file, once for each combination, of which an ensemble has few.
    """
    texts = time_texts(base)
    combinations, index_of_run = np.unique(np.stack(list(times.values()), axis=1), axis=0, return_inverse=True)
    index_of_run = index_of_run.reshape(-1)
    reasons, table = [""] * len(combinations), np.full((len(combinations), 4), np.nan)
    for index, combination in enumerate(combinations.tolist()):
        try:
            run_times = clock_with(base.name, texts, dict(zip(times, combination, strict=True)))
        except ScenarioError as error:
            reasons[index] = str(error)
        else:
            table[index] = run_times.duration, run_times.step, run_times.output_interval, run_times.period
    is_refused = np.array([bool(reason) for reason in reasons])[index_of_run]
    return RunTimes(*table[index_of_run].T.copy()), ((is_refused, lambda run: reasons[index_of_run[run]]),)


def lacks(scenario: Scenario, kind: MetricKind) -> str:
    """Return the reason why a metric does not apply to a vane alone; "" if it applies."""
    if WALK in kind.needs:
        return "the metric needs a walk"
    leg = vane_motion(scenario).leg
    if LED_SHANK in kind.needs and not (leg is not None and leg.gait):
        return "the metric needs a leg whose shank follows a gait"
    if not kind.of_reference:
        return ""
    if not scenario.follows_reference:
        return "the controller has no reference"
    controlled = scenario.controlled
    return "" if kind.of_reference == controlled else f"reference.of is '{controlled}', not '{kind.of_reference}'"
