"""Experiments of the rig. To add one: ``ExperimentRequest -> ExperimentResult``, and one line in ``EXPERIMENTS``.

Steady experiments turn true values into sensor readings: static torque against pressure, flow of the open valve, flow
map of the valve, leak across the vane. Dynamic experiments are integrated with SciPy's LSODA: step response, torque
task, free decay, leak between closed chambers.

``record`` runs one experiment and returns the synthetic recording with the true parameters, in memory or in a folder
with one CSV file for each experiment and ``rig.json`` with the true parameters of all.
"""

import copy
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.documents.json_text import json_text, plain
from ppafo.engine.run import Run
from ppafo.errors import DataError, ParameterError, ScenarioError
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import TORQUE
from ppafo.model.effects.second_virial import real_density
from ppafo.model.effects.spool_play import spool_position
from ppafo.model.gas import gas_energy
from ppafo.model.orifice import ExactOrifice
from ppafo.model.plant import chamber_volumes
from ppafo.parameters import load_device
from ppafo.parameters.declaration import SECTIONS
from ppafo.parameters.device import VANE, Device
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.plant import valve_settings
from ppafo.rig.dynamics import RigPhysics, RigState, ambient_node, leak_exchange, orifice_exchange
from ppafo.rig.preset import (
    CHANNEL_SENSORS,
    PREFIX,
    ExperimentRequest,
    ExperimentResult,
    Floats,
    Preset,
    list_presets,
    load_preset,
    random_stream,
    real_device,
    rig_physics,
    sensor,
    with_line,
)
from ppafo.rig.solution import RigRun, sensor_signals, solve_rig
from ppafo.signals.recording import CHANNELS, Channel, Recording
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.plan import exact_orifice, plan_run
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.scenario import UNITS, Scenario
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.files import LEFT_ASIDE, add_files, check_files_can_be_added
from ppafo.storage.owned_folder import read_json
from ppafo.version import __version__
from ppafo.wording import nearest_name, one_line, reason


def read_off(
    name: str,
    request: ExperimentRequest,
    device: Device,
    interval: float,
    true: Mapping[str, Floats],
    settings: Mapping[str, float],
    fraction_of_flow_range: float = 1.0,
) -> ExperimentResult:
    """Return sensor readings of true values [SI] by channel, every ``interval`` [s].

    A channel without a sensor is exact.
    """
    count = len(next(iter(true.values())))
    fractions = {"mass_flow": fraction_of_flow_range}
    sensors = {
        channel: sensor(request.preset, channel, request.seed, count, fractions.get(channel, 1.0))
        for channel in true
        if channel in CHANNEL_SENSORS
    }
    channels = {
        channel: Channel(sensors[channel].readings(values) if channel in sensors else values, CHANNELS[channel].unit)
        for channel, values in true.items()
    }
    recording = Recording(name, np.arange(count, dtype=np.float64) * interval, channels, kind="synthetic")
    offsets = {channel: sensor.offset for channel, sensor in sensors.items()}
    return ExperimentResult(recording, device, offsets, {"reading_interval": interval, **settings})


STEP = 5.0 * PASCALS_PER_PSI
HIGHEST = 95.0 * PASCALS_PER_PSI
TURN = 20.0 * PASCALS_PER_PSI
"""Pressure [Pa] above the highest reading from which the pressure returns, so that friction has reversed before."""
TORQUE_REPETITIONS = 3
TORQUE_READING_INTERVAL = 10.0


def record_static_torque(request: ExperimentRequest) -> ExperimentResult:
    """Return torque on the scale [N m] over pressure difference, three times up and down in steps of 5 psi.

    The vane presses on a scale and creeps without slipping, so friction is at the static limit and opposes the
    direction of the pressure change. This is the rig's friction law at zero speed, a play operator without inertia,
    which needs no solver.
    """
    device = real_device(
        load_device(request.parameter_set, overrides=request.overrides, valve=request.valve), request.preset
    )
    rising = np.arange(1, round(HIGHEST / STEP) + 1) * STEP
    once = np.concatenate([rising, rising[::-1]])
    directions = np.repeat([1.0, -1.0], rising.size)
    values = request.preset.values
    scatter = values["friction.scatter"] * random_stream(request.seed, "friction").standard_normal(
        (TORQUE_REPETITIONS, once.size)
    )
    torque = []
    for repetition in scatter:
        pressed = 0.0
        for pressure, direction, deviation in zip(once, directions, repetition, strict=True):
            # On the way to the turn friction has changed sides, whatever was read before.
            if direction < 0.0 and pressure == once[rising.size]:
                pressed = device.actuator.torque_constant * (HIGHEST + TURN)
            limit = device.friction.static_torque + values["friction.static_per_pressure"] * pressure
            pressed = on_scale(pressed, device.actuator.torque_constant * pressure, limit * max(0.0, 1.0 + deviation))
            torque.append(pressed)
    true = {
        "torque": np.array(torque),
        "pressure_difference": np.tile(once, TORQUE_REPETITIONS),
        "direction": np.tile(directions, TORQUE_REPETITIONS),
        "repetition": np.repeat(np.arange(1.0, TORQUE_REPETITIONS + 1.0), once.size),
    }
    return read_off("static-torque", request, device, TORQUE_READING_INTERVAL, true, {"turn_beyond": TURN})


def on_scale(before: float, actuator: float, limit: float) -> float:
    """Return the torque [N m] on a scale, given the previous torque, the actuator torque and the friction limit [N m].

    Friction takes any difference up to the limit; the scale cannot pull.
    """
    return max(0.0, min(max(before, actuator - limit), actuator + limit))


UPSTREAM_GAUGE = tuple(level * PASCALS_PER_PSI for level in (20.0, 35.0, 50.0, 65.0, 80.0))
PRESSURE_RATIOS = (0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.98)
LEAK_GAUGE = tuple(level * PASCALS_PER_PSI for level in range(5, 85, 5))
COMMAND_STEPS = 100
READING_INTERVAL = 2.0
REPETITIONS = 2
SMALL_METER = 0.1
"""Ratio [-] of the flow range of the leak meter to the range of the other meter."""


def record_open_valve(request: ExperimentRequest) -> ExperimentResult:
    """Return the mass flow [kg/s] of the fully open valve at several upstream and downstream pressures."""
    device, physics = _bench(request)
    ambient = device.supply.atmospheric_pressure
    pairs = []
    for gauge in UPSTREAM_GAUGE:
        upstream = ambient + gauge
        pairs += [(upstream, ambient)]
        pairs += [(upstream, upstream * ratio) for ratio in PRESSURE_RATIOS if upstream * ratio > ambient]
    points = np.array(pairs * REPETITIONS)
    orifice = exact_orifice(device.valve.orifice, device)
    true = {
        "upstream_pressure": points[:, 0],
        "downstream_pressure": points[:, 1],
        "mass_flow": np.array([_flow(physics, up, down, 1.0, orifice) for up, down in points]),
        "command": np.ones(len(points)),
    }
    return read_off(
        "open-valve-flow", request, device, READING_INTERVAL, true, {"gas_temperature": physics.supply_temperature}
    )


def record_valve_map(request: ExperimentRequest) -> ExperimentResult:
    """Return the mass flow [kg/s] of the valve over command, with outlet to the atmosphere; above 0 into chamber 1."""
    device, physics = _bench(request)
    supply, orifice = device.supply, exact_orifice(device.valve.orifice, device)
    # The openings once nothing moves any more: of the valve with every time and frequency taken out.
    kind = VALVES[device.valve.kind]
    with_times = valve_settings(device.valve)
    still = with_times._replace(**{quantity.name: 0.0 for quantity in kind.quantities if quantity.unit})
    model = kind.choose(still)
    parameters = model.prepare(still)
    rising = np.linspace(-1.0, 1.0, COMMAND_STEPS + 1)
    commands = np.concatenate([rising, rising[-2::-1]])
    # The sweep begins at the lowest command, where the play lies behind the spool.
    spool, flows, upstream = -1.0, [], []
    for command in commands:
        spool = spool_position(spool, float(command), request.preset.values["valve.hysteresis"])
        openings = model.instant(parameters, model.settle(parameters, model.initial(), spool, 0.0), spool)
        forward = _flow(physics, supply.pressure, supply.atmospheric_pressure, openings.source_1, orifice)
        backward = _flow(physics, supply.dorsiflexion_pressure, supply.atmospheric_pressure, openings.source_2, orifice)
        flows.append(forward - backward)
        upstream.append(supply.dorsiflexion_pressure if command < 0.0 else supply.pressure)
    true = {
        "command": commands,
        "mass_flow": np.array(flows),
        "upstream_pressure": np.array(upstream),
        "downstream_pressure": np.full(commands.size, supply.atmospheric_pressure),
    }
    return read_off(
        "valve-map", request, device, READING_INTERVAL, true, {"gas_temperature": physics.supply_temperature}
    )


def record_steady_leak(request: ExperimentRequest) -> ExperimentResult:
    """Return the mass flow [kg/s] that maintains the pressure in chamber 1, with chamber 2 open to the atmosphere."""
    device, physics = _bench(request)
    ambient = device.supply.atmospheric_pressure
    levels = np.array(LEAK_GAUGE * REPETITIONS) + ambient
    orifice = exact_orifice(device.actuator.leak, device)
    # Gas that leaks has taken the temperature of the walls.
    behind = ambient_node(physics, ambient, physics.wall_temperature)
    before = [ambient_node(physics, float(level), physics.wall_temperature) for level in levels]
    true = {
        "pressure_1": levels,
        "pressure_2": np.full(levels.size, ambient),
        "mass_flow": np.array([leak_exchange(physics, node, behind, orifice).mass for node in before]),
    }
    settings = {"gas_temperature": physics.wall_temperature}
    return read_off("vane-leak-steady", request, device, READING_INTERVAL, true, settings, SMALL_METER)


def _bench(request: ExperimentRequest) -> tuple[Device, RigPhysics]:
    device = real_device(
        load_device(request.parameter_set, overrides=request.overrides, valve=request.valve), request.preset
    )
    return device, rig_physics(device, request.preset)


def _flow(physics: RigPhysics, upstream: float, downstream: float, fraction: float, orifice: ExactOrifice) -> float:
    """Return the mass flow [kg/s] of gas at supply temperature."""
    before = ambient_node(physics, float(upstream), physics.supply_temperature)
    behind = ambient_node(physics, float(downstream), physics.wall_temperature)
    return orifice_exchange(physics, before, behind, fraction, orifice, 1.0).mass


LEAK_RATE = 20.0
"""Sample rate [Hz] of a leak experiment that takes half a minute."""

_SUPPLIES = {"supply_pressure": "supply_drop_1", "dorsiflexion_pressure": "supply_drop_2"}
_SENSED = ("angle", "pressure_1", "pressure_2")
_IN_MOTION = (*_SENSED, *_SUPPLIES, "command")
_WHOLE = 1.0e-9
"""Rounding tolerance at the end of a run, as a fraction of a sample."""

_CLOSED_VALVE = {"kind": "constant", "command": 0, "rate": "1 kHz"}


def record_step_response(request: ExperimentRequest) -> ExperimentResult:
    """Return the step response of figure 7: the valve opens fully and the vane turns from stop to stop."""
    scenario = _of_package("step-response", request)
    return _recorded("step-response", scenario, rig_run(scenario, request), (*_IN_MOTION, "torque"))


def record_torque_task(request: ExperimentRequest) -> ExperimentResult:
    """Return the torque task of figure 8 with the controller for the kind of valve."""
    # Overrides may be of the scenario, which is chosen by the valve first.
    kind = load_device(request.parameter_set, valve=request.valve).valve.kind
    scenario = _of_package(f"torque-task-{kind}", request)
    return _recorded("torque-task", scenario, rig_run(scenario, request), (*_IN_MOTION, "reference", "torque"))


def record_free_decay(request: ExperimentRequest) -> ExperimentResult:
    """Return the angle after an impulse, with the device on its side and both chambers open to the atmosphere."""
    motion = {"kind": "free", "angle": "25 deg", "angular_velocity": "380 deg/s", "external_torque": "0 N m"}
    scenario = _of_bench("free-decay", request, motion, {}, "2 s")
    bench_run = rig_run(scenario, request)
    # On its side gravity turns nothing.
    run = replace(bench_run.run, plant=bench_run.run.plant._replace(gravity_torque=0.0))
    opened = replace(bench_run, run=run, physics=bench_run.physics._replace(chambers_open=1.0))
    return _recorded("free-decay", scenario, opened, ("angle",))


def record_vane_leak(request: ExperimentRequest) -> ExperimentResult:
    """Return both pressures after chamber 1 is filled and both ports are plugged, with the vane locked at mid-range."""
    sections = {section.partition(".")[0] for section in SECTIONS} | {"valve", "valves"}
    # What belongs to the scenario is no override of a device.
    of_device = [override for override in request.overrides if override.strip().partition(".")[0] in sections]
    actuator = load_device(request.parameter_set, overrides=of_device, valve=request.valve).actuator
    motion = {"kind": "locked", "angle": f"{0.5 * (actuator.angle_min + actuator.angle_max)!r} rad"}
    initial = {"pressure_1": "supply", "pressure_2": "atmosphere"}
    scenario = _of_bench("vane-leak", request, motion, initial, "30 s")
    bench_run = rig_run(scenario, request, LEAK_RATE)
    plugged = replace(bench_run, physics=bench_run.physics._replace(ports_open=0.0))
    return _recorded("vane-leak", scenario, plugged, ("pressure_1", "pressure_2"))


def rig_run(scenario: Scenario, request: ExperimentRequest, highest_rate: float = math.inf) -> RigRun:
    """Return the run of a scenario on the rig of a request, sampled at no more than ``highest_rate`` [Hz].

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
    if run.program.valve.joint is not None:
        raise ScenarioError(
            f"the simulated test bench has no valve between the chambers: valve '{device.valve.kind}' has one"
        )
    physics, (plant, line) = rig_physics(device, preset), with_line(device, run.plant, preset)
    run = replace(run, plant=plant)
    times = np.arange(int(scenario.run.duration * rate + _WHOLE) + 1, dtype=np.float64) / rate
    return RigRun(
        device=device,
        run=run,
        physics=physics,
        line_orifice=line,
        initial=initial_state(scenario, run, physics),
        sensors={name: sensor(preset, name, request.seed, times.size) for name in (*_SENSED, *_SUPPLIES)},
        sample_times=times,
        # A constant command is decided once.
        control_period=2.0 * scenario.run.duration if scenario.controller.is_open_loop else run.period,
        command_delay=run.command_delay + preset.values["line.delay"],
        hysteresis=preset.values["valve.hysteresis"],
    )


def initial_state(scenario: Scenario, run: Run, physics: RigPhysics) -> RigState:
    """Return the initial state of vane and gas [SI], with all gas at wall temperature."""
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
    return RigState(**start)


def _recorded(name: str, scenario: Scenario, bench_run: RigRun, names: tuple[str, ...]) -> ExperimentResult:
    """Return the sensor readings at every sample; the torque is computed from the measured pressures."""
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
        "impacts": solution.impacts,
        "breakaways": solution.breakaways,
    }
    return ExperimentResult(recording, bench_run.device, offsets, settings)


def _of_package(name: str, request: ExperimentRequest) -> Scenario:
    """Return a scenario of the package with the requested device."""
    document = copy.deepcopy(dict(load_scenario(name).origin.content))
    document["device"] = {"overrides": document["device"].get("overrides", []), **_device_table(request)}
    return scenario_from_dict(document, request.overrides)


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


EXPERIMENTS: dict[str, tuple[str, Callable[[ExperimentRequest], ExperimentResult]]] = {
    "static-torque": ("torque on a scale over pressure, three times up and down", record_static_torque),
    "free-decay": ("angle after an impulse, chambers open to the room", record_free_decay),
    "open-valve-flow": ("flow of the open valve at many pressures", record_open_valve),
    "vane-leak": ("pressures of plugged chambers as gas leaks across the vane", record_vane_leak),
    "vane-leak-steady": ("flow that maintains the pressure in chamber 1", record_steady_leak),
    "valve-map": ("flow of the valve over its command, up and down", record_valve_map),
    "step-response": ("figure 7: valve opened fully, vane from stop to stop", record_step_response),
    "torque-task": ("figure 8: torque ramp and hold under control", record_torque_task),
}
"""Experiments by name: their summary, and the function that records them."""


def overview() -> tuple[str, dict[str, Any]]:
    """Return a list of the experiments and presets with their descriptions, as text and as plain data."""
    experiments = {name: summary for name, (summary, _) in EXPERIMENTS.items()}
    presets = {name: load_preset(name).title for name in list_presets()}
    width = max(map(len, [*experiments, *presets]))
    lines = ["experiments (recordings are synthetic):"]
    lines += [f"  {name:<{width}}  {summary}" for name, summary in experiments.items()]
    lines += ["presets:", *(f"  {name:<{width}}  {title}" for name, title in presets.items())]
    document = {
        "experiments": [{"name": name, "summary": summary} for name, summary in experiments.items()],
        "presets": [{"name": name, "title": title} for name, title in presets.items()],
    }
    return "\n".join(lines), document


LARGEST_SEED = 2**32 - 1
DEFAULT_DEVICE = "ppafo2011"
DEFAULT_PRESET = "paper-bench"

NOTICE = "synthetic: made by the simulated test bench of ppafo in place of a measurement"


@dataclass(frozen=True, slots=True)
class RigRecording:
    """Synthetic recording with the true device and the true parameters behind it.

    ``device``: the true device, which the sensors do not know
    ``truth``: all settings and true values as plain data, for ``rig.json``
    """

    recording: Recording
    device: Device
    truth: Mapping[str, Any]


def record(
    experiment: str,
    preset: str | Path | Preset = DEFAULT_PRESET,
    seed: int = 1,
    device: str = DEFAULT_DEVICE,
    overrides: Iterable[str] = (),
    valve: str | None = None,
) -> RigRecording:
    """Run an experiment on the rig and return its synthetic recording; equal arguments give equal bytes.

    ``overrides`` are texts such as ``friction.static_torque=0.5 N m`` (device), ``run.duration=1 s`` (dynamic
    experiments) or ``rig.pressure_sensor.noise=0 Pa_d`` (preset). Raises SimulationError if the solver fails.
    """
    summary, run = find_experiment(experiment)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError(f"seed = {seed} must be a whole number from 0 to {LARGEST_SEED}")
    words = tuple(overrides)
    of_preset = tuple(word for word in words if word.strip().startswith(PREFIX))
    others = tuple(word for word in words if word not in of_preset)
    if not isinstance(preset, Preset):
        preset = load_preset(preset, of_preset)
    elif of_preset:
        raise ParameterError(f"override '{of_preset[0]}': change a preset object itself, with Preset.with_value")
    kind = load_parameter_set(device).actuator_kind
    if kind != VANE:
        raise ParameterError(
            f"the simulated test bench supports vane actuators only, and '{one_line(device)}' has an actuator '{kind}'"
        )
    outcome = run(ExperimentRequest(preset, seed, device, valve, others))
    truth = {
        "notice": NOTICE,
        "units": UNITS,
        "version": __version__,
        "experiment": experiment,
        "summary": summary,
        "seed": seed,
        "parameter_set": device,
        "overrides": list(words),
        "device": plain(outcome.device),
        "shown": dict(outcome.device.shown),
        "preset": {
            "name": preset.name,
            "title": preset.title,
            "values": plain(preset.values),
            "reasons": dict(preset.reasons),
        },
        "sensor_offsets": plain(outcome.offsets),
        "settings": plain(outcome.settings),
        "channels": {name: outcome.recording.unit(name) for name in outcome.recording.names},
        "samples": len(outcome.recording),
    }
    return RigRecording(outcome.recording, outcome.device, truth)


def find_experiment(name: str) -> tuple[str, Callable[[ExperimentRequest], ExperimentResult]]:
    """Return summary and function of the experiment with a name. Raises ParameterError for an unknown name."""
    if name not in EXPERIMENTS:
        hint = nearest_name(name, EXPERIMENTS)
        raise ParameterError(f"there is no experiment '{one_line(name)}'{hint}; available: {', '.join(EXPERIMENTS)}")
    return EXPERIMENTS[name]


RIG_FILE = "rig.json"
FORMAT = "ppafo rig"


def check_rig_folder(folder: Path, experiment: str) -> None:
    """Raise DataError, before any run, if a folder is not writable or contains files of another origin."""
    _earlier(folder, f"{experiment}.csv")
    check_files_can_be_added(folder, [f"{experiment}.csv", RIG_FILE])


def write_rig_recording(folder: Path, made: RigRecording) -> tuple[str, ...]:
    """Write recording and true parameters into a folder, beside other experiments; returns the file names.

    Raises DataError if the folder contains files of another origin.
    """
    name = f"{made.truth['experiment']}.csv"
    recordings = {**_earlier(folder, name), name: dict(made.truth)}
    document = {
        "format": FORMAT,
        "schema_version": 1,
        "notice": NOTICE,
        "recordings": {key: recordings[key] for key in sorted(recordings)},
    }
    # By rig.json a folder is known to be the rig's: it is there first, whenever the process is killed.
    add_files(folder, {RIG_FILE: f"{json_text(document)}\n".encode(), name: marked_csv_bytes(made.recording)})
    return name, RIG_FILE


def _earlier(folder: Path, name: str) -> dict[str, Any]:
    """Return the entries of ``rig.json`` for the recordings that are already in a folder.

    Raises DataError if the folder was not written by the rig, or if the recording ``name`` would replace a file of
    another origin.
    """
    try:
        there = {entry.name for entry in folder.iterdir()} if folder.is_dir() else set()
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error
    # What a killed writer left is no file of others.
    present = {entry for entry in there if LEFT_ASIDE not in entry}
    recordings: Any = {}
    if RIG_FILE in present:
        path = folder / RIG_FILE
        try:
            document = read_json(path)
        except DataError as error:
            raise DataError(f"{error}, so it is not overwritten") from error
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            raise DataError(f"{path}: was not written by the rig, so it is not overwritten")
        recordings = document.get("recordings")
        if not isinstance(recordings, dict):
            raise DataError(f"{path}: has no 'recordings', so it is not overwritten")
    elif present:
        raise DataError(f"{folder}: is not empty and has no recordings of the rig ({RIG_FILE}); choose another folder")
    if name in present and name not in recordings:
        raise DataError(f"{folder}: has a {name} that the rig did not write; move it or choose another folder")
    return dict(recordings)
