"""Steady flow on a flow bench: the open valve at many pressures, the map of the valve, the leak across the vane."""

from collections.abc import Callable

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.engine.reference.derivative import ExactOrifice
from ppafo.model.plant import Openings
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters import load_device
from ppafo.parameters.device import Device, Valve
from ppafo.rig.bench.readings import read_off
from ppafo.rig.dynamics import ambient_node, leak_exchange, orifice_exchange
from ppafo.rig.hardware import real_device, rig_physics
from ppafo.rig.request import Outcome, Request
from ppafo.rig.rows import Exchange, RigPhysics
from ppafo.rig.run import spool_position
from ppafo.simulation.plan import exact_orifice

UPSTREAM_GAUGE = tuple(level * PASCALS_PER_PSI for level in (20.0, 35.0, 50.0, 65.0, 80.0))
PRESSURE_RATIOS = (0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.98)
LEAK_GAUGE = tuple(level * PASCALS_PER_PSI for level in range(5, 85, 5))
COMMAND_STEPS = 100
READING_INTERVAL = 2.0
REPETITIONS = 2
SMALL_METER = 0.1
"""Range of the flow meter for the leak as a fraction [-] of that of the other."""


def record_open_valve(request: Request) -> Outcome:
    """Return the mass flow [kg/s] of the fully open valve at several pressures before and behind it."""
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


def record_valve_map(request: Request) -> Outcome:
    """Return the mass flow [kg/s], above 0 into chamber 1, of the valve into the atmosphere over its command."""
    device, physics = _bench(request)
    supply, orifice = device.supply, exact_orifice(device.valve.orifice, device)
    openings_of = _steady_openings(device.valve)
    rising = np.linspace(-1.0, 1.0, COMMAND_STEPS + 1)
    commands = np.concatenate([rising, rising[-2::-1]])
    spool, flows, upstream = -1.0, [], []
    for command in commands:
        spool = spool_position(spool, float(command), request.preset.values["valve.hysteresis"])
        openings = openings_of(spool)
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


def record_steady_leak(request: Request) -> Outcome:
    """Return the mass flow [kg/s] that maintains the pressure in chamber 1, with chamber 2 open to the atmosphere."""
    device, physics = _bench(request)
    ambient = device.supply.atmospheric_pressure
    levels = np.array(LEAK_GAUGE * REPETITIONS) + ambient
    orifice = exact_orifice(device.actuator.leak, device)
    true = {
        "pressure_1": levels,
        "pressure_2": np.full(levels.size, ambient),
        "mass_flow": np.array([_across(physics, level, ambient, orifice).mass for level in levels]),
    }
    settings = {"gas_temperature": physics.wall_temperature}
    return read_off("vane-leak-steady", request, device, READING_INTERVAL, true, settings, SMALL_METER)


def _bench(request: Request) -> tuple[Device, RigPhysics]:
    device = real_device(load_device(request.parameter_set, request.valve, request.overrides), request.preset)
    return device, rig_physics(device, request.preset)


def _flow(physics: RigPhysics, upstream: float, downstream: float, fraction: float, orifice: ExactOrifice) -> float:
    """Mass flow [kg/s] of gas at the supply's temperature."""
    a = ambient_node(physics, float(upstream), physics.supply_temperature)
    return orifice_exchange(
        physics, a, ambient_node(physics, float(downstream), physics.wall_temperature), fraction, orifice, 1.0
    ).mass


def _across(physics: RigPhysics, upstream: float, downstream: float, orifice: ExactOrifice) -> Exchange:
    """Leak of gas that has taken the temperature of the walls."""
    a = ambient_node(physics, float(upstream), physics.wall_temperature)
    return leak_exchange(physics, a, ambient_node(physics, float(downstream), physics.wall_temperature), orifice)


def _steady_openings(valve: Valve) -> Callable[[float], Openings]:
    """Openings over the command once nothing moves any more: the valve with every time and frequency taken out."""
    kind = VALVES[valve.kind]
    still = {item.name: 0.0 if item.unit else valve.settings[item.name] for item in kind.quantities}
    model = kind.choose(still)
    parameters = model.prepare(still)

    def openings(command: float) -> Openings:
        state = model.settle(parameters, model.initial(), command, 0.0)
        found: Openings = model.instant(parameters, state, command)
        return found

    return openings
