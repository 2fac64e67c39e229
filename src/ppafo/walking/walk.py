"""Runs a walk and gathers what came of it, stride by stride and on average."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.metrics import Metric
from ppafo.model.leg import centrifugal_torques, gravity_torques, mass_matrix
from ppafo.model.plant import chamber_pressures
from ppafo.signals import Channel, Recording
from ppafo.simulation.result import Status
from ppafo.simulation.sampled import state_row_numbers
from ppafo.walking.configuration import Configuration
from ppafo.walking.planning import WalkPlan, plan_walk
from ppafo.walking.strides import PER_STRIDE, SETTLING, Curves, averaged, per_stride, stride_starts

SHORTEST_STRIDES = 4
LONGEST_MINUTES = 600.0
FINE_RECORD = 1.0e-3
COARSE_RECORD = 5.0e-3
FINE_UP_TO = 61.0
"""Length of a walk [s] up to which every millisecond is recorded; longer ones keep every fifth."""

REMEDY = "the step may be too long, or a value far from any real one: try a smaller run.step, and look at the wearer"


@dataclass(frozen=True, slots=True)
class WalkResult:
    """A finished walk: recording, numbers of each stride (strides,), curves over the stride, and numbers of the whole.

    ``averages`` and ``metrics`` leave out the first strides, in which the controller learns.
    """

    configuration: Configuration
    recording: Recording
    strides: Mapping[str, Floats]
    averages: Mapping[str, Curves]
    metrics: Mapping[str, Metric]
    status: Status


def walk(configuration: Configuration, minutes: float) -> WalkResult:
    """Walk for some minutes; a walk that diverges is a result with that status. ScenarioError for bad input."""
    seconds = 60.0 * minutes
    shortest = SHORTEST_STRIDES * configuration.gait.stride_time
    if not shortest <= seconds <= 60.0 * LONGEST_MINUTES:
        raise ScenarioError(
            f"a walk of {minutes:.6g} min: must be {shortest / 60.0:.2g} min ({SHORTEST_STRIDES} strides) or more and "
            f"at most {LONGEST_MINUTES:g} min"
        )
    run = plan_walk(plan_of(configuration, seconds))
    outcome = run_batch(batch_of(run))
    rows = state_row_numbers(run)
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    status = _status(float(outcome.states[rows["result.failure_time"], 0]), outcome.states)
    time = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    if status.time is not None:
        kept = time < status.time
        time, record = time[kept], {name: values[kept] for name, values in record.items()}
    recording = _recording(configuration, run, time, record)
    starts = stride_starts(record["walk.strides"])
    return _gathered(configuration, recording, record, starts, status)


def plan_of(configuration: Configuration, seconds: float) -> WalkPlan:
    """The plan of a walk of some seconds."""
    return WalkPlan(
        device=configuration.device,
        wearer=configuration.wearer,
        gait=configuration.gait,
        controller=configuration.controller,
        settings=dict(configuration.settings),
        sensors=configuration.sensors,
        gait_sensors=configuration.gait_sensors,
        has_ideal_sensors=configuration.has_ideal_sensors,
        duration=seconds,
        period=configuration.period,
        step=configuration.step,
        record_interval=FINE_RECORD if seconds <= FINE_UP_TO else COARSE_RECORD,
    )


def _gathered(
    configuration: Configuration,
    recording: Recording,
    record: Mapping[str, Floats],
    starts: "np.ndarray[tuple[int], np.dtype[np.intp]]",
    status: Status,
) -> WalkResult:
    strides = per_stride(record, starts)
    settled = starts[SETTLING:]
    averages: dict[str, Curves] = {}
    if settled.size >= 2:
        averages = {
            name: averaged(recording.time, recording[name], recording.unit(name), settled) for name in recording.names
        }
    metrics = _metrics(configuration, strides, averages)
    return WalkResult(configuration, recording, strides, averages, metrics, status)


def _status(failed: float, states: Floats) -> Status:
    if failed >= NEVER_FAILED and bool(np.isfinite(states).all()):
        return Status("completed", None, "completed")
    return Status("diverged", failed, f"diverged at t = {failed:.6g} s; {REMEDY}")


def _recording(configuration: Configuration, run: Run, time: Floats, record: Mapping[str, Floats]) -> Recording:
    angle, rate = record["state.angle"], record["state.angular_velocity"]
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, record["state.mass_1"], record["state.mass_2"])  # type: ignore[arg-type]
    external = record["walk.external_torque"]
    channels = {
        "angle": (angle, "rad"),
        "angular_velocity": (rate, "rad/s"),
        "shank_angle": (record["walk.now.shank"], "rad"),
        "healthy_angle": (record["walk.now.ankle"], "rad"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (run.plant.torque_constant * np.subtract(pressure_1, pressure_2), "N m"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
        "knee_torque": (_knee_torque(run, time, record), "N m"),
        "command": (record["result.command"], "-"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
        "supplied_mass": (record["state.supplied_mass"], "kg"),
        "vented_mass": (record["state.vented_mass"], "kg"),
    }
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(f"walk, {configuration.name}", time, values, kind="simulated")


def _knee_torque(run: Run, time: Floats, record: Mapping[str, Floats]) -> Floats:
    """T_1 of equation (11) [N m]: what moves shank and foot as prescribed, without the ground; for the swing."""
    assert run.walk is not None, "a walk has a leg"
    leg = run.walk.leg
    theta, phi = record["state.angle"], record["walk.now.shank"]
    alpha = phi - theta + 0.5 * np.pi
    ankle_acceleration = np.gradient(record["state.angular_velocity"], time)
    matrix = mass_matrix(leg, np.cos(theta))  # type: ignore[arg-type]
    turning = centrifugal_torques(leg, np.sin(theta), record["walk.now.shank_rate"], record["state.angular_velocity"])  # type: ignore[arg-type]
    forward, up = record["walk.now.knee_forward"], record["walk.now.knee_up"]
    weight = gravity_torques(leg, np.sin(phi), np.cos(phi), np.sin(alpha), np.cos(alpha), forward, up)  # type: ignore[arg-type]
    inertial = matrix.shank * record["walk.now.shank_acceleration"] + matrix.coupling * ankle_acceleration
    return np.asarray(inertial + turning.knee + weight.knee)


def _metrics(
    configuration: Configuration, strides: Mapping[str, Floats], averages: Mapping[str, Curves]
) -> dict[str, Metric]:
    """Means over the strides after the first ones, and what they are of a healthy ankle."""
    found = {}
    for name, item in PER_STRIDE.items():
        values = strides[name][SETTLING:]
        if values.size:
            found[name] = Metric(float(values.mean()), item.unit, f"{item.summary}, mean")
    found["strides"] = Metric(float(strides["gas"].size), "-", "whole strides of the walk")
    healthy = healthy_positive_work(configuration)
    if healthy > 0.0:
        found["healthy_positive_work"] = Metric(healthy, "J", "positive work of the healthy ankle in one stride")
        if "push_off_work" in found:
            share = found["push_off_work"].value / healthy
            found["push_off_share"] = Metric(
                share, "-", "work of T_ex in push-off over the healthy ankle's positive work"
            )
    if "angle" in averages:
        away = averages["angle"].mean - averages["healthy_angle"].mean
        found["angle_difference"] = Metric(
            float(np.sqrt(np.mean(away**2))), "rad", "RMS difference of the mean ankle angle to the healthy one"
        )
    return found


def healthy_positive_work(configuration: Configuration) -> float:
    """Positive work [J] of the measured ankle moment in one stride of the wearer; 0 where no moment was measured."""
    gait = configuration.gait
    if "ankle_moment" not in gait.curves:
        return 0.0
    phases = np.linspace(0.0, 1.0, 2001)
    moment = configuration.wearer.body_mass * gait.curve("ankle_moment").sampled(phases)
    angle = gait.ankle_angle.sampled(phases)
    power = np.maximum(moment * np.gradient(angle, phases), 0.0)
    return float(np.trapezoid(power, phases))
