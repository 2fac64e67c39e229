"""Makes a check: the run again with less error, with its start moved and with its measurements moved."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ppafo.engine.actuator_values import pressures_of, volumes_of
from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.metrics.metric import Floats
from ppafo.signals import Recording
from ppafo.simulation.check import ALLOWED_CHANGE, HALF_ERROR, MOVE, MOVED_MEASUREMENT, MOVED_START, Check, NumberCheck
from ppafo.simulation.plan import plan_run
from ppafo.simulation.result import Result
from ppafo.simulation.simulate import results_of

DRAWS = 4
"""Draws of what moves the measurements of sensors without noise."""
ALLOWED_PARTING = 1.0e-2
"""Largest difference of two runs over time that counts as none, as a fraction of the range."""


_COURSES = {"angle over time": ("angle",), "pressures over time": ("pressure_1", "pressure_2")}


def check_result(result: Result) -> Check:
    """Return what a completed run determines; SimulationError for one that diverged, or that is never the same."""
    scenario = result.scenario
    if not result.status.is_completed:
        raise SimulationError(f"{scenario.name}: the run diverged, so there is nothing to check")
    run = plan_run(scenario)
    _check_repeatable(result, run)
    pressures = _pressure_range(result)
    repeats = _repeats(run, pressures)
    results = results_of(scenario, [repeat for _, repeat in repeats])
    found = [(name, repeated) for (name, _), repeated in zip(repeats, results, strict=True)]
    courses = tuple(_course(name, found, result, pressures) for name in _COURSES)
    return Check(
        scenario=scenario.name,
        metrics=_metrics(result, found, pressures),
        courses=courses,
        parts_at=_time_of_parting([repeated for _, repeated in found], result, courses),
        failed=tuple(dict.fromkeys(name for name, repeated in found if not repeated.status.is_completed)),
        atmosphere=scenario.device.supply.atmospheric_pressure,
    )


def _check_repeatable(result: Result, run: Run) -> None:
    """Refuse a Python controller that gives a different run each time: every change would be its own."""
    controller = result.scenario.control.custom
    if controller is None:
        return
    again = results_of(result.scenario, [run])[0].recording
    if not all(np.array_equal(again[name], result.recording[name]) for name in again.names):
        raise SimulationError(
            f"{result.scenario.name}: {type(controller).__name__} gives a different run each time, so nothing can be "
            f"checked; its reset() must forget everything, and its random numbers need a fixed seed"
        )


def _repeats(run: Run, pressures: float) -> list[tuple[str, Run]]:
    """The runs to compare with, by what is changed in them; moved ones in both directions."""
    half = replace(
        run,
        tolerance=0.5 * run.tolerance,
        step=0.5 * run.step,
        step_count=2 * run.step_count,
        steps_per_sample=2 * run.steps_per_sample,
        record_every=2 * run.record_every,
    )
    repeats = [(HALF_ERROR, half), *((MOVED_START, _start_moved(run, move)) for move in (MOVE, -MOVE))]
    if run.program.ideal_sensors:
        return repeats
    return [*repeats, *((MOVED_MEASUREMENT, moved) for moved in _measurements_moved(run, pressures))]


def _start_moved(run: Run, move: float) -> Run:
    """The run from a little more gas in both chambers, and where the vane is free from a little further on."""
    plant, start = run.plant, run.initial
    angle = start.angle
    if run.program.angle is None:
        shifted = angle + move * (plant.angle_max - plant.angle_min)
        angle = min(max(shifted, plant.angle_min), plant.angle_max)
    actuator = run.program.actuator
    pressures = pressures_of(actuator, plant, start.angle, start.mass_1, start.mass_2)
    before, after = (volumes_of(actuator, plant, at, *pressures) for at in (start.angle, angle))
    mass_1, mass_2 = (
        mass * now / then * (1.0 + move)
        for mass, now, then in zip((start.mass_1, start.mass_2), after, before, strict=True)
    )
    return replace(run, initial=start._replace(angle=angle, mass_1=mass_1, mass_2=mass_2))


def _measurements_moved(run: Run, pressures: float) -> list[Run]:
    """Runs with a little more noise on each sensor, either way; several draws of it where they have none themselves.

    One draw alone seldom crosses a step of a coarse sensor, which is what matters.
    """
    sensors, angles = run.sensors, run.plant.angle_max - run.plant.angle_min
    draws = 1 if sensors.angle_noise or sensors.pressure_noise else DRAWS
    return [
        replace(
            run,
            sensors=sensors._replace(
                angle_noise=sensors.angle_noise + move * angles,
                pressure_noise=sensors.pressure_noise + move * pressures,
                seed=sensors.seed + draw,
            ),
        )
        for draw in range(draws)
        for move in (MOVE, -MOVE)
    ]


def _pressure_range(result: Result) -> float:
    """Highest less lowest pressure [Pa] that the chambers had or are connected to; the atmosphere's if there is one."""
    supply, recording = result.scenario.device.supply, result.recording
    outside = [supply.pressure, supply.dorsiflexion_pressure, supply.atmospheric_pressure]
    values = np.concatenate([recording["pressure_1"], recording["pressure_2"], outside])
    return float(np.ptp(values)) or supply.atmospheric_pressure


def _metrics(result: Result, repeats: list[tuple[str, Result]], pressures: float) -> tuple[NumberCheck, ...]:
    names = dict.fromkeys(name for one in (result, *(repeat for _, repeat in repeats)) for name in one.metrics)
    rows = []
    for name in names:
        kind = next(one.metrics[name] for one in (result, *(r for _, r in repeats)) if name in one.metrics)
        value = _value(result, name)
        changes = _largest((repeat, _difference(_value(repeated, name), value)) for repeat, repeated in repeats)
        scale = max(abs(value) if math.isfinite(value) else 0.0, _metric_range(result, name, kind.unit, pressures))
        rows.append(NumberCheck(name, kind.unit, value, ALLOWED_CHANGE * scale, changes))
    return tuple(rows)


def _value(result: Result, name: str) -> float:
    return result.metrics[name].value if name in result.metrics else math.nan


def _difference(now: float, before: float) -> float:
    """The change; inf where only one of both is a number."""
    if math.isfinite(now) and math.isfinite(before):
        return now - before
    return 0.0 if now == before or (math.isnan(now) and math.isnan(before)) else math.inf


def _largest(changes: Iterable[tuple[str, float]]) -> dict[str, float]:
    """The largest change of all directions, with its sign, by repeat."""
    largest: dict[str, float] = {}
    for name, change in changes:
        largest[name] = max(largest.get(name, 0.0), change, key=abs)
    return largest


def _metric_range(result: Result, name: str, unit: str, pressures: float) -> float:
    """Range of the quantity of a metric; 1 for a number of events, 0 for a unit that has none."""
    scenario, recording = result.scenario, result.recording
    actuator = scenario.device.actuator
    angles, torques = actuator.angle_max - actuator.angle_min, abs(actuator.torque_constant) * pressures
    ranges = {
        "rad": angles,
        "rad/s": float(np.max(np.abs(recording["angular_velocity"]))),
        "Pa": pressures,
        "N m": torques,
        "J": torques * angles,
        "kg": max(_value(result, "gas_supplied"), float(np.max(recording["mass_1"] + recording["mass_2"]))),
        "s": scenario.duration,
        "-": 1.0,
    }
    if unit in ranges:
        return ranges[unit]
    # A ratio of work and gas is as open as both are; where one is next to nothing, so is what the ratio says.
    parts = {"mechanical_work": ranges["J"], "gas_supplied": ranges["kg"]}
    values = {part: abs(_value(result, part)) for part in parts}
    if not all(value > ALLOWED_CHANGE * parts[part] for part, value in values.items()):
        return math.inf
    return abs(_value(result, name)) * max(parts[part] / value for part, value in values.items())


def _largest_differences(one: Recording, other: Recording, channels: Iterable[str]) -> Floats:
    """Largest difference of some channels at each sample that both have."""
    count = min(len(one), len(other))
    return np.asarray(np.max([np.abs(one[name][:count] - other[name][:count]) for name in channels], axis=0))


def _course(name: str, repeats: list[tuple[str, Result]], result: Result, pressures: float) -> NumberCheck:
    actuator = result.scenario.device.actuator
    is_angle = name == "angle over time"
    span, unit = (actuator.angle_max - actuator.angle_min, "rad") if is_angle else (pressures, "Pa")
    changes = _largest(
        (repeat, float(np.max(_largest_differences(repeated.recording, result.recording, _COURSES[name]))))
        for repeat, repeated in repeats
    )
    return NumberCheck(name, unit, span, ALLOWED_PARTING * span, changes)


def _time_of_parting(repeats: list[Result], result: Result, courses: tuple[NumberCheck, ...]) -> float | None:
    times = [repeat.status.time for repeat in repeats if repeat.status.time is not None]
    for course in courses:
        for repeat in repeats:
            beyond = _largest_differences(repeat.recording, result.recording, _COURSES[course.name]) > course.allowed
            times += [float(result.recording.time[np.argmax(beyond)])] if beyond.any() else []
    return min(times, default=None)
