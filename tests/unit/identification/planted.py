"""Recordings with known values planted, for the tests of the bench procedures."""

import numpy as np
from ppafo.identification.bench.flow_laws import (
    LAMINAR,
    LINEAR,
    Chambers,
    GasAt,
    Opening,
    difference_in_time,
    orifice_shape,
)

from ppafo.identification.bench.free_decay import angle_of_decay
from ppafo.identification.bench.valve_map import area_of_command
from ppafo.identification.source import Source
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import Floats

CO2 = GasAt(0.044, 1.3, 298.0)
LAWS = (Opening(CO2).law(), LAMINAR, LINEAR)
PSI = 6894.757293168361
TORQUE_CONSTANT, STATIC_TORQUE, OFFSET = 1.451e-5, 0.45, 0.12
DAMPING_RATE, DECELERATION = 0.4, 0.13
SUPPLY, ROOM = 446.0e3, 101325.0


def source(label: str, time: Floats, **channels: tuple[Floats, str]) -> Source:
    """A recording from arrays and units."""
    made = {name: Channel(np.asarray(values, dtype=float), unit) for name, (values, unit) in channels.items()}
    return Source(Recording(label, time, made, "synthetic"))


def static(noise: float = 0.03, growth: float = 0.0, seed: int = 1, sign: float = 1.0, floor: float = -9.0) -> Source:
    """0 to 95 psi in steps of 5 and back, three times; friction grows with pressure by ``growth`` [N m/Pa]."""
    steps = np.arange(0.0, 96.0, 5.0) * PSI
    pressure = np.tile(np.concatenate([steps, steps[::-1]]), 3)
    direction = np.tile(np.repeat([1.0, -1.0], steps.size), 3)
    friction = STATIC_TORQUE + growth * (pressure - steps.mean())
    torque = TORQUE_CONSTANT * pressure + OFFSET - sign * direction * friction
    torque += np.random.default_rng(seed).normal(0.0, noise, torque.size)
    return source(
        "static",
        10.0 * np.arange(torque.size),
        torque=(np.maximum(torque, floor), "N m"),
        pressure_difference=(pressure, "Pa_d"),
        direction=(direction, "-"),
        repetition=(np.repeat([1.0, 2.0, 3.0], 2 * steps.size), "-"),
    )


def decay(
    noise: float = 2e-3,
    rate: float = DAMPING_RATE,
    deceleration: float = DECELERATION,
    seed: int = 1,
    sign: float = 1.0,
) -> Source:
    """Rest for one second, a push, and a free decay; 200 Hz."""
    time = np.arange(0.0, 8.0, 0.005)
    angle = sign * angle_of_decay(np.maximum(time - 1.0, 0.0), 0.4, 2.5, rate, deceleration)
    return source("decay", time, angle=(angle + np.random.default_rng(seed).normal(0.0, noise, time.size), "rad"))


def flow(
    area: float = 3.57e-6, ratios: tuple[float, float] = (0.22, 0.97), noise: float = 0.01, seed: int = 1
) -> Source:
    """Sixty readings of flow through a fully open valve between two pressure ratios."""
    upstream = np.full(60, SUPPLY)
    downstream = SUPPLY * np.linspace(*ratios, 60)
    mass_flow = CO2.choked_flow_constant * area * orifice_shape(upstream, downstream, CO2.heat_capacity_ratio)
    mass_flow *= 1.0 + np.random.default_rng(seed).normal(0.0, noise, 60)
    return source(
        "flow",
        np.arange(60.0),
        upstream_pressure=(upstream, "Pa"),
        downstream_pressure=(downstream, "Pa"),
        mass_flow=(mass_flow, "kg/s"),
        command=(np.ones(60), "-"),
    )


def leak(law: str, rate: float, ratio: float = 1.3, seed: int = 1, lost: float = 0.0) -> Source:
    """Two closed chambers, one at supply pressure and one at the atmosphere, for 20 s at 100 Hz."""
    time = np.arange(0.0, 20.0, 0.01)
    chambers = Chambers(ratio, ratio * SUPPLY + ROOM)
    chosen = next(item for item in LAWS if item.name == law)
    first, second = chambers.pressures(difference_in_time(chosen, chambers, SUPPLY - ROOM, rate, time, 100.0))
    draw = np.random.default_rng(seed)
    first, second = (values + draw.normal(0.0, 300.0, time.size) - lost * time for values in (first, second))
    return source("leak", time, pressure_1=(first, "Pa"), pressure_2=(second, "Pa"))


def orifice_rate(area: float, volume: float) -> float:
    """Rate of the orifice law [1/s] for an effective area [m^2] and a volume [m^3]."""
    return area * CO2.choked_flow_constant * CO2.specific_gas_constant * CO2.temperature / volume


def sweep(dead_band: float = 0.12, width: float = 0.04, sign: float = 1.0, seed: int = 1) -> Source:
    """Command from -1 to 1 and back at constant pressures, with a valve that saturates."""
    command = np.concatenate([np.linspace(-1.0, 1.0, 101), np.linspace(1.0, -1.0, 101)])
    branch = np.repeat([1.0, -1.0], 101)
    area = area_of_command(command, branch, dead_band, 4.2e-6, 3.4e-6, width)
    upstream, downstream = np.full(202, SUPPLY), np.full(202, ROOM)
    mass_flow = area * CO2.choked_flow_constant * orifice_shape(upstream, downstream, CO2.heat_capacity_ratio)
    mass_flow += np.random.default_rng(seed).normal(0.0, 1e-5, 202)
    return source(
        "sweep",
        0.1 * np.arange(202.0),
        command=(command, "-"),
        mass_flow=(sign * mass_flow, "kg/s"),
        upstream_pressure=(upstream, "Pa"),
        downstream_pressure=(downstream, "Pa"),
    )
