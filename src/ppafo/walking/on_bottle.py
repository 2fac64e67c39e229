"""A walk on its bottle: lanes and bottle take turns, and the walk ends where the bottle no longer feeds it.

Chambers and lines move within milliseconds, bottle, regulator and hose within seconds. So the lanes run for a tenth of
a second with what the supply offers at its beginning, and the supply follows with the gas that the regulator let
through in it; they meet more often where little is left. Nothing is compiled for it: what a supply offers are
parameters of any program with lines.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.engine.lanes import BatchResult, Floats, begin_block
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.model.cold_gas import DRY_ICE, SupplyNow, SupplyState, advance_supply, open_share
from ppafo.model.fluid_table import has_liquid
from ppafo.model.plant import PlantParameters
from ppafo.model.source import bottle_content
from ppafo.signals import Channel, Recording
from ppafo.walking.bottle_supply import BottleSupply

EndKind = Literal["walk's end", "empty", "too cold", "frozen", "iced", "too little flow", "diverged"]
WALKED: EndKind = "walk's end"
DIVERGED: EndKind = "diverged"

_PARAMETERS = (
    "plant.gas_product",
    "plant.valve_conductance",
    "plant.leak_conductance",
    "plant.supply_pressure",
    "lines.largest_flow_1",
)
"""Parameters of the lanes that follow the supply."""

_STRIDES = 2.0
"""Strides in which the line must once come near the set pressure."""

_LARGEST_DRAW = 0.05
"""Share of the gas in the bottle that may leave between two meetings: what it offers stays until the next one."""

_LEAST_FLOW = 1.0e-12
_ABOVE_FREEZING = 0.02
_OPEN = 0.999
UNITS = {
    "bottle_mass": "kg",
    "liquid_mass": "kg",
    "bottle_temperature": "K",
    "wall_temperature": "K",
    "bottle_pressure": "Pa",
    "regulator_temperature": "K",
    "hose_temperature": "K",
    "outlet_temperature": "K",
    "gas_temperature": "K",
    "regulated_pressure": "Pa",
    "seat_open": "-",
}


class SupplyEnding(NamedTuple):
    """What ended a walk on its bottle: kind, a sentence, and when [s]."""

    kind: EndKind
    message: str
    time: float


class SupplyBalance(NamedTuple):
    """What must close: gas out of the bottle, through its regulator and as ice in it [kg], and energy of all parts [J].

    left_bottle = regulated + iced. ``given_up`` is what content, wall, regulator and hose lost, ``ice`` the enthalpy
    that the dry ice in the seat lacks, ``room`` the heat of the room, ``delivered`` the enthalpy of the gas behind the
    hose: given_up + ice + room = delivered.
    """

    left_bottle: float
    regulated: float
    iced: float
    given_up: float
    ice: float
    room: float
    delivered: float


@dataclass(frozen=True, slots=True, eq=False)
class SupplyCourse:
    """A supply over a walk: times [s] (n,) at which bottle and device met, values (n,) by name in ``UNITS``."""

    supply: BottleSupply
    times: Floats
    values: Mapping[str, Floats]
    first: SupplyState
    last: SupplyState
    regulated: float
    ending: SupplyEnding

    def at(self, name: str, times: Floats) -> Floats:
        """Return a value at times [s], straight between those at which bottle and device met."""
        return np.interp(times, self.times, self.values[name])

    @property
    def recording(self) -> Recording:
        """Return the course of the supply as a recording."""
        channels = {name: Channel(values, UNITS[name]) for name, values in self.values.items()}
        return Recording(f"bottle {self.supply.bottle.name}", self.times, channels, kind="simulated")

    @property
    def balance(self) -> SupplyBalance:
        """Return what went where, from start to end."""
        first, last, supply = self.first, self.last, self.supply.bottle.supply
        parts = (
            first.energy - last.energy,
            supply.wall.wall_heat_capacity * (first.wall_temperature - last.wall_temperature),
            supply.body.heat_capacity * (first.body_temperature - last.body_temperature),
            supply.hose.heat_capacity * (first.hose_temperature - last.hose_temperature),
        )
        return SupplyBalance(
            left_bottle=first.mass - last.mass,
            regulated=self.regulated,
            iced=last.ice,
            given_up=sum(parts),
            ice=(DRY_ICE - self.supply.line.enthalpies[0]) * last.ice,
            room=last.room_heat,
            delivered=last.delivered,
        )


def run_on_bottle(
    run: Run, supply: BottleSupply, stride_time: float, progress: Callable[[float, float], None]
) -> tuple[BatchResult, SupplyCourse]:
    """Return what a run gives on a bottle, up to where that ends it, and the course of the bottle.

    ``stride_time`` [s] is how long a stride takes; ``progress`` gets the minutes done and in all.
    """
    if run.effects:
        names = ", ".join(f"'{effect.name}'" for effect in run.program.effects)
        raise ScenarioError(
            f"effects ({names}) do not follow the temperature of a bottle: switch them off, or walk without"
        )
    batch = batch_of(run)
    count = batch.clock.step_count
    block = begin_block(batch)
    states = row_numbers(batch.program.state_rows())
    regulated, line = states["line_state.regulated_mass"], states["line_state.mass_1"]
    every = max(1, round(supply.coupling / run.step))
    state, table = supply.start(), supply.bottle.fluid.table
    met = [(0.0, state, supply.offers_first())]
    lanes = _lanes_of(run, met[0][2])
    window = max(2, math.ceil(_STRIDES * stride_time / (every * run.step))) * every
    gauges = [(0, 1.0)]
    ending, done, before = None, 0, float(batch.states[regulated, 0])
    while ending is None and done < count:
        steps = min(_steps_to_meet(met[-1], run.step, every), count - done)
        block.set_parameters(lanes.rows, lanes.offered(met[-1][2]))
        block.advance(steps)
        done += steps
        progress(done * run.step / 60.0, count * run.step / 60.0)
        ending = _divergence(block.states, states["result.failure_time"], state, done * run.step)
        if ending is not None:
            break
        mass, before = float(block.states[regulated, 0]) - before, float(block.states[regulated, 0])
        content = met[-1][2].content
        state = advance_supply(table, supply.line, supply.bottle.supply, state, content, mass, steps * run.step)
        now = supply.offers(state, content.temperature, mass)
        met.append((done * run.step, state, now))
        gauges = [
            *(old for old in gauges if old[0] > done - window),
            (done, lanes.gauge(float(block.states[line, 0]), now)),
        ]
        ending = _ending(supply, state, now, max(gauge for _, gauge in gauges), done * run.step)
    result = block.result()
    record = result.record if done == count else result.record[: (done - 1) // int(run.record_every) + 1]
    last = ending or SupplyEnding(WALKED, _at_the_end(state), done * run.step)
    let_through = before - float(batch.states[regulated, 0])
    return BatchResult(result.states, record), _course(supply, met, let_through, last)


def _steps_to_meet(last: tuple[float, SupplyState, SupplyNow], step: float, every: int) -> int:
    """Return how many steps [of ``step`` s] the lanes go until they meet the supply again, at most ``every``."""
    _, state, now = last
    return max(1, min(every, int(_LARGEST_DRAW * state.mass / (max(now.largest_flow, _LEAST_FLOW) * step))))


def _divergence(states: Floats, failure: int, state: SupplyState, time: float) -> SupplyEnding | None:
    """Return that a walk left what is possible by a time [s], None where it did not; ``state`` is the last before."""
    failed = float(states[failure, 0])
    if failed >= NEVER_FAILED and bool(np.isfinite(states).all()):
        return None
    message = f"the walk diverged, and {_grams(state.mass)} were left in the bottle before"
    return SupplyEnding(DIVERGED, message, min(time, failed))


@dataclass(frozen=True, slots=True)
class _Lanes:
    """The lanes as their supply sees them: rows that follow it, and the numbers with gas of the ``start`` [K]."""

    rows: list[int]
    plant: PlantParameters
    volume: float
    start: float

    def offered(self, now: SupplyNow) -> Floats:
        """Return the parameters: gas of its temperature, flows through openings with 1 over its root, the regulator."""
        plant, warmth = self.plant, now.gas_temperature / self.start
        slower = 1.0 / math.sqrt(warmth)
        product, valve, leak = plant.gas_product, plant.valve_conductance, plant.leak_conductance
        return np.array([product * warmth, valve * slower, leak * slower, now.set_pressure, now.largest_flow])

    def gauge(self, mass: float, now: SupplyNow) -> float:
        """Return the gauge pressure of the line with a mass [kg] in it over that to which the regulator is set [-]."""
        plant = self.plant
        pressure = mass * plant.gas_product * now.gas_temperature / (self.start * self.volume)
        return (pressure - plant.atmospheric_pressure) / (plant.supply_pressure - plant.atmospheric_pressure)


def _lanes_of(run: Run, first: SupplyNow) -> _Lanes:
    assert run.lines is not None, "a bottle feeds lines"
    names = row_numbers(run.program.parameter_rows())
    rows = [names[path] for path in _PARAMETERS]
    return _Lanes(rows, run.plant, run.lines.parameters.volume_1, first.gas_temperature)


def _ending(
    supply: BottleSupply, state: SupplyState, now: SupplyNow, reached: float, time: float
) -> SupplyEnding | None:
    """Return what ends a walk, None while it goes on; ``reached`` is the best gauge pressure of late over the set."""
    bottle = supply.bottle
    left = _grams(state.mass)
    if now.content.temperature <= bottle.fluid.table.temperatures[0] + _ABOVE_FREEZING:
        return SupplyEnding("frozen", f"the content of the bottle freezes, with {left} left", time)
    if reached >= supply.least_torque:
        return None
    short = f"the supply gives less than {100.0 * supply.least_torque:.0f} % of the torque"
    if now.set_pressure >= bottle.regulator.set_pressure and open_share(bottle.supply, state.ice) < _OPEN:
        kind: EndKind = "iced"
        why = f"dry ice in the seat leaves {100.0 * open_share(bottle.supply, state.ice):.0f} % of it open"
        return SupplyEnding(kind, f"the regulator is iced: {why}, and {short}; {left} are left", time)
    if now.set_pressure >= bottle.regulator.set_pressure:
        return SupplyEnding("too little flow", f"the regulator passes too little, and {short}; {left} are left", time)
    warm = bottle_content(bottle.fluid.table, state.mass, bottle.volume, bottle.room_temperature).pressure
    if warm - bottle.regulator.pressure_margin >= bottle.regulator.set_pressure:
        degrees = f"{now.content.temperature - 273.15:.0f} degC"
        return SupplyEnding("too cold", f"the bottle is too cold, {degrees}, and {short}; {left} are left", time)
    return SupplyEnding("empty", f"the bottle is empty, and {short}; {left} are left", time)


def _at_the_end(state: SupplyState) -> str:
    return f"the walk is over, and {_grams(state.mass)} are left in the bottle"


def _grams(mass: float) -> str:
    return f"{mass * GRAMS_PER_KILOGRAM:.3g} g"


def _course(
    supply: BottleSupply, met: list[tuple[float, SupplyState, SupplyNow]], regulated: float, ending: SupplyEnding
) -> SupplyCourse:
    rows = [
        (
            state.mass,
            now.content.liquid_mass,
            now.content.temperature,
            state.wall_temperature,
            now.content.pressure,
            state.body_temperature,
            state.hose_temperature,
            now.outlet_temperature,
            now.gas_temperature,
            now.set_pressure,
            open_share(supply.bottle.supply, state.ice),
        )
        for _, state, now in met
    ]
    values = dict(zip(UNITS, np.array(rows).T.copy(), strict=True))
    if not has_liquid(supply.bottle.fluid.table):
        del values["liquid_mass"]
    times = np.array([time for time, _, _ in met])
    return SupplyCourse(supply, times, values, met[0][1], met[-1][1], regulated, ending)
