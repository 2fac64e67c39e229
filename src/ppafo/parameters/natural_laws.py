"""Laws of nature to which the functions of actuators, valves and effects are held.

Tests hold the kinds of this package to them; a kind of a user is held to them by each device that is built with it.
"""

import inspect
import math
from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

from ppafo.model.actuators.kind import ActuatorModel
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES
from ppafo.model.effects.kind import Effect, PlantSnapshot
from ppafo.model.plant import blended_port_flow, blended_ports, chamber_mass
from ppafo.model.ports import (
    exhaust_path,
    friction_at_rest,
    friction_in_motion,
    load_torque,
    rebound,
    supply_path,
)
from ppafo.model.valves.kind import ValveModel, valve_problem
from ppafo.parameters.device import Device
from ppafo.parameters.effects import effect_row, effects_of
from ppafo.parameters.plant import first_settings, plant_parameters
from ppafo.wording import one_line

ALLOWED = 1.0e-3
"""Largest departure of a kind of a user, relative to the scale of its law [-]."""
_ANGLES = tuple((2 * number + 1) / 22.0 for number in range(11))
"""Angles at which an actuator is tried, as fractions of its range [-]."""
_PRESSURES = ((0.13, 0.71), (0.71, 0.13), (0.93, 0.89))
"""Gauge pressures of both chambers, as fractions of that of the supply [-]."""
_STEP = 1.0e-4
"""Half of a difference, as a fraction of range or pressure [-]."""
_COMMANDS = (-1.0, -0.6, 0.0, 0.3, 1.0)
_STEPS = tuple(1.0e-3 * 2**number for number in range(18))
"""Steps after which a valve has followed its command, 262 s in all [s]."""
_MOST_PARTS = 40
"""Largest number of parts of these steps; a valve that switches more often has no steady state."""
_STEADY = 1.0e-9
"""Change of the flow in the last step that counts as none, relative to the full flow [-]."""
_SPEEDS = (-30.0, -1.0, -0.01, 0.01, 1.0, 30.0)
"""Angular velocities at which friction is tried [rad/s]."""


class LawDeparture(NamedTuple):
    """Departure from a law of nature: relative size [-], and a sentence with the numbers and the place."""

    size: float
    text: str


def actuator_departure(model: ActuatorModel, plant: Any) -> LawDeparture:
    """Return the largest departure of an actuator from virtual work and from the gas that fills its chambers.

    Virtual work: the torque grows with a gauge pressure as the volume of this chamber with the angle, so that the
    shaft gets the work p dV of the gas. The pressures of a mass are those at which it fills the chambers, and the
    compliances are the growth of the volumes with the pressure.
    """
    width = plant.angle_max - plant.angle_min
    room = plant.atmospheric_pressure
    gauge = plant.supply_pressure - room
    turn = _STEP * width
    push = _STEP * gauge
    found = []
    for fraction, pair in product(_ANGLES, _PRESSURES):
        angle = plant.angle_min + fraction * width
        pressures = [room + share * gauge for share in pair]
        place = f"at {math.degrees(angle):.4g} deg with {_kilopascals(pressures[0])} and {_kilopascals(pressures[1])}"
        before, after = (model.chambers(plant, angle + way, *pressures) for way in (-turn, turn))
        here = model.chambers(plant, angle, *pressures)
        for number in (0, 1):
            less = [*pressures]
            more = [*pressures]
            less[number] = pressures[number] - push
            more[number] = pressures[number] + push
            of_torque = (model.torque(plant, angle, *more) - model.torque(plant, angle, *less)) / (2.0 * push)
            of_volume = (after[number] - before[number]) / (2.0 * turn)
            text = (
                f"{place} the torque grows by {1e6 * of_torque:.4g} N m per MPa in chamber {number + 1}, but its "
                f"volume by {1e6 * of_volume:.4g} cm^3/rad; by virtual work both are one number, or the shaft does not "
                "get the work of the gas"
            )
            found.append((abs(of_torque - of_volume), abs(of_volume), text))
            wider = model.chambers(plant, angle, *more)[number] - model.chambers(plant, angle, *less)[number]
            given = here[2 + number]
            scale = here[number] / abs(gauge)
            text = (
                f"{place} chamber {number + 1} widens by {1e9 * wider / (2.0 * push):.4g} cm^3/kPa, but its compliance "
                f"is {1e9 * given:.4g} cm^3/kPa"
            )
            yielded = abs(wider / (2.0 * push) - given) / scale
            found.append((yielded, math.inf, text))
        masses = (chamber_mass(*filled, plant.gas_product) for filled in zip(pressures, here[:2], strict=True))
        filled = model.pressures(plant, angle, *masses)
        text = f"{place} the gas of these pressures gives {_kilopascals(filled[0])} and {_kilopascals(filled[1])}"
        found.append((max(abs(own / each - 1.0) for own, each in zip(filled, pressures, strict=True)), math.inf, text))
    growth = max(scale for _, scale, _ in found if scale < math.inf) or 1.0
    return max(LawDeparture(size if scale == math.inf else size / growth, text) for size, scale, text in found)


def valve_departure(model: ValveModel, settings: Any, plant: Any) -> LawDeparture:
    """Return the largest departure of the steady flow of ``advance`` from the one of ``instant``.

    Time stepping uses the first, the reference solver the second. A valve that does not come to rest departs by 0, and
    so does one that regulates pressures.
    """
    if model.instant is None:
        return LawDeparture(0.0, "")
    valve = model.prepare(settings)
    room = plant.atmospheric_pressure
    pressure = room + 0.5 * (plant.supply_pressure - room)
    full = plant.valve_conductance * max(plant.supply_pressure, room)
    found = [LawDeparture(0.0, "")]
    for command in _COMMANDS:
        state = model.state()
        time = 0.0
        parts = 0
        flows = []
        for step in _STEPS:
            end = time + step
            while time < end and parts < _MOST_PARTS:
                event = model.next_event(valve, state, command, time) if model.jumps else math.inf
                part = min(end, event if event > time else end) - time
                shown, state = model.advance(valve, state, command, time, part)
                time = time + part
                parts = parts + 1
            ports = model.connect(plant, shown)
            flows.append([model.port_flow(pressure, port, plant.valve_curve)[0].total for port in ports])
        settled = model.settle(valve, state, command, time)
        rates = state if model.rates is None else model.rates(valve, state, command)
        if not type(state) is type(settled) is type(rates):
            return LawDeparture(
                math.inf,
                f"settle and rates must return a {type(state).__name__}, not {settled!r} and {rates!r}",
            )
        openings = model.instant(valve, settled, command)
        ports = blended_ports(plant, openings)
        instant = [blended_port_flow(pressure, port, plant.valve_curve)[0].total for port in ports]
        for number, (last, former, other) in enumerate(zip(flows[-1], flows[-2], instant, strict=True), 1):
            if parts < _MOST_PARTS and abs(last - former) <= _STEADY * full:
                text = (
                    f"at the command {command:g} advance comes to rest with {1e3 * last:.4g} g/s into chamber {number} "
                    f"at {_kilopascals(pressure)}, but instant gives {1e3 * other:.4g} g/s"
                )
                found.append(LawDeparture(abs(last - other) / full, text))
    return max(found)


def effect_departure(effect: Effect, row: Any, plant: Any) -> LawDeparture:
    """Return the largest departure of an effect with parameters ``row`` from the sign of what it acts on.

    Friction, drag, an impact and the flow through a path take power and never give it.
    """
    room = plant.atmospheric_pressure
    supply = plant.supply_pressure
    middle = 0.5 * (plant.angle_min + plant.angle_max)
    rows = {effect.name: row}
    found = [LawDeparture(0.0, "")]
    if effect.state is not None:
        start = effect.state.start
        now = PlantSnapshot(middle, 0.0, room, room, 0.0, 0.0, 0.0)
        rows[effect.state_name] = effect.state.row() if start is None else start(row, now)
    pairs = ((room, room), (supply, room), (supply, supply))
    path = plant.valve_conductance
    for port, law in effect.laws.items():
        tried: list[tuple[tuple[float, ...], float, float]] = []
        # A law takes the parameters, the state, or both.
        own = {name: rows[name] for name in inspect.signature(law).parameters if name in rows}
        if port is friction_at_rest:
            tried = [((plant.static_torque, *pair), 1.0, 0.0) for pair in pairs]
        elif port is friction_in_motion:
            tried = [((plant.dynamic_torque, speed, *pair), 1.0, 0.0) for speed, pair in product(_SPEEDS, pairs)]
        elif port is load_torque:
            at = [plant.angle_min + fraction * (plant.angle_max - plant.angle_min) for fraction in _ANGLES]
            still = {angle: law(0.0, angle, 0.0, **own) for angle in at}
            tried = [
                ((0.0, angle, speed), math.copysign(1.0, speed), still[angle]) for angle in at for speed in _SPEEDS
            ]
        elif port is rebound:
            # Of an impact at 1 rad/s at most as much comes back.
            tried = [((1.0,), -1.0, 0.0), ((1.0,), 1.0, -1.0)]
        elif port in (supply_path, exhaust_path):
            tried = [((path,), 1.0, 0.0)]
        for given, sign, zero in tried:
            value = law(*given, **own)
            scale = max(abs(value), abs(zero), abs(given[0]), 1.0e-12)
            numbers = ", ".join(f"{each:.4g}" for each in given)
            text = (
                f"{port.__name__}({numbers}) is {value:.4g}, on the wrong side of {zero:.4g}: what acts there takes "
                "power and never gives it"
            )
            found.append(LawDeparture(max(0.0, sign * (zero - value)) / scale, text))
    return max(found)


def broken_laws(device: Device) -> Iterator[str]:
    """Yield the departures of the user's kinds in a device, each with the name of its kind."""
    actuator = device.actuator.kind
    valve = device.valve.kind
    effects = [effect for effect in effects_of(device) if not EFFECTS.is_own(effect.name)]
    if ACTUATORS.is_own(actuator) and VALVES.is_own(valve) and not effects:
        return
    plant = plant_parameters(device)
    departures = []
    if not ACTUATORS.is_own(actuator):
        departures.append((f"actuator '{actuator}'", actuator_departure(ACTUATORS[actuator].model, plant)))
    if not VALVES.is_own(valve):
        settings = first_settings(device.valve)
        model = VALVES[valve].choose(settings)
        # Only analyses ask for it, of which the error would be.
        if (lag := VALVES[valve].lag) is not None:
            lag(settings)
        if problem := valve_problem(model):
            yield f"valve '{one_line(valve)}': {problem}"
            return
        departures.append((f"valve '{valve}'", valve_departure(model, settings, plant)))
    departures += [
        (f"effect '{effect.name}'", effect_departure(effect, effect_row(effect, device), plant)) for effect in effects
    ]
    yield from (f"{one_line(name)}: {found.text}" for name, found in departures if not found.size <= ALLOWED)


def _kilopascals(pressure: float) -> str:
    return f"{1e-3 * pressure:.4g} kPa_a"
