"""Simulation of the discharge of a full bottle until it no longer maintains the supply pressure."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property, partial
from typing import Any, Literal, NamedTuple

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.documents.json_text import fields_of
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
from ppafo.units.shown import shown_text, units_beside
from ppafo.version import __version__
from ppafo.walking.bottle.coupling import Schedule
from ppafo.walking.bottle.supply import SET_PRESSURE

TIME_IS_UP = "time is up"
SAMPLES = 1001
"""Number of samples of the recording of a discharge."""
_NEXT_TO_NOTHING = 0.01
"""Usable gas at room temperature, as a fraction of a full bottle, below which a bottle counts as empty [-]."""
_RELATIVE, _ABSOLUTE = 1e-7, (1e-10, 1e-4, 1e-6, 1e-10, 1e-4, 1e-4)
"""Tolerances of the ODE solver: relative [-], and absolute for each component of the state [SI]."""
_ABOVE_FREEZING = 0.02
"""Temperature [K] above the cold end of the property table at which a run stops, to stay within the table."""
_BALANCE = ("drawn_mass", "outflow_energy", "room_heat", "mass_change", "content_energy_change", "wall_energy_change")
"""Mass [kg] and energy [J] across the boundary, and their changes inside."""
_Stop = Literal["supply", "frozen", "time"]
"""Reason for the end of a discharge: supply pressure lost, cold end of the property table, or time limit."""


@dataclass(frozen=True)
class Endurance:
    """Duration of a full bottle for a gas use: inputs and result, in SI.

    - ``bottle``, ``schedule``: the bottle; times of walking and rest [s]
    - ``origin``: origin of the gas use; ``counted``: "stride", or "repetition" if a whole recording is repeated
    - ``mass_per_stride``, ``stride_time``: gas use [kg], [s]; ``mean_flow``, ``peak_flow``: while walking [kg/s]
    - ``walking_time``, ``total_time``, ``strides``: duration [s], [s] and number of strides
    - ``strides_when_warm``: strides from a bottle at constant room temperature, to show the effect of cooling
    - ``ending``, ``message``: reason of the end, and its explanation
    - ``mass_left``, ``usable_when_warm``: gas left in the bottle, and the part of it usable at room temperature [kg]
    - ``balance``: mass [kg] and energy [J] across the boundary, and their changes inside
    - ``shown``: display units by SI unit, of the device if it is known, otherwise of the bottle file
    """

    bottle: Bottle
    schedule: Schedule
    origin: str
    mass_per_stride: float
    stride_time: float
    mean_flow: float
    peak_flow: float
    walking_time: float
    total_time: float
    strides: float
    strides_when_warm: float
    ending: str
    message: str
    mass_left: float
    usable_when_warm: float
    balance: Mapping[str, float]
    shown: Mapping[str, str] = field(compare=False)
    record: Callable[[], Recording] = field(repr=False, compare=False)
    counted: str = "stride"

    @cached_property
    def recording(self) -> Recording:
        """State of the bottle over time, computed at the first access, which takes as long as the simulation."""
        return self.record()

    def json_document(self) -> dict[str, Any]:
        """Return the duration, its end and the bottle as plain data in SI units."""
        bottle, recording = self.bottle, self.recording
        return {
            "format": "ppafo bottle",
            "schema_version": 2,
            "kind": "simulated",
            "ppafo": __version__,
            **{each.name: getattr(self, each.name) for each in fields(self) if each.compare},
            "coldest_temperature": float(np.min(recording["bottle_temperature"])),
            "at_end": {name: float(recording[name][-1]) for name in recording.names},
            "schedule": self.schedule._asdict(),
            "bottle": {
                **fields_of(bottle, "name", "title", "volume"),
                "fluid": bottle.fluid.name,
                "properties": bottle.fluid.source,
                "gas_mass": bottle.mass,
                "values": {path: asdict(entry) for path, entry in bottle.entries.items()},
            },
        }


class _Interval(NamedTuple):
    """Interval of a discharge with a constant gas flow ``draw`` [kg/s]; ``stopped_by`` is the reason of an early end.

    The state is mass [kg] and energy [J] of the content, temperature of the wall [K], and the cumulative gas [kg],
    enthalpy [J] and heat from the room [J] across the boundary.
    """

    start: float
    end: float
    draw: float
    solution: Callable[[Any], Any]
    last: Floats
    stopped_by: _Stop | None


def discharge(
    bottle: Bottle,
    mass_per_stride: float,
    stride_time: float,
    peak_flow: float,
    schedule: Schedule,
    origin: str = "numbers given",
) -> Endurance:
    """Return the duration of a full bottle for a gas use [kg], [s], [kg/s]; while walking, the draw is the mean flow.

    The mean replaces the pulses because strides take about a second and bottles cool in minutes. The regulator is
    checked against the largest flow. Raises SimulationError if the solver fails.
    """
    mean_flow = mass_per_stride / stride_time
    content = bottle_content(bottle.fluid.table, bottle.mass, bottle.volume, bottle.room_temperature)
    if min(reserves(bottle, peak_flow, content.pressure, content.temperature)) <= 0.0:
        most = flow_limit(bottle, content.pressure, content.temperature)
        raise ParameterError(
            f"the largest flow is {shown_text(peak_flow, 'kg/s', '.3g')}, but the regulator of the full bottle "
            f"passes at most {shown_text(most, 'kg/s', '.3g')}; increase regulator.area"
        )
    energy = content_energy(bottle.fluid.table, bottle.mass, bottle.volume, bottle.room_temperature)
    start = np.array([bottle.mass, energy, bottle.room_temperature, 0.0, 0.0, 0.0])
    intervals: list[_Interval] = []
    time, values, walking = 0.0, start, True
    reason: _Stop | None = None
    while reason is None:
        # Walking and resting take turns; without a rest there is one interval.
        length = schedule.longest if schedule.rest == 0.0 else (schedule.walk if walking else schedule.rest)
        end, flow = min(time + length, schedule.longest), mean_flow * walking
        interval = _solve_interval(bottle, flow, peak_flow, time, end, values)
        intervals.append(interval)
        time, values, walking = interval.end, interval.last, not walking
        reason = interval.stopped_by or ("time" if time >= schedule.longest else None)
    walked = sum(interval.end - interval.start for interval in intervals if interval.draw > 0.0)
    mass, needed = float(values[0]), smallest_mass_when_warm(bottle, peak_flow)
    usable, change, wall = max(0.0, mass - needed), (values - start).tolist(), bottle.wall
    ending, message = _end(bottle, peak_flow, content_of(bottle, mass, float(values[1])), mass, usable, reason)
    return Endurance(
        bottle=bottle,
        schedule=schedule,
        origin=origin,
        mass_per_stride=mass_per_stride,
        stride_time=stride_time,
        mean_flow=mean_flow,
        peak_flow=peak_flow,
        walking_time=walked,
        total_time=time,
        strides=walked / stride_time,
        strides_when_warm=(bottle.mass - needed) / mass_per_stride,
        ending=ending,
        message=message,
        mass_left=mass,
        usable_when_warm=usable,
        balance=dict(zip(_BALANCE, (*change[3:], *change[:2], change[2] * wall.wall_heat_capacity), strict=True)),
        shown=units_beside("Pa_a", bottle.entries[SET_PRESSURE].unit),
        record=partial(_recording, bottle, intervals),
    )


def reserves(bottle: Bottle, peak_flow: float, pressure: float, temperature: float) -> tuple[float, float]:
    """Return the relative margins of pressure and flow [-] at the largest flow; below 0 the supply pressure is lost.

    The pressure margin is the excess over the regulator's need divided by the set pressure; the flow margin is the flow
    limit of the regulator divided by the largest flow, minus 1.
    """
    to_spare = pressure_reserve(bottle.regulator, pressure, peak_flow) / bottle.regulator.set_pressure
    return to_spare, flow_limit(bottle, pressure, temperature) / peak_flow - 1.0


def flow_limit(bottle: Bottle, pressure: float, temperature: float) -> float:
    """Return the largest flow [kg/s] of the regulator at a pressure [Pa] and a temperature [K] in the bottle."""
    gas_constant = bottle.fluid.table.gas_constant
    return regulator_flow_limit(bottle.regulator, pressure, temperature, bottle.heat_capacity_ratio, gas_constant)


def smallest_mass_when_warm(bottle: Bottle, peak_flow: float, enough: float = math.inf) -> float:
    """Return the smallest mass of gas [kg] with which the bottle maintains the supply pressure at room temperature.

    ``enough`` is a pressure in the bottle [Pa absolute] that was seen to suffice.
    """
    table, room = bottle.fluid.table, bottle.room_temperature
    low, high = 0.0, min(bottle.mass, bottle.volume * densest_gas(table, room))
    # Halved until nothing is left to halve: the reserve grows with the mass, though not smoothly where liquid begins.
    for _ in range(60):
        middle = 0.5 * (low + high)
        pressure = bottle_content(table, middle, bottle.volume, room).pressure
        if min(reserves(bottle, peak_flow, pressure, room)) < 0.0 and pressure < enough:
            low = middle
        else:
            high = middle
    return high


def _end(
    bottle: Bottle, peak_flow: float, content: BottleContent, mass: float, usable: float, stopped_by: _Stop
) -> tuple[str, str]:
    """Return reason and explanation of an end: loss of supply pressure, cold end of the property table, or time limit.

    After a loss of pressure, the bottle is "too cold" if it could still deliver at room temperature, and "empty"
    otherwise.
    """
    remaining = f"{mass * GRAMS_PER_KILOGRAM:.3g} g are left"
    warm = f"{usable * GRAMS_PER_KILOGRAM:.3g} g of this would be usable at room temperature"
    if stopped_by == "time":
        return TIME_IS_UP, f"the supply pressure was maintained for the whole requested time; {remaining}"
    if stopped_by == "frozen":
        cold = "the liquid begins to freeze (dry ice)" if has_liquid(bottle.fluid.table) else "the gas is too cold"
        return "frozen", f"{cold}, and the property table ends here; {remaining}, {warm}"
    pressure_margin, flow_margin = reserves(bottle, peak_flow, content.pressure, content.temperature)
    # Both are fractions, so that the smaller one says what went short first.
    is_pressure = pressure_margin <= flow_margin
    short = "maintain the supply pressure" if is_pressure else "drive the largest flow through the regulator"
    why = f"its pressure is too low to {short}"
    # What a warm bottle would still give decides between the two: cold is mended by waiting, empty is not.
    if usable > _NEXT_TO_NOTHING * bottle.mass:
        return "too cold", f"the bottle is too cold: {why}; {remaining}, {warm}"
    return "empty", f"the bottle is empty: {why}, even at room temperature; {remaining}"


def _recording(bottle: Bottle, intervals: Sequence[_Interval]) -> Recording:
    """Return the recording of a discharge at uniformly spaced times, from the start to the exact end."""
    times = np.linspace(0.0, intervals[-1].end, SAMPLES)
    ends = np.array([interval.end for interval in intervals])
    # The last time may be beyond the last end by rounding.
    numbers = np.minimum(np.searchsorted(ends, times, side="left"), len(intervals) - 1)
    rows = np.array([intervals[number].solution(time) for number, time in zip(numbers, times, strict=True)])
    contents = [content_of(bottle, float(row[0]), float(row[1])) for row in rows]
    flows = [intervals[number].draw for number in numbers]
    pressures = [content.pressure for content in contents]
    channels = {
        "bottle_mass": (rows[:, 0], "kg"),
        "bottle_temperature": ([content.temperature for content in contents], "K"),
        "wall_temperature": (rows[:, 2], "K"),
        "bottle_pressure": (pressures, "Pa"),
        "supply_pressure": (list(map(partial(delivered_pressure, bottle.regulator), pressures, flows)), "Pa"),
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
    bottle: Bottle, flow: float, peak_flow: float, start: float, end: float, values: Floats
) -> _Interval:
    """Simulate one interval of walking or, without flow, of rest; walking ends early if the supply pressure is lost."""
    from scipy.integrate import solve_ivp

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
        return min(reserves(bottle, peak_flow, content.pressure, content.temperature))

    # An interval may begin without a reserve, and the solver finds crossings only.
    if flow > 0.0 and to_spare(start, values) <= 0.0:
        return _Interval(start, start, flow, lambda _times: values, values, "supply")
    events: list[Any] = [kelvins_above_freezing, *([to_spare] if flow > 0.0 else [])]
    for event in events:
        # It ends the interval where it falls through 0.
        event.terminal, event.direction = True, -1.0
    solution = solve_ivp(
        rates, (start, end), values, method="LSODA", events=events, dense_output=True, rtol=_RELATIVE, atol=_ABSOLUTE
    )
    if solution.status < 0:
        raise SimulationError(f"the simulation of the bottle failed at {solution.t[-1]:.4g} s: {solution.message}")
    stopped: _Stop = "frozen" if len(solution.t_events[0]) else "supply"
    last = np.asarray(solution.y[:, -1])
    return _Interval(start, float(solution.t[-1]), flow, solution.sol, last, stopped if solution.status == 1 else None)
