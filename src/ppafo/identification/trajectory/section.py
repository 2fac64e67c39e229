"""Section [trajectory] of a problem file: conversion to SI units, fit, and ranking of candidate experiments.

All input errors are reported before the search starts.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import DataError, IdentificationError, ScenarioError
from ppafo.identification.bench.law import BenchContext
from ppafo.identification.estimate import Estimate, in_shown_unit, interval_factor
from ppafo.identification.least_squares import FitNumber
from ppafo.identification.problem import ExperimentSection, ParameterSection, TrajectorySection
from ppafo.identification.source import RecordingSource, UsedRecording, double_use, remarks_on_readings
from ppafo.identification.tolerances import quantity_of
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    INPUTS,
    TIME_OFFSET,
    FittedExperiment,
    InitialState,
    TrajectoryProblem,
    declaration_of,
    full_path,
    refuse_first,
    stated_by,
    tolerance_parameters,
    use_of,
)
from ppafo.identification.trajectory.fitting import (
    CandidateExperiment,
    TrajectoryFit,
    expected_information,
    fit,
)
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.overrides import over
from ppafo.progress import Report
from ppafo.signals import Recording
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.recorded.channels import ANGLE, COMMAND
from ppafo.simulation.recorded.replay import locked_vane, replay_scenario, with_fixed_volume
from ppafo.simulation.recorded.rest import start_of
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class SectionContext(BenchContext):
    """Context of a section, whose set and valve replace those of all scenarios.

    ``read``: function that returns the recording of an experiment. ``folder``: base of relative paths of scenarios.
    ``bench``: earlier estimates by path. ``used``: recordings from which these were obtained.
    """

    read: Callable[[ExperimentSection], RecordingSource]
    folder: Path
    bench: Mapping[str, Estimate]
    used: tuple[UsedRecording, ...]


def trajectory_problem(section: TrajectorySection, context: SectionContext) -> TrajectoryProblem:
    """Convert a section to a fit problem. Raises IdentificationError for a recording used by a bench procedure."""
    experiments = tuple(_experiment(entry, context) for entry in section.experiments)
    scenarios = {experiment.label: experiment.scenario for experiment in experiments}
    # Samples that a bench procedure used are in its interval, which is a prior here.
    if message := double_use((*context.used, *map(use_of, experiments))):
        raise IdentificationError(f"{context.label}: {message}")
    parameters = [_parameter(entry, scenarios, context) for entry in section.parameters]
    for entry in section.experiments:
        if (limit := entry.time_offset) is not None:
            # The delay of the samples of one recording is known within a limit, as a tolerance is.
            deviation = deviation_of_limit(limit)
            parameters.append(
                FitNumber(TIME_OFFSET, 0.0, -limit, limit, 1.0, deviation, (entry.label,), is_tolerance=True)
            )
    stated = stated_by(context.parameter_set, experiments[0].scenario)
    tolerances = tolerance_parameters(context.tolerances, experiments, parameters, stated)
    return TrajectoryProblem((*parameters, *tolerances), experiments, section.confidence)


def _experiment(entry: ExperimentSection, context: SectionContext) -> FittedExperiment:
    """Convert a table of a section to an experiment: recording, and scenario that models it."""
    where = f"{context.label}: experiment '{entry.label}'"
    source = context.read(entry)
    if entry.scenario is None:
        scenario, start, inputs = _replay(entry, source.recording, context, where)
    else:
        reason = "cannot be combined with a scenario, which prescribes the motion of the vane"
        refuse_first(where, *((getattr(entry, name) is not None, f"{name} {reason}") for name in ("locked", "volume")))
        scenario = _scenario(entry.scenario, entry.overrides, context)
        start, inputs = entry.start or 0.0, entry.inputs or ()
    channels = entry.channels
    if channels is None:
        # All that is neither locked nor followed; of a fixed volume its pressure.
        is_prescribed = entry.locked is not None or ANGLE in (entry.inputs or ())
        channels = FITTED_CHANNELS[1:] if is_prescribed else FITTED_CHANNELS
        channels = channels if entry.volume is None else ("pressure_1",)
        if scenario.device.actuator.has_one_chamber:
            channels = tuple(name for name in channels if name != "pressure_2")
    if entry.step is not None:
        scenario = replace(scenario, run=replace(scenario.run, step=entry.step))
    # The scenario of a replay has the state of the samples already.
    is_read = entry.scenario is not None and entry.initial_state in ("recording", "fitted")
    state: InitialState = "recording" if is_read else "scenario"
    noise, recording = entry.noise.by_channel(), source.recording
    return FittedExperiment(entry.label, scenario, recording, start, channels, noise, inputs, state, source.trace)


def _scenario(name: str, overrides: tuple[str, ...], context: SectionContext) -> Scenario:
    """Load a scenario, bundled or from a file in the folder of the problem, with the device of the problem."""
    name_or_file = name if name in list_scenarios() else str(context.folder / name)
    # The valve of the problem goes before what the experiment changes of it.
    chosen = () if context.valve is None else (f"device.valve={context.valve}",)
    return load_scenario(name_or_file, over(chosen, overrides, ScenarioError), context.parameter_set)


def _parameter(entry: ParameterSection, scenarios: Mapping[str, Scenario], context: SectionContext) -> FitNumber:
    """Convert a table of a section to a parameter to fit [SI]; ``scenarios`` are by label of the experiment."""
    scenario = next((scenarios[label] for label in entry.recordings if label in scenarios), None)
    acting = scenario or next(iter(scenarios.values()))
    quantity = declaration_of(entry.path, acting)
    atmosphere = acting.device.supply.atmospheric_pressure
    where = f"{context.label}: parameter '{entry.path}'"
    stated = {key: getattr(entry, key) for key in ("start", "low", "high")}
    start, low, high = (
        math.nan if text is None else quantity_of(f"{where}: {key}", text, quantity.unit, atmosphere)
        for key, text in stated.items()
    )
    deviation = math.inf
    if entry.prior == "bench":
        estimate = context.bench.get(full_path(entry.path, acting))
        if estimate is None or not estimate.is_usable:
            identified = ", ".join(path for path, known in context.bench.items() if known.is_usable) or "none"
            raise IdentificationError(
                f"{where}: prior = 'bench' needs a value that a procedure of this problem identifies; identified: "
                f"{identified}"
            )
        start, deviation = estimate.value, estimate.wider_half_width / interval_factor(estimate.confidence)
    elif entry.prior is not None:
        start = quantity_of(f"{where}: prior.mean", entry.prior.mean, quantity.unit, atmosphere)
        deviation = abs(start) * entry.prior.relative
    return FitNumber(entry.path, start, low, high, 1.0, deviation, entry.recordings)


def _replay(
    entry: ExperimentSection, recording: Recording, context: SectionContext, where: str
) -> tuple[Scenario, float, tuple[str, ...]]:
    """Return a replay scenario for a recording, its start time [s] in the recording, and its inputs.

    The replay starts at the first sample unless a start is given. Raises IdentificationError if a scenario is needed.
    """
    inputs = tuple(name for name in INPUTS if name in recording) if entry.inputs is None else entry.inputs
    is_locked, is_fixed = entry.locked is not None, entry.volume is not None
    refuse_first(
        where,
        (entry.initial_state == "scenario", "initial_state = 'scenario' needs a scenario"),
        (
            (is_locked or is_fixed) and ANGLE in inputs,
            f"'{ANGLE}' cannot be an input with locked or volume",
        ),
        (is_locked and is_fixed, "locked and volume exclude each other: a fixed volume has no vane"),
        (
            COMMAND not in recording,
            f"has no scenario, so its recording needs a channel '{COMMAND}'; available: {', '.join(recording.names)}",
        ),
        (COMMAND not in inputs, f"has no scenario, so inputs must have '{COMMAND}'"),
    )
    start_time = float(recording.time[0]) if entry.start is None else entry.start
    used = recording.between(start_time, float(recording.time[-1]))
    device = build_device(apply_overrides(context.parameter_set, entry.overrides, valve=context.valve), context.valve)
    known = {} if entry.locked is None else {ANGLE: entry.locked}
    if entry.volume is not None:
        device, known = with_fixed_volume(device, entry.volume)
    start = start_of(used, device, known, where)
    motion = locked_vane(start.angle) if known else None
    return replay_scenario(recording, device, start, used.duration, where, motion), start_time, inputs


def solve_section(section: TrajectorySection, context: SectionContext, report: Report) -> TrajectoryFit:
    """Solve section [trajectory]: fit the parameters and rank the candidates, after a check of all inputs."""
    try:
        problem = trajectory_problem(section, context)
        candidates = []
        for entry in section.candidates:
            where = f"{context.label}: candidate '{entry.label}'"
            scenario = _scenario(entry.scenario, entry.overrides, context)
            if entry.interval > (longest := scenario.run.duration):
                raise IdentificationError(f"{where}: interval = {entry.interval:g} s must be at most {longest:g} s")
            noise = entry.noise.by_channel()
            candidates.append(CandidateExperiment(entry.label, scenario, noise, entry.interval))
        fitted = fit(problem, report)
        expected = expected_information(fitted, candidates)
    except (IdentificationError, DataError) as error:
        if str(error).startswith(context.label):
            raise
        raise type(error)(f"{context.label}: {error}") from error
    sources = tuple(RecordingSource(experiment.recording, experiment.source) for experiment in problem.experiments)
    remarks = [*remarks_on_readings(sources), *fitted.remarks]
    for estimate in fitted.estimates:
        measured = context.bench.get(estimate.path)
        if measured is None or not (measured.is_usable and estimate.is_usable):
            continue
        if estimate.low > measured.high or estimate.high < measured.low:
            numbers = (estimate.low, estimate.high, measured.low, measured.high)
            ends = [in_shown_unit(number, estimate.unit) for number in numbers]
            low, high, lowest, highest = (f"{end:.4g}" for end, _ in ends)
            remarks.append(
                f"{estimate.path}: fitted {low} to {high} {ends[0][1]}, bench procedure {lowest} to {highest}"
            )
    return replace(fitted, expected=expected, remarks=tuple(remarks))
