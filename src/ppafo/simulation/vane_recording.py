"""Recording and metrics of a run of a vane alone, computed from its rows."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ppafo.engine.in_python import over_samples, over_samples_in
from ppafo.engine.lanes import Floats
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.engine.run import Run
from ppafo.engine.step.lane import SAME_MOMENT
from ppafo.metrics import evaluate
from ppafo.model.controlled import CONTROLLED
from ppafo.model.declaration import PlainFunction
from ppafo.model.gas import energy_per_content
from ppafo.model.plant import direction_of, driving_torque, net_torque
from ppafo.model.ports import friction_in_motion
from ppafo.model.regulator import LineState, line_pressures
from ppafo.parameters.device import Gas
from ppafo.signals.recording import OF_SECOND_CHAMBER, Channel, Recording
from ppafo.simulation.motion_kind import Measured
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.scenario import Scenario, vane_motion


def measured_vane(scenario: Scenario, run: Run, times: Floats, rows: Mapping[str, Floats]) -> Measured:
    """Return recording and metrics of a vane; T_ex of equation (1) is constant, or moves the vane along its profile."""
    path = vane_motion(scenario).profile
    plant = run.plant

    def external_torque(torque: Floats) -> Floats:
        if path is None:
            return np.full(times.size, plant.external_torque)
        acceleration = profile_values(path, times)[2]
        return np.asarray(net_torques(run, rows, torque) - plant.inertia * acceleration)

    return measured(scenario, run, times, rows, external_torque)


def measured(
    scenario: Scenario,
    run: Run,
    times: Floats,
    rows: Mapping[str, Floats],
    external_torque: Callable[[Floats], Floats],
    of_leg: Mapping[str, tuple[Floats, str]] | None = None,
) -> Measured:
    """Return recording and metrics from rows (samples,) by path, at times [s].

    ``external_torque`` computes T_ex of equation (1) [N m] from the actuator torque [N m]; ``of_leg`` are the channels
    of a leg.
    """
    channels = device_channels(scenario.device.gas, run, rows)
    torque = channels["torque"][0]
    channels["external_torque"] = (external_torque(torque), "N m")
    if scenario.follows_reference:
        # Times of the first samples [s], shape (count,), rounded as the engine does, so that a reference has its bits.
        steps = np.arange(times.size, dtype=np.float64) * run.record_every
        whole = np.round(steps)
        moments: Floats = np.where(np.abs(steps - whole) <= SAME_MOMENT, whole, steps) * run.step
        followed = CONTROLLED[scenario.controlled]
        channels[followed.reference] = (profile_values(scenario.reference, moments)[0], followed.unit)
        if followed.name not in channels:
            of = (channels[name][0] for name in ("angle", "pressure_1", "pressure_2", "torque"))
            value = followed.value(*of)  # type: ignore[arg-type]
            channels[followed.name] = (np.asarray(value), followed.unit)
    recording = recording_of(scenario.name, run, times, channels | dict(of_leg or {}))
    return recording, evaluate(recording)


def recording_of(label: str, run: Run, times: Floats, channels: Mapping[str, tuple[Floats, str]]) -> Recording:
    """Return the simulated recording of channels (samples,) [SI] with their units, at times [s]."""
    absent = OF_SECOND_CHAMBER if run.program.has_one_chamber else frozenset()
    present = {name: Channel(np.asarray(each), unit) for name, (each, unit) in channels.items() if name not in absent}
    return Recording(label, times, present, kind="simulated")


def device_channels(gas: Gas, run: Run, rows: Mapping[str, Floats]) -> dict[str, tuple[Floats, str]]:
    """Return the channels of the device, which a joint and a walk record alike, in SI with unit, from rows by path.

    With supply lines: line pressures and the gas through the bottle's regulator. With an energy balance: true masses,
    temperatures and energies.
    """
    angle = rows["state.angle"]
    actuator = run.program.actuator
    masses = rows["state.mass_1"], rows["state.mass_2"]
    pressure_1, pressure_2 = over_samples(actuator.pressures, run.plant, angle, *masses)
    channels: dict[str, tuple[Floats, str]] = {
        "angle": (angle, "rad"),
        "angular_velocity": (rows["state.angular_velocity"], "rad/s"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (np.asarray(over_samples(actuator.torque, run.plant, angle, pressure_1, pressure_2)), "N m"),
        "command": (rows["result.command"], "-"),
        "supplied_mass": (rows["state.supplied_mass"], "kg"),
        "vented_mass": (rows["state.vented_mass"], "kg"),
        "leaked_mass": (rows["state.leaked_mass"], "kg"),
        "mass_1": (rows["state.mass_1"], "kg"),
        "mass_2": (rows["state.mass_2"], "kg"),
    }
    if run.lines is not None:
        lines = rebuilt(LineState, [rows[path] for path in leaf_paths(LineState, "line_state")])
        line_1, line_2 = line_pressures(run.lines.parameters, run.plant.gas_product, lines)
        channels |= {"line_pressure_1": (np.asarray(line_1), "Pa"), "line_pressure_2": (np.asarray(line_2), "Pa")}
        channels["regulated_mass"] = (np.asarray(lines.regulated_mass), "kg")
    if "masses.mass_1" in rows:
        channels |= {name: (rows[f"masses.{name}"], "kg") for name in ("mass_1", "mass_2")}
    if "masses.gas_work" not in rows:
        return channels
    for chamber in (1, 2):
        # The state has the mass that would have this pressure at the temperature of the room.
        warmth = rows[f"state.mass_{chamber}"] / rows[f"masses.mass_{chamber}"]
        channels[f"temperature_{chamber}"] = (gas.temperature * warmth, "K")
    per_content = energy_per_content(run.plant.gas_product, gas.heat_capacity_ratio)
    channels["gas_energy"] = (per_content * (rows["state.mass_1"] + rows["state.mass_2"]), "J")
    for name, row in (("supplied_enthalpy", "supplied"), ("vented_enthalpy", "vented"), ("wall_heat", "heat")):
        channels[name] = (per_content * rows[f"masses.{row}_content"], "J")
    channels["gas_work"] = (rows["masses.gas_work"], "J")
    return channels


def net_torques(run: Run, rows: Mapping[str, Floats], torque: Floats) -> Floats:
    """Net torque [N m] on a vane at each sample; ``torque`` [N m] is the actuator's. Equation (1)."""
    angle = rows["state.angle"]
    rate = rows["state.angular_velocity"]
    plant = run.plant
    masses = rows["state.mass_1"], rows["state.mass_2"]
    pressures = over_samples(run.program.actuator.pressures, plant, angle, *masses)
    sliding = _with_effects(run, rows, friction_in_motion, plant.dynamic_torque, rate, *pressures)
    driving = _with_effects(run, rows, driving_torque, plant, torque, angle)
    way = over_samples(direction_of, rate)
    return np.asarray(_with_effects(run, rows, net_torque, driving, way, sliding, plant.viscous_damping, angle, rate))


def _with_effects(run: Run, rows: Mapping[str, Floats], function: PlainFunction, *given: Any) -> Any:
    """Value of a model function at each sample, including the effects of a run."""
    states = {
        name: rebuilt(row, [rows[path] for path in leaf_paths(row, name)])
        for name, row in run.program.effect_states.items()
    }
    return over_samples_in(run.program, run.effects, function, states, *given)
