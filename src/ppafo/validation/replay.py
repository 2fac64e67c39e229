"""The model on the inputs of a recording: command, supply pressure and external torque, or the recorded angle."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.replay import replay
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import DataError, SimulationError
from ppafo.model.plant import chamber_pressures
from ppafo.parameters.device import Device
from ppafo.signals import Channel, Recording
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.inputs import (
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    SUPPLY,
    RecordedInputs,
    led_along,
    sample_period,
    step_inputs,
)
from ppafo.simulation.recorded.scenario import held_at, recorded_scenario, with_highest_supply
from ppafo.simulation.recorded.start import Start
from ppafo.simulation.sampled import state_row_numbers
from ppafo.validation.compared import ANGLE
from ppafo.validation.measured import Measured

Motion = Literal["free", "measured", "held"]

MOST_STEPS = 20_000_000
_WHOLE = 1.0e-9
_RECORD_INTERVAL = 2.5e-4
"""Seconds between two records of the model, or less: fine enough to be shifted in time and read between."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """What the model did, at every step, on the clock of the recording; the step of the engine [s] and its inputs."""

    recording: Recording
    step: float
    inputs: tuple[str, ...]


def replay_recording(measured: Measured, device: Device, start: Start, motion: Motion, extra: float) -> Replayed:
    """Run the model on the inputs of a recording and ``extra`` seconds longer, with the last inputs."""
    run = _planned(measured, device, start, motion, extra)
    if motion == "measured":
        run = led_along(run, start.angle)
    inputs = _inputs(measured, motion)
    outcome = replay(batch_of(run), step_inputs(inputs, device, run))
    failed = float(outcome.states[state_row_numbers(run)["result.failure_time"], 0])
    if failed < NEVER_FAILED or not np.isfinite(outcome.record).all():
        until = min(failed, run.step * run.step_count)
        raise SimulationError(
            f"{measured.file}: the model diverged {until:.6g} s after the first sample; look at the volumes, the "
            "inertia and the valve of the set (ppafo audit)"
        )
    return Replayed(_recording(measured, run, outcome.record[:, :, 0]), run.step, inputs.names)


def _inputs(measured: Measured, motion: Motion) -> RecordedInputs:
    """Return what the model is given: the command, and supply and torque where they are in the recording."""
    names = (
        COMMAND,
        *(name for name in (SUPPLY, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE) if _is_used(measured, name, motion)),
        *((ANGLE,) if motion == "measured" else ()),
    )
    return RecordedInputs(measured.recording, names, float(measured.recording.time[0]))


def _planned(measured: Measured, device: Device, start: Start, motion: Motion, extra: float) -> Run:
    """The run of a free or a held vane; the steps of a free one are fine enough for a led one too."""
    recording = measured.recording
    duration = recording.duration + max(extra, sample_period(recording.time))
    highest, held = with_highest_supply(device, recording), held_at(start.angle) if motion == "held" else None
    scenario = recorded_scenario(recording, highest, start, duration, measured.file, held)
    run = plan_run(scenario)
    if run.step_count > MOST_STEPS:
        raise DataError(
            f"{measured.file}: {duration:.4g} s would take {run.step_count} steps of {run.step:.2g} s, at most "
            f"{MOST_STEPS} are allowed; cut the recording into parts"
        )
    supply = device.supply
    plant = run.plant._replace(supply_pressure=supply.pressure, dorsiflexion_pressure=supply.dorsiflexion_pressure)
    samples = math.ceil(run.step_count / run.steps_per_sample)
    return replace(run, plant=plant, record_every=_record_every(run), step_count=samples * run.steps_per_sample)


def _record_every(run: Run) -> int:
    """Steps between two records; they divide a sample, so that the model is known at every regular sample."""
    most = max(1, int(_RECORD_INTERVAL / run.step * (1.0 + _WHOLE)))
    return max(count for count in range(1, most + 1) if run.steps_per_sample % count == 0)


def _is_used(measured: Measured, name: str, motion: Motion) -> bool:
    """True where an input is in the recording; a torque on a led vane is what leads it, not an input."""
    return measured.has(name) and not (name == EXTERNAL_TORQUE and motion != "free")


def _recording(measured: Measured, run: Run, record: Floats) -> Recording:
    rows = state_row_numbers(run)
    angle, masses = record[:, rows["state.angle"]], (record[:, rows["state.mass_1"]], record[:, rows["state.mass_2"]])
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, *masses)  # type: ignore[arg-type]
    difference = np.subtract(pressure_1, pressure_2)
    channels = {
        "angle": (angle, "rad"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "pressure_difference": (difference, "Pa_d"),
        "torque": (run.plant.torque_constant * difference, "N m"),
        "command": (record[:, rows["result.command"]], "-"),
    }
    interval = run.step * run.record_every
    times = measured.recording.time[0] + interval * np.arange(record.shape[0], dtype=np.float64)
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(f"{measured.recording.label}, replayed", times, values, kind="simulated")
