"""A bench made with scipy: the equations of docs/equations.md for a vane under a held command.

It shares no code with the package and takes no step of it; numbers are read off a scenario. The valve is a port without
dynamics, the gas isothermal.
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


@dataclass
class Bench:
    """One run: the numbers of a scenario; its unknowns are angle, rate and both masses."""

    rig: Rig

    def pressures(self, y: Any) -> tuple[float, float]:
        """Both pressures [Pa]."""
        rig = self.rig
        product = rig.gas_constant * rig.temperature
        return (
            y[2] * product / (rig.dead_1 + rig.displacement_per_radian * (y[0] - rig.lowest)),
            y[3] * product / (rig.dead_2 + rig.displacement_per_radian * (rig.highest - y[0])),
        )

    def between(self, inside: float, outside: float, share: float) -> float:
        """Flow into a space at ``inside`` through a share of the valve [kg/s]."""
        if share <= 0.0:
            return 0.0
        if outside >= inside:
            return share * float(flow(outside, inside, 1.0, self.rig.port, self.rig.linear))
        return -share * float(flow(inside, outside, 1.0, self.rig.port, self.rig.linear))

    def leak(self, pressure_1: float, pressure_2: float) -> float:
        """Flow from chamber 1 to chamber 2 [kg/s]."""
        high = max(pressure_1, pressure_2)
        low = min(pressure_1, pressure_2)
        size = float(flow(high, low, 1.0, self.rig.leak, self.rig.linear))
        return size if pressure_1 >= pressure_2 else -size

    def drive(self, y: Any) -> float:
        """Torque before friction and damping [N m]."""
        rig = self.rig
        pressure_1, pressure_2 = self.pressures(y)
        return float(rig.torque_constant * (pressure_1 - pressure_2) + rig.gravity * math.sin(y[0]) - rig.external)

    def rates(self, y: Any, way: float, opening: float) -> list[float]:
        """Time derivatives of the unknowns."""
        rig = self.rig
        pressure_1, pressure_2 = self.pressures(y)
        velocity = y[1] if way != 0.0 else 0.0
        torque = self.drive(y) - rig.viscous * velocity - way * rig.dynamic
        to_1 = min(max(opening, 0.0), 1.0)
        to_2 = min(max(-opening, 0.0), 1.0)
        into_1 = self.between(pressure_1, rig.source_1, to_1) + self.between(pressure_1, rig.room, to_2)
        into_2 = self.between(pressure_2, rig.source_2, to_2) + self.between(pressure_2, rig.room, to_1)
        leaked = self.leak(pressure_1, pressure_2)
        return [velocity, torque / rig.inertia if way != 0.0 else 0.0, into_1 - leaked, into_2 + leaked]

    def leaves(self, y: Any) -> float:
        """1 or -1 where a vane at rest begins to move that way, else 0."""
        torque = self.drive(y)
        if torque > self.rig.static and y[0] < self.rig.highest:
            return 1.0
        return -1.0 if torque < -self.rig.static and y[0] > self.rig.lowest else 0.0


def bench(scenario: Scenario, commands: Sequence[tuple[float, float]], times: Any) -> Any:
    """Angle [rad], pressure 1 and 2 [Pa] (3, samples) at ``times`` [s] of a free vane under commands that are held."""
    assert isinstance(scenario.motion, FreeMotion)
    rig = rig_of(scenario)
    made = Bench(rig)
    y = np.zeros(4)
    y[0] = scenario.motion.angle
    product = rig.gas_constant * rig.temperature
    volumes = (
        rig.dead_1 + rig.displacement_per_radian * (y[0] - rig.lowest),
        rig.dead_2 + rig.displacement_per_radian * (rig.highest - y[0]),
    )
    for n, pressure in enumerate((scenario.initial.pressure_1, scenario.initial.pressure_2)):
        y[2 + n] = pressure * volumes[n] / product
    seen = np.empty((3, len(times)))
    ends = [time for time, _ in commands[1:]] + [float(times[-1]) + 1.0e-6]
    now = 0.0
    way = 0.0
    for (begin, opening), end in zip(commands, ends, strict=True):
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
        torque = made.drive(y)
        upwards = torque if y[0] < rig.highest else -math.inf
        downwards = -torque if y[0] > rig.lowest else -math.inf
        return max(upwards, downwards) - rig.static

    def stands(_: float, y: Any) -> float:
        return float(y[1] * way)

    def stops(_: float, y: Any) -> float:
        return float((rig.highest - y[0]) if way > 0.0 else (y[0] - rig.lowest))

    events: list[Any] = [breaks] if way == 0.0 else [stands, stops]
    for event in events:
        event.terminal = True
        event.direction = 1.0 if event is breaks else -1.0
    return events


def _stretch(made: Bench, now: float, end: float, y: Any, way: float, opening: float, times: Any, seen: Any) -> Any:
    """One stretch without an event, and what follows at its end."""
    rig = made.rig
    scale = np.array([1.0, 10.0, 1.0e-5, 1.0e-5])

    def moved(_: float, y: Any) -> Any:
        return made.rates(y, way, opening)

    events = events_of(made, way)
    found = solve_ivp(
        moved,
        (now, end),
        y,
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
        seen[:, place] = state[0], *made.pressures(state)
    y = found.y[:, -1].copy()
    if found.status == 1 and way == 0.0:
        way = made.leaves(y) or math.copysign(1.0, made.drive(y))
    elif found.status == 1:
        if found.t_events[1].size:
            y[0] = rig.highest if way > 0.0 else rig.lowest
        y[1] = 0.0
        way = made.leaves(y)
    return reached, y, way
