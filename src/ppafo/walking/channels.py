"""Channels of a recorded walk that do not depend on who walks: what the device does, what its controller sees."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.walking.events import EVENT_ROW, FRACTION_ROW, PHASE_ROW, REQUEST_ROW, SAFE_ROW, clock_row

Channels = dict[str, tuple[Any, str]]
"""Values (samples,) and SI unit of channels by name."""


def actuator_channels(run: Run, record: Mapping[str, Floats]) -> Channels:
    """Pressures, torques and power, from rows (samples,) by path."""
    angle, rate, external = (record[row] for row in ("state.angle", "state.angular_velocity", "walk.external_torque"))
    actuator, masses = run.program.actuator, (record["state.mass_1"], record["state.mass_2"])
    pressure_1, pressure_2 = pressures_of(actuator, run.plant, angle, *masses)
    return {
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (np.asarray(torque_of(actuator, run.plant, angle, pressure_1, pressure_2)), "N m"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
    }


def valve_and_ground_channels(record: Mapping[str, Floats]) -> Channels:
    """The command, how the foot meets the ground, and the gas taken and vented so far."""
    return {
        "command": (record["result.command"], "-"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
        "supplied_mass": (record["state.supplied_mass"], "kg"),
        "vented_mass": (record["state.vented_mass"], "kg"),
    }


def controller_channels(record: Mapping[str, Floats]) -> Channels:
    """What a controller keeps: phase of the gait, level of help, requested torque, where it is in the stride."""
    channels: Channels = {}
    if PHASE_ROW in record:
        channels["controller_phase"] = (record[PHASE_ROW], "-")
        channels["safe_state"] = (record[SAFE_ROW], "-")
    if REQUEST_ROW in record:
        channels["reference"] = (record[REQUEST_ROW], "N m")
    fraction, event = clock_row(record, FRACTION_ROW), clock_row(record, EVENT_ROW)
    if fraction is not None and event is not None:
        channels["gait_fraction"], channels["gait_event"] = (fraction, "-"), (event, "-")
    return channels
