"""Experiments in time: step response, torque task, free decay, leak between closed chambers. CVODE solves them."""

import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.run import Run
from ppafo.errors import ScenarioError
from ppafo.model.plant import chamber_volumes
from ppafo.model.thermal import gas_energy, real_density
from ppafo.parameters import load_device
from ppafo.parameters.declaration import SECTIONS
from ppafo.rig.hardware import line_orifice, real_device, rig_physics, rig_plant
from ppafo.rig.request import Outcome, Request
from ppafo.rig.rows import RigPhysics, RigState
from ppafo.rig.run import RigRun, RigSolution, sensor_signals
from ppafo.rig.sensors import Floats, sensor
from ppafo.rig.solution import solve_rig
from ppafo.signals.channels import CHANNELS
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.scenario import Scenario

LEAK_RATE = 20.0
"""Samples in a second [Hz] of a leak that takes half a minute."""

_SUPPLIES = {"supply_pressure": "supply_drop_1", "dorsiflexion_pressure": "supply_drop_2"}
_IN_MOTION = ("angle", "pressure_1", "pressure_2", *_SUPPLIES, "command")
_WHOLE = 1.0e-9
_OPEN_LOOP = "constant"
_CLOSED_VALVE = {"kind": "constant", "command": 0, "rate": "1 kHz"}


def record_step_response(request: Request) -> Outcome:
    """Return the step response of figure 7: the valve opens fully and the vane turns from stop to stop."""
    scenario = _of_package("step-response", request)
    bench_run = rig_run(scenario, request, request.preset.values["sampling.rate"])
    return _outcome("step-response", scenario, bench_run, (*_IN_MOTION, "torque"))


def record_torque_task(request: Request) -> Outcome:
    """Return the torque task of figure 8 with the controller that belongs to the kind of valve."""
    kind = load_device(request.parameter_set, request.valve).valve.kind
    scenario = _of_package(f"torque-task-{kind}", request)
    bench_run = rig_run(scenario, request, request.preset.values["sampling.rate"])
    return _outcome("torque-task", scenario, bench_run, (*_IN_MOTION, "reference", "torque"))


def record_free_decay(request: Request) -> Outcome:
    """Return the angle after an impulse, device on its side, both chambers open to the room."""
    motion = {"kind": "free", "angle": "25 deg", "angular_velocity": "380 deg/s", "external_torque": "0 N m"}
    scenario = _of_bench("free-decay", request, motion, {}, "2 s")
    bench_run = rig_run(scenario, request, request.preset.values["sampling.rate"])
    run = replace(bench_run.run, plant=bench_run.run.plant._replace(gravity_torque=0.0))
    opened = replace(bench_run, run=run, physics=bench_run.physics._replace(chambers_open=1.0))
    return _outcome("free-decay", scenario, opened, ("angle",))


def record_vane_leak(request: Request) -> Outcome:
    """Return both pressures after chamber 1 was filled and both ports were plugged, the vane held in the middle."""
    actuator = load_device(request.parameter_set, request.valve, device_overrides(request)).actuator
    motion = {"kind": "held", "angle": f"{0.5 * (actuator.angle_min + actuator.angle_max)!r} rad"}
    initial = {"pressure_1": "supply", "pressure_2": "atmosphere"}
    scenario = _of_bench("vane-leak", request, motion, initial, "30 s")
    bench_run = rig_run(scenario, request, min(LEAK_RATE, request.preset.values["sampling.rate"]))
    plugged = replace(bench_run, physics=bench_run.physics._replace(ports_open=0.0))
    return _outcome("vane-leak", scenario, plugged, ("pressure_1", "pressure_2"))


def rig_run(scenario: Scenario, request: Request, rate: float) -> RigRun:
    """Return the run of a scenario on the rig of a request, recorded ``rate`` times a second [Hz].

    ScenarioError for a valve that the rig does not have.
    """
    preset, seed = request.preset, request.seed
    device = real_device(scenario.device, preset)
    run = plan_run(replace(scenario, device=device))
    if run.program.valve.joint is not None:
        raise ScenarioError(f"the virtual rig has no valve between the chambers: valve '{device.valve.kind}' has one")
    run = replace(run, plant=rig_plant(run.plant, preset))
    physics = rig_physics(device, preset)
    times = np.arange(int(scenario.duration * rate + _WHOLE) + 1, dtype=np.float64) / rate
    is_open_loop = scenario.control.kind == _OPEN_LOOP
    return RigRun(
        device=device,
        run=run,
        physics=physics,
        line_orifice=line_orifice(device, preset),
        initial=initial_state(scenario, run, physics),
        sensors={
            name: sensor(preset, name, seed, times.size) for name in ("angle", "pressure_1", "pressure_2", *_SUPPLIES)
        },
        sample_times=times,
        control_period=2.0 * scenario.duration if is_open_loop else run.period,
        command_delay=run.command_delay + preset.values["line.delay"],
        hysteresis=preset.values["valve.hysteresis"],
    )


def initial_state(scenario: Scenario, run: Run, physics: RigPhysics) -> RigState:
    """Return vane and gas at the start [SI], everything at the temperature of the walls."""
    angle, rate = run.initial.angle, run.initial.angular_velocity
    warm = physics.wall_temperature
    pressures = (scenario.initial_pressure_1, scenario.initial_pressure_2)
    densities = [real_density(pressure, warm, physics.gas_constant, physics.virial) for pressure in pressures]
    volumes = chamber_volumes(run.plant, angle)
    mass_1, mass_2 = (density * volume for density, volume in zip(densities, volumes, strict=True))
    line_1, line_2 = (density * physics.line_volume for density in densities)
    energy_1, energy_2, line_energy_1, line_energy_2 = (
        gas_energy(mass, warm, physics.heat_capacity) for mass in (mass_1, mass_2, line_1, line_2)
    )
    return RigState(
        angle=angle,
        angular_velocity=rate,
        mass_1=mass_1,
        energy_1=energy_1,
        mass_2=mass_2,
        energy_2=energy_2,
        line_mass_1=line_1,
        line_energy_1=line_energy_1,
        line_mass_2=line_2,
        line_energy_2=line_energy_2,
        supplied_mass=0.0,
        vented_mass=0.0,
        leaked_mass=0.0,
        supply_drop_1=0.0,
        supply_drop_2=0.0,
        enthalpy_in=0.0,
        work_done=0.0,
        heat_in=0.0,
        sensor_angle=angle,
        sensor_pressure_1=pressures[0],
        sensor_pressure_2=pressures[1],
    )


def _outcome(name: str, scenario: Scenario, bench_run: RigRun, names: tuple[str, ...]) -> Outcome:
    solution = solve_rig(bench_run)
    values = sensor_readings(scenario, bench_run, solution)
    channels = {item: Channel(values[item], CHANNELS[item].unit) for item in names}
    recording = Recording(name, bench_run.sample_times, channels, kind="synthetic")
    offsets = {item: bench_run.sensors[item].offset for item in names if item in bench_run.sensors}
    settings = {
        "duration": scenario.duration,
        "initial_angle": bench_run.initial.angle,
        "initial_angular_velocity": bench_run.initial.angular_velocity,
        "impacts": solution.impacts,
        "breakaways": solution.breakaways,
    }
    return Outcome(recording, bench_run.device, offsets, settings)


def sensor_readings(scenario: Scenario, bench_run: RigRun, solution: RigSolution) -> dict[str, Floats]:
    """Return what the sensors read at every sample [SI]; the torque is computed from the measured pressures."""
    signals = [sensor_signals(bench_run, *pair) for pair in zip(solution.states, solution.pressures, strict=True)]
    true = dict(zip(("angle", "pressure_1", "pressure_2"), np.array(signals).T, strict=True))
    for name, drop in _SUPPLIES.items():
        regulated = getattr(bench_run.run.plant, name)
        true[name] = regulated - solution.states[:, RigState._fields.index(drop)]
    readings = {name: bench_run.sensors[name].readings(values) for name, values in true.items()}
    readings["command"] = solution.commands
    readings["torque"] = bench_run.run.plant.torque_constant * (readings["pressure_1"] - readings["pressure_2"])
    readings["reference"] = profile_values(scenario.reference, bench_run.sample_times)[0]
    return readings


def device_overrides(request: Request) -> tuple[str, ...]:
    """Return the overrides that belong to the device and not to the scenario of an experiment."""
    sections = {section.partition(".")[0] for section in SECTIONS} | {"valve", "valves"}
    return tuple(item for item in request.overrides if item.strip().partition(".")[0] in sections)


def _of_package(name: str, request: Request) -> Scenario:
    """Return a scenario of the package with the requested device."""
    document = copy.deepcopy(dict(load_scenario(name).origin.content))
    document["device"] = {"overrides": document["device"].get("overrides", []), **_device_table(request)}
    return scenario_from_dict(document, request.overrides)


def _of_bench(name: str, request: Request, motion: dict[str, str], initial: dict[str, str], duration: str) -> Scenario:
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


def _device_table(request: Request) -> dict[str, str]:
    table = {"set": request.parameter_set}
    return table if request.valve is None else {**table, "valve": request.valve}
