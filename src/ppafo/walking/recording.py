"""Recording of a walk: channels with units from the rows of the engine and the supply by a gas bottle."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.model.plant import PlantParameters
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.vane_recording import gas_channels
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
    walk, gait, actuator = run.walk, walk_of(scenario).gait, run.program.actuator
    assert walk is not None, "a walk has a leg"
    plant = run.plant if supply is None else _plant_on_bottle(run, time, supply)
    path = ankle_path(gait, walk.timing, walk_of(scenario).wearer)
    angle, rate, external = (record[row] for row in ("state.angle", "state.angular_velocity", "walk.external_torque"))
    pressure_1, pressure_2 = pressures_of(actuator, plant, angle, record["state.mass_1"], record["state.mass_2"])
    channels: dict[str, tuple[Any, str]] = {
        "angle": (angle, "rad"),
        "angular_velocity": (rate, "rad/s"),
        "shank_angle": (record["walk.now.shank"], "rad"),
        "healthy_angle": (record["walk.now.ankle"], "rad"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (torque_of(actuator, plant, angle, pressure_1, pressure_2), "N m"),
        "external_torque": (external, "N m"),
        "device_power": (external * rate, "W"),
        "swing_knee_torque": (swing_knee_torque(walk.leg, time, record), "N m"),
        "toe_height": (path.toe_height(record["walk.now.phase"], record["walk.now.shank"], angle), "m"),
        "command": (record["result.command"], "-"),
        "contact": (record["walk.contact"], "-"),
        "heel_force": (record["walk.heel_force"], "N"),
        "toe_force": (record["walk.toe_force"], "N"),
        "supplied_mass": (record["state.supplied_mass"], "kg"),
        "vented_mass": (record["state.vented_mass"], "kg"),
    }
    if walk.leg.keeps_gait >= 0.5:
        channels["dorsiflexor_moment"] = (dorsiflexor_moment(walk.leg, record), "N m")
    channels |= gas_channels(scenario.device.gas, replace(run, plant=plant), record)
    if supply is not None:
        # Interpolated linearly between the exchanges of bottle and device.
        for name, values in supply.values.items():
            channels[name] = (np.interp(time, supply.times, values), UNITS[name])
        channels["bottle_mass"] = (supply.first.mass - record["line_state.regulated_mass"], "kg")
    if _PHASE_ROW in record:
        channels["controller_phase"] = (record[_PHASE_ROW], "-")
    if _REQUEST_ROW in record:
        channels["reference"] = (record[_REQUEST_ROW], "N m")
    absent = OF_SECOND_CHAMBER if run.program.has_one_chamber else frozenset()
    present = {name: Channel(np.asarray(each), unit) for name, (each, unit) in channels.items() if name not in absent}
    return Recording(f"walk, {scenario.name}", time, present, kind="simulated")


def _plant_on_bottle(run: Run, time: Floats, supply: SupplyCourse) -> PlantParameters:
    """Return the plant with the gas product R T [J/kg] at each time [s], for the gas temperature of the bottle.

    The temperature is constant between two exchanges of bottle and device.
    """
    exchanges = np.searchsorted(supply.times, time + 1.0e-9 * run.step, side="right") - 1
    latest = np.minimum(np.maximum(exchanges, 0), supply.times.size - 2)
    temperature = supply.values["gas_temperature"]
    gas_product: Any = run.plant.gas_product * (temperature / temperature[0])[latest]
    return run.plant._replace(gas_product=gas_product)
