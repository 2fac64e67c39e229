"""The model on the inputs of a recording: command, supply pressure and external torque, or the recorded angle."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.replay import StepInputs, led_by_recording, replay
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import DataError, SimulationError
from ppafo.model.plant import chamber_pressures
from ppafo.parameters.device import Device
from ppafo.signals import Channel, Recording
from ppafo.simulation.plan import plan_run
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Origin,
    ProfileChoice,
    Scenario,
    Sensors,
)
from ppafo.validation.compared import ANGLE
from ppafo.validation.measured import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY, Measured
from ppafo.validation.start import Start, between_stops

Motion = Literal["free", "measured"]

LONGEST_STEP = 1.0e-3
SHORTEST_SAMPLE = 1.0e-4
"""Seconds; irregular samples are placed on a grid no finer than this."""
MOST_STEPS = 20_000_000
_WHOLE = 1.0e-9
_RECORD_INTERVAL = 2.5e-4
"""Seconds between two records of the model, or less: fine enough to be shifted in time and read between."""
_UNIFORM = 0.02
"""Share of a sample by which a time may be off a regular grid; clocks write rounded times."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """What the model did, at every step, on the clock of the recording; the step of the engine [s] and its inputs."""

    recording: Recording
    step: float
    inputs: tuple[str, ...]


def replay_recording(measured: Measured, device: Device, start: Start, motion: Motion, extra: float) -> Replayed:
    """Run the model on the inputs of a recording and ``extra`` seconds longer, with the last inputs."""
    run = _planned(measured, device, start, extra)
    if motion == "measured":
        run = replace(run, program=led_by_recording(run.program), path=(0.0, start.angle, 0.0))
    times = run.step * np.arange(run.step_count, dtype=np.float64)
    inputs = StepInputs(_held(measured, COMMAND, times, run.step), _parameters(measured, device, motion, run, times))
    outcome = replay(batch_of(run), inputs)
    failed = float(outcome.states[state_row_numbers(run)["result.failure_time"], 0])
    if failed < NEVER_FAILED or not np.isfinite(outcome.record).all():
        until = min(failed, float(times[-1]))
        raise SimulationError(
            f"{measured.file}: the model diverged {until:.6g} s after the first sample; look at the volumes, the "
            "inertia and the valve of the set (ppafo audit)"
        )
    used = (
        COMMAND,
        *(name for name in (SUPPLY, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE) if _is_used(measured, name, motion)),
    )
    names = (*used, ANGLE) if motion == "measured" else used
    return Replayed(_recording(measured, run, outcome.record[:, :, 0]), run.step, names)


def regular_interval(time: Floats) -> float | None:
    """Time between samples [s] where they are regular, else None."""
    interval = float(time[-1] - time[0]) / (time.size - 1)
    away = time - time[0] - interval * np.arange(time.size)
    return interval if float(np.abs(away).max()) < _UNIFORM * interval else None


def _planned(measured: Measured, device: Device, start: Start, extra: float) -> Run:
    """The run of a free vane, whose steps are fine enough for a led one too."""
    time = measured.recording.time
    regular = regular_interval(time)
    period = regular or min(max(float(np.diff(time).min()), SHORTEST_SAMPLE), LONGEST_STEP)
    duration = measured.recording.duration + max(extra, period)
    recorded = [float(measured.recording[name].max()) for name in (SUPPLY, DORSIFLEXION_SUPPLY) if measured.has(name)]
    supply = replace(device.supply, pressure=max(device.supply.pressure, *recorded, 0.0))
    scenario = Scenario(
        name=measured.recording.label,
        description="replay of a recording",
        device=replace(device, supply=supply),
        duration=duration,
        time_step=min(period, LONGEST_STEP),
        output_interval=period,
        motion=FreeMotion(start.angle, start.angular_velocity),
        initial_pressure_1=start.pressure_1,
        initial_pressure_2=start.pressure_2,
        control=Control(PYTHON_CONTROLLER, {}, period),
        reference=ProfileChoice("constant", {"level": 0.0}),
        sensors=Sensors(),
        assumptions=(),
        origin=Origin(measured.file, device.name, device.valve_name, (), {}),
    )
    run = plan_run(scenario)
    if run.step_count > MOST_STEPS:
        raise DataError(
            f"{measured.file}: {duration:.4g} s would take {run.step_count} steps of {run.step:.2g} s, at most "
            f"{MOST_STEPS} are allowed; cut the recording into parts"
        )
    plant = run.plant._replace(supply_pressure=device.supply.pressure)
    samples = math.ceil(run.step_count / run.steps_per_sample)
    return replace(run, plant=plant, record_every=_record_every(run), step_count=samples * run.steps_per_sample)


def _record_every(run: Run) -> int:
    """Steps between two records; they divide a sample, so that the model is known at every regular sample."""
    most = max(1, int(_RECORD_INTERVAL / run.step * (1.0 + _WHOLE)))
    return max(count for count in range(1, most + 1) if run.steps_per_sample % count == 0)


def _parameters(measured: Measured, device: Device, motion: Motion, run: Run, times: Floats) -> dict[str, Floats]:
    """Parameters that follow the recording, for every step; pressure and torque keep their mean over a millisecond."""
    together = max(1, min(run.steps_per_sample, round(LONGEST_STEP / run.step)))
    first = (np.arange(times.size) // together * together).astype(np.float64)
    middle: Floats = run.step * (first + 0.5 * together)
    followed: dict[str, Floats] = {}
    if measured.has(SUPPLY):
        followed["plant.supply_pressure"] = _between_samples(measured, SUPPLY, middle)
        if device.supply.pressure == device.supply.dorsiflexion_pressure:
            followed["plant.dorsiflexion_pressure"] = followed["plant.supply_pressure"]
    if measured.has(DORSIFLEXION_SUPPLY):
        followed["plant.dorsiflexion_pressure"] = _between_samples(measured, DORSIFLEXION_SUPPLY, middle)
    if _is_used(measured, EXTERNAL_TORQUE, motion):
        followed["plant.external_torque"] = _between_samples(measured, EXTERNAL_TORQUE, middle)
    if motion == "measured":
        followed |= _path(measured, device, times + 0.5 * run.step)
    return followed


def _path(measured: Measured, device: Device, middle: Floats) -> dict[str, Floats]:
    """The straight piece of the recorded angle that holds at each step; after the last sample the vane stands still."""
    time = measured.recording.time - measured.recording.time[0]
    angles = between_stops(measured.recording[ANGLE], device, measured.file)
    rates = np.append(np.diff(angles) / np.diff(time), 0.0)
    piece = np.searchsorted(time, middle, side="right") - 1
    return {"path.start": time[piece], "path.level": angles[piece], "path.rate": rates[piece]}


def _is_used(measured: Measured, name: str, motion: Motion) -> bool:
    """True where an input is in the recording; a torque on a led vane is what leads it, not an input."""
    return measured.has(name) and not (name == EXTERNAL_TORQUE and motion == "measured")


def _held(measured: Measured, name: str, times: Floats, step: float) -> Floats:
    """The last value at each time after the first sample; a change falls on the nearest step."""
    recording = measured.recording
    index = np.searchsorted(recording.time - recording.time[0], times + 0.5 * step, side="right") - 1
    return recording[name][index]


def _between_samples(measured: Measured, name: str, times: Floats) -> Floats:
    recording = measured.recording
    return np.interp(times, recording.time - recording.time[0], recording[name])


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
