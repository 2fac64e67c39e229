"""Inputs of a run that were recorded: command, supply pressure and external torque, for every step."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.replay import StepInputs, prescribe_recorded_angle
from ppafo.engine.run import Run
from ppafo.errors import DataError
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

COMMAND, SUPPLY, EXTERNAL_TORQUE = "command", "supply_pressure", "external_torque"
DORSIFLEXION_SUPPLY = "dorsiflexion_pressure"
ANGLE = "angle"
"""As an input, the vane follows it, in straight lines from sample to sample."""

LONGEST_STEP = 1.0e-3
"""Seconds over which a recorded pressure or torque is averaged, and the longest step of a replay."""

SHORTEST_SAMPLE = 1.0e-4
"""Seconds; irregular samples are placed on a grid no finer than this."""

_BEYOND_STOPS = 0.05
"""Fraction of the range by which a measured angle may exceed a stop; up to there it is set to the stop."""

_UNIFORM = 0.02
"""Fraction of a sample by which a time may be off a regular grid; clocks write rounded times."""


@dataclass(frozen=True, slots=True)
class RecordedInputs:
    """Channels ``names`` of a recording that a run follows; ``start`` [s] of the recording is time 0 of the run."""

    recording: Recording
    names: tuple[str, ...]
    start: float

    def has(self, name: str) -> bool:
        """True where the run follows this channel."""
        return name in self.names


def regular_interval(time: Floats) -> float | None:
    """Return the time between samples [s] where they are regular, else None."""
    interval = float(time[-1] - time[0]) / (time.size - 1)
    away = time - time[0] - interval * np.arange(time.size)
    return interval if float(np.abs(away).max()) < _UNIFORM * interval else None


def sample_period(time: Floats) -> float:
    """Return the time between samples [s], or of the grid on which irregular samples are placed."""
    shortest = min(max(float(np.diff(time).min()), SHORTEST_SAMPLE), LONGEST_STEP)
    return regular_interval(time) or shortest


def supply_paths(device: Device) -> tuple[str, ...]:
    """Return the parameters that follow a recorded supply: both regulators, unless they have two pressures."""
    supply = device.supply
    both = ("plant.supply_pressure", "plant.dorsiflexion_pressure")
    return both if supply.has_one_pressure else both[:1]


def step_times(run: Run) -> Floats:
    """Return the time [s] at which each step of a run begins."""
    return run.step * np.arange(run.step_count, dtype=np.float64)


def step_inputs(inputs: RecordedInputs, device: Device, run: Run) -> StepInputs:
    """Return what a run follows at each of its steps; ``device`` says which regulators follow the supply.

    A run that follows the angle is one of ``with_prescribed_angle``.
    """
    command = last_values(inputs, COMMAND, run) if inputs.has(COMMAND) else None
    path = _path(inputs, device, run) if inputs.has(ANGLE) else {}
    return StepInputs(command, {**recorded_parameters(inputs, device, run), **path})


def with_prescribed_angle(run: Run, angle: float) -> Run:
    """Return the run with the vane on a recorded angle, which is ``angle`` [rad] at the start."""
    return replace(run, program=prescribe_recorded_angle(run.program), path=(0.0, angle, 0.0), needs_parts=True)


def _path(inputs: RecordedInputs, device: Device, run: Run) -> dict[str, Floats]:
    """Return the straight piece of the angle that holds at each step; after the last sample the vane stands still."""
    time = inputs.recording.time - inputs.start
    angles = between_stops(inputs.recording[ANGLE], device, inputs.recording.label)
    rates = np.append(np.diff(angles) / np.diff(time), 0.0)
    piece = np.maximum(np.searchsorted(time, step_times(run) + 0.5 * run.step, side="right") - 1, 0)
    return {"path.start": time[piece], "path.level": angles[piece], "path.rate": rates[piece]}


def between_stops(angles: Floats, device: Device, file: str) -> Floats:
    """Return angles [rad] as they are or, slightly beyond a stop, as the stop; DataError for those far beyond."""
    lowest, highest = device.actuator.angle_min, device.actuator.angle_max
    margin = _BEYOND_STOPS * (highest - lowest)
    worst = angles[int(np.argmax(np.maximum(lowest - angles, angles - highest)))]
    if not lowest - margin <= worst <= highest + margin:
        shown, low, high = np.degrees([worst, lowest, highest])
        raise DataError(
            f"{file}: 'angle' is {shown:.4g} deg, beyond the stops of {device.name}, {low:g} to {high:g} deg"
        )
    return np.clip(angles, lowest, highest)


def recorded_parameters(inputs: RecordedInputs, device: Device, run: Run) -> dict[str, Floats]:
    """Return the parameters that follow a recording [SI], for every step; each is a mean over a millisecond."""
    followed: dict[str, Floats] = {}
    if inputs.has(SUPPLY):
        followed |= dict.fromkeys(supply_paths(device), _between_samples(inputs, SUPPLY, run))
    if inputs.has(DORSIFLEXION_SUPPLY):
        followed["plant.dorsiflexion_pressure"] = _between_samples(inputs, DORSIFLEXION_SUPPLY, run)
    if inputs.has(EXTERNAL_TORQUE):
        followed["plant.external_torque"] = _between_samples(inputs, EXTERNAL_TORQUE, run)
    return followed


def last_values(inputs: RecordedInputs, name: str, run: Run) -> Floats:
    """Return the last recorded value of a channel [SI] at each step; a change falls on the nearest step."""
    own_times = inputs.recording.time - inputs.start
    index = np.searchsorted(own_times, step_times(run) + 0.5 * run.step, side="right") - 1
    return inputs.recording[name][np.maximum(index, 0)]


def _between_samples(inputs: RecordedInputs, name: str, run: Run) -> Floats:
    together = max(1, min(run.steps_per_sample, round(LONGEST_STEP / run.step)))
    first = (np.arange(run.step_count) // together * together).astype(np.float64)
    middle = run.step * (first + 0.5 * together)
    return np.interp(middle, inputs.recording.time - inputs.start, inputs.recording[name])
