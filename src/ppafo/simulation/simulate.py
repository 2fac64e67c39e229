"""One run: its result, how it comes about, and what it determines."""

import math
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.documents.json_text import plain
from ppafo.engine.lanes import BatchResult, Floats, load_program, load_programs
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, batch_of, run_together, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, volumes_of
from ppafo.errors import SimulationError
from ppafo.signals.recording import Recording
from ppafo.simulation.accuracy import LARGEST_OF_ANGLE, LARGEST_OF_PRESSURE, MARGIN, ErrorEstimate, finer
from ppafo.simulation.check import ALLOWED_CHANGE, FINER, MOVE, MOVED_MEASUREMENT, MOVED_START, Check, NumberCheck
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import (
    Scenario,
    scenario_document,
)
from ppafo.version import __version__

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from ppafo.metrics.metric import Metric

REMEDY = (
    "the step may be too long for this device, or a value unrealistic: try a smaller run.step, "
    "and check the inertia, the volumes and the valve area (ppafo sets audit)"
)

_OF_STEPS = ("result.failure_time", "result.too_many_parts", "pace.", "valve_state.", "controller_state.")
"""Rows of the time stepping of which no recording of a vane is made."""

DRAWS = 4
"""Draws of what moves the measurements of sensors without noise."""
ALLOWED_PARTING = 1.0e-2
"""Largest difference of two runs over time that counts as none, as a fraction of the range."""
_COURSES = {"angle over time": ("angle",), "pressures over time": ("pressure_1", "pressure_2")}


@dataclass(frozen=True, slots=True)
class Status:
    """How a run ended: ``time`` [s] is where a diverged run stopped; ``message`` says its state and the remedy."""

    kind: Literal["completed", "diverged"]
    time: float | None = None
    message: str = ""

    @property
    def is_completed(self) -> bool:
        """True where the run reached the end of the scenario."""
        return self.kind == "completed"


Measured = tuple[Recording, "Mapping[str, Metric]", str]
"""The channels of a run, its metrics, and how it ended if it was completed, in words."""


@dataclass(frozen=True, slots=True, repr=False)
class Result:
    """A finished run. ``versions`` are the packages', ``engine`` the figures of the time stepping."""

    scenario: Scenario
    recording: Recording
    metrics: "Mapping[str, Metric]"
    status: Status
    versions: Mapping[str, str]
    engine: Mapping[str, float | int | str]

    _measure: Callable[[], Measured] | None = field(default=None, init=False, repr=False, compare=False)
    """What makes recording and metrics of a run until they are first asked for: many runs are never looked at."""

    def __getattr__(self, name: str) -> Any:
        """Return recording or metrics where they were not made yet, and keep both."""
        # Python comes here only where the ordinary look-up fails, as for a field that was never set.
        if name not in ("recording", "metrics"):
            raise AttributeError(f"a result has no '{name}'", name=name, obj=self)
        measure = self._measure
        if measure is not None:
            recording, metrics, _ = measure()
            # The class is frozen, and these two are only kept, so they are set past it.
            object.__setattr__(self, "recording", recording)
            object.__setattr__(self, "metrics", metrics)
            object.__setattr__(self, "_measure", None)
        return object.__getattribute__(self, name)

    def __repr__(self) -> str:
        """Return name, status, duration and one line a metric, in SI units."""
        scenario, status = self.scenario, self.status
        width = max((len(name) for name in self.metrics), default=0)
        lines = [f"  {name:<{width}}  {item.value:.4g} {item.unit}" for name, item in self.metrics.items()]
        return "\n".join(
            [f"Result of '{scenario.name}', {scenario.run.duration:g} s: {status.message or status.kind}", *lines]
        )

    def __str__(self) -> str:
        """Return what ``ppafo simulate`` prints: status and metrics in the units that people are shown."""
        from ppafo.report.display_units import metrics_lines

        head = f"{self.scenario.name}: {self.status.kind}"
        return "\n".join([head, "", *metrics_lines(self.metrics, self.scenario.device.supply.atmospheric_pressure)])

    def plot(self) -> "Figure":
        """Return a figure of angle, pressures, torque, command and gas; ``.savefig(...)`` writes it."""
        from ppafo.report.recording_figure import recording_figure

        remark = "" if self.status.is_completed else self.status.message
        atmosphere = self.scenario.device.supply.atmospheric_pressure
        valve = self.scenario.device.valve.kind
        return recording_figure(self.recording, self.scenario.name, remark, atmosphere, valve)

    def error(self) -> ErrorEstimate:
        """Return the estimated error [SI] of this run from its steps: it runs again with a sixteenth of it.

        SimulationError for a run that diverged.
        """
        if not self.status.is_completed:
            raise SimulationError(f"{self.scenario.name}: the run diverged, so its error cannot be estimated")
        return _error(self, results_of(self.scenario, [finer(plan_run(self.scenario))])[0])

    def check(self) -> Check:
        """Return whether this run can be repeated: with finer steps, and with start and measurements moved.

        SimulationError for a run that diverged, and for a Python controller that gives a different run each time.
        """
        scenario = self.scenario
        if not self.status.is_completed:
            raise SimulationError(f"{scenario.name}: the run diverged, so there is nothing to check")
        run = plan_run(scenario)
        _check_repeatable(self, run)
        # Highest less lowest pressure [Pa] that the chambers had or are connected to; the atmosphere's if there is one.
        supply, recording = self.scenario.device.supply, self.recording
        outside = [supply.pressure, supply.dorsiflexion_pressure, supply.atmospheric_pressure]
        values = np.concatenate([recording["pressure_1"], recording["pressure_2"], outside])
        pressures = float(np.ptp(values)) or supply.atmospheric_pressure
        repeats = _repeats(run, pressures)
        results = results_of(scenario, [repeat for _, repeat in repeats])
        found = [(name, repeated) for (name, _), repeated in zip(repeats, results, strict=True)]
        courses = tuple(_course(name, found, self, pressures) for name in _COURSES)
        return Check(
            scenario=scenario.name,
            metrics=_metrics(self, found, pressures),
            courses=courses,
            error=_error(self, results[0]),
            parts_at=_time_of_parting([repeated for _, repeated in found], self, courses),
            failed=tuple(dict.fromkeys(name for name, repeated in found if not repeated.status.is_completed)),
            atmosphere=scenario.device.supply.atmospheric_pressure,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what ``run.json`` says of a result, beside what storage adds to it, as plain data in SI units."""
        return {
            "status": plain(self.status),
            "metrics": {name: plain(metric) for name, metric in self.metrics.items()},
            "versions": dict(self.versions),
            "seed": self.scenario.sensors.seed,
            "engine": plain(self.engine),
            "scenario": scenario_document(self.scenario),
        }

    def dataset(self) -> "xarray.Dataset":
        """Return the recording as an xarray Dataset; attributes hold units, long names and the scenario as JSON."""
        from ppafo.storage import dataset_of

        return dataset_of(self.recording, scenario_document(self.scenario))

    def save(self, folder: str | Path, attachments: Mapping[str, bytes] | None = None) -> Path:
        """Write ``recording.nc``, ``recording.csv``, ``run.json`` and any attachments (contents by file name).

        The folder is complete or not there; an earlier result in it is replaced. Returns the folder.
        """
        from ppafo.storage import write_result

        return write_result(folder, self.recording, self.to_dict(), attachments or {})


def simulate(scenario: Scenario) -> Result:
    """Run one scenario. A run that diverges is a Result with that status, up to the time of failure."""
    return results_of(scenario, [plan_run(scenario)])[0]


def results_of(scenario: Scenario, runs: Sequence[Run]) -> list[Result]:
    """Results of runs of one scenario, as planned or with other numbers; a Python controller has them in turn."""
    custom = scenario.controller.custom
    if custom is None:
        outcomes = run_together(runs)
    else:
        from ppafo.simulation.sampled import run_sampled

        outcomes = [run_sampled(batch_of(run), custom) for run in runs]
    return [result_of(scenario, run, outcome) for run, outcome in zip(runs, outcomes, strict=True)]


def simulate_many(scenarios: Sequence[Scenario], threads: int | None = None) -> list[Result]:
    """Run many scenarios side by side, each exactly as if it ran alone."""
    runs = [plan_run(scenario) for scenario in scenarios]
    # A Python controller does not run in the lanes: its scenario runs by itself below.
    inside = [index for index, scenario in enumerate(scenarios) if scenario.controller.custom is None]
    outcomes = dict(zip(inside, run_together([runs[index] for index in inside], threads), strict=True))
    return [
        result_of(scenario, run, outcomes[index]) if index in outcomes else simulate(scenario)
        for index, (scenario, run) in enumerate(zip(scenarios, runs, strict=True))
    ]


def result_of(scenario: Scenario, run: Run, outcome: BatchResult) -> Result:
    """The result of what a run came to; one that was stopped has the records up to there."""
    rows = state_row_numbers(run)
    times: Floats = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    record = outcome.record[:, :, 0]
    status = _status(outcome, record, rows, times)
    # The first sample stays in any case: a recording is never empty.
    kept = times.size if status.time is None else max(1, int(np.searchsorted(times, status.time)))
    versions = {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__}
    engine = {"step": run.step, "steps": run.step_count, "steps_per_sample": run.steps_per_sample}
    if scenario.walks:
        # A walk is measured at once, for its status says how it ended.
        recording, metrics, ended = _measured(scenario, run, times[:kept], record[:kept], rows)
        status = replace(status, message=ended) if status.is_completed else status
        return Result(scenario, recording, metrics, status, versions, engine)
    shown = {path: row for path, row in rows.items() if not path.startswith(_OF_STEPS)}
    # Without __init__ recording and metrics stay unset, so that __getattr__ makes them when first asked for.
    result: Result = object.__new__(Result)
    known = {"scenario": scenario, "status": status, "versions": versions, "engine": engine}
    measure = partial(_measured, scenario, run, times[:kept], record[:kept], shown)
    for name, value in {**known, "_measure": measure}.items():
        object.__setattr__(result, name, value)
    return result


def _measured(scenario: Scenario, run: Run, times: Floats, record: Floats, rows: Mapping[str, int]) -> "Measured":
    """Recording and metrics of a record (samples, rows), and how a completed run ended."""
    from ppafo.metrics.metric import Metrics

    by_path = {path: np.ascontiguousarray(record[:, row]) for path, row in rows.items()}
    recording, metrics, ended = scenario.motion.motion_kind.measured(scenario, run, times, by_path)
    return recording, Metrics(metrics), ended


def _status(outcome: BatchResult, record: Floats, rows: dict[str, int], times: Floats) -> Status:
    """Completed, or diverged with time, the last good state and what to do."""
    failed = float(outcome.states[rows["result.failure_time"], 0])
    if failed >= NEVER_FAILED and bool(np.isfinite(outcome.states).all()):
        return Status("completed", None, "completed")
    # Without a time of failure the last sample is the best that is known.
    time = failed if failed < NEVER_FAILED else float(times[-1])
    # The last sample before the failure: the one at it need not be finite.
    last = record[max(0, int(np.searchsorted(times, time)) - 1)]
    state = ", ".join(
        f"{name.replace('_', ' ')} {last[rows[f'state.{name}']]:.4g} {unit}"
        for name, unit in (("angle", "rad"), ("angular_velocity", "rad/s"), ("mass_1", "kg"), ("mass_2", "kg"))
    )
    remedy = TOO_MANY_PARTS if outcome.states[rows["result.too_many_parts"], 0] else REMEDY
    return Status("diverged", time, f"diverged at t = {time:.6g} s (before that: {state}); {remedy}")


def compile_models(scenarios: Iterable[Scenario]) -> None:
    """Compile the models of scenarios into the cache, unless they are there; nothing is run."""
    programs = [plan_run(scenario).program for scenario in scenarios]
    load_programs(programs)
    for program in programs:
        load_program(program)


def _error(result: Result, fine: Result) -> ErrorEstimate:
    """The estimated error of a result, from the same run with finer steps; inf where that diverged."""
    if not fine.status.is_completed:
        return ErrorEstimate(math.inf, math.inf, dict.fromkeys(result.metrics, math.inf))
    angle, pressure = (
        MARGIN * float(np.max(_largest_differences(fine.recording, result.recording, names)))
        for names in _COURSES.values()
    )
    changes = {name: abs(_difference(_value(fine, name), _value(result, name))) for name in result.metrics}
    return ErrorEstimate(angle, pressure, {name: MARGIN * change for name, change in changes.items()})


def _check_repeatable(result: Result, run: Run) -> None:
    """Refuse a Python controller that gives a different run each time: every change would be its own."""
    controller = result.scenario.controller.custom
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
    starts = [_start_moved(run, move, apart) for apart in (1.0, -1.0) for move in (MOVE, -MOVE)]
    repeats = [(FINER, finer(run)), *((MOVED_START, moved) for moved in starts)]
    if run.program.ideal_sensors:
        return repeats
    return [*repeats, *((MOVED_MEASUREMENT, moved) for moved in _measurements_moved(run, pressures))]


def _start_moved(run: Run, move: float, apart: float) -> Run:
    """The run from a little more gas in both chambers, and where the vane is free from a little further on.

    With ``apart`` -1 chamber 2 has a little less instead: a torque that is exactly the wanted one then is so no more.
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


def _metrics(result: Result, repeats: list[tuple[str, Result]], pressures: float) -> tuple[NumberCheck, ...]:
    names = dict.fromkeys(name for one in (result, *(repeat for _, repeat in repeats)) for name in one.metrics)
    rows = []
    for name in names:
        kind = next(one.metrics[name] for one in (result, *(r for _, r in repeats)) if name in one.metrics)
        value = _value(result, name)
        changes = _largest((repeat, _difference(_value(repeated, name), value)) for repeat, repeated in repeats)
        scale = max(abs(value) if math.isfinite(value) else 0.0, _metric_range(result, name, kind.unit, pressures))
        rows.append(NumberCheck(name, kind.unit, value, ALLOWED_CHANGE * scale, changes, ALLOWED_CHANGE * scale))
    return tuple(rows)


def _value(result: Result, name: str) -> float:
    return result.metrics[name].value if name in result.metrics else math.nan


def _difference(now: float, before: float) -> float:
    """The change; inf where only one of both is a number."""
    if math.isfinite(now) and math.isfinite(before):
        return now - before
    # Equal infinities and two values that are not known are no change.
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
        "kg": max(_value(result, "gas_supplied"), _largest_content(recording)),
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


def _largest_content(recording: Recording) -> float:
    """Largest mass [kg] in both chambers; 0 in a walk, which does not record it and takes more than that."""
    masses = [recording[name] for name in ("mass_1", "mass_2") if name in recording]
    return float(np.max(sum(masses))) if masses else 0.0


def _largest_differences(one: Recording, other: Recording, channels: Iterable[str]) -> Floats:
    """Largest difference of some channels at each sample that both have."""
    # A repeat that diverged is shorter.
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
    allowed_error = (LARGEST_OF_ANGLE if is_angle else LARGEST_OF_PRESSURE) * span / MARGIN
    return NumberCheck(name, unit, span, ALLOWED_PARTING * span, changes, allowed_error)


def _time_of_parting(repeats: list[Result], result: Result, courses: tuple[NumberCheck, ...]) -> float | None:
    times = [repeat.status.time for repeat in repeats if repeat.status.time is not None]
    for course in courses:
        for repeat in repeats:
            beyond = _largest_differences(repeat.recording, result.recording, _COURSES[course.name]) > course.allowed
            times += [float(result.recording.time[np.argmax(beyond)])] if beyond.any() else []
    return min(times, default=None)
