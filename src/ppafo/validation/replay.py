"""The model on the inputs of a recording, from its first state: command, supply, external torque or recorded angle."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ppafo.engine.lanes import Batch, Floats, StepInputs, replay
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.errors import DataError, PpafoError, SimulationError, UnitError, nearest_name, one_line, refused_as
from ppafo.parameters.device import Device
from ppafo.signals import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.recorded.clock import sample_period
from ppafo.simulation.recorded.inputs import RecordedInputs, step_inputs, with_highest_supply, with_prescribed_angle
from ppafo.simulation.recorded.replay import locked_vane, replay_scenario
from ppafo.simulation.recorded.rest import Start
from ppafo.simulation.scenario import FreeMotion, Leg, PrescribedMotion, Scenario
from ppafo.units import parse_quantity
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.validation.measured import Measured

Motion = Literal["free", "measured", "locked", "leg"]
MOTIONS: tuple[Motion, ...] = ("free", "measured", "locked", "leg")

MAXIMUM_STEPS = 20_000_000
_WHOLE = 1.0e-9
_RECORD_INTERVAL = 2.5e-4
"""Seconds between two records of the model, or less: fine enough to be shifted in time and read between."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """What the model did, at every step, on the clock of the recording; the step of the engine [s] and its inputs."""

    recording: Recording
    step: float
    inputs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Replay:
    """What is to be replayed: a recording on a device, ``extra`` [s] longer with the last inputs.

    The motion ``leg`` is that with ``leg``, or on the fixture of figure 7.
    """

    measured: Measured
    device: Device
    start: Start
    motion: Motion
    extra: float
    leg: Leg | None = None


def replay_recording(wanted: Replay) -> Replayed:
    """Return the model on the inputs of a recording; SimulationError where it diverges."""
    found = replay_together([wanted])[0]
    if isinstance(found, PpafoError):
        raise found
    return found


def replay_together(wanted: Sequence[Replay]) -> list[Replayed | PpafoError]:
    """Return many replays, or why one cannot be made; all of one program, clock and inputs are one batch."""
    found: dict[int, Replayed | PpafoError] = {}
    planned: dict[int, tuple[Run, StepInputs, Batch]] = {}
    groups: dict[tuple[Any, ...], list[int]] = {}
    for place, one in enumerate(wanted):
        followed = followed_channels(one.measured, one.motion)
        inputs = RecordedInputs(one.measured.recording, followed, float(one.measured.recording.time[0]))
        try:
            run = _plan(one)
            steps = step_inputs(inputs, one.device, run)
        except PpafoError as error:
            found[place] = error
            continue
        batch = batch_of(run)
        planned[place] = run, steps, batch
        table = [(name, series.tobytes()) for name, series in steps.parameters.items()]
        command = b"" if steps.command is None else steps.command.tobytes()
        groups.setdefault((batch.program, batch.clock, command, tuple(table)), []).append(place)
    for places in groups.values():
        first, steps, batch = planned[places[0]]
        parameters = np.concatenate([planned[place][2].parameters for place in places], axis=1)
        states = np.concatenate([planned[place][2].states for place in places], axis=1)
        outcome = replay(replace(batch, parameters=parameters, states=states), steps)
        rows = state_row_numbers(first)
        for element, place in enumerate(places):
            record, ends = outcome.record[:, :, element], outcome.states[:, element]
            found[place] = _replayed(wanted[place], planned[place][0], rows, record, ends)
    return [found[place] for place in range(len(wanted))]


def _replayed(
    one: Replay, run: Run, rows: Mapping[str, int], record: Floats, ends: Floats
) -> Replayed | SimulationError:
    failed = float(ends[rows["result.failure_time"]])
    if failed < NEVER_FAILED or not np.isfinite(record).all():
        until = min(failed, run.step * run.step_count)
        remedy = "check the volumes, the inertia and the valve of the set (ppafo sets audit)"
        if ends[rows["result.too_many_parts"]]:
            remedy = TOO_MANY_PARTS
        return SimulationError(
            f"{one.measured.file}: the model diverged {until:.6g} s after the first sample; {remedy}"
        )
    inputs = followed_channels(one.measured, one.motion)
    return Replayed(_recording(one.measured, run, record), run.step, inputs)


def followed_channels(measured: Measured, motion: Motion) -> tuple[str, ...]:
    """Return the channels that a replay follows; the torque on a prescribed vane is what moves it, not an input."""
    followed = [name for name in (SUPPLY, DORSIFLEXION_SUPPLY) if measured.has(name)]
    followed += [EXTERNAL_TORQUE] if measured.has(EXTERNAL_TORQUE) and motion == "free" else []
    return (COMMAND, *followed, *([ANGLE] if motion == "measured" else []))


def replayed_scenario(one: Replay) -> Scenario:
    """Return the run of a recording: of a vane that is unconstrained, locked or on a leg."""
    recording, start = one.measured.recording, one.start
    duration = recording.duration + max(one.extra, sample_period(recording.time))
    highest = with_highest_supply(one.device, recording, recording.names)
    given: FreeMotion | PrescribedMotion | None = locked_vane(start.angle) if one.motion == "locked" else None
    if one.motion == "leg":
        # The leg on the test fixture is the scenario's of figure 7.
        fixture = load_scenario("step-response").motion
        leg = one.leg or (fixture.leg if isinstance(fixture, FreeMotion) else None)
        given = FreeMotion(start.angle, start.angular_velocity, leg=leg)
    return replay_scenario(recording, highest, start, duration, one.measured.file, given)


def _plan(one: Replay) -> Run:
    """The run of a vane that is unconstrained, locked or on a leg, with steps fine enough for a prescribed one too."""
    scenario = replayed_scenario(one)
    run = plan_run(scenario)
    if run.step_count > MAXIMUM_STEPS:
        raise DataError(
            f"{one.measured.file}: {scenario.run.duration:.4g} s would take {run.step_count} steps of {run.step:.2g} "
            f"s, at most {MAXIMUM_STEPS} are allowed; split the recording into parts, or give the unit of its times "
            "where they are not seconds"
        )
    supply = one.device.supply
    plant = run.plant._replace(supply_pressure=supply.pressure, dorsiflexion_pressure=supply.dorsiflexion_pressure)
    samples = math.ceil(run.step_count / run.steps_per_sample)
    # Steps between two records divide a sample, so that the model is known at every regular sample.
    most = max(1, int(_RECORD_INTERVAL / run.step * (1.0 + _WHOLE)))
    every = max(count for count in range(1, most + 1) if run.steps_per_sample % count == 0)
    run = replace(run, plant=plant, record_every=every, step_count=samples * run.steps_per_sample)
    return with_prescribed_angle(run, one.start.angle) if one.motion == "measured" else run


def _recording(measured: Measured, run: Run, record: Floats) -> Recording:
    rows = state_row_numbers(run)
    angle, masses = record[:, rows["state.angle"]], (record[:, rows["state.mass_1"]], record[:, rows["state.mass_2"]])
    pressure_1, pressure_2 = pressures_of(run.program.actuator, run.plant, angle, *masses)
    channels = {
        "angle": (angle, "rad"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "pressure_difference": (np.subtract(pressure_1, pressure_2), "Pa_d"),
        "torque": (torque_of(run.program.actuator, run.plant, angle, pressure_1, pressure_2), "N m"),
        "command": (record[:, rows["result.command"]], "-"),
    }
    interval = run.step * run.record_every
    times = measured.recording.time[0] + interval * np.arange(record.shape[0], dtype=np.float64)
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(f"{measured.recording.label}, replayed", times, values, kind="simulated")


_UNITS = {ANGLE: "rad", PRESSURE_1: "Pa_a", PRESSURE_2: "Pa_a"}
_EXAMPLES = {ANGLE: "angle=75 deg", PRESSURE_1: "pressure_1=0 psi_g", PRESSURE_2: "pressure_2=50 psi_g"}
INITIAL_REMEDIES = {name: f'give its initial value, --initial "{example}"' for name, example in _EXAMPLES.items()}
"""What to do about a channel that a replay would start from and that was not recorded."""


def parse_initial(texts: Sequence[str], atmosphere: float) -> dict[str, float]:
    """Return initial values in SI by channel from texts such as ``pressure_1=0 psi_g``."""
    values = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise DataError(
                f"initial value '{one_line(text)}' is not of the form CHANNEL=VALUE, for example '{_EXAMPLES[ANGLE]}'"
            )
        if name not in _UNITS:
            hint = nearest_name(name, _UNITS)
            raise DataError(
                f"initial value '{one_line(text)}': there is no channel '{one_line(name)}'{hint}; "
                f"available: {', '.join(_UNITS)}"
            )
        with refused_as(DataError, f"initial value '{one_line(text)}'", UnitError):
            values[name] = parse_quantity(value, _UNITS[name], atmosphere)
    return values
