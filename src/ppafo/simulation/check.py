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
from ppafo.engine.scheme.actuators import filled_chambers, pressures_of
from ppafo.errors import SimulationError
from ppafo.signals.recording import Recording
from ppafo.simulation.at_hand import RecordedResult
from ppafo.simulation.scenario import Scenario
from ppafo.units.shown import in_units, units_in_force
from ppafo.wording import without_exponent

SHORTER = 4
"""Factor by which the finer run shortens the steps; its allowed error is smaller by the square of this factor."""
MARGIN = 1.5
"""Safety factor on the change: the estimate then exceeds the error in 99 % of drawn runs (docs/evidence.md)."""
# Default error limits relative to the ranges of angle and pressures, and to the gas temperature [-].
LARGEST_OF_ANGLE = 2.0e-4
LARGEST_OF_PRESSURE = 1.0e-3
LARGEST_OF_TEMPERATURE = 2.0e-3
SMALLEST_TOLERANCE = 1.0e-6
"""Smallest ``run.tolerance`` [-] that a scenario may have."""
SMALLEST_TRIED = 0.01
"""Smallest ``run.tolerance`` that is tried for the promised accuracy, divided by the tolerance of the run [-]."""

MOVE = 1.0e-7
"""Perturbation of a start or a measurement, as a fraction of its range."""
ALLOWED_CHANGE = 1.0e-3
"""Largest change of a metric that is ignored, as a fraction of its value or of the range of its quantity."""

FINER = "finer steps"
MOVED_START = "start moved"
MOVED_MEASUREMENT = "measurement moved"
_PERTURBATIONS = frozenset({MOVED_START, MOVED_MEASUREMENT})

DRAWS = 4
"""Number of noise realisations with which measurements are perturbed if the sensors have no noise."""
ALLOWED_PARTING = 1.0e-2
"""Largest difference between two runs over time that is ignored, as a fraction of the range."""
_SIGNALS = {
    "angle over time": (("angle",), "rad", LARGEST_OF_ANGLE),
    "pressures over time": (("pressure_1", "pressure_2"), "Pa", LARGEST_OF_PRESSURE),
    "temperatures over time": (("temperature_1", "temperature_2"), "K", LARGEST_OF_TEMPERATURE),
}
"""Channels that are compared over time, their unit, and the promised error divided by their range [-]."""


_in_own_units = in_units(lambda estimate: estimate.units)


@dataclass(frozen=True, slots=True)
class ErrorEstimate:
    """Estimated time-stepping error of a run.

    ``angle`` [rad], ``pressure`` [Pa] and ``temperature`` [K] are the largest errors over time; ``temperature`` is None
    for gas without an energy balance. ``metrics`` maps each metric to its error in SI units, inf if the finer run lacks
    this metric. ``largest`` names the metric with the largest relative error, "" without metrics, and ``share`` is that
    relative error [-], with respect to the value of the metric or the range of its quantity. ``over_promise`` is the
    largest of the errors of angle, pressure and temperature, divided by the default error limit [-]. ``tolerance`` is a
    ``run.tolerance`` with which a trial run met the limit, 0 if none is needed or none that was tried meets the limit.
    ``units`` are the display units by SI unit.
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
    @_in_own_units
    def sentence(self) -> str:
        """Errors of angle, pressures, temperatures and metrics in display units."""
        from ppafo.report.kind import metric_change

        errors = {"rad": self.angle, "Pa": self.pressure, "K": self.temperature}
        in_display_units = [metric_change(error, unit) for unit, error in errors.items() if error is not None]
        texts = [f"{without_exponent(value, '.1e')} {unit}" for value, unit in in_display_units]
        over_time = f"{', '.join(texts[:-1])} and {texts[-1]}"
        of_metrics = f"; at most {self.share:.1e} of a metric's value ({self.largest})" if self.largest else ""
        within = f"Estimated error of the time steps: at most {over_time} over time{of_metrics}."
        if self.over_promise <= 1.0:
            return within
        no_remedy = (
            "; trials with smaller values of `run.tolerance` do not reach it: repeated impacts, or a loop that "
            "oscillates, may amplify small differences, and the metrics then hold for one run among many"
        )
        remedy = f": `run.tolerance = {self.tolerance:.1g}` reduces it" if self.tolerance else no_remedy
        return f"{within} That is {self.over_promise:.2g} times the promised accuracy of a run{remedy}."


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
    def passes(self) -> bool:
        """True if every repeat completed, and nothing changed but counts of events, which one run seldom determines."""
        return not self.failed and all(row.is_determined or row.unit == "-" for row in (*self.metrics, *self.courses))

    @property
    def sentence(self) -> str:
        """Result of the check in plain words."""
        if self.is_determined:
            return (
                f"All metrics are repeatable: no metric changes by more than {ALLOWED_CHANGE:.0e} of its value or "
                f"range. {self.error.sentence}"
            )
        sensitive = [row for row in (*self.metrics, *self.courses) if not row.is_determined]
        perturbed = [row.name for row in sensitive if row.changed_by & _PERTURBATIONS]
        inexact = [row.name for row in sensitive if not row.changed_by & _PERTURBATIONS]
        sentences = []
        if perturbed:
            kinds = {name.split()[0] for row in sensitive for name in row.changed_by & _PERTURBATIONS}
            sentences.append(
                f"{', '.join(perturbed)}: changed by moving a {' or '.join(sorted(kinds, reverse=True))} by {MOVE:.0e} "
                "of its range, far less than can be measured. One run does not determine these values; give "
                "the spread over many runs (ppafo sweep)."
            )
        if inexact:
            sentences.append(
                f"{', '.join(inexact)}: changed by finer steps with a sixteenth of the error. Set a smaller "
                "run.tolerance and check again; metrics that still change are not repeatable."
            )
        if self.failed:
            sentences.append(f"completion: the run with {' and the run with '.join(self.failed)} diverged.")
        separation = [] if self.parts_at is None else [f"The runs separate at t = {self.parts_at:.4g} s."]
        return " ".join([f"Numerically sensitive: {' Also: '.join(sentences)}", self.error.sentence, *separation])

    @_in_own_units
    def __repr__(self) -> str:
        """Return the table of all changes in display units, and the sentence."""
        from ppafo.report.kind import metric_change, metric_level
        from ppafo.report.writing import align_columns

        names = list(self.metrics[0].changes) if self.metrics else []
        values = [(row, metric_level(row.value, row.unit)) for row in self.metrics]
        # The value of a signal over time is its range, which does not count from the atmosphere.
        values += [(row, metric_change(row.value, row.unit)) for row in self.courses]
        rows = [["", "value", *names, ""]]
        for row, (value, unit) in values:
            changes = [without_exponent(metric_change(row.changes[name], row.unit)[0], "+.1e") for name in names]
            verdict = "" if row.is_determined else "sensitive"
            extent = "range " if row in self.courses else ""
            rows.append([row.name, f"{extent}{value:.4g} {unit}".rstrip(), *changes, verdict])
        head = f"Check of '{self.scenario}': differences between runs that should be equal"
        return "\n".join([head, *align_columns(rows), "", self.sentence])

    def document(self) -> dict[str, Any]:
        """Return the check as data that can be written as JSON, in SI units."""
        document: dict[str, Any] = plain(self)
        for name, rows in (("metrics", self.metrics), ("courses", self.courses)):
            document[name] = [{**plain(row), "is_determined": row.is_determined} for row in rows]
        return {"is_determined": self.is_determined, "sentence": self.sentence, **document}


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


def _compared(
    result: RecordedResult, repeats: Sequence[tuple[str, RecordedResult]]
) -> tuple[list[NumberCheck], list[NumberCheck], list[float]]:
    """Metrics and channels of a result with their changes in repeats, by kind, and times [s] at which repeats part."""
    recording = result.recording
    courses = []
    metrics = []
    parted = [repeat.status.time for _, repeat in repeats if repeat.status.time is not None]
    for name, (compared, unit, promised_error) in _SIGNALS.items():
        channels = [channel for channel in compared if channel in recording]
        if not channels:
            continue
        extent = _signal_range(result, unit)
        allowed = ALLOWED_PARTING * extent
        promised = promised_error * extent / MARGIN
        differences = [(kind, _largest_differences(repeat.recording, recording, channels)) for kind, repeat in repeats]
        changes = _largest_changes((kind, float(np.max(each))) for kind, each in differences)
        courses.append(NumberCheck(name, unit, extent, allowed, changes, promised))
        late = (each > allowed for _, each in differences if np.any(each > allowed))
        parted += [float(recording.time[np.argmax(each)]) for each in late]
    for name, unit in {
        name: each.unit for _, run in (("", result), *repeats) for name, each in run.metrics.items()
    }.items():
        value = _value(result, name)
        changes = _largest_changes((kind, _difference(_value(repeat, name), value)) for kind, repeat in repeats)
        allowed = ALLOWED_CHANGE * max(abs(value) if math.isfinite(value) else 0.0, _metric_range(result, name, unit))
        metrics.append(NumberCheck(name, unit, value, allowed, changes, allowed))
    return metrics, courses, parted


def estimated_error(result: RecordedResult, fine: RecordedResult) -> ErrorEstimate:
    """Estimated error of a result, from the same run with finer steps; inf if the finer run diverged.

    A smaller tolerance for an error beyond the promised accuracy is not sought here (``with_tolerance``).
    """
    metrics, courses, _ = _compared(result, [(FINER, fine)])

    def error(row: NumberCheck) -> float:
        return MARGIN * abs(row.changes[FINER]) if fine.status.is_completed else math.inf

    errors = {row.unit: error(row) for row in courses}
    shares = {}
    known = [row for row in metrics if row.name in result.metrics]
    for row in (row for row in known if math.isfinite(row.value)):
        # Relative to the metric's value or, if larger, to the range of its quantity.
        scale = max(abs(row.value), _metric_range(result, row.name, row.unit))
        if 0.0 < scale < math.inf:
            shares[row.name] = error(row) / scale
    worst = max(shares, key=shares.__getitem__, default="")
    return ErrorEstimate(
        angle=errors["rad"],
        pressure=errors["Pa"],
        metrics={row.name: error(row) for row in known},
        temperature=errors.get("K"),
        largest=worst,
        share=shares.get(worst, 0.0),
        over_promise=max(error(row) / (_SIGNALS[row.name][2] * row.value) for row in courses),
    )


Rerun = Callable[[Sequence[Run]], Sequence[RecordedResult]]
"""Function that executes other planned runs of the same scenario."""


def with_tolerance(scenario: Scenario, error: ErrorEstimate, rerun: Rerun) -> ErrorEstimate:
    """Complete the estimate by a smaller tolerance whose trial run has the promised accuracy, if one is found."""
    from ppafo.simulation.plan import plan_run

    tolerance = scenario.run.tolerance
    over_promise = error.over_promise
    smallest = max(SMALLEST_TRIED * tolerance, SMALLEST_TOLERANCE)
    while over_promise > 1.0:
        # The error is proportional to the tolerance: half of the tolerance that just meets the promise is tried.
        last = tolerance
        tolerance = float(f"{max(0.5 * tolerance / over_promise, smallest):.1g}")
        if tolerance >= last:
            return error
        run = plan_run(replace(scenario, run=replace(scenario.run, tolerance=tolerance)))
        trial, fine = rerun([run, finer(run)])
        over_promise = estimated_error(trial, fine).over_promise if trial.status.is_completed else math.inf
    return replace(error, tolerance=tolerance) if tolerance < scenario.run.tolerance else error


def _signal_range(result: RecordedResult, unit: str) -> float:
    """Range of the angle [rad] or of the pressures [Pa], or the gas temperature [K].

    Pressures are those of chambers, supplies and atmosphere; the atmospheric pressure if their range is 0.
    """
    actuator = result.scenario.device.actuator
    if unit != "Pa":
        return actuator.angle_max - actuator.angle_min if unit == "rad" else result.scenario.device.gas.temperature
    supply = result.scenario.device.supply
    constant = [supply.pressure, supply.dorsiflexion_pressure, supply.atmospheric_pressure]
    chambers = [result.recording[name] for name in ("pressure_1", "pressure_2") if name in result.recording]
    return float(np.ptp(np.concatenate([*chambers, constant]))) or supply.atmospheric_pressure


def checked(result: RecordedResult, run: Run, rerun: Rerun) -> Check:
    """Return the repeatability check of a result, from its planned run.

    Raises SimulationError for a Python controller that gives a different run each time, which makes a check impossible.
    """
    scenario = result.scenario
    recording = result.recording
    controller = scenario.controller.custom
    if controller is not None:
        same = rerun([run])[0].recording
        if not all(np.array_equal(same[name], recording[name]) for name in same.names):
            raise SimulationError(
                f"{scenario.name}: {type(controller).__name__} gives different results in equal runs and cannot "
                f"be checked; reset() must restore the initial state, and random numbers need a fixed seed"
            )
    starts = [start_moved(run, move, opposite) for opposite in (1.0, -1.0) for move in (MOVE, -MOVE)]
    runs = [(FINER, finer(run)), *((MOVED_START, moved) for moved in starts)]
    if not run.program.ideal_sensors:
        sensors = run.sensors
        angles = _signal_range(result, "rad")
        pressures = _signal_range(result, "Pa")
        # One draw alone seldom crosses a step of a coarse sensor without noise.
        draws = 1 if sensors.angle_noise or sensors.pressure_noise else DRAWS
        for draw, move in product(range(draws), (MOVE, -MOVE)):
            noise = sensors.angle_noise + move * angles, sensors.pressure_noise + move * pressures
            changed = sensors._replace(angle_noise=noise[0], pressure_noise=noise[1], seed=sensors.seed + draw)
            runs.append((MOVED_MEASUREMENT, replace(run, sensors=changed)))
    results = rerun([planned for _, planned in runs])
    repeats = [(kind, repeat) for (kind, _), repeat in zip(runs, results, strict=True)]
    metrics, courses, parted = _compared(result, repeats)
    return Check(
        scenario=scenario.name,
        metrics=tuple(metrics),
        courses=tuple(courses),
        error=with_tolerance(scenario, estimated_error(result, results[0]), rerun),
        parts_at=min(parted, default=None),
        failed=tuple(dict.fromkeys(kind for kind, repeat in repeats if not repeat.status.is_completed)),
    )


def start_moved(run: Run, move: float, opposite: float) -> Run:
    """Run that starts with slightly more gas in both chambers and, for a free vane, at a slightly larger angle.

    With ``opposite`` -1 chamber 2 starts with slightly less gas instead, so that a torque that equals the reference
    exactly no longer does.
    """
    plant = run.plant
    start = run.initial
    angle = start.angle
    if run.program.angle is None:
        shifted = angle + move * (plant.angle_max - plant.angle_min)
        # A start beyond a stop is no state of the vane.
        angle = min(max(shifted, plant.angle_min), plant.angle_max)
    actuator = run.program.actuator
    pressures = pressures_of(actuator, plant, start.angle, start.mass_1, start.mass_2)
    before, after = (filled_chambers(actuator, plant, vane_angle, *pressures) for vane_angle in (start.angle, angle))
    # Mass in proportion to volume keeps the pressure, so that only the move itself changes it.
    mass_1 = start.mass_1 * after[0] / before[0] * (1.0 + move)
    mass_2 = start.mass_2 * after[1] / before[1] * (1.0 + opposite * move)
    return replace(run, initial=start._replace(angle=angle, mass_1=mass_1, mass_2=mass_2))


def _value(result: RecordedResult, name: str) -> float:
    return result.metrics[name].value if name in result.metrics else math.nan


def _difference(after: float, before: float) -> float:
    """Change from ``before`` to ``after``; inf if only one of the two is finite."""
    if math.isfinite(after) and math.isfinite(before):
        return after - before
    # Equal infinities and two values that are not known are no change.
    return 0.0 if after == before or (math.isnan(after) and math.isnan(before)) else math.inf


def _largest_changes(changes: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Largest signed change over all perturbations, by kind of repeat."""
    largest: dict[str, float] = {}
    for name, change in changes:
        largest[name] = max(largest.get(name, 0.0), change, key=abs)
    return largest


def _metric_range(result: RecordedResult, name: str, unit: str) -> float:
    """Range of the quantity of a metric; 1 for a count of events, 0 for a unit without a range."""
    scenario = result.scenario
    recording = result.recording
    angles = _signal_range(result, "rad")
    pressures = _signal_range(result, "Pa")
    torques = abs(scenario.device.actuator.torque_constant) * pressures
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
    # A ratio of work and gas is as uncertain as both are; where one is next to nothing, the ratio means nothing.
    of_ratio = {"mechanical_work": ranges["J"], "gas_supplied": ranges["kg"]}
    values = {metric: abs(_value(result, metric)) for metric in of_ratio}
    if not all(value > ALLOWED_CHANGE * of_ratio[metric] for metric, value in values.items()):
        return math.inf
    return abs(_value(result, name)) * max(of_ratio[metric] / value for metric, value in values.items())


def _largest_differences(recording: Recording, other: Recording, channels: Iterable[str]) -> Floats:
    """Largest difference over the channels at each sample that both recordings have."""
    # A repeat that diverged is shorter.
    count = min(len(recording), len(other))
    return np.asarray(np.max([np.abs(recording[name][:count] - other[name][:count]) for name in channels], axis=0))
