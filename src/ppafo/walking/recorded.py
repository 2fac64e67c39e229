"""The recording of a walk: the engine's rows as channels with units."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.model.contact import SWING
from ppafo.model.leg import centrifugal_torques, gravity_torques, mass_matrix
from ppafo.model.plant import chamber_pressures
from ppafo.signals import Channel, Recording
from ppafo.simulation.simulate import gas_channels
from ppafo.walking.configuration import Configuration
from ppafo.walking.posture import ankle_path

PHASE_ROW = "controller_state.phase.phase"
SAFE_ROW = "controller_state.safety.level"
"""Where event-based controllers keep the phase that they see, and whether they help, pause or have stopped."""

VENTINGS_ROW = "controller_state.safety.ventings"
"""And how often they have paused or stopped."""

REQUEST_ROW = "controller_state.request.torque"
"""Where those that follow a torque keep the one they want."""


def recording_of_walk(configuration: Configuration, run: Run, time: Floats, record: Mapping[str, Floats]) -> Recording:
    """The recording of a walk [SI] from its rows (samples,) by path, at these times [s]."""
    assert run.walk is not None, "a walk has a leg"
    angle, rate = record["state.angle"], record["state.angular_velocity"]
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, record["state.mass_1"], record["state.mass_2"])
    external = record["walk.external_torque"]
    path = ankle_path(configuration.gait, run.walk.timing, configuration.wearer)
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
    channels |= gas_channels(configuration.device.gas, run, record)
    if PHASE_ROW in record:
        channels["controller_phase"] = (record[PHASE_ROW], "-")
        channels["safe_state"] = (record[SAFE_ROW], "-")
    if REQUEST_ROW in record:
        channels["reference"] = (record[REQUEST_ROW], "N m")
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(f"walk, {configuration.name}", time, values, kind="simulated")


def swing_knee_torque(run: Run, time: Floats, record: Mapping[str, Floats]) -> Floats:
    """T_1 of equation (11) [N m] in the swing: what moves shank and foot as prescribed; 0 on the ground.

    There it would need the horizontal force of the ground, which a gait file does not have.
    """
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
    return np.where(record["walk.contact"] == SWING, inertial + turning.knee + weight.knee, 0.0)
