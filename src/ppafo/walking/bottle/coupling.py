"""Co-simulation of a walk and its gas supply, with data exchange every tenth of a second, and the supply over time.

Chambers and lines respond within milliseconds; bottle, regulator and hose within seconds. The walk is therefore
advanced by a tenth of a second with the supply pressure and the largest flow from the start of the interval, then the
supply is advanced with the gas mass that the regulator passed in that interval. The intervals are shorter when little
gas is left. No program is compiled for a bottle: set pressure, gas temperature and largest flow are parameters of any
program with supply lines. The walk ends when the bottle can no longer supply the device.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.engine.lanes import BatchResult, Floats, begin_block, effort_for
from ppafo.engine.rows import leaf_paths, leaves, row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.model.cold_gas import DRY_ICE, SupplyNow, SupplyState, advance_supply, open_share
from ppafo.model.effects.kind import Effect
from ppafo.model.gas import mass_flow_ratio
from ppafo.model.regulator import line_pressures
from ppafo.model.source import bottle_content, has_liquid
from ppafo.parameters.device import Device
from ppafo.parameters.effects import effect_row
from ppafo.report.kind import duration_kind
from ppafo.signals import Channel, Recording
from ppafo.walking.bottle.supply import BottleSupply

EndKind = Literal["walk's end", "empty", "too cold", "frozen", "iced", "too little flow", "diverged"]
WALKED: EndKind = "walk's end"
DIVERGED: EndKind = "diverged"

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
"""Series of a supply by name, with their units."""


class SupplyEnding(NamedTuple):
    """End of a walk caused by its gas bottle: reason code, explanation as a sentence, and time [s]."""

    kind: EndKind
    message: str
    time: float


class Meeting(NamedTuple):
    """Data exchange between bottle and device: time [s], state of the supply, and its output until the next one."""

    time: float
    state: SupplyState
    offered: SupplyNow


@dataclass(eq=False)
class SupplyCourse:
    """Supply over a walk: exchanges with the device, gas through the regulator [kg], times of walking and of rests [s].

    ``ended`` is the end that the supply caused, None if it lasted until the end of the walk.
    """

    supply: BottleSupply
    met: list[Meeting]
    regulated: float = 0.0
    walked: float = 0.0
    rested: float = 0.0
    ended: SupplyEnding | None = None

    @property
    def ending(self) -> SupplyEnding:
        """End of the walk."""
        last = self.met[-1]
        over = f"the walk is complete, and {_grams(last.state.mass)} are left in the bottle"
        return self.ended or SupplyEnding(WALKED, over, last.time)

    @property
    def times(self) -> Floats:
        """Times of the exchanges [s] (n,)."""
        return np.array([meeting.time for meeting in self.met])

    @cached_property
    def values(self) -> Mapping[str, Floats]:
        """Series (n,) at the exchanges by name, in the units of ``UNITS``; liquid only of a fluid that has it."""
        rows = [
            (
                state.mass,
                offered.content.liquid_mass,
                offered.content.temperature,
                state.wall_temperature,
                offered.content.pressure,
                state.body_temperature,
                state.hose_temperature,
                offered.outlet_temperature,
                offered.gas_temperature,
                offered.set_pressure,
                open_share(self.supply.bottle.supply, state.ice),
            )
            for _, state, offered in self.met
        ]
        values = dict(zip(UNITS, np.array(rows).T.copy(), strict=True))
        if not has_liquid(self.supply.bottle.fluid.table):
            del values["liquid_mass"]
        return values

    @property
    def recording(self) -> Recording:
        """State of the supply over the walk as a recording."""
        channels = {name: Channel(values, UNITS[name]) for name, values in self.values.items()}
        return Recording(f"bottle {self.supply.bottle.name}", self.times, channels, kind="simulated")

    @property
    def balance(self) -> dict[str, float]:
        """Mass and energy balances of the supply from the start of the walk to the end.

        Mass [kg]: left_bottle = regulated + iced, which are the gas that left the bottle, the gas through the regulator
        and the dry ice in the seat.

        Energy [J]: given_up + ice + room = delivered. ``given_up`` is the energy released by content, wall, regulator
        and hose, ``ice`` the enthalpy difference of the dry ice in the seat, ``room`` the heat from the room, and
        ``delivered`` the enthalpy of the gas downstream of the hose.
        """
        first = self.met[0].state
        last = self.met[-1].state
        supply = self.supply.bottle.supply
        parts = (
            first.energy - last.energy,
            supply.wall.wall_heat_capacity * (first.wall_temperature - last.wall_temperature),
            supply.body.heat_capacity * (first.body_temperature - last.body_temperature),
            supply.hose.heat_capacity * (first.hose_temperature - last.hose_temperature),
        )
        return {
            "left_bottle": first.mass - last.mass,
            "regulated": self.regulated,
            "iced": last.ice,
            "given_up": sum(parts),
            "ice": (DRY_ICE - self.supply.line.enthalpies[0]) * last.ice,
            "room": last.room_heat,
            "delivered": last.delivered,
        }


def duration_text(seconds: float) -> str:
    """Return a duration as text with three significant digits, in seconds to 2 min, in whole minutes from 1000 min."""
    kind = duration_kind(seconds)
    return kind.text(seconds, ".0f" if kind.values(seconds) >= 999.5 else ".3g")


def strides_text(strides: float) -> str:
    """Return a number of strides as text, with one decimal below 100 and none above."""
    return f"{strides:.1f}" if strides < 99.5 else f"{strides:.0f}"


# Paths of the rows for the gas through a line's regulator, and for the gas in the line [kg].
REGULATED = "line_state.regulated_mass"
_LINE = "line_state.mass_1"

_PARAMETERS = (
    "plant.gas_product",
    "plant.valve_conductance",
    "plant.leak_conductance",
    "plant.supply_pressure",
    "lines.largest_flow_1",
)
"""Parameters of the program that depend on the state of the supply."""

_STRIDES = 2.0
"""Number of strides within which the line pressure must once reach the required level."""

LARGEST_DRAW = 0.05
"""Fraction of the gas in the bottle that may be drawn between two data exchanges, while the supply is constant."""

LEAST_FLOW = 1.0e-12
"""Smallest assumed regulator flow [kg/s], which avoids a division by zero."""
RESTING = 5.0
"""Interval between two states of a bottle during a rest [s]."""
ABOVE_FREEZING = 0.02
"""Difference [K] to the lowest temperature of the property table below which the fluid counts as freezing."""
OPEN = 0.999
"""Fraction of the seat area that is open, above which ice is not the cause of an insufficient flow."""


class Schedule(NamedTuple):
    """Alternating durations of walking and rest [s], for at most ``longest`` [s]; a rest of 0 s means none."""

    walk: float
    rest: float
    longest: float


def walk_on_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    progress: Callable[[float, float], None],
    schedule: Schedule | None = None,
) -> tuple[BatchResult, SupplyCourse]:
    """Simulate a walk on a bottle until either ends; return states and records of the walk, and the supply over time.

    ``device`` is the device for which the run was planned, ``stride_time`` the duration of a stride [s]. With a
    schedule, the walk has its rests, and is repeated until the bottle is exhausted or the schedule over. ``progress``
    is called with the minutes simulated and the total number of minutes.
    """
    course = SupplyCourse(supply, [Meeting(0.0, supply.start(), supply.offers_first())])
    rows = _walk_once(run, device, course, stride_time, progress, schedule)
    while schedule is not None and course.ended is None and course.walked + course.rested < schedule.longest:
        rows = _walk_once(run, device, course, stride_time, progress, schedule)
    return rows, course


def _walk_once(
    run: Run,
    device: Device,
    course: SupplyCourse,
    stride_time: float,
    progress: Callable[[float, float], None],
    schedule: Schedule | None,
) -> BatchResult:
    """Simulate a run on a bottle and continue ``course`` in place; return the rows of the run, up to its end."""
    batch = batch_of(run)
    supply = course.supply
    met = course.met
    count = batch.clock.step_count
    block = begin_block(batch, effort_for(batch))
    states = row_numbers(batch.program.state_rows())
    regulated, lines = ([row for path, row in states.items() if path.endswith(end)] for end in (REGULATED, _LINE))
    every = max(1, round(supply.coupling / run.step))
    walked_before = course.walked
    lanes = _Lanes(run, device, met[0].offered.gas_temperature)
    # The line falls for a moment at each draw: its best over some strides counts, of two meetings at least.
    window = max(2, math.ceil(_STRIDES * stride_time / (every * run.step))) * every
    # The line starts at the set pressure.
    gauges = [(0, 1.0)]
    done = 0
    first = float(batch.states[regulated, 0].sum())
    before = first
    walk, rest, longest = schedule or Schedule(math.inf, 0.0, math.inf)
    until_rest = max(1, round((walk - course.walked % walk) / run.step)) if rest > 0.0 else count
    while course.ended is None and done < count and course.walked + course.rested < longest:
        meeting = met[-1]
        # More often where much of what is left may flow out between two meetings.
        largest_flow = max(meeting.offered.largest_flow, LEAST_FLOW)
        most = max(1, min(every, int(LARGEST_DRAW * meeting.state.mass / (largest_flow * run.step))))
        steps = min(most, count - done, until_rest)
        block.set_parameters(lanes.rows, lanes.parameters(meeting.offered))
        block.advance(steps)
        done = done + steps
        until_rest = until_rest - steps
        course.walked = walked_before + done * run.step
        time = course.walked + course.rested
        progress(course.walked / 60.0, (walked_before + count * run.step) / 60.0)
        # Divergence first: a gas mass that is no number must not reach the supply.
        failed = float(block.states[states["result.failure_time"], 0])
        if failed < NEVER_FAILED or not bool(np.isfinite(block.states).all()):
            message = f"the walk diverged with {_grams(meeting.state.mass)} left in the bottle"
            course.ended = SupplyEnding(DIVERGED, message, min(time, failed))
            break
        regulated_mass = float(block.states[regulated, 0].sum())
        drawn = regulated_mass - before
        before = regulated_mass
        met.append(met_again(supply, meeting, drawn, steps * run.step, time))
        gauges = [
            *((step, gauge) for step, gauge in gauges if step > done - window),
            (done, min(lanes.gauge(float(block.states[line, 0]), met[-1].offered) for line in lines)),
        ]
        course.ended = _ending(supply, met[-1], max(gauge for _, gauge in gauges))
        if course.ended is None and rest > 0.0 and until_rest <= 0 and time < longest:
            resting = min(rest, longest - time)
            parts = max(1, math.ceil(resting / RESTING))
            # The bottle warms, and no gas flows.
            for _ in range(parts):
                met.append(met_again(supply, met[-1], 0.0, resting / parts, met[-1].time + resting / parts))
            course.rested += resting
            # Gauges of before the rest say nothing of the bottle that has warmed in it.
            gauges = [(done, 1.0)]
            until_rest = round(walk / run.step)
    course.regulated += before - first
    result = block.result()
    record = result.record if done == count else result.record[: (done - 1) // int(run.record_every) + 1]
    return BatchResult(result.states, record)


def met_again(supply: BottleSupply, meeting: Meeting, drawn: float, duration: float, time: float) -> Meeting:
    """Return the exchange at ``time`` [s], after the device has drawn a mass ``drawn`` [kg] over ``duration`` [s]."""
    table = supply.bottle.fluid.table
    content = meeting.offered.content
    state = advance_supply(table, supply.line, supply.bottle.supply, meeting.state, content, drawn, duration)
    return Meeting(time, state, supply.offers(state, content.temperature, drawn))


@dataclass(frozen=True)
class _Lanes:
    """Parameters of a walk program that depend on the state of the supply.

    The run was planned for its ``device`` and gas at the temperature ``start`` [K].
    """

    run: Run
    device: Device
    start: float

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """Active effects of the device, whose parameters may depend on the gas temperature."""
        return tuple(effect for effect in self.run.program.effects if effect.is_of_device)

    @cached_property
    def rows(self) -> list[int]:
        """Rows of the parameters in the program."""
        names = row_numbers(self.run.program.parameter_rows())
        of_effects = [path for effect in self.effects for path in leaf_paths(effect.parameters, effect.name)]
        return [names[path] for path in (*_PARAMETERS, *of_effects)]

    def parameters(self, now: SupplyNow) -> Floats:
        """Return the values of the parameters that depend on the supply, in the order of ``rows``.

        The gas product is proportional to the gas temperature T, the conductances of valve and leak to 1/sqrt(T). Set
        pressure and largest flow of the regulator follow, then the parameters of the effects at the temperature T.
        """
        plant = self.run.plant
        warmth = now.gas_temperature / self.start
        slower = mass_flow_ratio(math.sqrt(warmth))
        product = plant.gas_product
        valve = plant.valve_conductance
        leak = plant.leak_conductance
        own = [product * warmth, valve * slower, leak * slower, now.set_pressure, now.largest_flow]
        device = replace(self.device, gas=replace(self.device.gas, temperature=now.gas_temperature))
        return np.array([*own, *(number for effect in self.effects for number in leaves(effect_row(effect, device)))])

    def gauge(self, mass: float, now: SupplyNow) -> float:
        """Return the gauge pressure of the line, which contains a mass [kg], divided by the set gauge pressure [-]."""
        plant = self.run.plant
        lines = self.run.lines
        assert lines is not None, "a bottle feeds lines"
        product = plant.gas_product * now.gas_temperature / self.start
        pressure, _ = line_pressures(lines.parameters, product, lines.initial._replace(mass_1=mass))
        return (pressure - plant.atmospheric_pressure) / (plant.supply_pressure - plant.atmospheric_pressure)


def _ending(supply: BottleSupply, meeting: Meeting, reached: float) -> SupplyEnding | None:
    """Return the end of a walk caused by its supply, or None if the walk continues.

    ``reached`` is the largest recent gauge pressure of the line divided by the set gauge pressure [-].
    """
    time, state, now = meeting
    bottle = supply.bottle
    left = _grams(state.mass)
    # Freezing first: it ends the walk even at full torque.
    if now.content.temperature <= bottle.fluid.table.temperatures[0] + ABOVE_FREEZING:
        return SupplyEnding("frozen", f"the fluid in the bottle freezes, with {left} left", time)
    if reached >= supply.least_torque:
        return None
    short = f"the supply gives less than {100.0 * supply.least_torque:.0f} % of the torque"
    # The bottle still has the pressure: the flow is too small, by ice or by the seat itself.
    if now.set_pressure >= bottle.regulator.set_pressure and open_share(bottle.supply, state.ice) < OPEN:
        why = f"dry ice leaves {100.0 * open_share(bottle.supply, state.ice):.0f} % of the seat open"
        return SupplyEnding("iced", f"the regulator is iced: {why}, and {short}; {left} are left", time)
    if now.set_pressure >= bottle.regulator.set_pressure:
        return SupplyEnding("too little flow", f"the regulator flow is too small, and {short}; {left} are left", time)
    # The same gas at room temperature tells a cold bottle from an empty one.
    warm = bottle_content(bottle.fluid.table, state.mass, bottle.volume, bottle.room_temperature).pressure
    if warm - bottle.regulator.pressure_margin >= bottle.regulator.set_pressure:
        degrees = f"{now.content.temperature - 273.15:.0f} degC"
        return SupplyEnding("too cold", f"the bottle is too cold, {degrees}, and {short}; {left} are left", time)
    return SupplyEnding("empty", f"the bottle is empty, and {short}; {left} are left", time)


def _grams(mass: float) -> str:
    """Return a mass [kg] as text in grams."""
    return f"{mass * GRAMS_PER_KILOGRAM:.3g} g"
