"""The recording of a walk: the engine's rows as channels with units."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.model.contact import SWING
from ppafo.model.leg import centrifugal_torques, gravity_torques, mass_matrix, passive_torque
from ppafo.model.plant import chamber_pressures
from ppafo.signals import Channel, Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import gas_channels
from ppafo.walking.course_planning import pace_in_time
from ppafo.walking.event_times import EVENT_ROW, FRACTION_ROW, clock_row
from ppafo.walking.gait_series import truncate
from ppafo.walking.motion import walk_of
from ppafo.walking.on_bottle import UNITS, SupplyCourse
from ppafo.walking.posture import AnklePath, ankle_path

PHASE_ROW = "controller_state.phase.phase"
SAFE_ROW = "controller_state.safety.level"
"""Where event-based controllers keep the phase that they see, and whether they help, pause or have stopped."""

VENTINGS_ROW = "controller_state.safety.ventings"
"""And how often they gave less help: lifted only, paused or stopped."""

FINDING_ROW = "controller_state.safety.finding"
"""And the last sign by which they did, with the readings then."""

REQUEST_ROW = "controller_state.request.torque"
"""Where those that follow a torque keep the one they want."""


def recording_of_walk(
    configuration: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    supply: SupplyCourse | None = None,
) -> Recording:
    """The recording of a walk [SI] from its rows (samples,) by path, at these times [s]; with its bottle's course."""
    run = run if supply is None else _with_cold_gas(run, supply, time)
    assert run.walk is not None, "a walk has a leg"
    angle, rate = record["state.angle"], record["state.angular_velocity"]
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, record["state.mass_1"], record["state.mass_2"])
    external = record["walk.external_torque"]
    path = ankle_path(walk_of(configuration).gait, run.walk.timing, walk_of(configuration).wearer)
    channels: dict[str, tuple[Any, str]] = {
        "angle": (angle, "rad"),
        "angular_velocity": (rate, "rad/s"),
        "shank_angle": (record["walk.now.shank"], "rad"),
        "healthy_angle": (record["walk.now.ankle"], "rad"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (run.plant.torque_constant * np.subtract(pressure_1, pressure_2), "N m"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
        "swing_knee_torque": (swing_knee_torque(run, time, record), "N m"),
        "toe_height": (path.toe_height(record["walk.now.phase"], record["walk.now.shank"], angle), "m"),
        "command": (record["result.command"], "-"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
        "supplied_mass": (record["state.supplied_mass"], "kg"),
        "vented_mass": (record["state.vented_mass"], "kg"),
    }
    if run.walk.leg.keeps_gait >= 0.5:
        channels["dorsiflexor_moment"] = (dorsiflexor_moment(run, record), "N m")
    channels |= gas_channels(configuration.device.gas, run, record)
    if supply is not None:
        channels |= {name: (supply.at(name, time), UNITS[name]) for name in supply.values}
        channels["bottle_mass"] = (supply.first.mass - record["line_state.regulated_mass"], "kg")
    if PHASE_ROW in record:
        channels["controller_phase"] = (record[PHASE_ROW], "-")
        channels["safe_state"] = (record[SAFE_ROW], "-")
    if REQUEST_ROW in record:
        channels["reference"] = (record[REQUEST_ROW], "N m")
    fraction, event = clock_row(record, FRACTION_ROW), clock_row(record, EVENT_ROW)
    if fraction is not None and event is not None:
        channels["gait_fraction"], channels["gait_event"] = (fraction, "-"), (event, "-")
    if run.walk.course is not None:
        channels |= _course_channels(configuration, run, path, time, record)
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(f"walk, {configuration.name}", time, values, kind="simulated")


def _with_cold_gas(run: Run, supply: SupplyCourse, time: Floats) -> Run:
    """The run with the gas of each time [s], as it was in force between two meetings of bottle and device."""
    met = np.maximum(np.searchsorted(supply.times, time + 1.0e-9 * run.step, side="right") - 1, 0)
    warmth = supply.values["gas_temperature"] / supply.values["gas_temperature"][0]
    product: Any = run.plant.gas_product * warmth[np.minimum(met, supply.times.size - 2)]
    return replace(run, plant=run.plant._replace(gas_product=product))


def _course_channels(
    configuration: Scenario, run: Run, path: AnklePath, time: Floats, record: Mapping[str, Any]
) -> dict[str, tuple[Any, str]]:
    """What a course has beside a walk of equal strides, and the toes over ground that may rise: stairs lift the ankle.

    The healthy toes are as high as those of the gait, times the stride over the recorded one.
    """
    assert run.walk is not None, "a walk has a leg"
    assert run.walk.course is not None, "of a course"
    gait, pace = walk_of(configuration).gait, pace_in_time(run.walk.course, time)
    phase, shank = record["walk.now.phase"], record["walk.now.shank"]
    healthy = path.toe_height(
        phase, truncate(gait.shank_angle).values_at(phase), truncate(gait.ankle_angle).values_at(phase)
    )
    above = path.toes_over_ankle(shank, record["state.angle"]) - path.toes_over_ankle(shank, record["walk.now.ankle"])
    found: dict[str, tuple[Any, str]] = {
        "toe_height": (pace.stride * healthy + above, "m"),
        "stride_frequency": (pace.frequency, "Hz"),
    }
    if gait.walking_speed is not None:
        found["walking_speed"] = (gait.walking_speed * pace.stride * pace.frequency * gait.stride_time, "m/s")
    return found


def dorsiflexor_moment(run: Run, record: Mapping[str, Any]) -> Floats:
    """Moment [N m] of the muscles that lift the foot, 0 or more, of a wearer who keeps the measured ankle.

    What the healthy ankle needs, by its moment on the ground and by equation (11) in the swing, less tissue and T_ex.
    The literature shows the activity of the tibialis anterior in its place.
    """
    assert run.walk is not None, "a walk has a leg"
    in_swing = record["walk.contact"] == SWING
    needed = np.where(in_swing, record["walk.now.healthy_torque"], record["walk.now.moment"])
    tissue = passive_torque(run.walk.leg, record["walk.now.ankle"])
    return np.asarray(np.maximum(tissue + record["walk.external_torque"] - needed, 0.0))


def swing_knee_torque(run: Run, time: Floats, record: Mapping[str, Any]) -> Floats:
    """T_1 of equation (11) [N m] in the swing: what moves shank and foot as prescribed; 0 on the ground.

    There it would need the horizontal force of the ground, which a gait file does not have.
    """
    assert run.walk is not None, "a walk has a leg"
    leg = run.walk.leg
    theta, phi = record["state.angle"], record["walk.now.shank"]
    alpha = phi - theta + 0.5 * np.pi
    rate = record["state.angular_velocity"]
    # A walk that fails at once has one sample, and no acceleration is known of it.
    ankle_acceleration = np.gradient(rate, time) if len(time) > 1 else np.zeros_like(rate)
    matrix = mass_matrix(leg, np.cos(theta))
    turning = centrifugal_torques(leg, np.sin(theta), record["walk.now.shank_rate"], record["state.angular_velocity"])
    forward, up = record["walk.now.knee_forward"], record["walk.now.knee_up"]
    weight = gravity_torques(leg, np.sin(phi), np.cos(phi), np.sin(alpha), np.cos(alpha), forward, up)
    inertial = matrix.shank * record["walk.now.shank_acceleration"] + matrix.coupling * ankle_acceleration
    return np.where(record["walk.contact"] == SWING, inertial + turning.knee + weight.knee, 0.0)
