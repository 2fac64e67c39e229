"""Transient experiments of the simulated bench: step response, torque task, free decay, leak over time."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.documents.json_text import fields_of
from ppafo.errors import ScenarioError
from ppafo.model.controlled import TORQUE
from ppafo.model.effects.second_virial import real_density
from ppafo.model.gas import gas_energy
from ppafo.model.plant import chamber_volumes
from ppafo.parameters import load_device, load_parameter_set
from ppafo.parameters.declaration import SECTIONS
from ppafo.rig.dynamics import RigState
from ppafo.rig.sensors import sensor
from ppafo.rig.setup import ExperimentRequest, ExperimentResult, real_device, rig_physics, with_line
from ppafo.rig.solution import RigRun, sensor_signals, solve_rig
from ppafo.signals.recording import CHANNELS, Channel, Recording
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.plan import plan_run
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.scenario import Scenario, vane_motion

_LEAK_RATE = 20.0
"""Sample rate [Hz] of a leak experiment of half a minute."""

_SUPPLIES = {"supply_pressure": "supply_drop_1", "dorsiflexion_pressure": "supply_drop_2"}
"""Field of ``RigState`` with the regulator droop, by channel of the supply pressure."""
_SENSED = ("angle", "pressure_1", "pressure_2")
_IN_MOTION = (*_SENSED, *_SUPPLIES, "command")
"""Channels of the device's sensors, and channels of a recording of motion."""
_WHOLE = 1.0e-9
"""Rounding tolerance at the end of a run, as a fraction of a sample [-]."""

_CLOSED_VALVE = {"kind": "constant", "command": 0, "rate": "1 kHz"}
"""Controller that keeps the valve closed."""


def record_step_response(request: ExperimentRequest) -> ExperimentResult:
    """Record the step response of figure 7 of the paper: the valve opens fully, the vane turns from stop to stop."""
    scenario = _of_package("step-response", request)
    return _recorded("step-response", scenario, rig_run(scenario, request), (*_IN_MOTION, "torque"))


def record_torque_task(request: ExperimentRequest) -> ExperimentResult:
    """Record the torque task of figure 8 of the paper, with the controller for the type of valve."""
    # Overrides may be of the scenario, which is chosen by the valve first.
    kind = load_device(request.parameter_set, valve=request.valve).valve.kind
    scenario = _of_package(f"torque-task-{kind}", request)
    return _recorded("torque-task", scenario, rig_run(scenario, request), (*_IN_MOTION, "reference", "torque"))


def record_free_decay(request: ExperimentRequest) -> ExperimentResult:
    """Record the angle after an impulse, with the device on its side and both chambers open to the atmosphere."""
    motion = {"kind": "free", "angle": "25 deg", "angular_velocity": "380 deg/s", "external_torque": "0 N m"}
    scenario = _of_bench("free-decay", request, motion, {}, "2 s")
    bench_run = rig_run(scenario, request)
    # On its side gravity turns nothing.
    run = replace(bench_run.run, plant=bench_run.run.plant._replace(gravity_torque=0.0))
    opened = replace(bench_run, run=run, physics=bench_run.physics._replace(chambers_open=1.0))
    return _recorded("free-decay", scenario, opened, ("angle",))


def record_vane_leak(request: ExperimentRequest) -> ExperimentResult:
    """Record both pressures after chamber 1 is filled and both ports are plugged, with the vane locked mid-range."""
    sections = {section.partition(".")[0] for section in SECTIONS} | {"valve", "valves"}
    # What belongs to the scenario is no override of a device.
    overrides = [override for override in request.overrides if override.strip().partition(".")[0] in sections]
    actuator = load_device(request.parameter_set, overrides=overrides, valve=request.valve).actuator
    motion = {"kind": "locked", "angle": f"{0.5 * (actuator.angle_min + actuator.angle_max)!r} rad"}
    initial = {"pressure_1": "supply", "pressure_2": "atmosphere"}
    scenario = _of_bench("vane-leak", request, motion, initial, "30 s")
    bench_run = rig_run(scenario, request, _LEAK_RATE)
    plugged = replace(bench_run, physics=bench_run.physics._replace(ports_open=0.0))
    return _recorded("vane-leak", scenario, plugged, ("pressure_1", "pressure_2"))


def rig_run(scenario: Scenario, request: ExperimentRequest, highest_rate: float = math.inf) -> RigRun:
    """Return the run of a scenario on the bench of a request, sampled at no more than ``highest_rate`` [Hz].

    Raises ScenarioError for a valve that the rig does not have, and for a reference other than a torque.
    """
    if scenario.controlled != TORQUE:
        raise ScenarioError(
            f"{scenario.name}: reference.of = '{scenario.controlled}': controllers on the simulated test bench "
            f"follow a torque only; give a scenario with reference.of = 'torque'"
        )
    preset = request.preset
    rate = min(highest_rate, preset.values["sampling.rate"])
    device = real_device(scenario.device, preset)
    run = plan_run(replace(scenario, device=device))
    physics, (plant, line) = rig_physics(device, preset), with_line(device, run.plant, preset)
    run = replace(run, plant=plant)
    # All gas is at wall temperature at the start.
    angle, warm = run.initial.angle, physics.wall_temperature
    start = dict.fromkeys(RigState._fields, 0.0)
    start |= {"angle": angle, "angular_velocity": run.initial.angular_velocity, "sensor_angle": angle}
    pressures = (scenario.initial.pressure_1, scenario.initial.pressure_2)
    for number, (pressure, volume) in enumerate(zip(pressures, chamber_volumes(run.plant, angle), strict=True), 1):
        density = real_density(pressure, warm, physics.gas_constant, physics.virial)
        start[f"sensor_pressure_{number}"] = pressure
        for prefix, filled in (("", volume), ("line_", physics.line_volume)):
            start[f"{prefix}mass_{number}"] = mass = density * filled
            start[f"{prefix}energy_{number}"] = gas_energy(mass, warm, physics.heat_capacity)
    times = np.arange(int(scenario.run.duration * rate + _WHOLE) + 1, dtype=np.float64) / rate
    return RigRun(
        device=device,
        run=run,
        physics=physics,
        line_orifice=line,
        initial=RigState(**start),
        sensors={name: sensor(preset, name, request.seed, times.size) for name in (*_SENSED, *_SUPPLIES)},
        sample_times=times,
        # A constant command is decided once.
        control_period=2.0 * scenario.run.duration if scenario.controller.is_open_loop else run.period,
        command_delay=run.command_delay + preset.values["line.delay"],
        hysteresis=preset.values["valve.hysteresis"],
        report=request.report,
    )


def _recorded(name: str, scenario: Scenario, bench_run: RigRun, names: tuple[str, ...]) -> ExperimentResult:
    """Return sensor readings at every sample; the torque is computed from the measured pressures."""
    solution, plant = solve_rig(bench_run), bench_run.run.plant
    pairs = zip(solution.states, solution.pressures, strict=True)
    signals = np.array([sensor_signals(bench_run.physics, *pair) for pair in pairs])
    true = dict(zip(_SENSED, signals.T, strict=True))
    for supply, drop in _SUPPLIES.items():
        true[supply] = getattr(plant, supply) - solution.states[:, RigState._fields.index(drop)]
    readings = {channel: bench_run.sensors[channel].readings(values) for channel, values in true.items()}
    readings["command"] = solution.commands
    readings["torque"] = plant.torque_constant * (readings["pressure_1"] - readings["pressure_2"])
    readings["reference"] = profile_values(scenario.reference, bench_run.sample_times)[0]
    channels = {channel: Channel(readings[channel], CHANNELS[channel].unit) for channel in names}
    recording = Recording(name, bench_run.sample_times, channels, kind="synthetic")
    offsets = {channel: bench_run.sensors[channel].offset for channel in names if channel in bench_run.sensors}
    settings = {
        "duration": scenario.run.duration,
        "initial_angle": bench_run.initial.angle,
        "initial_angular_velocity": bench_run.initial.angular_velocity,
        **fields_of(solution, "impacts", "breakaways"),
    }
    moved = vane_motion(scenario)
    kind = "leg" if moved.leg else getattr(moved, "kind", "free")
    motion = {"prescribed": "measured"}.get(kind, kind)
    return ExperimentResult(recording, bench_run.device, offsets, settings, scenario.origin.replaced, motion)


def _of_package(name: str, request: ExperimentRequest) -> Scenario:
    """Load a bundled scenario with the requested device."""
    content = load_scenario(name).origin.content
    # As overrides, so that the scenario reports its values that replace values of another set.
    chosen = {"valve": load_parameter_set(request.parameter_set).default_valve, **_device_table(request)}
    of_device = (f"device.{key}={name}" for key, name in chosen.items() if name != content["device"][key])
    return scenario_from_dict(content, [*of_device, *request.overrides])


def _of_bench(
    name: str, request: ExperimentRequest, motion: dict[str, str], initial: dict[str, str], duration: str
) -> Scenario:
    document: dict[str, Any] = {
        "schema_version": 1,
        "name": name,
        "device": _device_table(request),
        "run": {"duration": duration, "step": "1 ms", "output_interval": "1 ms"},
        "motion": motion,
        "initial": initial,
        "controller": _CLOSED_VALVE,
    }
    return scenario_from_dict(document, request.overrides)


def _device_table(request: ExperimentRequest) -> dict[str, str]:
    table = {"set": request.parameter_set}
    return table if request.valve is None else {**table, "valve": request.valve}
