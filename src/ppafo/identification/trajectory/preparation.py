"""Makes an experiment ready for fitting: measured inputs, initial state, noise, times, and one clock for all columns.

The division of the step is taken from the start values and stays as it is while the search goes on, because a step
that changes with the numbers would make the residual jump. ``refined`` takes it anew at other numbers.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.run import Run
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.problem import Experiment
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import FreeMotion, Scenario

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

FEWEST_SAMPLES = 10
_OPEN_LOOP = "constant"
_COMMAND_CHANGE = 1.0e-3
_FITS = 1.0e-6
_SPREAD_OF_MEDIAN = 1.4826
_KEPT = 3.0
_SHARE_OF_KEPT = 0.98658
"""Standard deviation of a normal distribution cut at 3 standard deviations, over that of the whole."""

_GAIN_OF_DIFFERENCES = math.sqrt(20.0)
"""Standard deviation of the third difference of white noise over that of the noise."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One channel of an experiment: samples [rad] or [Pa] and the standard deviation of their noise."""

    name: str
    values: Floats
    noise: float


@dataclass(frozen=True, slots=True)
class Prepared:
    """An experiment by its label, with its scenario completed and its samples placed in the record of a run.

    ``run`` has the step and the clock of all columns; a sample is ``share`` [-] of the way from record ``place`` to the
    next. ``time`` is in the time of the run [s].
    """

    label: str
    scenario: Scenario
    run: Run
    time: Floats
    place: Indices
    share: Floats
    channels: tuple[Measured, ...]


def prepare(experiment: Experiment, numbers: Mapping[str, float]) -> Prepared:
    """Return the experiment made ready; ``numbers`` by path are the start values, which decide the step."""
    recording, said = experiment.recording, f"experiment '{experiment.label}'"
    inside = recording.time >= experiment.start - _FITS
    time = np.maximum(recording.time[inside] - experiment.start, 0.0)
    if time.size < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{said}: {recording.label} has {time.size} samples after {experiment.start:g} s, "
            f"at least {FEWEST_SAMPLES} are needed"
        )
    scenario = _with_initial_state(experiment, _with_inputs(experiment, inside))
    scenario = replace(scenario, duration=float(time[-1]))
    channels = tuple(_measured(experiment, name, inside) for name in experiment.channels)
    return prepared_times(experiment.label, scenario, time, channels, numbers)


def prepared_times(
    label: str, scenario: Scenario, time: Floats, channels: tuple[Measured, ...], numbers: Mapping[str, float]
) -> Prepared:
    """Return samples at times [s] of a scenario's run made ready, with the step that ``numbers`` by path need."""
    return _placed(label, scenario, plan_run(with_numbers(scenario, numbers)), time, channels)


def refined(prepared: Prepared, numbers: Mapping[str, float]) -> Prepared:
    """Return the experiment with the step that ``numbers`` by path need, if that is shorter than the present one."""
    run = plan_run(with_numbers(prepared.scenario, numbers))
    if run.steps_per_sample <= prepared.run.steps_per_sample:
        return prepared
    return _placed(prepared.label, prepared.scenario, run, prepared.time, prepared.channels)


def noise_of(values: Floats) -> float:
    """Return the standard deviation of white noise on a smooth signal, from third differences that are not unusual.

    What the signal itself does between four samples counts as noise where it is larger; a few jumps do not matter.
    """
    if values.size < FEWEST_SAMPLES:
        return 0.0
    differences = np.abs(np.diff(values, n=3))
    most = _KEPT * _SPREAD_OF_MEDIAN * float(np.median(differences))
    inner = differences[differences <= most]
    return float(np.sqrt(np.mean(inner * inner)) / _SHARE_OF_KEPT / _GAIN_OF_DIFFERENCES)


def _placed(label: str, scenario: Scenario, run: Run, time: Floats, channels: tuple[Measured, ...]) -> Prepared:
    """Return the samples placed in a record that is no finer than they need."""
    every = _steps_between_samples(time, run.step)
    records = math.ceil(float(time[-1]) / (run.step * every) - _FITS)
    position = time / (run.step * every)
    place = np.minimum(np.floor(position + _FITS), records).astype(np.intp)
    share = np.maximum(position - place, 0.0)
    share[share < _FITS] = 0.0
    frozen = replace(run, record_every=every, step_count=records * every)
    return Prepared(label, scenario, frozen, time, place, share, channels)


def _steps_between_samples(time: Floats, step: float) -> int:
    """Return the steps between two records: as many as between two samples if all of these fall on records, else 1."""
    every = max(1, round(float(np.min(np.diff(time))) / step))
    position = time / (step * every)
    return every if bool(np.all(np.abs(position - np.round(position)) < _FITS * np.maximum(position, 1.0))) else 1


def _measured(experiment: Experiment, name: str, inside: NDArray[np.bool_]) -> Measured:
    values = experiment.recording[name][inside]
    noise = experiment.noise[name] if name in experiment.noise else noise_of(values)
    if not noise > 0.0:
        raise IdentificationError(
            f"experiment '{experiment.label}': channel '{name}' shows no noise from sample to sample, so its weight is "
            f"unknown: give its standard deviation in noise, for example from the sensor's data sheet"
        )
    return Measured(name, values, noise)


def _with_inputs(experiment: Experiment, inside: NDArray[np.bool_]) -> Scenario:
    scenario, recording = experiment.scenario, experiment.recording
    if "supply_pressure" in experiment.inputs:
        mean = float(np.mean(recording["supply_pressure"][inside]))
        supply = replace(scenario.device.supply, pressure=mean)
        scenario = replace(scenario, device=replace(scenario.device, supply=supply))
    if "command" in experiment.inputs:
        scenario = _with_command(experiment, scenario, recording["command"][inside])
    return scenario


def _with_command(experiment: Experiment, scenario: Scenario, command: Floats) -> Scenario:
    said = f"experiment '{experiment.label}': the measured command"
    changed = np.flatnonzero(np.abs(command - np.median(command)) > _COMMAND_CHANGE)
    if changed.size:
        raise IdentificationError(
            f"{said} changes (sample {int(changed[0]) + 1} after the start); only a constant one is taken from a file"
        )
    if scenario.control.kind != _OPEN_LOOP:
        raise IdentificationError(
            f"{said} needs a scenario with controller '{_OPEN_LOOP}', not '{scenario.control.kind}'"
        )
    control = replace(scenario.control, settings={**scenario.control.settings, "command": float(np.median(command))})
    return replace(scenario, control=control)


def _with_initial_state(experiment: Experiment, scenario: Scenario) -> Scenario:
    """Return the scenario that starts where the recording says: at the means of the samples up to the start."""
    if experiment.initial_state == "scenario":
        return scenario
    recording = experiment.recording
    before = recording.time <= experiment.start + _FITS
    if not before.any():
        raise IdentificationError(
            f"experiment '{experiment.label}': {recording.label} has no sample up to {experiment.start:g} s, from "
            f"which the initial state could be taken"
        )
    means = {name: float(np.mean(recording[name][before])) for name in recording.names}
    scenario = replace(
        scenario,
        initial_pressure_1=means.get("pressure_1", scenario.initial_pressure_1),
        initial_pressure_2=means.get("pressure_2", scenario.initial_pressure_2),
    )
    if "angle" in means and isinstance(scenario.motion, FreeMotion):
        actuator = scenario.device.actuator
        angle = float(np.clip(means["angle"], actuator.angle_min, actuator.angle_max))
        scenario = replace(scenario, motion=replace(scenario.motion, angle=angle))
    return scenario
