"""An independent simulator of a walking device on its bottle: one set of equations, coupled at every stage.

It is given the angle of the ankle and the command to the valves as a walk recorded them, and CoolProp's properties at
nodes of its own; it knows no table, no step and no coupling of the package. Runge and Kutta of order four, 0.1 ms. The
long comparison of docs/decisions/0018 is ``python -m tests.reference.bottle``.
"""

import math
import sys
from bisect import bisect_right
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.walking.motion import walk_of

Floats = NDArray[np.float64]
Column = list[float]

BOTTLE_TEMPERATURE, BOTTLE_MASS, WALL, BODY, HOSE, ICE, LINE_1, LINE_2, MASS_1, MASS_2 = range(10)
STEP = 1.0e-4
SUBLIMATION = 555.0e3
SWITCHING = 0.05
SPAN = 0.01
"""Kelvin over which the saturated fluid is differentiated."""


class Fluid(NamedTuple):
    """Saturated CO2 (temperatures, pressure, densities and energies of vapour and liquid), and the gas at 50 psig."""

    temperatures: Column
    pressure: Column
    vapour: Column
    liquid: Column
    vapour_energy: Column
    liquid_energy: Column
    gas_temperatures: Column
    gas_enthalpies: Column


def fluid(pressure: float) -> Fluid:
    """CoolProp's CO2, every 0.05 K where it boils and every 1 K as gas at a pressure [Pa]."""
    from CoolProp.CoolProp import PropsSI

    boiling = np.arange(216.60, 303.5, 0.05)
    gas = np.arange(216.60, 306.0, 1.0)
    names = (("P", 1), ("D", 1), ("D", 0), ("U", 1), ("U", 0))
    saturated = [list(map(float, PropsSI(name, "T", boiling, "Q", quality, "CO2"))) for name, quality in names]
    enthalpies = list(map(float, PropsSI("H", "T", gas, "P", pressure, "CO2")))
    return Fluid(boiling.tolist(), *saturated, gas.tolist(), enthalpies)


def between(nodes: Column, values: Column, at: float) -> float:
    """Straight between nodes, whose ends hold outside them."""
    place = min(max(bisect_right(nodes, at), 1), len(nodes) - 1)
    share = min(max((at - nodes[place - 1]) / (nodes[place] - nodes[place - 1]), 0.0), 1.0)
    return values[place - 1] + share * (values[place] - values[place - 1])


def content(gas: Fluid, temperature: float, mass: float, volume: float) -> float:
    """Internal energy [J] of liquid and vapour in a volume [m^3]."""
    vapour, liquid = (between(gas.temperatures, density, temperature) for density in (gas.vapour, gas.liquid))
    wet = (mass - volume * vapour) / (1.0 - vapour / liquid)
    boiled = between(gas.temperatures, gas.vapour_energy, temperature)
    return wet * between(gas.temperatures, gas.liquid_energy, temperature) + (mass - wet) * boiled


def orifice(area: float, up: float, down: float, warmth: float, constant: float, k: float) -> float:
    """Equation (6): flow [kg/s] through an effective area [m^2], straight from a ratio of 0.999 on."""
    near = min(down / up, 1.0)
    ratio = min(near, 0.999)
    share = min((1.0 - near) / 0.001, 1.0)
    critical = (2.0 / (k + 1.0)) ** (k / (k - 1.0))
    choked = math.sqrt(k / (constant * warmth)) * (2.0 / (k + 1.0)) ** ((k + 1.0) / (2.0 * (k - 1.0)))
    if ratio <= critical:
        return area * up * choked
    shape = 2.0 * k / ((k - 1.0) * constant * warmth) * (ratio ** (2.0 / k) - ratio ** ((k + 1.0) / k))
    return share * area * up * math.sqrt(shape)


def port(area: float, inside: float, outside: float, warmth: float, constant: float, k: float) -> float:
    """Flow [kg/s] into a chamber from beyond an opening, below 0 out of it."""
    if outside >= inside:
        return orifice(area, outside, inside, warmth, constant, k)
    return -orifice(area, inside, outside, warmth, constant, k)


def rates(y: Column, angle: float, open_1: bool, open_2: bool, n: "Numbers", gas: Fluid) -> tuple[Column, float]:
    """Time derivatives of all, and the temperature of the gas at the device [K]."""
    boiling = y[BOTTLE_TEMPERATURE]
    bottle = between(gas.temperatures, gas.pressure, boiling)
    enthalpy = between(gas.temperatures, gas.vapour_energy, boiling) + bottle / between(
        gas.temperatures, gas.vapour, boiling
    )
    at_body = between(gas.gas_temperatures, gas.gas_enthalpies, y[BODY])
    at_hose = between(gas.gas_temperatures, gas.gas_enthalpies, y[HOSE])
    arriving = enthalpy + n.body_share * (at_body - enthalpy)
    frost = gas.gas_enthalpies[0]
    outlet = frost if y[ICE] > 0.0 else max(arriving, frost)
    warmth = between(gas.gas_enthalpies, gas.gas_temperatures, outlet + n.hose_share * (at_hose - outlet))
    product = n.constant * warmth
    line_1 = y[LINE_1] * product / n.line_1
    line_2 = y[LINE_2] * product / n.line_2
    volume_1 = n.dead_1 + n.per_angle * (angle - n.lowest)
    volume_2 = n.dead_2 + n.per_angle * (n.highest - angle)
    inside_1 = y[MASS_1] * product / volume_1
    inside_2 = y[MASS_2] * product / volume_2
    held = min(n.set_1, bottle - n.margin)
    most = orifice(n.seat, bottle, held, boiling, n.fluid_constant, n.k) * max(0.0, 1.0 - y[ICE] / n.ice_room)
    through = min(max((held - line_1) / n.droop_1, 0.0), most)
    second = min(max((min(n.set_2, line_1) - line_2) / n.droop_2, 0.0), n.most_2)
    into_1 = port(n.valve, inside_1, line_1 if open_1 else n.room_pressure, warmth, n.constant, n.k)
    into_2 = port(n.valve, inside_2, line_2 if open_2 else n.room_pressure, warmth, n.constant, n.k)
    leak = port(n.leak, inside_1, inside_2, warmth, n.constant, n.k)
    # What comes from the bottle has the enthalpy growth * (frost - SUBLIMATION) + through * frost: ice, and gas.
    freezes = y[ICE] > 0.0 or arriving < frost
    growth = through * (frost - arriving) / (SUBLIMATION + arriving - frost) if freezes else 0.0
    drawn = through + growth
    leaving = frost if freezes else arriving
    behind = leaving + n.hose_share * (at_hose - leaving)
    to_content = n.content_heat * (y[WALL] - boiling)
    per_kelvin = (
        content(gas, boiling + SPAN, y[BOTTLE_MASS], n.volume) - content(gas, boiling - SPAN, y[BOTTLE_MASS], n.volume)
    ) / (2.0 * SPAN)
    per_mass = (
        content(gas, boiling, y[BOTTLE_MASS] * 1.0001, n.volume) - content(gas, boiling, y[BOTTLE_MASS], n.volume)
    ) / (0.0001 * y[BOTTLE_MASS])
    slope = [
        (to_content - drawn * enthalpy + drawn * per_mass) / per_kelvin,
        -drawn,
        (n.wall_heat * (n.room - y[WALL]) - to_content) / n.wall_capacity,
        (n.body_heat * (n.room - y[BODY]) - drawn * (arriving - enthalpy)) / n.body_capacity,
        (n.hose_heat * (n.room - y[HOSE]) - through * (behind - leaving)) / n.hose_capacity,
        growth,
        through - second - (into_1 if open_1 else 0.0),
        second - (into_2 if open_2 else 0.0),
        into_1 + leak,
        into_2 - leak,
    ]
    return slope, warmth


class Numbers(NamedTuple):
    """All numbers of device, bottle, regulators and hose, SI."""

    constant: float
    k: float
    fluid_constant: float
    valve: float
    leak: float
    per_angle: float
    lowest: float
    highest: float
    dead_1: float
    dead_2: float
    room_pressure: float
    set_1: float
    set_2: float
    droop_1: float
    droop_2: float
    most_2: float
    line_1: float
    line_2: float
    volume: float
    wall_capacity: float
    content_heat: float
    wall_heat: float
    margin: float
    seat: float
    body_capacity: float
    body_share: float
    body_heat: float
    ice_room: float
    hose_capacity: float
    hose_share: float
    hose_heat: float
    room: float


def numbers_of(walk: Any) -> Numbers:
    """The numbers of a walk on its bottle."""
    device = walk.scenario.device
    lines = walk.scenario.supply_lines
    supply = walk_of(walk.scenario).bottle
    bottle = supply.bottle
    actuator = device.actuator
    valve = device.valve.orifice
    leak = actuator.leak
    return Numbers(
        device.gas.specific_gas_constant,
        device.gas.heat_capacity_ratio,
        188.924,
        valve.area * valve.discharge_coefficient,
        leak.area * leak.discharge_coefficient,
        actuator.displacement_per_radian,
        actuator.angle_min,
        actuator.angle_max,
        actuator.dead_volume_1,
        actuator.dead_volume_2,
        device.supply.atmospheric_pressure,
        device.supply.pressure,
        device.supply.dorsiflexion_pressure,
        bottle.regulator.droop,
        lines.droop_2,
        lines.largest_flow_2,
        lines.volume_1,
        lines.volume_2,
        bottle.volume,
        *bottle.wall,
        bottle.regulator.pressure_margin,
        bottle.regulator.seat_area,
        *bottle.body,
        bottle.ice_capacity,
        *bottle.hose,
        bottle.room_temperature,
    )


def coil_positions(commands: Floats, wanted: Any, interval: float) -> NDArray[np.bool_]:
    """Whether a coil is open at each sample of the commands: it takes an order 50 ms after its last one or later."""
    position = False
    taken = -1.0
    found = np.zeros(commands.size, dtype=np.bool_)
    for sample, command in enumerate(commands):
        time = sample * interval
        if wanted(command) != position and time - taken >= SWITCHING - 1.0e-9:
            position = not position
            taken = time
        found[sample] = position
    return found


def start_of(walk: Any, n: Numbers, gas: Fluid) -> Column:
    """Everything at the bottle's temperature, lines at their regulators' pressures, chambers vented."""
    supply = walk_of(walk.scenario).bottle
    angle = float(walk.recording["angle"][0])
    parts = [supply.temperature, supply.mass, *(supply.temperature,) * 3, 0.0]
    product = n.constant * rates([*parts, *(1.0e-6,) * 4], angle, False, False, n, gas)[1]
    lines = [n.set_1 * n.line_1 / product, n.set_2 * n.line_2 / product]
    volumes = n.dead_1 + n.per_angle * (angle - n.lowest), n.dead_2 + n.per_angle * (n.highest - angle)
    return [*parts, *lines, *(n.room_pressure * volume / product for volume in volumes)]


def follow(y: Column, angles: Column, open_1: Any, open_2: Any, interval: float, n: Numbers, gas: Fluid) -> Floats:
    """Step from sample to sample: (samples, 12) states, temperature of the gas at the device, regulated mass."""
    parts = round(interval / STEP)
    step = interval / parts
    first = y[BOTTLE_MASS]
    seen = []
    for sample, (a, b) in enumerate(zip(open_1, open_2, strict=True)):
        angle = angles[sample]
        seen.append([*y, rates(y, angle, a, b, n, gas)[1], first - y[BOTTLE_MASS]])
        gain = (angles[min(sample + 1, len(angles) - 1)] - angle) / parts
        for part in range(parts):
            at = angle + gain * part
            k1, _ = rates(y, at, a, b, n, gas)
            k2, _ = rates(moved(y, k1, 0.5 * step), at + 0.5 * gain, a, b, n, gas)
            k3, _ = rates(moved(y, k2, 0.5 * step), at + 0.5 * gain, a, b, n, gas)
            k4, _ = rates(moved(y, k3, step), at + gain, a, b, n, gas)
            mean = [(p + 2.0 * q + 2.0 * r + t) / 6.0 for p, q, r, t in zip(k1, k2, k3, k4, strict=True)]
            y = moved(y, mean, step)
            y[ICE] = max(y[ICE], 0.0)
    return np.array(seen)


def moved(y: Column, slope: Column, step: float) -> Column:
    """A state after a step [s] at these rates."""
    return [value + step * rate for value, rate in zip(y, slope, strict=True)]


def independent_run(walk: Any, seconds: float) -> Floats:
    """What the equations give for the first seconds of a walk of the solenoid pair: (samples, 12) as ``follow``."""
    n = numbers_of(walk)
    gas = fluid(n.set_1)
    interval = float(walk.recording.time[1])
    commands = walk.recording["command"][: round(seconds / interval) + 1]
    open_1 = coil_positions(commands, lambda command: 0.0 < command < 1.5, interval)
    open_2 = coil_positions(commands, lambda command: command < 0.0, interval)
    angles = walk.recording["angle"][: commands.size].tolist()
    return follow(start_of(walk, n, gas), angles, open_1.tolist(), open_2.tolist(), interval, n, gas)


def differences(walk: Any, seen: Floats) -> dict[str, float]:
    """Largest differences over time: temperatures [K], gas [g] and pressures [Pa] in lines and chambers (RMS too)."""
    recording = walk.recording
    samples = seen.shape[0]
    n = numbers_of(walk)
    product = n.constant * seen[:, 10]
    angle = recording["angle"][:samples]
    mine = {
        "bottle_temperature": seen[:, BOTTLE_TEMPERATURE],
        "regulator_temperature": seen[:, BODY],
        "hose_temperature": seen[:, HOSE],
        "gas_temperature": seen[:, 10],
        "regulated_mass": seen[:, 11],
        "line_pressure_1": seen[:, LINE_1] * product / n.line_1,
        "pressure_1": seen[:, MASS_1] * product / (n.dead_1 + n.per_angle * (angle - n.lowest)),
        "pressure_2": seen[:, MASS_2] * product / (n.dead_2 + n.per_angle * (n.highest - angle)),
    }
    gaps = {name: recording[name][:samples] - values for name, values in mine.items()}
    found = {name: float(np.abs(gap).max()) for name, gap in gaps.items()}
    return found | {f"{name}_rms": float(np.sqrt(np.mean(gap**2))) for name, gap in gaps.items()}


def main(words: list[str]) -> None:
    """Print the differences over a minute, or until the bottle ends it, for some couplings."""
    from ppafo.walking import walk

    for coupling in words or ["1 ms", "10 ms", "100 ms", "500 ms"]:
        changes = [f"bottle.coupling={coupling}", "bottle.fill=0.3", "bottle.temperature=280 K"]
        found = walk("solenoid-regulators", minutes=1.0, overrides=changes, bottle="paper-co2-9oz")
        gaps = differences(found, independent_run(found, float(found.recording.time[-1])))
        line = f"{coupling}: {found.supply.ending.time:.6g} s, "
        sys.stdout.write(line + ", ".join(f"{name} {gap:.3g}" for name, gap in gaps.items()) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
