"""Reliability of a run: time-stepping error, and repeatability.

The time-stepping error falls with the allowed error, so the difference from a run with a sixteenth of the allowed
error is nearly the whole error. A loop with coarse sensors or repeated impacts may amplify an unmeasurably small
difference into different results. The run is therefore repeated with slightly perturbed start and measurements;
metrics that change then are numerically sensitive: their values hold for one run among many.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ppafo.documents.json_text import plain
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.engine.scheme.actuators import pressures_of, volumes_of
from ppafo.errors import SimulationError
from ppafo.signals.recording import Recording
from ppafo.simulation.at_hand import RecordedResult
from ppafo.units import without_exponent
from ppafo.units.shown import in_units, units_in_force

SHORTER = 4
"""Factor by which the finer run shortens the steps; its allowed error is smaller by the square of this factor."""
MARGIN = 1.5
"""Safety factor on the change: the estimate then exceeds the error in 99 % of drawn runs (docs/evidence.md)."""
LARGEST_OF_ANGLE, LARGEST_OF_PRESSURE, LARGEST_OF_TEMPERATURE = 2.0e-4, 1.0e-3, 2.0e-3
"""Default error limits relative to the ranges of angle and pressures, and to the gas temperature [-]."""
SMALLEST_TOLERANCE = 1.0e-6
"""Smallest allowed ``run.tolerance`` [-]."""

MOVE = 1.0e-7
"""Perturbation of a start or a measurement, as a fraction of its range."""
ALLOWED_CHANGE = 1.0e-3
"""Largest change of a metric that is ignored, as a fraction of its value or of the range of its quantity."""

FINER, MOVED_START, MOVED_MEASUREMENT = "finer steps", "start moved", "measurement moved"
_MOVES = frozenset({MOVED_START, MOVED_MEASUREMENT})

DRAWS = 4
"""Number of noise realisations with which measurements are perturbed if the sensors have no noise."""
ALLOWED_PARTING = 1.0e-2
"""Largest difference between two runs over time that is ignored, as a fraction of the range."""
_TEMPERATURES = "temperatures over time"
_COURSES = {
    "angle over time": ("angle",),
    "pressures over time": ("pressure_1", "pressure_2"),
    _TEMPERATURES: ("temperature_1", "temperature_2"),
}


def _units_of(shown: "ErrorEstimate | Check") -> Mapping[str, str]:
    return shown.units


@dataclass(frozen=True, slots=True)
class ErrorEstimate:
    """Estimated time-stepping error of a run.

    ``angle`` [rad], ``pressure`` [Pa] and ``temperature`` [K] are the largest errors over time; ``temperature`` is None
    for gas without an energy balance. ``metrics`` maps each metric to its error in SI units, inf if the finer run lacks
    this metric. ``largest`` names the metric with the largest relative error, "" without metrics, and ``share`` is that
    relative error [-], with respect to the value of the metric or the range of its quantity. ``over_promise`` is the
    largest of the errors of angle, pressure and temperature, divided by the default error limit [-]. ``tolerance`` is a
    ``run.tolerance`` that meets the limit, 0 if none is needed. ``units`` are the display units by SI unit.
    """

    angle: float
    pressure: float
    metrics: Mapping[str, float]
    temperature: float | None = None
    largest: str = ""
    share: float = 0.0
    over_promise: float = 0.0
    tolerance: float = 0.0
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    @in_units(_units_of)
    def sentence(self) -> str:
        """Errors of angle, pressures, temperatures and metrics in display units."""
        from ppafo.report.display_units import metric_change

        errors = {"rad": self.angle, "Pa": self.pressure, "K": self.temperature}
        shown = [metric_change(error, unit) for unit, error in errors.items() if error is not None]
        texts = [f"{without_exponent(value, '.1e')} {unit}" for value, unit in shown]
        over_time = f"{', '.join(texts[:-1])} and {texts[-1]}"
        of_metrics = f"; of a metric at most {self.share:.1e} of it ({self.largest})" if self.largest else ""
        beyond = ""
        if self.over_promise > 1.0:
            remedy = f": `run.tolerance = {self.tolerance:.1g}` reduces it" if self.tolerance else ""
            beyond = f" That is {self.over_promise:.2g} times what a run promises{remedy}."
        return f"Estimated error of the steps: at most {over_time} over time{of_metrics}.{beyond}"


@dataclass(frozen=True, slots=True)
class NumberCheck:
    """Change of one quantity [SI] between the run and each repeat.

    ``value`` is the value of a metric, or the range of a channel. ``changes`` maps each kind of repeat to the change of
    the metric, or to the largest change of the channel over time; inf if the repeat lacks the value. ``allowed`` is the
    largest allowed change under perturbation, ``allowed_error`` the largest allowed change with finer steps.
    """

    name: str
    unit: str
    value: float
    allowed: float
    changes: Mapping[str, float]
    allowed_error: float

    @property
    def is_determined(self) -> bool:
        """True if no repeat changed the value by more than the allowed change."""
        return not self.changed_by

    @property
    def changed_by(self) -> frozenset[str]:
        """Kinds of repeat that changed the value by more than the allowed change."""
        return frozenset(
            name
            for name, change in self.changes.items()
            if not abs(change) <= (self.allowed_error if name == FINER else self.allowed)
        )


@dataclass(frozen=True, slots=True, repr=False)
class Check:
    """Repeatability of a run.

    ``metrics`` and ``courses`` (angle, pressures and temperatures over time) hold the changes in the repeats. ``error``
    is the estimated time-stepping error, from a run with a sixteenth of the allowed error. ``parts_at`` is the first
    time [s] at which a repeat differs by more than 1e-2 of a range, None if none does. ``failed`` names the kinds of
    repeat that diverged. ``units`` are the display units by SI unit.
    """

    scenario: str
    metrics: tuple[NumberCheck, ...]
    courses: tuple[NumberCheck, ...]
    error: ErrorEstimate
    parts_at: float | None
    failed: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    def is_determined(self) -> bool:
        """True if every repeat completed with the same metrics and the same channels over time."""
        return not self.failed and all(row.is_determined for row in (*self.metrics, *self.courses))

    @property
    def sentence(self) -> str:
        """Result of the check in plain words."""
        if self.is_determined:
            return (
                f"All metrics are repeatable: none changes by more than {ALLOWED_CHANGE:.0e} of its value or its "
                f"range. {self.error.sentence}"
            )
        lost = [row for row in (*self.metrics, *self.courses) if not row.is_determined]
        by_move = [row.name for row in lost if row.changed_by & _MOVES]
        by_error = [row.name for row in lost if not row.changed_by & _MOVES]
        what = " or ".join(sorted({name.split()[0] for row in lost for name in row.changed_by & _MOVES}, reverse=True))
        causes = [
            (
                by_move,
                f"a {what} moved by {MOVE:.0e} of its range, far below what can be measured, changes them. One run "
                f"is no evidence of their values; give the spread over many (ppafo sweep --statistic).",
            ),
            (
                by_error,
                "finer steps with a sixteenth of the error change them. Take a smaller run.tolerance and check "
                "again; metrics that still change are not repeatable.",
            ),
            (("how it ends",) if self.failed else (), f"the run with {' and that with '.join(self.failed)} diverged."),
        ]
        sentences = [f"{', '.join(names)}: {cause}" for names, cause in causes if names]
        parting = [] if self.parts_at is None else [f"The runs separate at t = {self.parts_at:.4g} s."]
        return " ".join([f"Numerically sensitive: {' Also: '.join(sentences)}", self.error.sentence, *parting])

    @in_units(_units_of)
    def __repr__(self) -> str:
        """Return the table of all changes in display units, and the sentence."""
        from ppafo.report.display_units import metric_change, metric_level
        from ppafo.report.writing import align_columns

        names = list(self.metrics[0].changes) if self.metrics else []
        shown = [(row, metric_level(row.value, row.unit)) for row in self.metrics]
        # The value of a course is a range, which does not count from the atmosphere.
        shown += [(row, metric_change(row.value, row.unit)) for row in self.courses]
        rows = [["", "value", *names, ""]]
        for row, (value, unit) in shown:
            changes = [without_exponent(metric_change(row.changes[name], row.unit)[0], "+.1e") for name in names]
            verdict = "" if row.is_determined else "sensitive"
            rows.append([row.name, f"{value:.4g} {unit}".rstrip(), *changes, verdict])
        head = f"Check of '{self.scenario}': what changes in runs that should be the same"
        return "\n".join([head, *align_columns(rows), "", self.sentence])

    def document(self) -> dict[str, Any]:
        """Return the check as data that can be written as JSON, in SI units."""
        document: dict[str, Any] = plain(self)
        rows = {"metrics": self.metrics, "courses": self.courses}
        judged = {
            group: [{**plain(row), "is_determined": row.is_determined} for row in row] for group, row in rows.items()
        }
        return {"is_determined": self.is_determined, "sentence": self.sentence, **document, **judged}


Again = Callable[[Sequence[Run]], Sequence[RecordedResult]]
"""Function that executes other planned runs of the same scenario."""


def finer(run: Run) -> Run:
    """Return a run, or an ensemble, with a sixteenth of the allowed error and a quarter of the step size."""
    return replace(
        run,
        tolerance=run.tolerance / SHORTER**2,
        step=run.step / SHORTER,
        step_count=SHORTER * run.step_count,
        steps_per_sample=SHORTER * run.steps_per_sample,
        record_every=SHORTER * run.record_every,
    )


def estimated_error(result: RecordedResult, fine: RecordedResult) -> ErrorEstimate:
    """Estimated error of a result, from the same run with finer steps; inf if the finer run diverged."""
    courses = list(_courses_of(result).values())
    if not fine.status.is_completed:
        errors_at_end, errors = [math.inf for _ in courses], dict.fromkeys(result.metrics, math.inf)
    else:
        largest = [np.max(_largest_differences(fine.recording, result.recording, names)) for names in courses]
        errors_at_end = [MARGIN * float(difference) for difference in largest]
        changes = {name: abs(_difference(_value(fine, name), _value(result, name))) for name in result.metrics}
        errors = {name: MARGIN * change for name, change in changes.items()}
    angle, pressure = errors_at_end[:2]
    temperature = errors_at_end[2] if len(errors_at_end) > 2 else None
    shares = _shares(result, errors)
    worst = max(shares, key=lambda name: shares[name], default="")
    device, own = result.scenario.device, result.scenario.run.tolerance
    promised = LARGEST_OF_PRESSURE * _pressure_range(result)
    over = [angle / (LARGEST_OF_ANGLE * (device.actuator.angle_max - device.actuator.angle_min)), pressure / promised]
    if temperature is not None:
        over.append(temperature / (LARGEST_OF_TEMPERATURE * device.gas.temperature))
    # The allowed error goes with the tolerance; with half of what is needed it is met.
    less = max(0.5 * own / max(over), SMALLEST_TOLERANCE) if max(over) > 0.0 else own
    return ErrorEstimate(
        angle=angle,
        pressure=pressure,
        metrics=errors,
        temperature=temperature,
        largest=worst,
        share=shares.get(worst, 0.0),
        over_promise=max(over),
        tolerance=less if max(over) > 1.0 and less < own else 0.0,
    )


def _courses_of(result: RecordedResult) -> dict[str, tuple[str, ...]]:
    """Recorded channels that are compared over time, grouped by their description."""
    recorded = {
        words: tuple(name for name in channels if name in result.recording) for words, channels in _COURSES.items()
    }
    return {words: channels for words, channels in recorded.items() if channels}


def _shares(result: RecordedResult, errors: Mapping[str, float]) -> dict[str, float]:
    """Relative errors of metrics [-]: divided by the metric's value or, if larger, the range of its quantity."""
    pressures = _pressure_range(result)
    scales = {
        name: max(abs(metric.value), _metric_range(result, name, metric.unit, pressures))
        for name, metric in result.metrics.items()
        if math.isfinite(metric.value)
    }
    return {name: errors[name] / scale for name, scale in scales.items() if 0.0 < scale < math.inf}


def _pressure_range(result: RecordedResult) -> float:
    """Range of the chamber, supply and atmospheric pressures [Pa]; the atmospheric pressure if the range is 0."""
    supply = result.scenario.device.supply
    outside = [supply.pressure, supply.dorsiflexion_pressure, supply.atmospheric_pressure]
    chambers = [result.recording[name] for name in _COURSES["pressures over time"] if name in result.recording]
    values = np.concatenate([*chambers, outside])
    return float(np.ptp(values)) or supply.atmospheric_pressure


def checked(result: RecordedResult, run: Run, again: Again) -> Check:
    """Return the repeatability check of a result, from its planned run.

    Raises SimulationError for a Python controller that gives a different run each time, which makes a check impossible.
    """
    scenario, recording = result.scenario, result.recording
    controller = scenario.controller.custom
    if controller is not None:
        same = again([run])[0].recording
        if not all(np.array_equal(same[name], recording[name]) for name in same.names):
            raise SimulationError(
                f"{scenario.name}: {type(controller).__name__} gives a different run each time, so nothing can be "
                f"checked; its reset() must forget everything, and its random numbers need a fixed seed"
            )
    pressures = _pressure_range(result)
    starts = [start_moved(run, move, apart) for apart in (1.0, -1.0) for move in (MOVE, -MOVE)]
    repeats = [(FINER, finer(run)), *((MOVED_START, moved) for moved in starts)]
    if not run.program.ideal_sensors:
        # A little more noise on each sensor, either way; one draw alone seldom crosses a step of a coarse sensor.
        sensors, angles = run.sensors, run.plant.angle_max - run.plant.angle_min
        draws = 1 if sensors.angle_noise or sensors.pressure_noise else DRAWS
        for draw, move in product(range(draws), (MOVE, -MOVE)):
            noisy = sensors._replace(
                angle_noise=sensors.angle_noise + move * angles,
                pressure_noise=sensors.pressure_noise + move * pressures,
                seed=sensors.seed + draw,
            )
            repeats.append((MOVED_MEASUREMENT, replace(run, sensors=noisy)))
    results = again([repeat for _, repeat in repeats])
    checked = [(name, repeated) for (name, _), repeated in zip(repeats, results, strict=True)]
    compared = _courses_of(result)
    courses = tuple(_course(words, channels, checked, result, pressures) for words, channels in compared.items())
    partings = [repeated.status.time for repeated in results if repeated.status.time is not None]
    for course in courses:
        for repeated in results:
            beyond = _largest_differences(repeated.recording, recording, compared[course.name]) > course.allowed
            partings += [float(recording.time[np.argmax(beyond)])] if beyond.any() else []
    return Check(
        scenario=scenario.name,
        metrics=_metrics(result, checked, pressures),
        courses=courses,
        error=estimated_error(result, results[0]),
        parts_at=min(partings, default=None),
        failed=tuple(dict.fromkeys(name for name, repeated in checked if not repeated.status.is_completed)),
    )


def start_moved(run: Run, move: float, apart: float) -> Run:
    """Run that starts with slightly more gas in both chambers and, for a free vane, at a slightly larger angle.

    With ``apart`` -1 chamber 2 starts with slightly less gas instead, so that a torque that equals the reference
    exactly no longer does.
    """
    plant, start = run.plant, run.initial
    angle = start.angle
    if run.program.angle is None:
        shifted = angle + move * (plant.angle_max - plant.angle_min)
        # A start beyond a stop is no state of the vane.
        angle = min(max(shifted, plant.angle_min), plant.angle_max)
    actuator = run.program.actuator
    pressures = pressures_of(actuator, plant, start.angle, start.mass_1, start.mass_2)
    before, after = (volumes_of(actuator, plant, at, *pressures) for at in (start.angle, angle))
    # Mass in proportion to volume keeps the pressure, so that only the move itself changes it.
    mass_1 = start.mass_1 * after[0] / before[0] * (1.0 + move)
    mass_2 = start.mass_2 * after[1] / before[1] * (1.0 + apart * move)
    return replace(run, initial=start._replace(angle=angle, mass_1=mass_1, mass_2=mass_2))


def _metrics(
    result: RecordedResult, repeats: list[tuple[str, RecordedResult]], pressures: float
) -> tuple[NumberCheck, ...]:
    names = dict.fromkeys(name for one in (result, *(repeat for _, repeat in repeats)) for name in one.metrics)
    rows = []
    for name in names:
        kind = next(one.metrics[name] for one in (result, *(r for _, r in repeats)) if name in one.metrics)
        value = _value(result, name)
        changes = _largest((repeat, _difference(_value(repeated, name), value)) for repeat, repeated in repeats)
        scale = max(abs(value) if math.isfinite(value) else 0.0, _metric_range(result, name, kind.unit, pressures))
        rows.append(NumberCheck(name, kind.unit, value, ALLOWED_CHANGE * scale, changes, ALLOWED_CHANGE * scale))
    return tuple(rows)


def _value(result: RecordedResult, name: str) -> float:
    return result.metrics[name].value if name in result.metrics else math.nan


def _difference(now: float, before: float) -> float:
    """Change from ``before`` to ``now``; inf if only one of the two is finite."""
    if math.isfinite(now) and math.isfinite(before):
        return now - before
    # Equal infinities and two values that are not known are no change.
    return 0.0 if now == before or (math.isnan(now) and math.isnan(before)) else math.inf


def _largest(changes: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Largest signed change over all perturbations, by kind of repeat."""
    largest: dict[str, float] = {}
    for name, change in changes:
        largest[name] = max(largest.get(name, 0.0), change, key=abs)
    return largest


def _metric_range(result: RecordedResult, name: str, unit: str, pressures: float) -> float:
    """Range of the quantity of a metric; 1 for a count of events, 0 for a unit without a range."""
    scenario, recording = result.scenario, result.recording
    actuator = scenario.device.actuator
    angles, torques = actuator.angle_max - actuator.angle_min, abs(actuator.torque_constant) * pressures
    # Largest mass in both chambers; a walk does not record it, and takes more than that.
    masses = [recording[name] for name in ("mass_1", "mass_2") if name in recording]
    content = float(np.max(sum(masses))) if masses else 0.0
    ranges = {
        "rad": angles,
        "rad/s": float(np.max(np.abs(recording["angular_velocity"]))),
        "Pa": pressures,
        "N m": torques,
        "J": torques * angles,
        "kg": max(_value(result, "gas_supplied"), content),
        "m": float(np.ptp(recording["toe_height"])) if "toe_height" in recording else 0.0,
        "s": scenario.run.duration,
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
    """Largest difference over the channels at each sample that both recordings have."""
    # A repeat that diverged is shorter.
    count = min(len(one), len(other))
    return np.asarray(np.max([np.abs(one[name][:count] - other[name][:count]) for name in channels], axis=0))


def _course(
    name: str,
    channels: tuple[str, ...],
    repeats: list[tuple[str, RecordedResult]],
    result: RecordedResult,
    pressures: float,
) -> NumberCheck:
    device = result.scenario.device
    span, unit, promised = {
        "angle over time": (device.actuator.angle_max - device.actuator.angle_min, "rad", LARGEST_OF_ANGLE),
        "pressures over time": (pressures, "Pa", LARGEST_OF_PRESSURE),
        _TEMPERATURES: (device.gas.temperature, "K", LARGEST_OF_TEMPERATURE),
    }[name]
    changes = _largest(
        (repeat, float(np.max(_largest_differences(repeated.recording, result.recording, channels))))
        for repeat, repeated in repeats
    )
    return NumberCheck(name, unit, span, ALLOWED_PARTING * span, changes, promised * span / MARGIN)
