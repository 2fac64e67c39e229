"""Recordings with known values planted, and the bench laws on a set that has no other numbers than a test gives."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.identification.bench.flow import GasAt, Opening, orifice_shape
from ppafo.identification.bench.law import BenchContext, BenchResult
from ppafo.identification.bench.valve_map import area_of_command, spool_of
from ppafo.identification.bench.vane_leak import pressures_of_fall
from ppafo.identification.procedures import LAWS, check_channels
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.parameter_set import Entry
from ppafo.parameters.records import record_from
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import Floats

CO2 = GasAt(0.044, 1.3, 298.0)
PSI = 6894.757293168361
TORQUE_CONSTANT, STATIC_TORQUE, OFFSET = 1.451e-5, 0.45, 0.12
DAMPING_RATE, DECELERATION = 0.4, 0.13
SUPPLY, ROOM = 446.0e3, 101325.0


def angle_of_decay(
    times: Floats, start_angle: float, start_velocity: float, damping_rate: float, deceleration: float
) -> Floats:
    """Angle [rad] of I w' = -beta w - T_c in closed form, at rest from where the speed is 0; beta/I [1/s] above 0."""
    ratio = deceleration / damping_rate
    stop = np.inf if ratio == 0.0 else np.log1p(start_velocity / ratio) / damping_rate
    moving = np.minimum(times, stop)
    swept = (start_velocity + ratio) * -np.expm1(-damping_rate * moving) / damping_rate - ratio * moving
    return np.asarray(start_angle + swept)


def source(label: str, time: Floats, **channels: tuple[Floats, str]) -> RecordingSource:
    """A recording from arrays and units."""
    made = {name: Channel(np.asarray(values, dtype=float), unit) for name, (values, unit) in channels.items()}
    return RecordingSource(Recording(label, time, made, "synthetic"))


def static(
    noise: float = 0.03, growth: float = 0.0, seed: int = 1, sign: float = 1.0, floor: float = -9.0
) -> RecordingSource:
    """0 to 95 psi in steps of 5 and back, three times; friction grows with pressure by ``growth`` [N m/Pa]."""
    steps = np.arange(0.0, 96.0, 5.0) * PSI
    pressure = np.tile(np.concatenate([steps, steps[::-1]]), 3)
    direction = np.tile(np.repeat([1.0, -1.0], steps.size), 3)
    friction = STATIC_TORQUE + growth * pressure
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
) -> RecordingSource:
    """Rest for one second, a push, and a free decay; 200 Hz."""
    time = np.arange(0.0, 8.0, 0.005)
    angle = sign * angle_of_decay(np.maximum(time - 1.0, 0.0), 0.4, 2.5, rate, deceleration)
    return source("decay", time, angle=(angle + np.random.default_rng(seed).normal(0.0, noise, time.size), "rad"))


def flow(
    area: float = 3.57e-6, ratios: tuple[float, float] = (0.22, 0.97), noise: float = 0.01, seed: int = 1
) -> RecordingSource:
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


def leak(
    law: str, size: float, ratio: float = 1.3, seed: int = 1, lost: float = 0.0, volume: float = 60e-6
) -> RecordingSource:
    """Two closed chambers, one at supply pressure and one at the atmosphere, 20 s at 20 Hz; Cd A or c is planted."""
    time = np.arange(0.0, 20.0, 0.05)
    opening = Opening(CO2, "laminar" if law == "laminar" else "orifice")
    rate = CO2.specific_gas_constant * CO2.temperature / volume
    first, second = pressures_of_fall(opening, {"size": size}, SUPPLY, ROOM, ratio, rate, time)
    draw = np.random.default_rng(seed)
    first, second = (values + draw.normal(0.0, 300.0, time.size) - lost * time for values in (first, second))
    return source("leak", time, pressure_1=(first, "Pa"), pressure_2=(second, "Pa"))


def steady(law: str, size: float, zero: float = 0.0, seed: int = 1) -> RecordingSource:
    """Twenty-four readings of the flow that keeps up a pressure; Cd A or c is planted, and the zero of the meter."""
    first, second = np.linspace(1.3e5, 6.0e5, 24), np.full(24, ROOM)
    flow = Opening(CO2, "laminar" if law == "laminar" else "orifice").flow({"size": size}, first, second)
    flow = flow * (1.0 + np.random.default_rng(seed).normal(0.0, 0.003, 24)) + zero
    channels = {"pressure_1": (first, "Pa"), "pressure_2": (second, "Pa"), "mass_flow": (flow, "kg/s")}
    return source("steady", np.arange(24.0), **channels)


def sweep(dead_band: float = 0.12, width: float = 0.04, sign: float = 1.0, seed: int = 1) -> RecordingSource:
    """Command from -1 to 1 and back at constant pressures, with a valve that saturates."""
    command = np.concatenate([np.linspace(-1.0, 1.0, 101), np.linspace(1.0, -1.0, 101)])
    area = area_of_command(spool_of(command, width), dead_band, 4.2e-6, 0.9)
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


Sources = tuple[RecordingSource, ...]
Numbers = dict[str, tuple[float | None, str]]
"""Numbers of a set with their units, None for one that it lacks."""


def of_law(kind: str, sources: Sources, tolerances: Tolerances, numbers: Numbers, **keys: Any) -> BenchResult:
    """What a law makes of recordings, with keys of its table."""
    entries = {
        path: Entry(value, unit, "assumed", "a test") for path, (value, unit) in numbers.items() if value is not None
    }
    context = BenchContext(
        replace(load_parameter_set("ppafo2011"), numbers=entries), "proportional", "here", tolerances
    )
    given = {name: value for name, value in keys.items() if value is not None}
    sources = tuple(replace(source, user=kind) for source in sources)
    law: Any = record_from(LAWS[kind], {"kind": kind, "recordings": ["a.csv"], **given})
    for source in sources:
        check_channels(source.name, law, source.recording.names)
    return law.run(sources, context)


def in_gas(kind: str, sources: Sources, gas: GasAt, tolerances: Tolerances, more: Numbers, **keys: Any) -> BenchResult:
    """What a law of flow makes of recordings with a gas."""
    numbers: Numbers = {
        "gas.molar_mass": (gas.molar_mass, "kg/mol"),
        "gas.heat_capacity_ratio": (gas.heat_capacity_ratio, ""),
        "gas.temperature": (gas.temperature, "K"),
    }
    tolerances = replace(tolerances, gas_temperature=math.sqrt(3.0) * gas.temperature_deviation)
    return of_law(kind, sources, tolerances, numbers | more, **keys)


def static_torque(sources: Sources, tolerances: Tolerances = DEFAULTS) -> BenchResult:
    return of_law("static-torque", sources, tolerances, {})


def free_decay(
    sources: Sources, inertia: str = "unknown", rise: float = 1.0, tolerances: Tolerances = DEFAULTS, **keys: Any
) -> BenchResult:
    numbers: Numbers = {
        f"friction.{kind}_torque": (size, "N m") for kind, size in (("static", 1.0 + rise), ("dynamic", 1.0))
    }
    return of_law("free-decay", sources, tolerances, numbers, inertia=inertia, **keys)


def open_valve_flow(
    sources: Sources, gas: GasAt, law: str = "orifice", area: float | None = None, tolerances: Tolerances = DEFAULTS
) -> BenchResult:
    area_of_set: Numbers = {"valves.proportional.area": (area, "m^2")}
    return in_gas("open-valve-flow", sources, gas, tolerances, area_of_set, law=law)


def valve_map(sources: Sources, gas: GasAt, **keys: Any) -> BenchResult:
    return in_gas("valve-map", sources, gas, DEFAULTS, {}, **keys)


def vane_leak(
    sources: Sources,
    gas: GasAt,
    *volumes: float,
    discharge_coefficient: float | None = None,
    critical_ratio: float | None = None,
    law: str = "orifice",
    tolerances: Tolerances = DEFAULTS,
) -> BenchResult:
    numbers: Numbers = {
        "actuator.leak.discharge_coefficient": (discharge_coefficient, ""),
        "actuator.leak.critical_ratio": (critical_ratio, ""),
    }
    kind, volumes = ("vane-leak-steady", ()) if "mass_flow" in sources[0].recording else ("vane-leak", volumes)
    stated = {f"volume_{number}": f"{volume!r} m^3" for number, volume in enumerate(volumes, 1)}
    return in_gas(kind, sources, gas, tolerances, numbers, law=law, **stated)
