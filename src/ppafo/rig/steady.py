"""Steady experiments of the simulated bench: true values converted to sensor readings.

Static torque against pressure, flow of the open valve, flow map of the valve, and leak across the vane.
"""

from collections.abc import Mapping

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.model.catalog import VALVES
from ppafo.model.effects.spool_play import spool_position
from ppafo.model.orifice import ExactOrifice
from ppafo.parameters.device import Device
from ppafo.parameters.plant import valve_settings
from ppafo.rig.dynamics import RigPhysics, ambient_node, leak_exchange, orifice_exchange
from ppafo.rig.sensors import CHANNEL_SENSORS, random_stream, sensor
from ppafo.rig.setup import ExperimentRequest, ExperimentResult, steady_bench
from ppafo.signals.recording import CHANNELS, Channel, Floats, Recording
from ppafo.simulation.plan import exact_orifice

_STEP, _HIGHEST = 5.0 * PASCALS_PER_PSI, 95.0 * PASCALS_PER_PSI
"""Step and largest pressure difference [Pa] of the static torque experiment."""
_TURN = 20.0 * PASCALS_PER_PSI
"""Overshoot [Pa] beyond the highest reading before the pressure falls, so that friction has reversed by then."""
_TORQUE_REPETITIONS = 3
"""Number of pressure cycles, up and down."""
_TORQUE_READING_INTERVAL = 10.0
"""Time between two readings of the scale [s]."""
_UPSTREAM_GAUGE = tuple(level * PASCALS_PER_PSI for level in (20.0, 35.0, 50.0, 65.0, 80.0))
_PRESSURE_RATIOS = (0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.98)
"""Upstream gauge pressures [Pa] at the open valve, and ratios of downstream to upstream pressure [-]."""
_LEAK_GAUGE = tuple(level * PASCALS_PER_PSI for level in range(5, 85, 5))
"""Gauge pressures in chamber 1 [Pa] for the steady leak."""
_COMMAND_STEPS = 100
"""Number of steps of the command from -1 to 1."""
_READING_INTERVAL, _REPETITIONS = 2.0, 2
"""Time between two readings of the flow meter [s], and number of readings at each pressure."""
_SMALL_METER = 0.1
"""Range of the leak flow meter relative to the other flow meter [-]."""


def record_static_torque(request: ExperimentRequest) -> ExperimentResult:
    """Record torque on the scale [N m] over pressure difference, three times up and down in steps of 5 psi.

    The vane presses on a scale and creeps without slipping, so friction is at the static limit and opposes the
    direction of the pressure change. This is the rig's friction law at zero speed, a play operator without inertia,
    which needs no solver.
    """
    device, _ = steady_bench(request)
    rising = np.arange(1, round(_HIGHEST / _STEP) + 1) * _STEP
    sweep = np.concatenate([rising, rising[::-1]])
    directions = np.repeat([1.0, -1.0], rising.size)
    values = request.preset.values
    scatter = values["friction.scatter"] * random_stream(request.seed, "friction").standard_normal(
        (_TORQUE_REPETITIONS, sweep.size)
    )
    torque = []
    for repetition in scatter:
        reading = 0.0
        for pressure, direction, deviation in zip(sweep, directions, repetition, strict=True):
            # On the way to the turn friction has changed sides, whatever was read before.
            if direction < 0.0 and pressure == sweep[rising.size]:
                reading = device.actuator.torque_constant * (_HIGHEST + _TURN)
            limit = device.friction.static_torque + values["friction.static_per_pressure"] * pressure
            reading = on_scale(reading, device.actuator.torque_constant * pressure, limit * max(0.0, 1.0 + deviation))
            torque.append(reading)
    true = {
        "torque": np.array(torque),
        "pressure_difference": np.tile(sweep, _TORQUE_REPETITIONS),
        "direction": np.tile(directions, _TORQUE_REPETITIONS),
        "repetition": np.repeat(np.arange(1.0, _TORQUE_REPETITIONS + 1.0), sweep.size),
    }
    return _read_off("static-torque", request, device, _TORQUE_READING_INTERVAL, true, {"turn_beyond": _TURN})


def on_scale(before: float, actuator: float, limit: float) -> float:
    """Return the torque on a scale [N m], from previous torque, actuator torque and friction limit [N m].

    Friction takes any difference up to the limit; the scale cannot pull.
    """
    return max(0.0, min(max(before, actuator - limit), actuator + limit))


def record_open_valve(request: ExperimentRequest) -> ExperimentResult:
    """Record the mass flow [kg/s] of the fully open valve at several upstream and downstream pressures."""
    device, physics = steady_bench(request)
    ambient = device.supply.atmospheric_pressure
    pairs = []
    for gauge in _UPSTREAM_GAUGE:
        upstream = ambient + gauge
        pairs += [(upstream, ambient)]
        pairs += [(upstream, upstream * ratio) for ratio in _PRESSURE_RATIOS if upstream * ratio > ambient]
    points = np.array(pairs * _REPETITIONS)
    orifice = exact_orifice(device.valve.orifice, device)
    true = {
        "upstream_pressure": points[:, 0],
        "downstream_pressure": points[:, 1],
        "mass_flow": np.array([_flow(physics, up, down, 1.0, orifice) for up, down in points]),
        "command": np.ones(len(points)),
    }
    return _read_off(
        "open-valve-flow", request, device, _READING_INTERVAL, true, {"gas_temperature": physics.supply_temperature}
    )


def record_valve_map(request: ExperimentRequest) -> ExperimentResult:
    """Record the mass flow [kg/s] of the valve over command, outlet to atmosphere; positive into chamber 1."""
    device, physics = steady_bench(request)
    supply, orifice = device.supply, exact_orifice(device.valve.orifice, device)
    # The openings once nothing moves any more: of the valve with every time and frequency taken out.
    kind = VALVES[device.valve.kind]
    with_times = valve_settings(device.valve)
    still = with_times._replace(**{quantity.name: 0.0 for quantity in kind.quantities if quantity.unit})
    model = kind.choose(still)
    parameters = model.prepare(still)
    rising = np.linspace(-1.0, 1.0, _COMMAND_STEPS + 1)
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
    return _read_off(
        "valve-map", request, device, _READING_INTERVAL, true, {"gas_temperature": physics.supply_temperature}
    )


def record_steady_leak(request: ExperimentRequest) -> ExperimentResult:
    """Record the mass flow [kg/s] that maintains the pressure in chamber 1, with chamber 2 at the atmosphere."""
    device, physics = steady_bench(request)
    ambient = device.supply.atmospheric_pressure
    levels = np.array(_LEAK_GAUGE * _REPETITIONS) + ambient
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
    return _read_off("vane-leak-steady", request, device, _READING_INTERVAL, true, settings, _SMALL_METER)


def _flow(physics: RigPhysics, upstream: float, downstream: float, fraction: float, orifice: ExactOrifice) -> float:
    """Return the mass flow [kg/s] of gas at supply temperature."""
    before = ambient_node(physics, float(upstream), physics.supply_temperature)
    behind = ambient_node(physics, float(downstream), physics.wall_temperature)
    return orifice_exchange(physics, before, behind, fraction, orifice, 1.0).mass


def _read_off(
    name: str,
    request: ExperimentRequest,
    device: Device,
    interval: float,
    true: Mapping[str, Floats],
    settings: Mapping[str, float],
    fraction_of_flow_range: float = 1.0,
) -> ExperimentResult:
    """Return a result with sensor readings of true values [SI] by channel, every ``interval`` [s].

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
