"""Experiments of the simulated bench: synthetic recordings of runs and of steady states, with the errors of sensors.

Motion and gas are those of ``simulate``, in a tenth of its steps; a preset adds effects that the identified model has
not. Readings of steady states are formulas. ``record`` returns the recording with the true parameters; a folder of
recordings has a CSV file for each experiment, and ``rig.json``.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.documents.json_text import fields_of, json_text, plain
from ppafo.errors import DataError, ParameterError, SimulationError
from ppafo.model.catalog import VALVES
from ppafo.model.gas import mass_flow_ratio
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import actuator_torque
from ppafo.model.sensors import follow, quantise
from ppafo.model.valves.proportional import spool_position
from ppafo.parameters.device import VANE, Device, SonicOrifice
from ppafo.parameters.loading import load_device, load_parameter_set
from ppafo.parameters.overrides import read_overrides
from ppafo.parameters.plant import plant_parameters, valve_settings
from ppafo.rig.preset import PREFIX, Preset, load_preset
from ppafo.signals.recording import CHANNELS, Channel, Floats, Recording
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.scenario import LARGEST_SEED, UNITS, Scenario, vane_motion
from ppafo.simulation.simulate import simulate
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.files import LEFT_ASIDE, add_files, check_files_can_be_added
from ppafo.storage.owned_folder import entries_of, read_json
from ppafo.version import __version__
from ppafo.wording import argument_text, check_known, one_line

# File with all true values beside the recordings of a folder, and its format.
RIG_FILE = "rig.json"
_RIG_FORMAT = "ppafo rig"
NOTICE = "synthetic: made by the simulated test bench of ppafo in place of a measurement"
"""Notice in the metadata of every recording of the simulated bench."""

# Step and largest pressure difference [Pa] of static torque, and the one at which pressure begins to fall.
_STEP = 5.0 * PASCALS_PER_PSI
_HIGHEST = 95.0 * PASCALS_PER_PSI
_TURN = 115.0 * PASCALS_PER_PSI
_UPSTREAM_GAUGE = tuple(level * PASCALS_PER_PSI for level in (20.0, 35.0, 50.0, 65.0, 80.0))
_PRESSURE_RATIOS = (0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.98)
"""Upstream gauge pressures [Pa] at the open valve, and ratios of downstream to upstream pressure [-]."""
# Time between readings at rest [s], sample rate of vane-leak [Hz], range of the meter of its flow over the other's.
_READING_INTERVAL = 2.0
_LEAK_RATE = 20.0
_SMALL_METER = 0.1
_NOTHING = 1.0e-9
"""Torque constant [m^3] of a device without gas torque, and diameter [m] of plugged ports."""
SENSORS = {
    "angle": "angle_sensor",
    "pressure_1": "pressure_sensor",
    "pressure_2": "pressure_sensor",
    "supply_pressure": "pressure_sensor",
    "pressure_difference": "pressure_sensor",
    "upstream_pressure": "pressure_sensor",
    "downstream_pressure": "pressure_sensor",
    "torque": "torque_sensor",
    "mass_flow": "flow_sensor",
    "friction": "",
    "dorsiflexion_pressure": "pressure_sensor",
}
"""Sensor by channel; ``friction`` has no sensor, only a random stream.

The order determines the streams: a new channel must come last, so that the other streams do not change.
"""
_SENSED = ("angle", "pressure_1", "pressure_2", "supply_pressure", "dorsiflexion_pressure")


def random_stream(seed: int, channel: str, *more: int) -> np.random.Generator:
    """Return a random generator of a channel, separate so that an additional channel changes no other channel."""
    # By its position, not its name: renaming a channel leaves its noise.
    sequence = np.random.SeedSequence([seed, list(SENSORS).index(channel), *more])
    return np.random.Generator(np.random.PCG64(sequence))


@dataclass(frozen=True, slots=True)
class RigRecording:
    """Synthetic recording with what is true of it.

    ``truth``: all settings and true values as plain data, for ``rig.json``
    ``motion``: motion of the vane for ``validate``, "" for an experiment without motion
    """

    recording: Recording
    truth: Mapping[str, Any]
    motion: str = ""


def _static_torque(device: Device, preset: Preset, seed: int) -> dict[str, Floats]:
    """Torque on the scale [N m] over pressure difference, three times up and down in steps of 5 psi.

    The vane presses on a scale and creeps without slipping, so friction is at the static limit and opposes the
    direction of the pressure change: a play operator without inertia.
    """
    rising = np.arange(1, round(_HIGHEST / _STEP) + 1) * _STEP
    sweep = np.concatenate([rising, rising[::-1]])
    scatter = random_stream(seed, "friction").standard_normal((3, sweep.size))
    per_pressure = device.effects.get("seal_friction", {}).get("static_per_pressure", 0.0)
    constant = device.actuator.torque_constant
    torque = []
    for repetition in preset.values["bench.friction_scatter"] * scatter:
        reading = 0.0
        for number, (pressure, deviation) in enumerate(zip(sweep, repetition, strict=True)):
            # On the way to the turn friction has changed sides, whatever was read before.
            if number == rising.size:
                reading = actuator_torque(_TURN, 0.0, constant)
            limit = (device.friction.static_torque + per_pressure * pressure) * max(0.0, 1.0 + deviation)
            reading = on_scale(reading, actuator_torque(pressure, 0.0, constant), limit)
            torque.append(reading)
    return {
        "torque": np.array(torque),
        "pressure_difference": np.tile(sweep, len(scatter)),
        "direction": np.tile(np.repeat([1.0, -1.0], rising.size), len(scatter)),
        "repetition": np.repeat(np.arange(1.0, len(scatter) + 1.0), sweep.size),
    }


def on_scale(before: float, actuator: float, limit: float) -> float:
    """Torque on a scale [N m] that cannot pull: friction [N m] takes any difference up to its limit [N m]."""
    return max(0.0, min(max(before, actuator - limit), actuator + limit))


def _open_valve(device: Device, preset: Preset, _seed: int) -> dict[str, Floats]:
    """Mass flow [kg/s] of the fully open valve at several upstream and downstream pressures."""
    ambient = device.supply.atmospheric_pressure
    pairs = []
    for level in (ambient + gauge for gauge in _UPSTREAM_GAUGE):
        pairs += [(level, ambient)]
        pairs += [(level, level * ratio) for ratio in _PRESSURE_RATIOS if level * ratio > ambient]
    points = np.array(pairs * 2)
    return {
        "upstream_pressure": points[:, 0],
        "downstream_pressure": points[:, 1],
        "mass_flow": np.array([_valve_flow(device, preset, up, down, 1.0) for up, down in points.tolist()]),
        "command": np.ones(len(points)),
    }


def _valve_map(device: Device, preset: Preset, _seed: int) -> dict[str, Floats]:
    """Mass flow [kg/s] of the valve over command, outlet to atmosphere; positive into chamber 1."""
    supply = device.supply
    ambient = device.supply.atmospheric_pressure
    # The openings once nothing moves any more: of the valve with every time and frequency taken out.
    kind = VALVES[device.valve.kind]
    still = valve_settings(device.valve)._replace(**{item.name: 0.0 for item in kind.quantities if item.unit})
    model = kind.choose(still)
    if model.instant is None:
        raise ParameterError(
            f"the experiment 'valve-map' measures a flow over the command, but a valve of kind '{kind.name}' sets a "
            "pressure; take 'step-response'"
        )
    parameters = model.prepare(still)
    rising = np.linspace(-1.0, 1.0, 101)
    commands = np.concatenate([rising, rising[-2::-1]])
    # The sweep begins at the lowest command, where the play lies behind the spool.
    spool = -1.0
    flows = []
    for command in commands.tolist():
        spool = spool_position(spool, command, preset.values["bench.hysteresis"])
        openings = model.instant(parameters, model.settle(parameters, model.state(), spool, 0.0), spool)
        forward = _valve_flow(device, preset, supply.pressure, ambient, openings.source_1)
        flows.append(forward - _valve_flow(device, preset, supply.dorsiflexion_pressure, ambient, openings.source_2))
    return {
        "command": commands,
        "mass_flow": np.array(flows),
        "upstream_pressure": np.where(commands < 0.0, supply.dorsiflexion_pressure, supply.pressure),
        "downstream_pressure": np.full(commands.size, ambient),
    }


def _steady_leak(device: Device, _preset: Preset, _seed: int) -> dict[str, Floats]:
    """Mass flow [kg/s] that maintains the pressure in chamber 1, with chamber 2 at the atmosphere."""
    ambient = device.supply.atmospheric_pressure
    plant = plant_parameters(device)
    levels = ambient + np.tile(np.arange(5.0, 85.0, 5.0) * PASCALS_PER_PSI, 2)
    laminar = device.effects.get("laminar_leak", {}).get("coefficient", 0.0)
    flows = [orifice_flow(level, ambient, plant.leak_conductance, 1.0, plant.leak_curve) for level in levels.tolist()]
    return {
        "pressure_1": levels,
        "pressure_2": np.full(levels.size, ambient),
        "mass_flow": np.array([flow for flow, _, _ in flows]) + laminar * (levels**2 - ambient**2),
    }


def _valve_flow(device: Device, preset: Preset, upstream: float, downstream: float, opening: float) -> float:
    """Mass flow [kg/s] of the valve at two pressures [Pa] and an opening [-], for the gas in the flow meter."""
    plant = plant_parameters(device)
    flow, _, _ = orifice_flow(upstream, downstream, opening * plant.valve_conductance, 1.0, plant.valve_curve)
    warmer = device.gas.temperature + preset.values["bench.gas_difference"]
    return flow * mass_flow_ratio(math.sqrt(warmer / device.gas.temperature))


@dataclass(frozen=True, slots=True)
class RigExperiment:
    """Experiment: a run of which ``channels`` are recorded, or readings ``at_rest``: true values [SI] by channel."""

    summary: str
    channels: tuple[str, ...] = ()
    at_rest: Callable[[Device, Preset, int], dict[str, Floats]] | None = None


EXPERIMENTS = {
    "static-torque": RigExperiment("torque on a scale over pressure, three times up and down", at_rest=_static_torque),
    "free-decay": RigExperiment("angle after an impulse, chambers open to the room", ("angle",)),
    "open-valve-flow": RigExperiment("flow of the open valve at many pressures", at_rest=_open_valve),
    "vane-leak": RigExperiment(
        "pressures of plugged chambers as gas leaks across the vane", ("pressure_1", "pressure_2")
    ),
    "vane-leak-steady": RigExperiment("flow that maintains the pressure in chamber 1", at_rest=_steady_leak),
    "valve-map": RigExperiment("flow of the valve over its command, up and down", at_rest=_valve_map),
    "step-response": RigExperiment(
        "figure 7: valve opened fully, vane from stop to stop", (*_SENSED, "command", "torque")
    ),
    "torque-task": RigExperiment(
        "figure 8: torque ramp and hold under control", (*_SENSED, "command", "reference", "torque")
    ),
}
"""Experiments by name."""


def record(
    experiment: str,
    preset: str | Path = "paper-bench",
    seed: int = 1,
    device: str = "ppafo2011",
    overrides: Iterable[str] = (),
    valve: str | None = None,
) -> RigRecording:
    """Run an experiment on the simulated bench; equal arguments give identical bytes.

    ``overrides`` are texts such as ``friction.static_torque=0.5 N m`` (device), ``run.duration=1 s`` (experiments with
    motion) or ``rig.pressure_sensor.noise=0 Pa_d`` (preset). Raises SimulationError if the run fails.
    """
    check_known(experiment, EXPERIMENTS, ParameterError, f"there is no experiment '{one_line(experiment)}'")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError(f"seed = {seed} must be a whole number from 0 to {LARGEST_SEED}")
    overrides = tuple(overrides)
    of_preset = [override for override in overrides if override.strip().startswith(PREFIX)]
    bench = load_preset(preset, of_preset)
    for override in read_overrides(overrides):
        if override.typed in ("device.set", "device.valve"):
            name = override.typed.removeprefix("device.").replace("set", "device")
            raise ParameterError(f"override '{override}': the bench takes it as {argument_text(name)}")
    kind = load_parameter_set(device).actuator_kind
    if kind != VANE:
        raise ParameterError(
            f"the simulated test bench supports vane actuators only; that of '{one_line(device)}' is a '{kind}'"
        )
    scenario = _scenario(experiment, device, valve, bench, [text for text in overrides if text not in of_preset])
    true = scenario.device
    true.check_pressurised("the simulated test bench", "; use the recording of a simulated run")
    at_rest = EXPERIMENTS[experiment].at_rest
    if at_rest is None:
        values = _run(experiment, scenario)
        interval = scenario.run.output_interval
    else:
        values = at_rest(true, bench, seed)
        interval = _READING_INTERVAL
    recording, errors = _read(experiment, values, interval, bench, true, seed)
    moved = vane_motion(scenario)
    kind = "leg" if moved.leg else getattr(moved, "kind", "free")
    motion = {"prescribed": "measured"}.get(kind, kind) if at_rest is None else ""
    truth = {
        "notice": NOTICE,
        "units": UNITS,
        "version": __version__,
        "experiment": experiment,
        "seed": seed,
        "parameter_set": device,
        "overrides": list(overrides),
        "device": plain(true),
        "shown": dict(true.shown),
        "preset": plain(fields_of(bench, "name", "title", "model", "values")),
        "sensor_errors": errors,
        **({"replaced": scenario.origin.replaced} if scenario.origin.replaced else {}),
    }
    return RigRecording(recording, truth, motion)


def _scenario(experiment: str, device: str, valve: str | None, bench: Preset, overrides: list[str]) -> Scenario:
    """Return the scenario of an experiment: of the package, or one with a closed valve."""
    kind = load_device(device, valve=valve).valve.kind
    rate = _LEAK_RATE if experiment == "vane-leak" else bench.values["bench.rate"]
    # Ten steps where the identified model makes one.
    of_run = ("run.step=0.1 ms", f"run.output_interval={1.0 / rate!r} s")
    given = {override.typed for override in read_overrides(overrides)}
    of_bench = (*of_run, *bench.model, *bench.valves.get(kind, ()))
    changes = [*(text for text in of_bench if text.partition("=")[0].strip() not in given), *overrides]
    table = {"set": device} if valve is None else {"set": device, "valve": valve}
    if experiment in ("step-response", "torque-task"):
        # Any valve but a pair of switching ones takes the law of the proportional valve.
        law = "solenoid" if kind == "solenoid" else "proportional"
        content = load_scenario(f"torque-task-{law}" if experiment == "torque-task" else experiment).origin.content
        # As overrides, so that the scenario reports its values that replace values of another set.
        chosen = {"valve": load_parameter_set(device).default_valve, **table}
        of_device = (f"device.{key}={value}" for key, value in chosen.items() if value != content["device"][key])
        return scenario_from_dict(content, [*of_device, *changes])
    of_actuator = [override for override in overrides if override.strip().startswith("actuator.")]
    actuator = load_device(device, overrides=of_actuator, valve=valve).actuator
    is_decay = experiment == "free-decay"
    locked = {"kind": "locked", "angle": f"{0.5 * (actuator.angle_min + actuator.angle_max)!r} rad"}
    document: dict[str, Any] = {
        "schema_version": 1,
        "name": experiment,
        "device": table,
        "run": {"duration": "2 s" if is_decay else "30 s"},
        "motion": {"kind": "free", "angle": "25 deg", "angular_velocity": "380 deg/s"} if is_decay else locked,
        "initial": {"pressure_1": "atmosphere" if is_decay else "supply", "pressure_2": "atmosphere"},
        "controller": {"kind": "constant", "command": 0, "rate": "1 kHz"},
    }
    return scenario_from_dict(document, changes)


def _run(experiment: str, scenario: Scenario) -> dict[str, Floats]:
    """Return the true values [SI] of a run by channel. Raises SimulationError if the run fails."""
    device = scenario.device
    if experiment == "free-decay":
        # Open chambers give no torque, and on its side gravity turns nothing.
        actuator = replace(device.actuator, torque_constant=_NOTHING, displacement_per_radian=_NOTHING)
        device = replace(device, actuator=actuator, foot_plate=replace(device.foot_plate, gravity_torque=0.0))
    if experiment == "vane-leak":
        orifice: Any = device.valve.orifice
        size = "sonic_conductance" if isinstance(orifice, SonicOrifice) else "area"
        device = replace(device, valve=replace(device.valve, orifice=replace(orifice, **{size: _NOTHING**2})))
    result = simulate(replace(scenario, device=device))
    if not result.status.is_completed:
        raise SimulationError(f"the simulated test bench: {result.status}")
    found = result.recording
    supply = device.supply
    values = {name: found[name] for name in found.names}
    for name, line, level in (
        ("supply_pressure", "line_pressure_1", supply.pressure),
        ("dorsiflexion_pressure", "line_pressure_2", supply.dorsiflexion_pressure),
    ):
        # Regulators that give way feed lines.
        values.setdefault(name, found[line] if line in found else np.full(len(found), level))
    return {name: values[name] for name in EXPERIMENTS[experiment].channels}


def _read(
    experiment: str, true: Mapping[str, Floats], interval: float, bench: Preset, device: Device, seed: int
) -> tuple[Recording, dict[str, dict[str, float]]]:
    """Return the recording of the sensors, and offset [SI] and gain error [-] of each; other channels are exact."""
    ambient = device.supply.atmospheric_pressure
    is_run = EXPERIMENTS[experiment].at_rest is None
    channels = {}
    errors = {}
    for name, values in true.items():
        channels[name] = values
        if name not in SENSORS or (is_run and name == "torque"):
            continue
        of_sensor = ("gain", "lag", "offset", "noise", "resolution")
        gain, lag, offset, noise, resolution = (bench.values[f"{SENSORS[name]}.{number}"] for number in of_sensor)
        # The meter of a leak has a smaller range, which scales offset, noise and resolution.
        scale = _SMALL_METER if (experiment, name) == ("vane-leak-steady", "mass_flow") else 1.0
        stream = random_stream(seed, name)
        # The offset comes first, so that a longer recording begins with the same noise.
        offset *= scale * float(stream.standard_normal())
        gain *= float(random_stream(seed, name, 1).standard_normal())
        shown = np.array(values)
        # Readings of steady states no lag changes.
        for sample in range(1, shown.size if lag > 0.0 and is_run else 0):
            before = float(values[sample - 1])
            now = float(values[sample])
            shown[sample] = follow(1.0 / lag, interval, float(shown[sample - 1]), before, now)
        # A gauge sensor shows the atmosphere as 0, whatever its gain.
        turn = ambient if CHANNELS[name].unit == "Pa" and name != "pressure_difference" else 0.0
        shown += gain * (shown - turn) + offset + scale * noise * stream.standard_normal(shown.size)
        channels[name] = np.array([quantise(float(value), scale * resolution) for value in shown])
        errors[name] = {"offset": offset, "gain": gain}
    if is_run and "torque" in true:
        # Of the measured pressures, as a laboratory has it.
        constant = device.actuator.torque_constant
        channels["torque"] = actuator_torque(channels["pressure_1"], channels["pressure_2"], constant)
    times = np.arange(len(next(iter(true.values()))), dtype=np.float64) * interval
    described = {name: Channel(values, CHANNELS[name].unit) for name, values in channels.items()}
    return Recording(experiment, times, described, kind="synthetic"), errors


def write_rig_recording(folder: Path, recorded: RigRecording) -> tuple[str, ...]:
    """Write recording and true parameters into a folder, and return the file names.

    Raises DataError if the folder contains files of another origin.
    """
    experiment = recorded.truth["experiment"]
    recordings = {**check_rig_folder(folder, experiment), f"{experiment}.csv": dict(recorded.truth)}
    document = {
        "format": _RIG_FORMAT,
        "schema_version": 1,
        "notice": NOTICE,
        "recordings": {key: recordings[key] for key in sorted(recordings)},
    }
    written = {RIG_FILE: f"{json_text(document)}\n".encode(), f"{experiment}.csv": marked_csv_bytes(recorded.recording)}
    # By rig.json a folder is known to be the rig's: it is there first, whenever the process is killed.
    add_files(folder, written)
    return f"{experiment}.csv", RIG_FILE


def check_rig_folder(folder: Path, experiment: str) -> dict[str, Any]:
    """Return the entries of ``rig.json`` for the recordings already in a folder.

    Raises DataError if the folder is not writable or was not written by the rig, or if the recording would replace a
    file of another origin.
    """
    # A file that a killed writer left behind is the writer's own.
    entries = entries_of(folder) if folder.is_dir() else []
    name = f"{experiment}.csv"
    present = {entry.name for entry in entries if LEFT_ASIDE not in entry.name}
    recordings: Any = {}
    if RIG_FILE in present:
        document = read_json(folder / RIG_FILE)
        is_of_rig = isinstance(document, dict) and document.get("format") == _RIG_FORMAT
        recordings = document.get("recordings") if is_of_rig else None
    if not isinstance(recordings, dict) or (present and RIG_FILE not in present):
        raise DataError(
            f"{folder}: is not empty and contains no {RIG_FILE} of the simulated test bench; choose another folder"
        )
    if name in present and name not in recordings:
        raise DataError(
            f"{folder}: contains '{name}', which was not written by the simulated test bench; move this file or choose "
            "another folder"
        )
    check_files_can_be_added(folder, [name, RIG_FILE])
    return dict(recordings)
