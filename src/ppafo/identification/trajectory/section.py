"""Section [trajectory] of a problem file: conversion to SI units, fit, and ranking of candidate experiments.

All input errors are reported before the search starts.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ppafo.errors import DataError, IdentificationError, ScenarioError
from ppafo.identification.estimate import Estimate, in_shown_unit, interval_factor
from ppafo.identification.problem import ExperimentSection, ParameterSection, TrajectorySection
from ppafo.identification.source import RecordingSource, UsedRecording, double_use, remarks_on_readings
from ppafo.identification.tolerances import Tolerances, positive_in, quantity_in, quantity_of
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    INPUTS,
    TIME_OFFSET,
    FittedExperiment,
    FreeParameter,
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
    ExpectedBenefit,
    TrajectoryFit,
    expected_information,
    fit,
)
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.overrides import over
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.progress import Report
from ppafo.signals import Recording
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.recorded.channels import ANGLE, COMMAND, LONGEST_STEP
from ppafo.simulation.recorded.replay import locked_vane, replay_scenario, with_fixed_volume
from ppafo.simulation.recorded.rest import start_of
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.simulation.scenario import Scenario
from ppafo.wording import known_names

_NOISE_UNITS = {"angle": "rad", "pressure_1": "Pa_d", "pressure_2": "Pa_d"}


@dataclass(frozen=True, slots=True)
class SectionContext:
    """Context of a section: parameter set, recordings and earlier results.

    ``read``: function that returns the recording of an experiment. ``folder``: base of relative paths of scenarios.
    ``file``: name of the section in messages. ``parameter_set`` and ``valve``: replacements for the sets and valves of
    all scenarios. ``bench``: earlier estimates by path. ``used``: recordings from which these were obtained.
    ``tolerances``: tolerances of the bench.
    """

    read: Callable[[ExperimentSection], RecordingSource]
    folder: Path
    file: str
    parameter_set: ParameterSet | None = None
    valve: str | None = None
    bench: Mapping[str, Estimate] = field(default_factory=dict)
    used: tuple[UsedRecording, ...] = ()
    tolerances: Tolerances = field(default_factory=Tolerances)


def noise_of_channels(texts: Mapping[str, str], where: str) -> dict[str, float]:
    """Parse the noise of each channel into standard deviations [rad], [Pa]; ``where`` is the prefix of messages.

    Raises IdentificationError for a channel that cannot be fitted.
    """
    deviations = {}
    for name, text in texts.items():
        if name not in _NOISE_UNITS:
            raise IdentificationError(
                f"{where}: noise.{name}: channel '{name}' cannot be fitted{known_names(name, _NOISE_UNITS)}"
            )
        deviations[name] = quantity_of(f"{where}: noise.{name}", text, _NOISE_UNITS[name])
    return deviations


SHORTEST_STEP = 1.0e-6
"""Shortest time step that a problem file may request [s]."""


def trajectory_problem(section: TrajectorySection, context: SectionContext) -> TrajectoryProblem:
    """Convert a section to a fit problem. Raises IdentificationError for a recording used by a bench procedure."""
    experiments = tuple(_experiment(entry, context) for entry in section.experiments)
    scenarios = {experiment.label: experiment.scenario for experiment in experiments}
    # Samples that a bench procedure used are in its interval, which is a prior here.
    if message := double_use(context.used, map(use_of, experiments)):
        raise IdentificationError(
            f"{context.file}: {message}; omit the recording from the procedure or from the trajectory"
        )
    parameters = [_parameter(entry, scenarios, context) for entry in section.parameters]
    for entry in section.experiments:
        limit = positive_in(entry, "time_offset", "s", f"{context.file}: experiment '{entry.label}'")
        if limit is not None:
            # The delay of the samples of one recording is known within a limit, as a tolerance is.
            deviation = deviation_of_limit(limit)
            parameters.append(
                FreeParameter(TIME_OFFSET, 0.0, -limit, limit, deviation, (entry.label,), is_tolerance=True)
            )
    stated = {} if context.parameter_set is None else stated_by(context.parameter_set, experiments[0].scenario)
    tolerances = tolerance_parameters(context.tolerances, experiments, parameters, stated)
    return TrajectoryProblem((*parameters, *tolerances), experiments, section.confidence)


def _experiment(entry: ExperimentSection, context: SectionContext) -> FittedExperiment:
    """Convert a table of a section to an experiment: recording, and scenario that models it."""
    where = f"{context.file}: experiment '{entry.label}'"
    source = context.read(entry)
    if entry.scenario is None:
        scenario, start, inputs = _replay(entry, source.recording, context, where)
    else:
        reason = "cannot be combined with a scenario, which prescribes the motion of the vane; omit one of them"
        refuse_first(where, *((getattr(entry, name) is not None, f"{name} {reason}") for name in ("locked", "volume")))
        scenario = _scenario(entry.scenario, entry.overrides, context)
        start, inputs = quantity_in(entry, "start", "s", where) or 0.0, entry.inputs or ()
    channels = entry.channels
    if channels is None:
        # All that is neither locked nor followed; of a fixed volume its pressure.
        is_prescribed = entry.locked is not None or ANGLE in (entry.inputs or ())
        channels = FITTED_CHANNELS[1:] if is_prescribed else FITTED_CHANNELS
        channels = channels if entry.volume is None else ("pressure_1",)
        if scenario.device.actuator.has_one_chamber:
            channels = tuple(name for name in channels if name != "pressure_2")
    step = quantity_in(entry, "step", "s", where, SHORTEST_STEP, LONGEST_STEP)
    scenario = scenario if step is None else replace(scenario, run=replace(scenario.run, step=step))
    # The scenario of a replay has the state of the samples already.
    is_read = entry.scenario is not None and entry.initial_state in ("recording", "fitted")
    state: InitialState = "recording" if is_read else "scenario"
    noise, recording = noise_of_channels(entry.noise, where), source.recording
    return FittedExperiment(entry.label, scenario, recording, start, channels, noise, inputs, state, source.trace)


def _scenario(name: str, overrides: tuple[str, ...], context: SectionContext) -> Scenario:
    """Load a scenario, bundled or from a file in the folder of the problem, with the device of the problem."""
    name_or_file = name if name in list_scenarios() else str(context.folder / name)
    # The valve of the problem goes before what the experiment changes of it.
    chosen = () if context.valve is None else (f"device.valve={context.valve}",)
    return load_scenario(name_or_file, over(chosen, overrides, ScenarioError), context.parameter_set)


def _parameter(entry: ParameterSection, scenarios: Mapping[str, Scenario], context: SectionContext) -> FreeParameter:
    """Convert a table of a section to a parameter to fit [SI]; ``scenarios`` are by label of the experiment."""
    scenario = next((scenarios[label] for label in entry.recordings if label in scenarios), None)
    acting = scenario or next(iter(scenarios.values()))
    quantity = declaration_of(entry.path, acting)
    atmosphere = acting.device.supply.atmospheric_pressure
    where = f"{context.file}: parameter '{entry.path}'"
    start, low, high = (
        quantity_in(entry, key, quantity.unit, where, atmosphere=atmosphere) for key in ("start", "low", "high")
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
    return FreeParameter(entry.path, start, low, high, deviation, entry.recordings)


def _replay(
    entry: ExperimentSection, recording: Recording, context: SectionContext, where: str
) -> tuple[Scenario, float, tuple[str, ...]]:
    """Return a replay scenario for a recording, its start time [s] in the recording, and its inputs.

    The replay starts at the first sample unless a start is given. Raises IdentificationError if a scenario is needed.
    """
    if context.parameter_set is None:
        raise IdentificationError(f"{where}: needs a scenario, because no device was given")
    inputs = tuple(name for name in INPUTS if name in recording) if entry.inputs is None else entry.inputs
    is_locked, is_fixed = entry.locked is not None, entry.volume is not None
    refuse_first(
        where,
        (entry.initial_state == "scenario", "initial_state = 'scenario' needs a scenario; omit initial_state"),
        (
            (is_locked or is_fixed) and ANGLE in inputs,
            f"'{ANGLE}' cannot be an input with locked or volume; remove '{ANGLE}' from inputs",
        ),
        (is_locked and is_fixed, "locked and volume exclude each other: a fixed volume has no vane; omit one of them"),
        (
            COMMAND not in recording,
            f"has no scenario, so its recording needs a channel '{COMMAND}'; available: {', '.join(recording.names)}; "
            "give a scenario",
        ),
        (COMMAND not in inputs, f"has no scenario, so inputs must have '{COMMAND}'"),
    )
    start_time = quantity_in(entry, "start", "s", where)
    start_time = float(recording.time[0]) if start_time is None else start_time
    used = recording.between(start_time, float(recording.time[-1]))
    device = build_device(apply_overrides(context.parameter_set, entry.overrides, valve=context.valve), context.valve)
    angle, volume = quantity_in(entry, "locked", "rad", where), positive_in(entry, "volume", "m^3", where)
    known = {} if angle is None else {ANGLE: angle}
    if volume is not None:
        device, known = with_fixed_volume(device, volume)
    remedies = dict.fromkeys(
        FITTED_CHANNELS, 'give a scenario, which prescribes the initial state, and channels = ["angle"]'
    )
    start = start_of(used, device, known, where, remedies)
    motion = locked_vane(start.angle) if known else None
    return replay_scenario(recording, device, start, used.duration, where, motion), start_time, inputs


@dataclass(frozen=True, slots=True)
class TrajectoryOutcome:
    """Result of section [trajectory]: fit, expected benefit of candidates (best first), and remarks."""

    fit: TrajectoryFit
    expected: tuple[ExpectedBenefit, ...]
    remarks: tuple[str, ...]

    @property
    def is_good(self) -> bool:
        """True if the search converged to a valid device and no part of the recordings contradicts the rest."""
        return not self.fit.conflict and not self.fit.remarks


def solve_section(section: TrajectorySection, context: SectionContext, report: Report) -> TrajectoryOutcome:
    """Solve section [trajectory]: fit the parameters and rank the candidates, after a check of all inputs."""
    try:
        problem = trajectory_problem(section, context)
        candidates = []
        for entry in section.candidates:
            where = f"{context.file}: candidate '{entry.label}'"
            scenario = _scenario(entry.scenario, entry.overrides, context)
            interval = quantity_in(entry, "interval", "s", where, SHORTEST_STEP, scenario.run.duration)
            assert interval is not None, "it has a default"
            candidates.append(
                CandidateExperiment(entry.label, scenario, noise_of_channels(entry.noise, where), interval)
            )
        fitted = fit(problem, report)
        expected = expected_information(fitted, candidates)
    except (IdentificationError, DataError) as error:
        if str(error).startswith(context.file):
            raise
        raise type(error)(f"{context.file}: {error}") from error
    sources = tuple(RecordingSource(experiment.recording, experiment.source) for experiment in problem.experiments)
    remarks = [*remarks_on_readings(sources), *fitted.outliers, *fitted.remarks]
    for estimate in fitted.estimates:
        measured = context.bench.get(estimate.path)
        if measured is None or not (measured.is_usable and estimate.is_usable):
            continue
        if estimate.low > measured.high or estimate.high < measured.low:
            numbers = (estimate.low, estimate.high, measured.low, measured.high)
            ends = [in_shown_unit(number, estimate.unit) for number in numbers]
            low, high, lowest, highest = (f"{end:.4g}" for end, _ in ends)
            remarks.append(
                f"{estimate.path}: fitted {low} to {high} {ends[0][1]}, bench procedure {lowest} to {highest}: the "
                "model of the fit or of the procedure is incomplete"
            )
    return TrajectoryOutcome(fitted, expected, tuple(remarks))
