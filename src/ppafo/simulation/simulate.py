"""Single run of a scenario: its plan, its execution and its result."""

import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.documents.json_text import plain
from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import BatchResult, Floats, load_program, load_programs
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, batch_of, run_together, state_row_numbers
from ppafo.errors import KindError, SimulationError
from ppafo.model.valves.kind import VENT
from ppafo.signals.recording import Recording
from ppafo.simulation.at_hand import RecordedResult, in_own_units
from ppafo.simulation.motion_kind import WALK, Measured
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario, scenario_document
from ppafo.version import __version__
from ppafo.wording import changed_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ppafo.metrics.metric import Metric
    from ppafo.simulation.check import Check, ErrorEstimate
    from ppafo.simulation.tracking import Tracking


REMEDY = (
    "the time step may be too long for this device, or a value unrealistic: try a smaller run.step, "
    "and check the inertia, the volumes and the valve area (ppafo sets audit)"
)


@dataclass(frozen=True, slots=True)
class Status:
    """End of a run: ``time`` [s] at which it stopped before its duration; ``message`` says why, and what to do."""

    kind: Literal["completed", "diverged", "ended early"]
    time: float | None = None
    message: str = ""

    @property
    def is_completed(self) -> bool:
        """True if the run reached the end of the scenario."""
        return self.kind == "completed"


class DeferredResult:
    """Recording and metrics of a run, computed on first use."""

    __slots__ = ("_measured",)

    def __init__(self, measured: Measured | Callable[[], Measured]) -> None:
        self._measured = measured

    def __call__(self) -> Measured:
        """Return recording and metrics; the same objects at every call."""
        # The function that makes them holds all rows of the run, so it is let go once they are made.
        if not isinstance(self._measured, tuple):
            self._measured = self._measured()
        return self._measured

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DeferredResult) and self() == other()

    __hash__ = None  # type: ignore[assignment]  # recordings have no hash

    def __reduce__(self) -> tuple[type["DeferredResult"], tuple[Measured]]:
        """Copy and pickle the recording and metrics only: the program of the run stays in this process."""
        return DeferredResult, (self(),)


@dataclass(frozen=True, slots=True, repr=False)
class Result(RecordedResult):
    """Result of a finished run; ``versions`` are package versions, ``engine`` has step size and numbers of steps.

    ``tries(result)`` returns the verdict with a remedy that was tried; without it remedies are untried.
    """

    scenario: Scenario
    status: Status
    versions: Mapping[str, str]
    engine: Mapping[str, float | int | str]
    measured: DeferredResult
    tries: "Callable[..., Tracking] | None" = field(default=None, compare=False, repr=False)

    @property
    def recording(self) -> Recording:
        """Channels over time, in SI."""
        return self.measured()[0]

    @property
    def metrics(self) -> "Mapping[str, Metric]":
        """Metrics by name, in SI."""
        return self.measured()[1]

    @property
    def tracking(self) -> "Tracking":
        """Verdict on the run: it follows its reference, does not, or is not judged, for a reason."""
        from ppafo.simulation.tracking import tracking_in

        return tracking_in(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Remarks on a missed reference with tried remedies, a stop, replaced values."""
        no_warnings = (self.tracking.said, changed_text(changes_in(self.scenario)))
        return tuple(sentence for sentence in self.to_dict()["verdict"] if sentence not in no_warnings)

    @in_own_units
    def sentences(self, verdict: "Tracking") -> list[str]:
        """Sentences of ``run.json``: unusual proportions of the device, tracking, remarks, and changed values.

        ``verdict`` is ``tracking``, with or without remedies that were tried.
        """
        from ppafo.parameters.audit.proportions import unusual_text
        from ppafo.simulation.tracking.verdict import remarks_on

        remarks = remarks_on(self, not verdict.fails and bool(verdict.said))
        device = unusual_text(self.scenario.device)
        said = (device, verdict.sentence, *remarks, changed_text(changes_in(self.scenario)))
        return list(filter(None, said))

    @in_own_units
    def __repr__(self) -> str:
        """Return name, status, duration and one line per metric, in display units."""
        from ppafo.report.kind import name_lines

        scenario = self.scenario
        status = self.status
        head = f"Result of '{scenario.name}', {scenario.run.duration:g} s: {status.message or status.kind}"
        return "\n".join([head, *name_lines(self.metrics)])

    @in_own_units
    def __str__(self) -> str:
        """Return the output of ``ppafo simulate``: status, verdict, warnings and metrics in the units of the device."""
        from ppafo.report.kind import metrics_lines

        head = [f"{self.scenario.name}: {self.status.kind}", *self.to_dict()["verdict"]]
        return "\n".join([*head, "", *metrics_lines(self.metrics)])

    def _figure(self) -> "Figure":
        from ppafo.report.recording_figure import recording_figure

        remark = "" if self.status.is_completed else self.status.message
        valve = self.scenario.device.valve.kind
        joint = self.scenario.device.joint
        return recording_figure(self.recording, self.scenario.name, remark, valve, joint)

    @in_own_units
    def error(self) -> "ErrorEstimate":
        """Return the estimated time-stepping error [SI], from a second run with a sixteenth of the allowed error.

        Raises SimulationError for a run that diverged.
        """
        if not self.status.is_completed:
            raise SimulationError(f"{self.scenario.name}: the run diverged, so its error cannot be estimated")
        from ppafo.simulation.check import estimated_error, finer, with_tolerance

        rerun = partial(results_of, self.scenario)
        (fine,) = rerun([finer(plan_run(self.scenario))])
        return with_tolerance(self.scenario, estimated_error(self, fine), rerun)

    @in_own_units
    def check(self) -> "Check":
        """Return the repeatability of this run: with finer steps, and with perturbed start and measurements.

        Raises SimulationError for a run that diverged, and for a Python controller that gives a different run each
        time.
        """
        if not self.status.is_completed:
            raise SimulationError(f"{self.scenario.name}: the run diverged and cannot be checked")
        from ppafo.simulation.check import checked

        return checked(self, plan_run(self.scenario), partial(results_of, self.scenario))

    @in_own_units
    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``run.json`` as plain data in SI units, except the fields added by storage."""
        verdict = self.tracking if self.tries is None else self.tries(self)
        return {
            "status": plain(self.status),
            "verdict": self.sentences(verdict),
            "metrics": {name: plain(metric) for name, metric in self.metrics.items()},
            "versions": dict(self.versions),
            "seed": self.scenario.sensors.seed,
            "engine": plain(self.engine),
            "scenario": scenario_document(self.scenario),
            "shown": dict(self.scenario.device.shown),
        }

    def save(self, folder: str | Path, attachments: Mapping[str, bytes] | None = None) -> Path:
        """Write ``recording.nc``, ``recording.csv``, ``run.json`` and any attachments (contents by file name).

        The folder is written completely or not at all; an earlier result in it is replaced. Returns the folder.
        """
        from ppafo.storage import write_result

        return write_result(folder, self.recording, self.to_dict(), attachments or {})


def simulate(scenario: Scenario) -> Result:
    """Run one scenario; a run that diverges gives a Result with that status, up to the time of failure."""
    return results_of(scenario, [plan_run(scenario)])[0]


def results_of(scenario: Scenario, runs: Sequence[Run]) -> list[Result]:
    """Results of runs of one scenario, as planned or with other numbers; a Python controller makes them one by one."""
    custom = scenario.controller.custom
    if custom is None:
        outcomes = run_together(runs)
    else:
        from ppafo.simulation.python_controller import run_sampled

        outcomes = [run_sampled(batch_of(run), custom) for run in runs]
    return [result_of(scenario, run, outcome) for run, outcome in zip(runs, outcomes, strict=True)]


def simulate_many(scenarios: Sequence[Scenario], threads: int | None = None) -> list[Result]:
    """Run many scenarios in parallel; each result is exactly as if run alone."""
    runs = [plan_run(scenario) for scenario in scenarios]
    # A Python controller does not run in the lanes: its scenario runs by itself below.
    inside = [index for index, scenario in enumerate(scenarios) if scenario.controller.custom is None]
    outcomes = dict(zip(inside, run_together([runs[index] for index in inside], threads), strict=True))
    return [
        result_of(scenario, run, outcomes[index]) if index in outcomes else simulate(scenario)
        for index, (scenario, run) in enumerate(zip(scenarios, runs, strict=True))
    ]


def result_of(scenario: Scenario, run: Run, outcome: BatchResult) -> Result:
    """Result of a run from its outcome; a diverged run has the record up to its failure."""
    status, times = end_of(run, outcome)
    versions = {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__}
    engine = {"step": run.step, "steps": run.step_count, "steps_per_sample": run.steps_per_sample}

    def measured() -> Measured:
        from ppafo.metrics.metric import Metrics

        rows = rows_by_path(run, outcome.record[: times.size])
        # A valve opens by 1 at most, and says nothing of more.
        commands = rows["result.command"]
        is_command = (np.abs(commands) <= 1.0) | ((commands == VENT) & (scenario.motion.motion_kind.layout == WALK))
        if not is_command.all():
            sample = int(np.argmin(is_command))
            raise KindError(
                f"controller '{scenario.controller.kind}': command {commands[sample]:.6g} at t = {times[sample]:.6g} s"
                ": must be -1 to 1"
            )
        recording, metrics = scenario.motion.motion_kind.measured(scenario, run, times, rows)
        return recording, Metrics(metrics)

    return Result(scenario, status, versions, engine, DeferredResult(measured))


def rows_by_path(run: Run, record: Floats) -> dict[str, Floats]:
    """State rows (samples,) of a run by path, from its record (samples, rows, 1)."""
    return {path: np.ascontiguousarray(record[:, row, 0]) for path, row in state_row_numbers(run).items()}


def end_of(run: Run, outcome: BatchResult) -> tuple[Status, Floats]:
    """Status of a run, with time, last good state and remedy if it diverged; and the times [s] of its samples."""
    rows = state_row_numbers(run)
    record = outcome.record[:, :, 0]
    times: Floats = np.arange(len(record), dtype=np.float64) * (run.step * run.record_every)
    failed = float(outcome.states[rows["result.failure_time"], 0])
    if failed >= NEVER_FAILED and bool(np.isfinite(outcome.states).all()):
        return Status("completed", None, "completed"), times
    # Without a time of failure the last sample is the best that is known.
    time = failed if failed < NEVER_FAILED else float(times[-1])
    # The last sample before the failure: the one at it need not be finite.
    kept = int(np.searchsorted(times, time))
    state = ", ".join(
        f"{name.replace('_', ' ')} {record[max(0, kept - 1), rows[f'state.{name}']]:.4g} {unit}"
        for name, unit in (("angle", "rad"), ("angular_velocity", "rad/s"), ("mass_1", "kg"), ("mass_2", "kg"))
    )
    remedy = TOO_MANY_PARTS if outcome.states[rows["result.too_many_parts"], 0] else REMEDY
    message = f"diverged at t = {time:.6g} s (before that: {state}); {remedy}"
    # The first sample stays in any case: a recording is never empty.
    return Status("diverged", time, message), times[: max(1, kept)]


def compile_models(scenarios: Iterable[Scenario]) -> None:
    """Compile the models of scenarios into the cache if they are not there yet; no run is made."""
    programs = [plan_run(scenario).program for scenario in scenarios]
    # Fully optimised ones serve single runs and ensembles.
    load_programs((program, Effort.FULL) for program in programs)
    for program in programs:
        load_program(program)
