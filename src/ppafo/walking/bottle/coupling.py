"""Co-simulation of a walk and its gas supply, with data exchange every tenth of a second.

Chambers and lines respond within milliseconds; bottle, regulator and hose within seconds. The walk is therefore
advanced by a tenth of a second with the supply pressure and the largest flow from the start of the interval, then the
supply is advanced with the gas mass that the regulator passed in that interval. The intervals are shorter when little
gas is left. No program is compiled for a bottle: set pressure, gas temperature and largest flow are parameters of any
program with supply lines. The walk ends when the bottle can no longer supply the device.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.engine.lanes import BatchResult, Floats, begin_block, effort_for
from ppafo.engine.rows import leaf_paths, leaves, row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.model.cold_gas import SupplyNow, SupplyState, advance_supply, open_share
from ppafo.model.effects.kind import Effect
from ppafo.model.plant import PlantParameters
from ppafo.model.source import bottle_content, has_liquid
from ppafo.parameters.device import Device
from ppafo.parameters.effects import effect_row
from ppafo.walking.bottle.course import DIVERGED, UNITS, WALKED, SupplyCourse, SupplyEnding
from ppafo.walking.bottle.supply import BottleSupply

REGULATED, _LINE = "line_state.regulated_mass", "line_state.mass_1"
"""Paths of the rows for the gas through a line's regulator, and for the gas in the line [kg]."""

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

_LARGEST_DRAW = 0.05
"""Fraction of the gas in the bottle that may be drawn between two data exchanges, while the supply is constant."""

_LEAST_FLOW = 1.0e-12
"""Smallest assumed regulator flow [kg/s], which avoids a division by zero."""
_RESTING = 5.0
"""Interval between two states of a bottle during a rest [s]."""
_ABOVE_FREEZING = 0.02
"""Difference [K] to the lowest temperature of the property table below which the fluid counts as freezing."""
_OPEN = 0.999
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
    use = _BottleInUse([_Meeting(0.0, supply.start(), supply.offers_first())])
    result, done = _use_bottle(run, device, supply, stride_time, use, progress, schedule)
    while schedule is not None and use.ending is None and use.walked + use.rested < schedule.longest:
        result, done = _use_bottle(run, device, supply, stride_time, use, progress, schedule)
    is_whole = done == batch_of(run).clock.step_count
    record = result.record if is_whole else result.record[: (done - 1) // int(run.record_every) + 1]
    return BatchResult(result.states, record), _course_of_use(supply, use)


class _Meeting(NamedTuple):
    """Data exchange between bottle and device: time [s], state of the supply, and its output until the next one."""

    time: float
    state: SupplyState
    offered: SupplyNow


@dataclass(slots=True)
class _BottleInUse:
    """Bottle during a walk: exchanges with the device, time walked and rested [s], gas through the regulator [kg]."""

    met: list[_Meeting]
    walked: float = 0.0
    rested: float = 0.0
    regulated: float = 0.0
    ending: SupplyEnding | None = None


def _course_of_use(supply: BottleSupply, use: _BottleInUse) -> SupplyCourse:
    """Return the state of a bottle over a walk; without another ending, the supply lasted until the end of the walk."""
    last = use.met[-1]
    over = f"the walk is complete, and {_grams(last.state.mass)} are left in the bottle"
    # In the order of ``UNITS``.
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
            open_share(supply.bottle.supply, state.ice),
        )
        for _, state, offered in use.met
    ]
    values = dict(zip(UNITS, np.array(rows).T.copy(), strict=True))
    if not has_liquid(supply.bottle.fluid.table):
        del values["liquid_mass"]
    return SupplyCourse(
        supply=supply,
        times=np.array([meeting.time for meeting in use.met]),
        values=values,
        first=use.met[0].state,
        last=last.state,
        regulated=use.regulated,
        walked=use.walked,
        rested=use.rested,
        ending=use.ending or SupplyEnding(WALKED, over, last.time),
    )


def _use_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    use: _BottleInUse,
    progress: Callable[[float, float], None],
    schedule: Schedule | None,
) -> tuple[BatchResult, int]:
    """Simulate a run on a bottle and update ``use`` in place; return the rows of the run and the number of steps."""
    batch = batch_of(run)
    count = batch.clock.step_count
    block = begin_block(batch, effort_for(batch))
    states = row_numbers(batch.program.state_rows())
    regulated, lines = ([row for path, row in states.items() if path.endswith(end)] for end in (REGULATED, _LINE))
    every, walked_before = max(1, round(supply.coupling / run.step)), use.walked
    lanes = _Lanes.of(run, device, use.met[0].offered.gas_temperature)
    # The line falls for a moment at each draw: its best over some strides counts, of two meetings at least.
    window = max(2, math.ceil(_STRIDES * stride_time / (every * run.step))) * every
    # The line starts at the set pressure.
    gauges = [(0, 1.0)]
    done, first = 0, float(batch.states[regulated, 0].sum())
    before, until_rest = first, count
    if schedule is not None and schedule.rest > 0.0:
        until_rest = max(1, round((schedule.walk - use.walked % schedule.walk) / run.step))
    while use.ending is None and done < count:
        meeting = use.met[-1]
        # More often where much of what is left may flow out between two meetings.
        largest_flow = max(meeting.offered.largest_flow, _LEAST_FLOW)
        most = max(1, min(every, int(_LARGEST_DRAW * meeting.state.mass / (largest_flow * run.step))))
        steps = min(most, count - done, until_rest)
        block.set_parameters(lanes.rows, lanes.parameters(meeting.offered))
        block.advance(steps)
        done, until_rest = done + steps, until_rest - steps
        use.walked = walked_before + done * run.step
        time = use.walked + use.rested
        progress(use.walked / 60.0, (walked_before + count * run.step) / 60.0)
        # Divergence first: a gas mass that is no number must not reach the supply.
        failed = float(block.states[states["result.failure_time"], 0])
        if failed < NEVER_FAILED or not bool(np.isfinite(block.states).all()):
            message = f"the walk diverged with {_grams(meeting.state.mass)} left in the bottle"
            use.ending = SupplyEnding(DIVERGED, message, min(time, failed))
            break
        regulated_mass = float(block.states[regulated, 0].sum())
        drawn, before = regulated_mass - before, regulated_mass
        use.met.append(_met_again(supply, meeting, drawn, steps * run.step, time))
        offered = use.met[-1].offered
        gauges = [
            *((step, gauge) for step, gauge in gauges if step > done - window),
            (done, min(lanes.gauge(float(block.states[line, 0]), offered) for line in lines)),
        ]
        use.ending = _ending(supply, use.met[-1], max(gauge for _, gauge in gauges))
        if schedule is not None and use.ending is None:
            if time >= schedule.longest:
                break
            if until_rest <= 0 and schedule.rest > 0.0:
                rest = min(schedule.rest, schedule.longest - time)
                parts = max(1, math.ceil(rest / _RESTING))
                # The bottle warms, and no gas flows.
                for _ in range(parts):
                    meeting = use.met[-1]
                    use.met.append(_met_again(supply, meeting, 0.0, rest / parts, meeting.time + rest / parts))
                use.rested += rest
                # Gauges of before the rest say nothing of the bottle that has warmed in it.
                gauges, until_rest = [(done, 1.0)], round(schedule.walk / run.step)
                if use.walked + use.rested >= schedule.longest:
                    break
    use.regulated += before - first
    return block.result(), done


def _met_again(supply: BottleSupply, meeting: _Meeting, drawn: float, duration: float, time: float) -> _Meeting:
    """Return the exchange at ``time`` [s], after the device has drawn a mass ``drawn`` [kg] over ``duration`` [s]."""
    table, content = supply.bottle.fluid.table, meeting.offered.content
    state = advance_supply(table, supply.line, supply.bottle.supply, meeting.state, content, drawn, duration)
    return _Meeting(time, state, supply.offers(state, content.temperature, drawn))


@dataclass(frozen=True, slots=True)
class _Lanes:
    """Parameters of the walk program that depend on the state of the supply.

    ``rows`` are the rows of these parameters in the program. ``plant`` has the values for gas at the temperature
    ``start`` [K], ``volume`` is the volume of the line [m^3]. ``effects`` are the active effects of the ``device``,
    whose parameters may depend on the gas temperature.
    """

    rows: list[int]
    plant: PlantParameters
    volume: float
    start: float
    device: Device
    effects: tuple[Effect, ...]

    @classmethod
    def of(cls, run: Run, device: Device, start: float) -> "_Lanes":
        """Return the supply-dependent parameters of a run that was planned for gas at the temperature ``start`` [K]."""
        assert run.lines is not None, "a bottle feeds lines"
        effects = tuple(effect for effect in run.program.effects if effect.is_of_device)
        names = row_numbers(run.program.parameter_rows())
        of_effects = [path for effect in effects for path in leaf_paths(effect.parameters, effect.name)]
        rows = [names[path] for path in (*_PARAMETERS, *of_effects)]
        return cls(rows, run.plant, run.lines.parameters.volume_1, start, device, effects)

    def parameters(self, now: SupplyNow) -> Floats:
        """Return the values of the parameters that depend on the supply, in the order of ``rows``.

        The gas product is proportional to the gas temperature T, the conductances of valve and leak to 1/sqrt(T). Set
        pressure and largest flow of the regulator follow, then the parameters of the effects at the temperature T.
        """
        plant, warmth = self.plant, now.gas_temperature / self.start
        # Mass flow at given pressures goes with one over the root of the temperature of the gas.
        slower = 1.0 / math.sqrt(warmth)
        product, valve, leak = plant.gas_product, plant.valve_conductance, plant.leak_conductance
        own = [product * warmth, valve * slower, leak * slower, now.set_pressure, now.largest_flow]
        device = replace(self.device, gas=replace(self.device.gas, temperature=now.gas_temperature))
        return np.array([*own, *(number for effect in self.effects for number in leaves(effect_row(effect, device)))])

    def gauge(self, mass: float, now: SupplyNow) -> float:
        """Return the gauge pressure of the line, which contains a mass [kg], divided by the set gauge pressure [-]."""
        plant = self.plant
        pressure = mass * plant.gas_product * now.gas_temperature / (self.start * self.volume)
        return (pressure - plant.atmospheric_pressure) / (plant.supply_pressure - plant.atmospheric_pressure)


def _ending(supply: BottleSupply, meeting: _Meeting, reached: float) -> SupplyEnding | None:
    """Return the end of a walk caused by its supply, or None if the walk continues.

    ``reached`` is the largest recent gauge pressure of the line divided by the set gauge pressure [-].
    """
    time, state, now = meeting
    bottle = supply.bottle
    left = _grams(state.mass)
    # Freezing first: it ends the walk even at full torque.
    if now.content.temperature <= bottle.fluid.table.temperatures[0] + _ABOVE_FREEZING:
        return SupplyEnding("frozen", f"the fluid in the bottle freezes, with {left} left", time)
    if reached >= supply.least_torque:
        return None
    short = f"the supply gives less than {100.0 * supply.least_torque:.0f} % of the torque"
    # The bottle still has the pressure: the flow is too small, by ice or by the seat itself.
    if now.set_pressure >= bottle.regulator.set_pressure and open_share(bottle.supply, state.ice) < _OPEN:
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
