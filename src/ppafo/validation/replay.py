"""Replay: the model driven by recorded inputs (command, supply, external torque or angle) from the first state."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.errors import DataError, PpafoError, SimulationError
from ppafo.parameters.device import Device
from ppafo.signals import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY, sample_period
from ppafo.simulation.recorded.inputs import RecordedInputs, step_inputs, with_highest_supply, with_prescribed_angle
from ppafo.simulation.recorded.replay import replay_scenario
from ppafo.simulation.recorded.rest import ReplayStart
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, Scenario, locked_vane, vane_motion
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.settings import ANGLE, ReplaySettings

MAXIMUM_STEPS = 20_000_000
"""Largest number of steps of a replay; more indicates a wrong time unit."""
_RECORD_INTERVAL = 2.5e-4
"""Largest interval [s] between two records of the model: fine enough for interpolation and time shifts."""
_ROUNDING = 1.0e-9
"""Rounding tolerance [-] for the number of steps in an interval."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """Replayed recording on the clock of the measurement, and engine time step [s]."""

    recording: Recording
    step: float


@dataclass(frozen=True, slots=True)
class Replay:
    """Request to replay a recording on a device, continued for the longest delay with the last inputs."""

    measured: MeasuredRecording
    device: Device
    start: ReplayStart
    settings: ReplaySettings

    @property
    def inputs(self) -> tuple[str, ...]:
        """Recorded channels used as inputs; external torque is an input of a free vane only."""
        motion = self.settings.motion
        recording = self.measured.recording
        names = (SUPPLY, DORSIFLEXION_SUPPLY, *([EXTERNAL_TORQUE] if motion == "free" else []))
        angle = (ANGLE,) if motion == "measured" else ()
        return (COMMAND, *(name for name in names if name in recording), *angle)


def replay_together(requests: Sequence[Replay]) -> list[Replayed | PpafoError]:
    """Run many replays and return their results in order; an invalid or diverging replay gives its error.

    Replays with the same program, clock and inputs are run in one batch.
    """
    ended: dict[int, Replayed | PpafoError] = {}
    alike: dict[Hashable, list[tuple[int, Run, StepInputs, Batch]]] = {}
    for number, request in enumerate(requests):
        try:
            recording = request.measured.recording
            run = _plan(request)
            recorded = RecordedInputs(recording, request.inputs, float(recording.time[0]))
            inputs = step_inputs(recorded, request.device, run)
            batch = batch_of(run)
        except PpafoError as error:
            ended[number] = error
            continue
        commands = [None if values is None else values.tobytes() for values in (inputs.command, inputs.earlier)]
        parameters = tuple((path, series.tobytes()) for path, series in inputs.parameters.items())
        key = (batch.program, batch.clock, *commands, parameters)
        alike.setdefault(key, []).append((number, run, inputs, batch))
    for together in alike.values():
        numbers, runs, followed_inputs, batches = zip(*together, strict=True)
        joint = replace(
            batches[0],
            parameters=np.concatenate([batch.parameters for batch in batches], axis=1),
            states=np.concatenate([batch.states for batch in batches], axis=1),
        )
        result = replay(joint, followed_inputs[0])
        for lane, (number, run) in enumerate(zip(numbers, runs, strict=True)):
            ended[number] = _replayed(requests[number], run, result.record[:, :, lane], result.states[:, lane])
    return [ended[number] for number in range(len(requests))]


def _replayed(request: Replay, run: Run, record: Floats, ends: Floats) -> Replayed | SimulationError:
    """Return a replay from its record (records, rows) and final state (rows,), or SimulationError if it diverged."""
    recorded = request.measured.recording
    rows = state_row_numbers(run)
    failure_time = float(ends[rows["result.failure_time"]])
    if failure_time < NEVER_FAILED or not np.isfinite(record).all():
        until = min(failure_time, run.step * run.step_count)
        why = f"; {TOO_MANY_PARTS}" if ends[rows["result.too_many_parts"]] else ""
        return SimulationError(f"{request.measured.file}: the model diverged {until:.6g} s after the first sample{why}")
    angle, mass_1, mass_2, command = (
        record[:, rows[path]] for path in ("state.angle", "state.mass_1", "state.mass_2", "result.command")
    )
    pressure_1, pressure_2 = pressures_of(run.program.actuator, run.plant, angle, mass_1, mass_2)
    channels = {
        "angle": Channel(angle, "rad"),
        "pressure_1": Channel(pressure_1, "Pa"),
        "pressure_2": Channel(pressure_2, "Pa"),
        "pressure_difference": Channel(np.subtract(pressure_1, pressure_2), "Pa_d"),
        "torque": Channel(np.asarray(torque_of(run.program.actuator, run.plant, angle, pressure_1, pressure_2)), "N m"),
        "command": Channel(command, "-"),
    }
    # Times are on the clock of the recording.
    interval = run.step * run.record_every
    times = recorded.time[0] + interval * np.arange(record.shape[0], dtype=np.float64)
    return Replayed(Recording(f"{recorded.label}, replayed", times, channels, kind="simulated"), run.step)


def replayed_scenario(request: Replay) -> Scenario:
    """Return the scenario that replays a recording with a free or locked vane, or a vane on a leg.

    A measured angle is prescribed later, when the run is planned.
    """
    recording = request.measured.recording
    start = request.start
    settings = request.settings
    motion: FreeMotion | PrescribedMotion | None = None
    if settings.motion == "locked":
        motion = locked_vane(start.angle)
    elif settings.motion == "leg":
        # The leg on the test fixture is the scenario's of figure 7.
        motion = FreeMotion(start.angle, start.angular_velocity, leg=vane_motion(load_scenario("step-response")).leg)
    highest = with_highest_supply(request.device, recording, recording.names)
    duration = recording.duration + max(settings.longest_delay, sample_period(recording.time))
    return replay_scenario(recording, highest, start, duration, request.measured.file, motion)


def _plan(request: Replay) -> Run:
    """Return the run of a replay, an integer number of samples long, with a measured angle prescribed if requested."""
    scenario = replayed_scenario(request)
    run = plan_run(scenario)
    if run.step_count > MAXIMUM_STEPS:
        raise DataError(
            f"{request.measured.file}: {scenario.run.duration:.4g} s would take {run.step_count} steps of "
            f"{run.step:.2g} s, but at most {MAXIMUM_STEPS} are allowed"
        )
    supply = request.device.supply
    plant = run.plant._replace(supply_pressure=supply.pressure, dorsiflexion_pressure=supply.dorsiflexion_pressure)
    samples = math.ceil(run.step_count / run.steps_per_sample)
    # Steps between two records divide a sample, so that the model is known at every regular sample.
    most = max(1, int(_RECORD_INTERVAL / run.step * (1.0 + _ROUNDING)))
    every = max(count for count in range(1, most + 1) if run.steps_per_sample % count == 0)
    run = replace(run, plant=plant, record_every=every, step_count=samples * run.steps_per_sample)
    return with_prescribed_angle(run, request.start.angle) if request.settings.motion == "measured" else run
