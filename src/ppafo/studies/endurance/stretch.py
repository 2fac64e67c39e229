"""One time of one draw from a bottle: the equations solved, and what ends it before its time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.errors import SimulationError
from ppafo.model.source import (
    BottleContent,
    BottleState,
    bottle_content,
    bottle_rates,
    content_energy,
    content_temperature,
)
from ppafo.signals.recording import Floats
from ppafo.studies.endurance.bottle import Bottle
from ppafo.studies.endurance.draw import Draw
from ppafo.studies.endurance.ending import Stop, frozen_below, reserve

_RELATIVE, _ABSOLUTE = 1e-7, (1e-10, 1e-4, 1e-6, 1e-10, 1e-4, 1e-4)
_ABOVE_FREEZING = 0.02
"""Kelvin above the cold end of the table at which a run stops, so that the end is approached and not sat on."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A time [s] of one draw [kg/s], the solution in it and at its end, and what stopped it before its time.

    The solution is mass [kg] and energy [J] of the content, temperature of the wall [K], and the sums of gas [kg], its
    enthalpy [J] and heat from the room [J] that crossed the border.
    """

    start: float
    end: float
    draw: float
    solution: Callable[[Any], Any]
    last: Floats
    stopped_by: Stop | None


def full_bottle(bottle: Bottle) -> Floats:
    """Return the solution at the start: a full bottle at the temperature of the room."""
    energy = content_energy(bottle.fluid.table, bottle.mass, bottle.volume, bottle.room_temperature)
    return np.array([bottle.mass, energy, bottle.room_temperature, 0.0, 0.0, 0.0])


def content_of(bottle: Bottle, mass: float, energy: float) -> BottleContent:
    """Return what the bottle holds with a mass [kg] of an energy [J]."""
    table = bottle.fluid.table
    return bottle_content(table, mass, bottle.volume, content_temperature(table, mass, bottle.volume, energy))


def solved_stretch(bottle: Bottle, draw: Draw, start: float, end: float, values: Floats, walking: bool) -> Stretch:
    """Return one stretch; walking, it may end early where the supply pressure is no longer held."""
    from scipy.integrate import solve_ivp

    flow = draw.mean_flow if walking else 0.0
    events = _events(bottle, draw)[: 2 if walking else 1]
    if walking and events[1](start, values) <= 0.0:
        return Stretch(start, start, flow, lambda _times: values, values, "supply")
    solution = solve_ivp(
        _rates(bottle, flow),
        (start, end),
        values,
        method="LSODA",
        events=events,
        dense_output=True,
        rtol=_RELATIVE,
        atol=_ABSOLUTE,
    )
    if solution.status < 0:
        raise SimulationError(f"the bottle could not be followed beyond {solution.t[-1]:.4g} s: {solution.message}")
    stopped: Stop = "frozen" if len(solution.t_events[0]) else "supply"
    last = np.asarray(solution.y[:, -1])
    return Stretch(start, float(solution.t[-1]), flow, solution.sol, last, stopped if solution.status == 1 else None)


def _rates(bottle: Bottle, flow: float) -> Callable[[float, Floats], list[float]]:
    """Return the right-hand side for mass, energy, wall temperature, and the sums of what crossed the border."""

    def rates(_time: float, y: Floats) -> list[float]:
        state = BottleState(float(y[0]), float(y[1]), float(y[2]))
        content = content_of(bottle, state.mass, state.energy)
        now = bottle_rates(content, state, flow, bottle.wall, bottle.room_temperature)
        inside = (now.mass_rate, now.content_energy_rate, now.wall_temperature_rate)
        return [*inside, flow, now.outflow_power, now.room_heat]

    return rates


def _events(bottle: Bottle, draw: Draw) -> list[Any]:
    """Return what ends a stretch where it falls through 0: kelvins above freezing, and what the supply has to spare."""

    def above_freezing(_time: float, y: Floats) -> float:
        return content_of(bottle, float(y[0]), float(y[1])).temperature - frozen_below(bottle) - _ABOVE_FREEZING

    def to_spare(_time: float, y: Floats) -> float:
        content = content_of(bottle, float(y[0]), float(y[1]))
        return reserve(bottle, draw, content.pressure, content.temperature)

    events: list[Any] = [above_freezing, to_spare]
    for event in events:
        event.terminal, event.direction = True, -1.0
    return events
