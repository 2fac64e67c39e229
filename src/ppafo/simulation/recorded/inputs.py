"""Inputs of a run from a recording, at each step: command, supply pressures, external torque and angle."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.replay import RECORDED_ANGLE, AngleSegment, StepInputs
from ppafo.engine.run import Run
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.recording import Floats, between_samples
from ppafo.simulation.recorded.channels import (
    ANGLE,
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    LONGEST_STEP,
    SUPPLY,
    between_stops,
)
from ppafo.simulation.recorded.rest import LONGEST_ONSET, command_ahead

_SUPPLY_PATH = "plant.supply_pressure"
_DORSIFLEXION_PATH = "plant.dorsiflexion_pressure"


@dataclass(frozen=True, slots=True)
class RecordedInputs:
    """Channels ``names`` of a recording that a run follows; ``start`` [s] of the recording is time 0 of the run."""

    recording: Recording
    names: tuple[str, ...]
    start: float


def supply_paths(device: Device) -> tuple[str, ...]:
    """Return the parameters set by a recorded supply pressure: both regulators, unless their pressures differ."""
    return (_SUPPLY_PATH, _DORSIFLEXION_PATH) if device.supply.has_one_pressure else (_SUPPLY_PATH,)


def with_highest_supply(device: Device, recording: Recording, followed: Collection[str]) -> Device:
    """Return the device with the highest recorded supply pressure, for which the steps must be fine enough."""
    supply = device.supply
    recorded = {name: float(recording[name].max()) for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in followed}
    highest = max(supply.pressure, recorded.get(SUPPLY, 0.0))
    own_dorsiflexion = highest if supply.has_one_pressure else supply.dorsiflexion_pressure
    highest_dorsiflexion = max(own_dorsiflexion, recorded.get(DORSIFLEXION_SUPPLY, 0.0))
    return replace(device, supply=replace(supply, pressure=highest, dorsiflexion_pressure=highest_dorsiflexion))


def step_inputs(inputs: RecordedInputs, device: Device, run: Run) -> StepInputs:
    """Return the inputs of a run at each step; ``device`` determines which regulators follow the supply.

    A run that follows the angle must come from ``with_prescribed_angle``. Raises DataError for angles far beyond the
    stops.
    """
    command = None
    earlier = None
    recording = inputs.recording
    if COMMAND in inputs.names:
        command = _values_at_steps(inputs, COMMAND, run)
        begin = float(recording.time[0])
        count = int(min(inputs.start - begin, LONGEST_ONSET) / run.step)
        before = _values_at_steps(inputs, COMMAND, run, -count)[:count]
        # Ahead of the history stands its own first command, ahead of a recording what holds its state.
        ahead = before[0] if inputs.start - begin > LONGEST_ONSET else command_ahead(recording, device)
        earlier = np.append(ahead, before)
    # The parameters that follow a recording [SI], for every step.
    followed: dict[str, Floats] = {}
    # Later ones prevail: a regulator with a recording of its own does not follow the supply.
    paths_of_channel = {
        SUPPLY: supply_paths(device),
        DORSIFLEXION_SUPPLY: (_DORSIFLEXION_PATH,),
        EXTERNAL_TORQUE: ("plant.external_torque",),
    }
    for channel, paths in paths_of_channel.items():
        if channel in inputs.names:
            followed |= dict.fromkeys(paths, _values_at_steps(inputs, channel, run))
    if ANGLE in inputs.names:
        # The straight segment in effect at each step; after the last sample the vane stands still.
        time = recording.time - inputs.start
        angles = between_stops(recording[ANGLE], device, recording.label)
        rates = np.append(np.diff(angles) / np.diff(time), 0.0)
        begins = run.step * np.arange(run.step_count, dtype=np.float64)
        # By the middle of a step: rounding may put a sample a little behind the step that begins with it.
        segment = np.maximum(np.searchsorted(time, begins + 0.5 * run.step, side="right") - 1, 0)
        followed |= {"path.start": time[segment], "path.level": angles[segment], "path.rate": rates[segment]}
    return StepInputs(command, followed, earlier)


def _values_at_steps(inputs: RecordedInputs, name: str, run: Run, first_step: int = 0) -> Floats:
    """Return an input [SI] at each step (steps,) from one on, interpolated as its recording declares.

    A step change of a zero-order-hold channel moves to the nearest step. A linear channel is averaged over a step or,
    for fewer changes, over a millisecond; a command is averaged over a step, because a valve responds within less.
    """
    if inputs.recording.is_held(name):
        middle = run.step * np.arange(first_step, run.step_count, dtype=np.float64) + 0.5 * run.step
    else:
        together = 1 if name == COMMAND else max(1, min(run.steps_per_sample, round(LONGEST_STEP / run.step)))
        first = (np.arange(first_step, run.step_count) // together * together).astype(np.float64)
        middle = run.step * (first + 0.5 * together)
    return between_samples(inputs.recording, name, middle, inputs.start)


def with_prescribed_angle(run: Run, angle: float) -> Run:
    """Return the run with its vane moved along a recorded angle, which is ``angle`` [rad] at the start."""
    program = replace(run.program, angle=RECORDED_ANGLE)
    return replace(run, program=program, path=AngleSegment(0.0, angle, 0.0), needs_parts=True)
