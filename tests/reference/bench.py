"""A bench made with scipy: the equations of docs/equations.md for a vane under a held command, and what a bench adds.

It shares no code with the package and takes no step of it; numbers are read off a scenario. The valve is a port without
dynamics. ``Extra`` has the physics that a fitted model may lack, each in a form of its own where the package has one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ppafo.simulation.scenario import FreeMotion, Scenario
from tests.reference.simulator import Rig, flow, rig_of

TOLERANCE = 1.0e-8


@dataclass(frozen=True)
class Extra:
    """What a bench has beside the paper's equations; nothing of it by default, SI units.

    ``leak_opens`` is the pressure between chambers below which the vane is tight, ``heat`` the heat transfer
    coefficient (infinite: isothermal) with ``walls`` [1/m], ``pressed`` friction torque per pressure between chambers
    [m^3], ``stribeck`` the velocity [rad/s] over which friction falls from static to dynamic, ``play`` the whole width
    of the spool's play, ``line`` the volume [m^3] between the valve and each chamber and ``line_port`` its conductance
    over that of the valve, ``virial`` the second virial coefficient over R T [1/Pa].
    """

    leak_opens: float = 0.0
    heat: float = math.inf
    walls: float = 100.0
    pressed: float = 0.0
    stribeck: float = 0.0
    play: float = 0.0
    line: float = 0.0
    line_port: float = 2.0
    virial: float = 0.0


@dataclass
class Bench:
    """One run: the numbers of a scenario, commands (time [s], value) that are held, and what the bench adds."""

    rig: Rig
    commands: Sequence[tuple[float, float]]
    extra: Extra

    def gas(self, y: Any) -> tuple[float, float, float, float, float, float]:
        """Both volumes [m^3], pressures [Pa] and temperatures over that of the walls."""
        rig, extra = self.rig, self.extra
        volume_1 = rig.dead_1 + rig.displacement_per_radian * (y[0] - rig.lowest)
        volume_2 = rig.dead_2 + rig.displacement_per_radian * (rig.highest - y[0])
        product = rig.gas_constant * rig.temperature
        if math.isfinite(extra.heat):
            pressure_1, pressure_2 = (rig.k - 1.0) * y[4] / volume_1, (rig.k - 1.0) * y[5] / volume_2
            warmth = pressure_1 * volume_1 / (y[2] * product), pressure_2 * volume_2 / (y[3] * product)
            return volume_1, volume_2, pressure_1, pressure_2, *warmth
        ideal_1, ideal_2 = y[2] * product / volume_1, y[3] * product / volume_2
        # p = r (1 + B p / (R T)), r the pressure of the ideal gas.
        return (
            volume_1,
            volume_2,
            ideal_1 / (1.0 - extra.virial * ideal_1),
            ideal_2 / (1.0 - extra.virial * ideal_2),
            1.0,
            1.0,
        )

    def between(self, inside: float, warmth: float, outside: float, share: float) -> tuple[float, float]:
        """Flow into a space at ``inside`` through a share of the valve [kg/s]; the same times its warmth."""
        if share <= 0.0:
            return 0.0, 0.0
        if outside >= inside:
            entering = share * flow(outside, inside, 1.0, self.rig.port, self.rig.linear)
            return entering, entering
        leaving = share * flow(inside, outside, warmth, self.rig.port, self.rig.linear)
        return -leaving, -leaving * warmth

    def leak(self, pressure_1: float, pressure_2: float, warmth_1: float, warmth_2: float) -> tuple[float, float]:
        """Flow from chamber 1 to chamber 2 [kg/s]; the same times its warmth. A seal opens over a quarter more."""
        opens, difference = self.extra.leak_opens, abs(pressure_1 - pressure_2)
        share = 1.0 if opens == 0.0 else min(max((difference - opens) / (0.25 * opens), 0.0), 1.0)
        if pressure_1 >= pressure_2:
            one = share * flow(pressure_1, pressure_2, warmth_1, self.rig.leak, self.rig.linear)
            return one, one * warmth_1
        one = -share * flow(pressure_2, pressure_1, warmth_2, self.rig.leak, self.rig.linear)
        return one, one * warmth_2

    def drive(self, y: Any) -> tuple[float, float]:
        """Torque before friction and damping [N m], and friction that grows with pressure [N m]."""
        _, _, pressure_1, pressure_2, _, _ = self.gas(y)
        rig = self.rig
        torque = rig.torque_constant * (pressure_1 - pressure_2) + rig.gravity * math.sin(y[0]) - rig.external
        return torque, self.extra.pressed * abs(pressure_1 - pressure_2)

    def rates(self, y: Any, way: float, opening: float) -> list[float]:
        """Time derivatives of angle, rate, both masses, both energies, both line masses."""
        rig, extra = self.rig, self.extra
        volume_1, volume_2, pressure_1, pressure_2, warmth_1, warmth_2 = self.gas(y)
        velocity = y[1] if way != 0.0 else 0.0
        acceleration = 0.0
        if way != 0.0:
            torque, pressed = self.drive(y)
            friction = rig.dynamic + pressed
            if extra.stribeck > 0.0:
                friction += 0.9 * (rig.static - rig.dynamic) * math.exp(-((velocity / extra.stribeck) ** 2))
            acceleration = (torque - rig.viscous * velocity - way * friction) / rig.inertia
        to_1, to_2 = min(max(opening, 0.0), 1.0), min(max(-opening, 0.0), 1.0)
        line_rates = [0.0, 0.0]
        if extra.line > 0.0:
            product = rig.gas_constant * rig.temperature
            behind = y[6] * product / extra.line, y[7] * product / extra.line
            source_1, source_2 = (
                self.between(behind[0], 1.0, rig.source_1, to_1),
                self.between(behind[1], 1.0, rig.source_2, to_2),
            )
            vent_1, vent_2 = self.between(behind[0], 1.0, rig.room, to_2), self.between(behind[1], 1.0, rig.room, to_1)
            flow_1 = self.between(pressure_1, 1.0, behind[0], extra.line_port)[0]
            flow_2 = self.between(pressure_2, 1.0, behind[1], extra.line_port)[0]
            line_rates = [source_1[0] + vent_1[0] - flow_1, source_2[0] + vent_2[0] - flow_2]
            into_1, into_2 = (flow_1, flow_1), (flow_2, flow_2)
        else:
            source_1 = self.between(pressure_1, warmth_1, rig.source_1, to_1)
            source_2 = self.between(pressure_2, warmth_2, rig.source_2, to_2)
            vent_1 = self.between(pressure_1, warmth_1, rig.room, to_2)
            vent_2 = self.between(pressure_2, warmth_2, rig.room, to_1)
            into_1 = source_1[0] + vent_1[0], source_1[1] + vent_1[1]
            into_2 = source_2[0] + vent_2[0], source_2[1] + vent_2[1]
        leaked, carried = self.leak(pressure_1, pressure_2, warmth_1, warmth_2)
        energies = [0.0, 0.0]
        if math.isfinite(extra.heat):
            enthalpy = rig.gas_constant * rig.temperature * rig.k / (rig.k - 1.0)
            swept = rig.displacement_per_radian * velocity
            walls = extra.heat * extra.walls * rig.temperature
            energies[0] = enthalpy * (into_1[1] - carried) - pressure_1 * swept + walls * volume_1 * (1.0 - warmth_1)
            energies[1] = enthalpy * (into_2[1] + carried) + pressure_2 * swept + walls * volume_2 * (1.0 - warmth_2)
        return [velocity, acceleration, into_1[0] - leaked, into_2[0] + leaked, *energies, *line_rates]

    def leaves(self, y: Any) -> float:
        """1 or -1 where a vane at rest begins to move that way, else 0."""
        torque, pressed = self.drive(y)
        limit = self.rig.static + pressed
        if torque > limit and y[0] < self.rig.highest:
            return 1.0
        return -1.0 if torque < -limit and y[0] > self.rig.lowest else 0.0


def bench(scenario: Scenario, commands: Sequence[tuple[float, float]], times: Any, extra: Extra = Extra()) -> Any:
    """Angle [rad], pressure 1 and 2 [Pa] (3, samples) at ``times`` [s] of a free vane under commands that are held."""
    assert isinstance(scenario.motion, FreeMotion)
    rig = rig_of(scenario)
    made = Bench(rig, commands, extra)
    y = np.zeros(8)
    y[0] = scenario.motion.angle
    product = rig.gas_constant * rig.temperature
    volumes = (
        rig.dead_1 + rig.displacement_per_radian * (y[0] - rig.lowest),
        rig.dead_2 + rig.displacement_per_radian * (rig.highest - y[0]),
    )
    for n, pressure in enumerate((scenario.initial.pressure_1, scenario.initial.pressure_2)):
        ideal = pressure / (1.0 + extra.virial * pressure)
        y[2 + n] = ideal * volumes[n] / product
        y[4 + n] = pressure * volumes[n] / (rig.k - 1.0)
        y[6 + n] = pressure * extra.line / product
    seen = np.empty((3, len(times)))
    ends = [time for time, _ in commands[1:]] + [float(times[-1]) + 1.0e-6]
    inner, now = 0.0, 0.0
    way = 0.0
    for (begin, command), end in zip(commands, ends, strict=True):
        half = 0.5 * extra.play
        inner = max(command - half, min(command + half, inner))
        opening = max(-1.0, min(1.0, inner / (1.0 - half)))
        now = max(now, begin) if begin > 0.0 else 0.0
        while now < end - 1.0e-12:
            if way == 0.0:
                way = made.leaves(y)
            now, y, way = _stretch(made, now, end, y, way, opening, times, seen)
    return seen


def events_of(made: Bench, way: float) -> list[Any]:
    """What ends a stretch: friction that gives way where the vane rests, else a standstill or a stop."""
    rig = made.rig

    def breaks(_: float, y: Any) -> float:
        torque, pressed = made.drive(y)
        upwards = torque if y[0] < rig.highest else -math.inf
        downwards = -torque if y[0] > rig.lowest else -math.inf
        return max(upwards, downwards) - rig.static - pressed

    def stands(_: float, y: Any) -> float:
        return float(y[1] * way)

    def stops(_: float, y: Any) -> float:
        return float((rig.highest - y[0]) if way > 0.0 else (y[0] - rig.lowest))

    events: list[Any] = [breaks] if way == 0.0 else [stands, stops]
    for event in events:
        event.terminal, event.direction = True, 1.0 if event is breaks else -1.0
    return events


def _stretch(made: Bench, now: float, end: float, y: Any, way: float, opening: float, times: Any, seen: Any) -> Any:
    """One stretch without an event, and what follows at its end."""
    rig = made.rig
    scale = np.array([1.0, 10.0, 1.0e-5, 1.0e-5, 1.0, 1.0, 1.0e-6, 1.0e-6])

    def moved(_: float, y: Any) -> Any:
        return made.rates(y, way, opening)

    events = events_of(made, way)
    found = solve_ivp(
        moved,
        (now, end),
        y,
        "RK45" if made.extra.line == 0.0 else "LSODA",
        rtol=TOLERANCE,
        atol=TOLERANCE * scale,
        events=events,
        dense_output=True,
        max_step=1.0e-3,
    )
    assert found.success, found.message
    reached = float(found.t[-1])
    inside = (times >= now - 1.0e-12) & (times < reached + (1.0e-12 if reached >= end else 0.0))
    for place in np.flatnonzero(inside).tolist():
        state = found.sol(times[place])
        _, _, pressure_1, pressure_2, _, _ = made.gas(state)
        seen[:, place] = state[0], pressure_1, pressure_2
    y = found.y[:, -1].copy()
    if found.status == 1 and way == 0.0:
        way = made.leaves(y) or math.copysign(1.0, made.drive(y)[0])
    elif found.status == 1:
        if found.t_events[1].size:
            y[0] = rig.highest if way > 0.0 else rig.lowest
        y[1] = 0.0
        way = made.leaves(y)
    return reached, y, way
