"""Recording of a walk: channels with units from the rows of the engine and the supply by a gas bottle."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.model.plant import PlantParameters
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.vane_recording import device_channels, recording_of
from ppafo.walking.bottle.course import UNITS, SupplyCourse
from ppafo.walking.gait_series import ankle_path
from ppafo.walking.inverse_dynamics import dorsiflexor_moment, swing_knee_torque
from ppafo.walking.motion import walk_of

_PHASE_ROW, _REQUEST_ROW = "controller_state.phase.phase", "controller_state.request.torque"
"""Paths of the rows for gait phase and requested torque of a controller that has them."""


def recording_of_walk(
    scenario: Scenario, run: Run, time: Floats, record: Mapping[str, Floats], supply: SupplyCourse | None = None
) -> Recording:
    """Return the recording of a walk [SI] from its rows (samples,) by path at times [s]; ``supply`` is its bottle."""
    walk, gait = run.walk, walk_of(scenario).gait
    assert walk is not None, "a walk has a leg"
    plant = run.plant if supply is None else _plant_on_bottle(run, time, supply)
    path = ankle_path(gait, walk.timing, walk_of(scenario).wearer)
    angle, rate, external = (record[row] for row in ("state.angle", "state.angular_velocity", "walk.external_torque"))
    channels = device_channels(scenario.device.gas, replace(run, plant=plant), record)
    channels |= {
        "shank_angle": (record["walk.now.shank"], "rad"),
        "healthy_angle": (record["walk.now.ankle"], "rad"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
        "swing_knee_torque": (swing_knee_torque(walk.leg, time, record), "N m"),
        "toe_height": (path.toe_height(record["walk.now.phase"], record["walk.now.shank"], angle), "m"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
    }
    if walk.leg.keeps_gait >= 0.5:
        channels["dorsiflexor_moment"] = (dorsiflexor_moment(walk.leg, record), "N m")
    if supply is not None:
        # Interpolated linearly between the exchanges of bottle and device.
        for name, values in supply.values.items():
            channels[name] = (np.interp(time, supply.times, values), UNITS[name])
        channels["bottle_mass"] = (supply.first.mass - record["line_state.regulated_mass"], "kg")
    if _PHASE_ROW in record:
        channels["controller_phase"] = (record[_PHASE_ROW], "-")
    if _REQUEST_ROW in record:
        channels["reference"] = (record[_REQUEST_ROW], "N m")
    return recording_of(f"walk, {scenario.name}", run, time, channels)


def _plant_on_bottle(run: Run, time: Floats, supply: SupplyCourse) -> PlantParameters:
    """Return the plant with the gas product R T [J/kg] at each time [s], for the gas temperature of the bottle.

    The temperature is constant between two exchanges of bottle and device.
    """
    exchanges = np.searchsorted(supply.times, time + 1.0e-9 * run.step, side="right") - 1
    latest = np.minimum(np.maximum(exchanges, 0), supply.times.size - 2)
    temperature = supply.values["gas_temperature"]
    gas_product: Any = run.plant.gas_product * (temperature / temperature[0])[latest]
    return run.plant._replace(gas_product=gas_product)
