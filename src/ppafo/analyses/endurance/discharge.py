"""Simulation of the discharge of a full bottle until it no longer maintains the supply pressure."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal, NamedTuple

import numpy as np

from ppafo.analyses.endurance.gas_demand import GasDemand
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import ParameterError, SimulationError
from ppafo.model.source import (
    BottleContent,
    BottleState,
    bottle_content,
    bottle_rates,
    content_energy,
    content_temperature,
    delivered_pressure,
    densest_gas,
    has_liquid,
    pressure_reserve,
    regulator_flow_limit,
)
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import Floats
from ppafo.units.shown import shown_text
from ppafo.walking.bottle.coupling import BottleLife, Schedule
from ppafo.walking.bottle.course import WALKED, SupplyBalance

TIME_IS_UP = "time is up"
Stop = Literal["supply", "frozen", "time"]
"""Reason for the end of a discharge: supply pressure lost, cold end of the property table, or time limit."""
_NEXT_TO_NOTHING = 0.01
"""Usable gas at room temperature, as a fraction of a full bottle, below which a bottle counts as empty [-]."""


@dataclass(frozen=True, slots=True)
class DischargeEnd:
    """End of a discharge: reason, explanation, remaining mass [kg], and usable part of it at room temperature [kg]."""

    kind: str
    message: str
    mass_left: float
    usable_when_warm: float


def reserves(bottle: Bottle, draw: GasDemand, pressure: float, temperature: float) -> tuple[float, float]:
    """Return the relative margins of pressure and flow [-] at the largest flow; below 0 the supply pressure is lost.

    The pressure margin is the excess over the regulator's need divided by the set pressure; the flow margin is the flow
    limit of the regulator divided by the largest flow, minus 1.
    """
    to_spare = pressure_reserve(bottle.regulator, pressure, draw.peak_flow) / bottle.regulator.set_pressure
    return to_spare, flow_limit(bottle, pressure, temperature) / draw.peak_flow - 1.0


def flow_limit(bottle: Bottle, pressure: float, temperature: float) -> float:
    """Return the largest flow [kg/s] of the regulator at a pressure [Pa] and a temperature [K] in the bottle."""
    gas_constant = bottle.fluid.table.gas_constant
    return regulator_flow_limit(bottle.regulator, pressure, temperature, bottle.heat_capacity_ratio, gas_constant)


def smallest_mass_when_warm(bottle: Bottle, draw: GasDemand, enough: float = math.inf) -> float:
    """Return the smallest mass of gas [kg] with which the bottle maintains the supply pressure at room temperature.

    ``enough`` is a pressure in the bottle [Pa absolute] that was seen to suffice.
    """
    table, room = bottle.fluid.table, bottle.room_temperature
    low, high = 0.0, min(bottle.mass, bottle.volume * densest_gas(table, room))
    # Halved until nothing is left to halve: the reserve grows with the mass, though not smoothly where liquid begins.
    for _ in range(60):
        middle = 0.5 * (low + high)
        pressure = bottle_content(table, middle, bottle.volume, room).pressure
        if min(reserves(bottle, draw, pressure, room)) < 0.0 and pressure < enough:
            low = middle
        else:
            high = middle
    return high


def ending(bottle: Bottle, draw: GasDemand, mass: float, content: BottleContent, stopped_by: Stop) -> DischargeEnd:
    """Return the end of a discharge by cause: loss of supply pressure, cold end of the property table, or time limit.

    After a loss of pressure, the bottle is "too cold" if it could still deliver at room temperature, and "empty"
    otherwise.
    """
    usable = max(0.0, mass - smallest_mass_when_warm(bottle, draw))
    remaining = f"{mass * GRAMS_PER_KILOGRAM:.3g} g are left"
    warm = f"{usable * GRAMS_PER_KILOGRAM:.3g} g of this would be usable at room temperature"
    if stopped_by == "time":
        return DischargeEnd(
            TIME_IS_UP, f"the supply pressure was maintained for the whole requested time; {remaining}", mass, usable
        )
    if stopped_by == "frozen":
        cold = "the liquid begins to freeze (dry ice)" if has_liquid(bottle.fluid.table) else "the gas is too cold"
        return DischargeEnd("frozen", f"{cold}, and the property table ends here; {remaining}, {warm}", mass, usable)
    pressure_margin, flow_margin = reserves(bottle, draw, content.pressure, content.temperature)
    # Both are fractions, so that the smaller one says what went short first.
    is_pressure = pressure_margin <= flow_margin
    short = "maintain the supply pressure" if is_pressure else "drive the largest flow through the regulator"
    why = f"its pressure is too low to {short}"
    # What a warm bottle would still give decides between the two: cold is mended by waiting, empty is not.
    if usable > _NEXT_TO_NOTHING * bottle.mass:
        return DischargeEnd("too cold", f"the bottle is too cold: {why}; {remaining}, {warm}", mass, usable)
    return DischargeEnd("empty", f"the bottle is empty: {why}, even at room temperature; {remaining}", mass, usable)


MAXIMUM_INTERVALS = 2000
"""Largest number of walking and resting intervals of a schedule; each is integrated separately."""
SAMPLES = 1001
"""Number of samples of the recording of a discharge."""
_RELATIVE, _ABSOLUTE = 1e-7, (1e-10, 1e-4, 1e-6, 1e-10, 1e-4, 1e-4)
"""Tolerances of the ODE solver: relative [-], and absolute for each component of the state [SI]."""
_ABOVE_FREEZING = 0.02
"""Temperature [K] above the cold end of the property table at which a run stops, to stay within the table."""


@dataclass(frozen=True, slots=True)
class _Interval:
    """Interval of a discharge with a constant gas flow ``draw`` [kg/s], from ``start`` to ``end`` [s].

    ``solution`` is the state as a function of time and ``last`` the state at the end; ``stopped_by`` is the reason of
    an early end, or None. The state consists of mass [kg] and energy [J] of the content, temperature of the wall [K],
    and the cumulative gas [kg], enthalpy [J] and heat from the room [J] across the boundary.
    """

    start: float
    end: float
    draw: float
    solution: Callable[[Any], Any]
    last: Floats
    stopped_by: Stop | None


class _Balance(NamedTuple):
    """Mass and energy balance of bottle and wall over a run.

    Across the boundary: gas drawn [kg], its enthalpy [J], heat from the room [J]. Changes inside: mass of the content
    [kg], energy of the content [J], energy of the wall [J].
    """

    drawn_mass: float
    outflow_energy: float
    room_heat: float
    mass_change: float
    content_energy_change: float
    wall_energy_change: float


@dataclass(frozen=True)
class Discharge:
    """Discharge of a bottle: walking time and total time [s], strides, ending, balance, and recording."""

    walking_time: float
    total_time: float
    strides: float
    ending: DischargeEnd
    balance: _Balance | SupplyBalance
    record: Callable[[], Recording] = field(repr=False, compare=False)

    @cached_property
    def recording(self) -> Recording:
        """Recording of the discharge, computed at the first access, which takes about as long as the simulation."""
        return self.record()


def check_schedule(schedule: Schedule) -> None:
    """Raise ParameterError for a schedule of walking and rest that cannot be simulated."""
    for name, least in (("walk", 1.0), ("longest", 1.0), ("rest", 0.0)):
        value = getattr(schedule, name)
        if not least <= value < math.inf:
            raise ParameterError(f"{name} = {value:g} s: must be finite and at least {least:g} s")
    if schedule.rest > 0.0 and 2.0 * schedule.longest / (schedule.walk + schedule.rest) > MAXIMUM_INTERVALS:
        raise ParameterError(
            f"walking {schedule.walk:g} s and resting {schedule.rest:g} s give more than {MAXIMUM_INTERVALS} "
            f"periods in {schedule.longest:g} s; increase walk or rest, or reduce longest"
        )


def discharge(bottle: Bottle, draw: GasDemand, schedule: Schedule) -> Discharge:
    """Return the discharge of a full bottle for a gas demand; while walking, the draw is the mean flow of a stride.

    The mean replaces the pulses because strides take about a second and bottles cool in minutes. The regulator is
    checked against the largest flow. Raises SimulationError if the solver fails.
    """
    check_schedule(schedule)
    content = bottle_content(bottle.fluid.table, bottle.mass, bottle.volume, bottle.room_temperature)
    if min(reserves(bottle, draw, content.pressure, content.temperature)) <= 0.0:
        most = flow_limit(bottle, content.pressure, content.temperature)
        raise ParameterError(
            f"the largest flow is {shown_text(draw.peak_flow, 'kg/s', '.3g')}, but the regulator of the full bottle "
            f"passes at most {shown_text(most, 'kg/s', '.3g')}; increase regulator.area"
        )
    energy = content_energy(bottle.fluid.table, bottle.mass, bottle.volume, bottle.room_temperature)
    start = np.array([bottle.mass, energy, bottle.room_temperature, 0.0, 0.0, 0.0])
    intervals: list[_Interval] = []
    time, values, walking = 0.0, start, True
    reason: Stop | None = None
    while reason is None:
        # Walking and resting take turns; without a rest there is one interval.
        length = schedule.longest if schedule.rest == 0.0 else (schedule.walk if walking else schedule.rest)
        end = min(time + length, schedule.longest)
        interval = _solve_interval(bottle, draw, time, end, values, walking)
        intervals.append(interval)
        time, values, walking = interval.end, interval.last, not walking
        reason = interval.stopped_by or ("time" if time >= schedule.longest else None)
    last = intervals[-1].last
    walked = sum(interval.end - interval.start for interval in intervals if interval.draw > 0.0)
    change = last - start
    balance = _Balance(
        drawn_mass=float(last[3]),
        outflow_energy=float(last[4]),
        room_heat=float(last[5]),
        mass_change=float(change[0]),
        content_energy_change=float(change[1]),
        wall_energy_change=float(change[2]) * bottle.wall.wall_heat_capacity,
    )
    return Discharge(
        walking_time=walked,
        total_time=intervals[-1].end,
        strides=walked / draw.stride_time,
        ending=ending(bottle, draw, float(last[0]), content_of(bottle, float(last[0]), float(last[1])), reason),
        balance=balance,
        record=partial(_recording, bottle, intervals),
    )


def discharge_of_life(life: BottleLife, draw: GasDemand) -> Discharge:
    """Return the discharge of a bottle from the simulation of a walk that emptied it."""
    course = life.course
    ended, bottle = course.ending, course.supply.bottle
    usable = max(0.0, course.last.mass - smallest_mass_when_warm(bottle, draw))
    return Discharge(
        walking_time=life.walked,
        total_time=life.total,
        strides=life.strides,
        ending=DischargeEnd(
            TIME_IS_UP if ended.kind == WALKED else ended.kind, ended.message, course.last.mass, usable
        ),
        balance=course.balance,
        # Read where it is wanted; a function of its own could not be pickled.
        record=partial(getattr, course, "recording"),
    )


def _recording(bottle: Bottle, intervals: Sequence[_Interval]) -> Recording:
    """Return the recording of a discharge at uniformly spaced times, from the start to the exact end."""
    times = np.linspace(0.0, intervals[-1].end, SAMPLES)
    ends = np.array([interval.end for interval in intervals])
    # The last time may be beyond the last end by rounding.
    numbers = np.minimum(np.searchsorted(ends, times, side="left"), len(intervals) - 1)
    rows = np.array([intervals[number].solution(time) for number, time in zip(numbers, times, strict=True)])
    contents = [content_of(bottle, float(row[0]), float(row[1])) for row in rows]
    flows = [intervals[number].draw for number in numbers]
    supply = [
        delivered_pressure(bottle.regulator, content.pressure, flow)
        for content, flow in zip(contents, flows, strict=True)
    ]
    channels = {
        "bottle_mass": (rows[:, 0], "kg"),
        "bottle_temperature": ([content.temperature for content in contents], "K"),
        "wall_temperature": (rows[:, 2], "K"),
        "bottle_pressure": ([content.pressure for content in contents], "Pa"),
        "supply_pressure": (supply, "Pa"),
        "supplied_mass": (rows[:, 3], "kg"),
    }
    if has_liquid(bottle.fluid.table):
        channels["liquid_mass"] = ([content.liquid_mass for content in contents], "kg")
    named = {name: Channel(np.asarray(values, dtype=np.float64), unit) for name, (values, unit) in channels.items()}
    return Recording(f"bottle {bottle.name}", times, named, kind="simulated")


def content_of(bottle: Bottle, mass: float, energy: float) -> BottleContent:
    """Return the state of the content of the bottle for a mass [kg] and an internal energy [J]."""
    table = bottle.fluid.table
    return bottle_content(table, mass, bottle.volume, content_temperature(table, mass, bottle.volume, energy))


def _solve_interval(
    bottle: Bottle, draw: GasDemand, start: float, end: float, values: Floats, walking: bool
) -> _Interval:
    """Simulate one interval of walking or rest; walking ends early if the supply pressure is no longer maintained."""
    from scipy.integrate import solve_ivp

    flow = draw.mean_flow if walking else 0.0

    def rates(_time: float, y: Floats) -> list[float]:
        state = BottleState(float(y[0]), float(y[1]), float(y[2]))
        content = content_of(bottle, state.mass, state.energy)
        now = bottle_rates(content, state, flow, bottle.wall, bottle.room_temperature)
        inside = (now.mass_rate, now.content_energy_rate, now.wall_temperature_rate)
        return [*inside, flow, now.outflow_power, now.room_heat]

    def kelvins_above_freezing(_time: float, y: Floats) -> float:
        # The liquid freezes where its table begins; below, the table knows nothing of the gas either.
        freezing = bottle.fluid.table.temperatures[0]
        return content_of(bottle, float(y[0]), float(y[1])).temperature - freezing - _ABOVE_FREEZING

    def to_spare(_time: float, y: Floats) -> float:
        content = content_of(bottle, float(y[0]), float(y[1]))
        return min(reserves(bottle, draw, content.pressure, content.temperature))

    # An interval may begin without a reserve, and the solver finds crossings only.
    if walking and to_spare(start, values) <= 0.0:
        return _Interval(start, start, flow, lambda _times: values, values, "supply")
    events: list[Any] = [kelvins_above_freezing, *([to_spare] if walking else [])]
    for event in events:
        # It ends the interval where it falls through 0.
        event.terminal, event.direction = True, -1.0
    solution = solve_ivp(
        rates, (start, end), values, method="LSODA", events=events, dense_output=True, rtol=_RELATIVE, atol=_ABSOLUTE
    )
    if solution.status < 0:
        raise SimulationError(f"the simulation of the bottle failed at {solution.t[-1]:.4g} s: {solution.message}")
    stopped: Stop = "frozen" if len(solution.t_events[0]) else "supply"
    last = np.asarray(solution.y[:, -1])
    return _Interval(start, float(solution.t[-1]), flow, solution.sol, last, stopped if solution.status == 1 else None)
