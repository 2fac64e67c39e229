"""A walk on its bottle: the lanes and the supply, which meet every tenth of a second.

Chambers and lines move within milliseconds, bottle, regulator and hose within seconds. So the lanes run for a tenth of
a second with what the supply offers at its beginning, and the supply follows with the gas that the regulator let
through in it; they meet more often where little is left. Nothing is compiled for it: what a supply offers are
parameters of any program with lines. The walk ends where the bottle no longer feeds it.
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
from ppafo.walking.bottle.course import DIVERGED, UNITS, WALKED, EndKind, SupplyCourse, SupplyEnding
from ppafo.walking.bottle.supply import BottleSupply

REGULATED, _LINE = "line_state.regulated_mass", "line_state.mass_1"
"""Rows of the gas that went through the regulator of a line, and of that in it [kg]."""

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
"""Flow [kg/s] that a regulator which passes nothing is taken to pass, so that nothing is divided by zero."""
_RESTING = 5.0
"""Seconds between two states of a bottle that is kept of a rest."""
_ABOVE_FREEZING = 0.02
"""Temperature [K] over the lowest of the fluid's table from which its content freezes."""
_OPEN = 0.999
"""Share of the seat that is open from which no ice is what makes the flow too small."""


class Schedule(NamedTuple):
    """Walking and resting in turn [s], for at most ``longest`` [s]; a rest of 0 s is walking without a break."""

    walk: float
    rest: float
    longest: float


@dataclass(frozen=True, slots=True)
class BottleLife:
    """A bottle walked to its end: its course over all of the time, time walked and in all [s].

    ``repeats`` is how many strides, or task sequences, were walked.
    """

    course: SupplyCourse
    walked: float
    total: float
    repeats: float


def run_on_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    progress: Callable[[float, float], None],
) -> tuple[BatchResult, SupplyCourse]:
    """Run a walk on a bottle, up to where that ends it; return its states and records, and the course of the bottle.

    ``device`` is what the run was planned for; ``stride_time`` [s] is how long a stride takes; ``progress`` gets the
    minutes done and in all.
    """
    use = _BottleInUse([_Meeting(0.0, supply.start(), supply.offers_first())])
    result, done = _use_bottle(run, device, supply, stride_time, use, progress)
    count = batch_of(run).clock.step_count
    record = result.record if done == count else result.record[: (done - 1) // int(run.record_every) + 1]
    return BatchResult(result.states, record), _course_of_use(supply, use)


def life_on_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    schedule: Schedule,
    progress: Callable[[float, float], None] = lambda _done, _total: None,
) -> BottleLife:
    """Walk until the bottle ends it: the run of ``run_on_bottle``, with rests, repeated where it is a task sequence.

    The run is planned for as long as may be walked at most.
    """
    use = _BottleInUse([_Meeting(0.0, supply.start(), supply.offers_first())])
    while use.ending is None and use.walked + use.rested < schedule.longest:
        _use_bottle(run, device, supply, stride_time, use, progress, schedule)
    length = batch_of(run).clock.step_count * run.step if run.program.takes_task_sequence else stride_time
    return BottleLife(_course_of_use(supply, use), use.walked, use.walked + use.rested, use.walked / length)


class _Meeting(NamedTuple):
    """When bottle and device meet [s], the state of the supply then, and what it offers until they meet again."""

    time: float
    state: SupplyState
    offered: SupplyNow


@dataclass(slots=True)
class _BottleInUse:
    """A bottle in use: where it met the device, time walked and rested [s], gas through its regulator [kg]."""

    met: list[_Meeting]
    walked: float = 0.0
    rested: float = 0.0
    regulated: float = 0.0
    ending: SupplyEnding | None = None


def _course_of_use(supply: BottleSupply, use: _BottleInUse) -> SupplyCourse:
    """Course of a bottle in use; a use that nothing ended went to the end of the walk."""
    last = use.met[-1]
    over = f"the walk is over, and {_grams(last.state.mass)} are left in the bottle"
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
        ending=use.ending or SupplyEnding(WALKED, over, last.time),
    )


def _use_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    use: _BottleInUse,
    progress: Callable[[float, float], None],
    schedule: Schedule | None = None,
) -> tuple[BatchResult, int]:
    """Walk a run on a bottle in ``use``, which is brought up to date; return its rows and the steps that were done."""
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
            message = f"the walk diverged, and {_grams(meeting.state.mass)} were left in the bottle before"
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
    """Return the supply after ``duration`` [s] in which a mass was drawn [kg], at a time [s]."""
    table, content = supply.bottle.fluid.table, meeting.offered.content
    state = advance_supply(table, supply.line, supply.bottle.supply, meeting.state, content, drawn, duration)
    return _Meeting(time, state, supply.offers(state, content.temperature, drawn))


@dataclass(frozen=True, slots=True)
class _Lanes:
    """The lanes as their supply sees them: rows that follow it, and the numbers with gas of the ``start`` [K].

    ``effects`` are the effects of the ``device`` that are on, whose rows may be of the temperature of its gas.
    """

    rows: list[int]
    plant: PlantParameters
    volume: float
    start: float
    device: Device
    effects: tuple[Effect, ...]

    @classmethod
    def of(cls, run: Run, device: Device, start: float) -> "_Lanes":
        """Return the lanes of a run, whose numbers were planned for gas of a temperature [K]."""
        assert run.lines is not None, "a bottle feeds lines"
        effects = tuple(effect for effect in run.program.effects if effect.is_of_device)
        names = row_numbers(run.program.parameter_rows())
        of_effects = [path for effect in effects for path in leaf_paths(effect.parameters, effect.name)]
        rows = [names[path] for path in (*_PARAMETERS, *of_effects)]
        return cls(rows, run.plant, run.lines.parameters.volume_1, start, device, effects)

    def parameters(self, now: SupplyNow) -> Floats:
        """Return the parameters that follow the supply.

        Gas of its temperature, flows through openings with 1 over its root, and the regulator; then the rows of the
        effects, prepared anew for gas of that temperature.
        """
        plant, warmth = self.plant, now.gas_temperature / self.start
        # Mass flow at given pressures goes with one over the root of the temperature of the gas.
        slower = 1.0 / math.sqrt(warmth)
        product, valve, leak = plant.gas_product, plant.valve_conductance, plant.leak_conductance
        own = [product * warmth, valve * slower, leak * slower, now.set_pressure, now.largest_flow]
        device = replace(self.device, gas=replace(self.device.gas, temperature=now.gas_temperature))
        return np.array([*own, *(number for effect in self.effects for number in leaves(effect_row(effect, device)))])

    def gauge(self, mass: float, now: SupplyNow) -> float:
        """Return the gauge pressure of the line with a mass [kg] in it over that to which the regulator is set [-]."""
        plant = self.plant
        pressure = mass * plant.gas_product * now.gas_temperature / (self.start * self.volume)
        return (pressure - plant.atmospheric_pressure) / (plant.supply_pressure - plant.atmospheric_pressure)


def _ending(supply: BottleSupply, meeting: _Meeting, reached: float) -> SupplyEnding | None:
    """End of a walk by its supply, None while it goes on; ``reached``: recent largest gauge pressure over the set."""
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
        kind: EndKind = "iced"
        why = f"dry ice in the seat leaves {100.0 * open_share(bottle.supply, state.ice):.0f} % of it open"
        return SupplyEnding(kind, f"the regulator is iced: {why}, and {short}; {left} are left", time)
    if now.set_pressure >= bottle.regulator.set_pressure:
        return SupplyEnding("too little flow", f"the regulator passes too little, and {short}; {left} are left", time)
    # The same gas at room temperature tells a cold bottle from an empty one.
    warm = bottle_content(bottle.fluid.table, state.mass, bottle.volume, bottle.room_temperature).pressure
    if warm - bottle.regulator.pressure_margin >= bottle.regulator.set_pressure:
        degrees = f"{now.content.temperature - 273.15:.0f} degC"
        return SupplyEnding("too cold", f"the bottle is too cold, {degrees}, and {short}; {left} are left", time)
    return SupplyEnding("empty", f"the bottle is empty, and {short}; {left} are left", time)


def _grams(mass: float) -> str:
    """Return a mass [kg] as it is said."""
    return f"{mass * GRAMS_PER_KILOGRAM:.3g} g"
