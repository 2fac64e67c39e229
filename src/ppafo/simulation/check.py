"""Whether a run determines what it says: it runs again with less error, and with start and measurements moved a little.

A loop with coarse sensors or repeated impacts may amplify a difference that nobody could measure into other results.
Then its metrics are those of one run among many, and a check says so.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.metrics.metric import Floats
from ppafo.model.plant import chamber_volumes
from ppafo.signals import Recording
from ppafo.simulation.document import plain
from ppafo.simulation.plan import plan_run
from ppafo.simulation.result import Result
from ppafo.simulation.simulate import results_of

MOVE = 1.0e-7
"""How far a start or a measurement is moved, as a share of its range."""
DRAWS = 4
"""Draws of what moves the measurements of sensors without noise."""
ALLOWED_CHANGE = 1.0e-3
"""Largest change of a metric that counts as none, as a share of its value or of the range of its quantity."""
ALLOWED_PARTING = 1.0e-2
"""Largest difference of two runs over time that counts as none, as a share of the range."""

HALF_ERROR, MOVED_START, MOVED_MEASUREMENT = "half the error", "start moved", "measurement moved"
_MOVES = frozenset({MOVED_START, MOVED_MEASUREMENT})
_COURSES = {"angle over time": ("angle",), "pressures over time": ("pressure_1", "pressure_2")}


@dataclass(frozen=True, slots=True)
class Changed:
    """A number in SI units and what changed in each repeat by its name; inf where a repeat has no such number.

    ``value`` is a metric, or the range of an angle or a pressure whose ``changes`` are the largest over time;
    ``allowed`` is the largest change that counts as none.
    """

    name: str
    unit: str
    value: float
    allowed: float
    changes: Mapping[str, float]

    @property
    def is_determined(self) -> bool:
        """True where no repeat changed it by more than is allowed."""
        return not self.changed_by

    @property
    def changed_by(self) -> frozenset[str]:
        """The repeats that changed it by more than is allowed."""
        return frozenset(name for name, change in self.changes.items() if not abs(change) <= self.allowed)


@dataclass(frozen=True, slots=True, repr=False)
class Check:
    """What of a run is determined: its metrics, and its angle and pressures over time.

    ``parts_at`` is the first time [s] at which a repeat is elsewhere by more than 1e-2 of a range, None where none is;
    ``failed`` names the repeats that diverged.
    """

    scenario: str
    metrics: tuple[Changed, ...]
    courses: tuple[Changed, ...]
    parts_at: float | None
    failed: tuple[str, ...]

    @property
    def is_determined(self) -> bool:
        """True where every repeat gave the same metrics and stayed with the run all the time."""
        return not self.failed and all(row.is_determined for row in (*self.metrics, *self.courses))

    @property
    def sentence(self) -> str:
        """What the check found, in plain words."""
        if self.is_determined:
            return (
                f"All metrics are determined: none changes by more than {ALLOWED_CHANGE:.0e} of its value or its range."
            )
        lost = [row for row in (*self.metrics, *self.courses) if not row.is_determined]
        by_move = [row.name for row in lost if row.changed_by & _MOVES]
        by_error = [row.name for row in lost if not row.changed_by & _MOVES]
        what = " or ".join(sorted({name.split()[0] for row in lost for name in row.changed_by & _MOVES}, reverse=True))
        causes = [
            (
                by_move,
                f"a {what} moved by {MOVE:.0e} of its range, which nobody could measure, gives other values. One run "
                f"says nothing there; give the spread over many (ppafo montecarlo).",
            ),
            (
                by_error,
                "half the error gives other values. Take a smaller run.step and check again; nothing determines what "
                "still changes.",
            ),
            (("how it ends",) if self.failed else (), f"the run with {' and that with '.join(self.failed)} diverged."),
        ]
        found = [f"{', '.join(names)}: {cause}" for names, cause in causes if names]
        parting = [] if self.parts_at is None else [f"The runs part at t = {self.parts_at:.4g} s."]
        return " ".join([f"Not determined by this run: {' Nor: '.join(found)}", *parting])

    def __repr__(self) -> str:
        """Return the table of all changes, the time at which the runs part and the sentence."""
        rows = [*self.metrics, *self.courses]
        names = list(rows[0].changes) if rows else []
        cells = [["", "value", "", *names, ""], *([*_cells(row, names)] for row in rows)]
        widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
        table = [
            "  ".join(
                f"{cell:{'<' if column in (0, 2) else '>'}{width}}"
                for column, (cell, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in cells
        ]
        return "\n".join(
            [f"Check of '{self.scenario}': what changes in runs that should be the same", *table, "", self.sentence]
        )

    def document(self) -> dict[str, Any]:
        """Return the check as data that JSON can hold, in SI units."""
        document: dict[str, Any] = plain(self)
        rows = {"metrics": self.metrics, "courses": self.courses}
        judged = {
            group: [{**plain(row), "is_determined": row.is_determined} for row in found]
            for group, found in rows.items()
        }
        return {"is_determined": self.is_determined, "sentence": self.sentence, **document, **judged}


def check_result(result: Result) -> Check:
    """Return what a completed run determines; SimulationError for one that diverged, or that is never the same."""
    scenario = result.scenario
    if not result.status.is_completed:
        raise SimulationError(f"{scenario.name}: the run diverged, so that there is nothing to check")
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
        parts_at=_parting([repeated for _, repeated in found], result, courses),
        failed=tuple(dict.fromkeys(name for name, repeated in found if not repeated.status.is_completed)),
    )


def _check_repeatable(result: Result, run: Run) -> None:
    """Refuse a Python controller that gives another run each time: every change would be its own."""
    controller = result.scenario.control.custom
    if controller is None:
        return
    again = results_of(result.scenario, [run])[0].recording
    if not all(np.array_equal(again[name], result.recording[name]) for name in again.names):
        raise SimulationError(
            f"{result.scenario.name}: {type(controller).__name__} gives another run each time, so that nothing can be "
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
        wanted = angle + move * (plant.angle_max - plant.angle_min)
        angle = min(max(wanted, plant.angle_min), plant.angle_max)
    before, after = chamber_volumes(plant, start.angle), chamber_volumes(plant, angle)
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


def _metrics(result: Result, repeats: list[tuple[str, Result]], pressures: float) -> tuple[Changed, ...]:
    names = dict.fromkeys(name for one in (result, *(repeat for _, repeat in repeats)) for name in one.metrics)
    rows = []
    for name in names:
        kind = next(one.metrics[name] for one in (result, *(r for _, r in repeats)) if name in one.metrics)
        value = _value(result, name)
        changes = _largest((repeat, _difference(_value(repeated, name), value)) for repeat, repeated in repeats)
        scale = max(abs(value) if math.isfinite(value) else 0.0, _metric_range(result, name, kind.unit, pressures))
        rows.append(Changed(name, kind.unit, value, ALLOWED_CHANGE * scale, changes))
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
    angles, torques = actuator.angle_max - actuator.angle_min, actuator.torque_constant * pressures
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


def _apart(one: Recording, other: Recording, channels: Iterable[str]) -> Floats:
    """Largest difference of some channels at each sample that both have."""
    count = min(len(one), len(other))
    return np.asarray(np.max([np.abs(one[name][:count] - other[name][:count]) for name in channels], axis=0))


def _course(name: str, repeats: list[tuple[str, Result]], result: Result, pressures: float) -> Changed:
    actuator = result.scenario.device.actuator
    is_angle = name == "angle over time"
    span, unit = (actuator.angle_max - actuator.angle_min, "rad") if is_angle else (pressures, "Pa")
    changes = _largest(
        (repeat, float(np.max(_apart(repeated.recording, result.recording, _COURSES[name]))))
        for repeat, repeated in repeats
    )
    return Changed(name, unit, span, ALLOWED_PARTING * span, changes)


def _parting(repeats: list[Result], result: Result, courses: tuple[Changed, ...]) -> float | None:
    times = [repeat.status.time for repeat in repeats if repeat.status.time is not None]
    for course in courses:
        for repeat in repeats:
            beyond = _apart(repeat.recording, result.recording, _COURSES[course.name]) > course.allowed
            times += [float(result.recording.time[np.argmax(beyond)])] if beyond.any() else []
    return min(times, default=None)


def _cells(row: Changed, names: list[str]) -> list[str]:
    changes = [f"{row.changes[name]:+.1e}" if row.changes[name] else "0" for name in names]
    mark = "" if row.is_determined else "not determined"
    return [row.name, f"{row.value:.4g}", row.unit.replace("-", ""), *changes, mark]
