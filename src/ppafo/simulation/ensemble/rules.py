"""Which numbers of a run contradict each other: the rules of a single scenario, over columns."""

import operator
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.model.columns import Problem, at
from ppafo.parameters.building import actuator_problem, beyond_pressures, consistency, growth_and_problem
from ppafo.parameters.device import VANE
from ppafo.simulation.clock import MAXIMUM_STEPS_OF_DELAY
from ppafo.simulation.motion import TOLERANCE, profile_problem
from ppafo.simulation.numbers import HELD_ANGLE
from ppafo.simulation.plan import profile_bounds
from ppafo.simulation.reading import quantity_text
from ppafo.simulation.scenario import FreeMotion, MotionKind, ProfileChoice, Scenario, vane_motion

Rule = Callable[[Scenario], tuple[Problem, ...]]
"""What may be wrong with a scenario that represents many runs."""


def _inconsistent(scenario: Scenario) -> tuple[Problem, ...]:
    """Two numbers of a device that contradict each other."""

    def problem(path: str, relation: str, other: str, holds: Any) -> Problem:
        first, second = _number(scenario, path), _number(scenario, other)
        return np.logical_not(
            holds
        ), lambda run: f"{path} = {at(first, run):.9g} must be {relation} {other} = {at(second, run):.9g} (SI units)"

    return tuple(problem(*rule) for rule in consistency(scenario.device))


def _misshapen(scenario: Scenario) -> tuple[Problem, ...]:
    """An actuator that is no vane, whose numbers do not fit together."""
    actuator = scenario.device.actuator
    stops = actuator.angle_min, actuator.angle_max, actuator.dead_volume_1, actuator.dead_volume_2
    varied: list[Any] = [value for value in (*stops, *actuator.settings.values()) if isinstance(value, np.ndarray)]
    if actuator.kind == VANE or not varied:
        return ()

    def words(run: int) -> str:
        low, high, dead_1, dead_2 = (at(value, run) for value in stops)
        alone = replace(
            actuator,
            angle_min=low,
            angle_max=high,
            dead_volume_1=dead_1,
            dead_volume_2=dead_2,
            settings={name: at(value, run) for name, value in actuator.settings.items()},
        )
        problem = actuator_problem(alone)
        return f"actuator: {problem}" if problem else ""

    found = [words(run) for run in range(varied[0].size)]
    return ((np.array([bool(line) for line in found]), lambda run: found[run]),)


def _beyond_the_table(scenario: Scenario) -> tuple[Problem, ...]:
    """A supply above the pressures at which an actuator was measured."""
    is_beyond, line = beyond_pressures(scenario.device)
    return ((is_beyond, lambda run: f"actuator: {line(run)}"),)


def _without_growth(scenario: Scenario) -> tuple[Problem, ...]:
    """An actuator that is no vane, whose chamber 1 does not grow with the angle."""
    return () if scenario.device.actuator.kind == VANE else (growth_and_problem(scenario.device)[1],)


def _beyond_the_stops(scenario: Scenario) -> tuple[Problem, ...]:
    """A vane that begins, is held or is to move beyond the stops."""
    actuator, motion = scenario.device.actuator, vane_motion(scenario)
    profile = ProfileChoice("constant", {"level": motion.angle}) if isinstance(motion, FreeMotion) else motion.profile
    lowest, highest = profile_bounds(profile)
    lower, upper = actuator.angle_min - TOLERANCE, actuator.angle_max + TOLERANCE
    outside = np.atleast_1d(np.logical_or(lowest < lower, highest > upper))
    if profile.kind == "constant":
        level = profile.settings["level"]

        def angle_line(run: int) -> str:
            low, high = (quantity_text(at(stop, run), "rad") for stop in (actuator.angle_min, actuator.angle_max))
            return f"{HELD_ANGLE} = {quantity_text(at(level, run), 'rad')}: must be between the stops, {low} to {high}"

        return ((outside, angle_line),)
    # The bounds hold for all time; a run that may leave them is checked at its own times.
    found = {int(run): _stop_violation(scenario, profile, int(run)) for run in np.flatnonzero(outside)}
    for run, problem in found.items():
        outside[run] = bool(problem)
    return ((outside, lambda run: found[run]),)


def _stop_violation(scenario: Scenario, profile: ProfileChoice, run: int) -> str:
    actuator = scenario.device.actuator
    settings = {name: at(value, run) for name, value in profile.settings.items()}
    stops = (at(actuator.angle_min, run), at(actuator.angle_max, run))
    one = ProfileChoice(profile.kind, settings)
    return profile_problem(scenario.device.name, stops, one, at(scenario.duration, run), at(scenario.time_step, run))


def _too_late(scenario: Scenario) -> tuple[Problem, ...]:
    """Sensors whose delay is longer than the run, or than can be stored."""
    delay, step = scenario.sensors.delay, scenario.time_step

    def long_line(run: int) -> str:
        longest = quantity_text(MAXIMUM_STEPS_OF_DELAY * at(step, run), "s")
        return f"sensors.delay = {at(delay, run):.9g} s: must be at most {longest}, {MAXIMUM_STEPS_OF_DELAY:.0e} steps"

    return (
        (
            delay > scenario.duration,
            lambda run: f"sensors.delay = {at(delay, run):.9g} s: must not be longer than run.duration",
        ),
        (delay / step > MAXIMUM_STEPS_OF_DELAY, long_line),
    )


def _number(scenario: Scenario, path: str) -> Floats | float:
    number: Floats | float = operator.attrgetter(path)(scenario.device)
    return number


def _second_regulator_above_the_first(scenario: Scenario) -> tuple[Problem, ...]:
    """A second regulator that is set to more than the line has that feeds it."""
    supply = scenario.device.supply
    if scenario.supply_lines is None:
        return ()

    def line(run: int) -> str:
        first, second = (
            quantity_text(at(pressure, run), "Pa_a", at(supply.atmospheric_pressure, run))
            for pressure in (supply.pressure, supply.dorsiflexion_pressure)
        )
        return f"supply.dorsiflexion_pressure = {second}: with [supply_line] at most supply.pressure, {first}"

    return ((np.atleast_1d(supply.dorsiflexion_pressure > supply.pressure), line),)


def rules_of(worn: MotionKind | None) -> tuple[Rule, ...]:
    """The rules for a leg that wears the device, or for a vane alone."""
    own: tuple[Rule, ...] = (_beyond_the_stops, _too_late) if worn is None else (worn.rules,)
    return _inconsistent, _misshapen, _beyond_the_table, _without_growth, *own, _second_regulator_above_the_first
