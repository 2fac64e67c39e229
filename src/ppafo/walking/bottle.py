"""The bottle that a walking device hangs on: what a walk file says of it, and a walk in which both are coupled.

Chambers and lines move within milliseconds, bottle, regulator and hose within seconds. So the lanes run for a tenth of
a second with what the supply offers at its beginning, and the supply follows with the gas that the regulator let
through in it; they meet more often where little is left. Nothing is compiled for it: what a supply offers are
parameters of any program with lines. The walk ends where the bottle no longer feeds it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.engine.lanes import BatchResult, Floats, begin_block
from ppafo.engine.rows import leaf_paths, leaves, row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import ParameterError, ScenarioError, refused_as
from ppafo.model.cold_gas import (
    DRY_ICE,
    Isobar,
    SupplyNow,
    SupplyState,
    advance_supply,
    following_rates,
    isobar,
    open_share,
    supply_now,
)
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import Effect
from ppafo.model.plant import PlantParameters
from ppafo.model.source import bottle_content, content_energy, densest_gas, has_liquid, liquid_density
from ppafo.parameters.bottles.bottle import PATHS, Bottle, is_of_catalogue, load_bottle
from ppafo.parameters.device import Device
from ppafo.parameters.parameter_set import Entry
from ppafo.parameters.plant import effect_row
from ppafo.report.display_units import display_value
from ppafo.report.display_units import quantity_text as shown_text
from ppafo.signals import Channel, Recording
from ppafo.simulation.declaration import SUPPLY_LINE, THERMAL, Reading, kind_at, quantity_text, value_at
from ppafo.simulation.scenario import SupplyLine
from ppafo.units import format_quantity, to_si

BOTTLE = "bottle"
BOTTLE_NAME = f"{BOTTLE}.name"
FILL = Quantity("fill", "1", "gas in the bottle over a full one's", 1.0, 0.0, 1.0, minimum_allowed=False)
TEMPERATURE = Quantity("temperature", "K", "temperature of bottle, regulator and hose at the start", None, 200.0, 400.0)
LEAST_TORQUE = Quantity("least_torque", "1", "torque that ends the walk, over that at the set pressure", 0.9, 0.0, 1.0)
COUPLING = Quantity("coupling", "s", "time between two exchanges of bottle and device", 0.1, 1.0e-3, 1.0)
_SET_PRESSURE = "regulator.set_pressure"
BOTTLE_OVERRIDES = {path if path.startswith(f"{BOTTLE}.") else f"{BOTTLE}.{path}": path for path in PATHS}
"""What an override may set of the bottle's own file, ``bottle.volume`` and ``bottle.regulator.area``, by its path."""

BOTTLE_NUMBERS = (FILL, TEMPERATURE, LEAST_TORQUE, COUPLING)

_FOLLOWS = {
    "content": f"set {BOTTLE}.gas_mass higher, or {BOTTLE}.content_heat_transfer lower",
    "wall": f"set {BOTTLE}.wall_heat_capacity higher",
    "regulator": f"set {BOTTLE}.regulator.heat_capacity higher",
    "hose": f"set {BOTTLE}.hose.heat_capacity higher",
}
"""What makes a part of the supply follow more slowly."""

_OWN = tuple(f"{SUPPLY_LINE}.plantarflexion.{name}" for name in ("droop", "largest_flow"))
"""What the bottle's own regulator says instead."""

_SAME_GAS, _SAME_PRESSURE = 1.0e-2, 2.0e-3
_FASTEST = 1.0e3
"""Rate [1/s] up to which a walk follows what warms and cools: within a millisecond, the step of the lanes."""

EndKind = Literal["walk's end", "empty", "too cold", "frozen", "iced", "too little flow", "diverged"]
WALKED: EndKind = "walk's end"
DIVERGED: EndKind = "diverged"

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
_RESTING = 5.0
"""Seconds between two states of a bottle that is kept of a rest."""
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


@dataclass(frozen=True, slots=True)
class BottleSupply:
    """The bottle that a walk hangs on, in SI: gas [kg] and temperature [K] at the start, ``coupling`` [s].

    ``line`` are the properties of the gas behind its regulator, which is set to the supply pressure of the device.
    ``least_torque`` is the torque over that at the set pressure [-] below which the walk ends.
    """

    bottle: Bottle
    line: Isobar
    mass: float
    temperature: float
    least_torque: float
    coupling: float

    def start(self) -> SupplyState:
        """Return the state at the start: all parts at one temperature, no ice."""
        energy = content_energy(self.bottle.fluid.table, self.mass, self.bottle.volume, self.temperature)
        return SupplyState(
            mass=self.mass,
            energy=energy,
            wall_temperature=self.temperature,
            body_temperature=self.temperature,
            hose_temperature=self.temperature,
            ice=0.0,
            outflow=0.0,
            delivered=0.0,
            room_heat=0.0,
        )

    def offers(self, state: SupplyState, near: float, mass: float) -> SupplyNow:
        """Return what the supply offers in a state whose content is ``near`` a temperature [K].

        ``mass`` [kg] is what the device drew in the last coupling.
        """
        return supply_now(self.bottle.fluid.table, self.line, self.bottle.supply, state, near, mass)

    def offers_first(self) -> SupplyNow:
        """Return what the supply offers the device at the start."""
        return self.offers(self.start(), self.temperature, 0.0)

    def fed(self, line: SupplyLine) -> SupplyLine:
        """Return the lines with the droop of the bottle's regulator, and with what it passes at the start."""
        droop, most = self.bottle.regulator.droop, self.offers_first().largest_flow
        return replace(line, plantarflexion=replace(line.plantarflexion, droop=droop, largest_flow=most))

    @property
    def assumed(self) -> dict[str, str]:
        """Return the values of the bottle that no source gives, by path, with the reason for each."""
        return {
            f"{BOTTLE}.{path}": f"{format_quantity(entry.value, entry.unit)}, assumed: {entry.source}"
            for path, entry in self.bottle.entries.items()
            if entry.origin == "assumed"
        }

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data in SI units, with the source of each value."""
        return {
            "name": self.bottle.name,
            "title": self.bottle.title,
            "gas_mass": self.mass,
            "temperature": self.temperature,
            "least_torque": self.least_torque,
            "coupling": self.coupling,
            "values": {path: entry.model_dump() for path, entry in self.bottle.entries.items()},
        }


def read_bottle(reading: Reading, device: Device, folder: Path) -> BottleSupply | None:
    """Return the bottle of a walk file, None where it has none; ScenarioError or ParameterError for a mistake."""
    section = value_at(reading.document, BOTTLE)
    if section is None:
        return None
    if not isinstance(section.get("name"), str):
        raise ScenarioError(
            f"{reading.file}: '{BOTTLE_NAME}' is missing: the name of a bottle, or the path of its file"
        )
    own = section.get("overrides", ())
    if any(text.partition("=")[0].strip() == _SET_PRESSURE for text in own):
        raise ScenarioError(
            f"{reading.file}: {BOTTLE}.{_SET_PRESSURE}: in a walk the bottle's regulator is set to supply.pressure; "
            f"set that"
        )
    with refused_as(ParameterError, f"{reading.file}: [{BOTTLE}]", ParameterError):
        name = section["name"]
        path = Path(name)
        is_file = path.suffix == ".toml" or is_of_catalogue(path)
        bottle = load_bottle(folder / path if is_file and not path.is_absolute() else name, own)
    pressure, stated = device.supply.pressure, bottle.entries[_SET_PRESSURE]
    # Gauge is the same at both: a bottle's file knows no atmosphere, and stands in that of the device.
    own_pressure = to_si(stated.value, stated.unit, "Pa_a", device.supply.atmospheric_pressure)
    # A bottle of the package is set to the paper's pressure, which says nothing of this walk; a user's file does.
    if path.suffix == ".toml" and abs(own_pressure - pressure) > _SAME_PRESSURE * pressure:
        room = device.supply.atmospheric_pressure
        raise ScenarioError(
            f"{reading.file}: {BOTTLE_NAME}: {name} sets {_SET_PRESSURE} to "
            f"{quantity_text(own_pressure, 'Pa_a', room)}, and supply.pressure is "
            f"{quantity_text(pressure, 'Pa_a', room)}: give both the same"
        )
    # The bottle with its regulator set to the supply pressure of the device, in its entries too.
    entry = Entry(value=pressure, unit="Pa_a", origin="derived", source="supply.pressure of the walk")
    regulator = bottle.regulator._replace(set_pressure=pressure)
    bottle = replace(bottle, regulator=regulator, entries={**bottle.entries, _SET_PRESSURE: entry})
    numbers = _numbers(reading, section, bottle)
    line = isobar(bottle.fluid.table, bottle.regulator.set_pressure)
    supply = BottleSupply(
        bottle,
        line,
        numbers["fill"] * bottle.mass,
        # The order of BOTTLE_NUMBERS is that of the fields after the mass.
        *(numbers[quantity.name] for quantity in BOTTLE_NUMBERS if quantity is not FILL),
    )
    _check(reading, device, supply)
    return supply


def _numbers(reading: Reading, section: Mapping[str, Any], bottle: Bottle) -> dict[str, float]:
    """Return the numbers of the section; the bottle starts at the temperature of the room unless one is given."""
    room = replace(TEMPERATURE, default=bottle.room_temperature)
    items = (
        room if quantity is TEMPERATURE and TEMPERATURE.name not in section else quantity for quantity in BOTTLE_NUMBERS
    )
    numbers = {quantity.name: reading.number(f"{BOTTLE}.{quantity.name}", quantity) for quantity in items}
    nodes = bottle.fluid.table.temperatures
    if not nodes[0] < numbers["temperature"] <= nodes[-1]:
        known = f"must be above {nodes[0]:g} K and at most {nodes[-1]:g} K, where {bottle.fluid.name} is known"
        raise reading.refusal(f"{BOTTLE}.temperature", known)
    mass, table = numbers["fill"] * bottle.mass, bottle.fluid.table
    most = bottle.volume * (liquid_density if has_liquid(table) else densest_gas)(table, numbers["temperature"])
    if mass >= most:
        fits = f"{GRAMS_PER_KILOGRAM * most:.4g} g fit into it at {numbers['temperature']:g} K"
        raise ScenarioError(
            f"{reading.file}: [{BOTTLE}]: {GRAMS_PER_KILOGRAM * mass:.4g} g of {bottle.fluid.name}, and {fits}: set "
            f"{BOTTLE}.fill or {BOTTLE}.temperature lower, or {BOTTLE}.volume higher"
        )
    return numbers


def _check(reading: Reading, device: Device, supply: BottleSupply) -> None:
    """Refuse what does not go with a bottle."""
    fluid, regulator = supply.bottle.fluid, supply.bottle.regulator
    if abs(device.gas.specific_gas_constant / fluid.table.gas_constant - 1.0) > _SAME_GAS:
        raise reading.refusal(
            BOTTLE_NAME,
            f"holds {fluid.name}, and the device is fed with {device.gas.species}: set gas.species={fluid.name}, or "
            f"take a bottle of {device.gas.species}",
        )
    if device.supply.relieving:
        raise ScenarioError(f"{reading.file}: supply.relieving: no gas goes back into a bottle; set it to false")
    if kind_at(reading.document, "gas_model") == THERMAL:
        raise reading.refusal("gas_model.kind", "goes with gas that arrives at room temperature, not with a bottle")
    for path in _OWN:
        if value_at(reading.document, path) is not None:
            raise reading.refusal(path, f"the bottle's regulator has its own: set {BOTTLE}.regulator.droop or .area")
    # Refuse a bottle of so little gas, or parts of so little heat capacity, that they follow within no time.
    flow = supply.offers_first().largest_flow
    rates = following_rates(supply.bottle.fluid.table, supply.line, supply.bottle.supply, supply.mass, flow)
    fastest = max(rates, key=rates.__getitem__)
    if rates[fastest] > _FASTEST:
        raise reading.refusal(
            BOTTLE_NAME,
            f"the temperature of its {fastest} follows within {1.0e3 / rates[fastest]:.3g} ms, and a walk follows what "
            f"takes {1.0e3 / _FASTEST:g} ms or more: {_FOLLOWS[fastest]}",
        )
    pressure = supply.offers_first().content.pressure
    if pressure < regulator.set_pressure + regulator.pressure_margin:
        has = quantity_text(pressure, "Pa_a", device.supply.atmospheric_pressure)
        needs = quantity_text(
            regulator.set_pressure + regulator.pressure_margin, "Pa_a", device.supply.atmospheric_pressure
        )
        raise reading.refusal(BOTTLE_NAME, f"has {has} at the start, and its regulator needs {needs}")


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


class Schedule(NamedTuple):
    """Walking and resting in turn [s], for at most ``longest`` [s]; a rest of 0 s is walking without a break."""

    walk: float
    rest: float
    longest: float


@dataclass(slots=True)
class _Use:
    """A bottle in use: where it met the device, time walked and in all [s], gas through its regulator [kg]."""

    met: list[tuple[float, SupplyState, SupplyNow]]
    walked: float = 0.0
    rested: float = 0.0
    regulated: float = 0.0
    ending: SupplyEnding | None = None


@dataclass(frozen=True, slots=True)
class BottleLife:
    """A bottle walked to its end: its course over all of the time, time walked and in all [s].

    ``repeats`` is how many strides, or task sequences, were walked.
    """

    course: SupplyCourse
    walked: float
    total: float
    repeats: float


def lasted(course: SupplyCourse) -> float | None:
    """Return how long a bottle lasted [s], None where the walk ended before it, or left what is possible."""
    return None if course.ending.kind in (WALKED, DIVERGED) else course.ending.time


def minutes_text(seconds: float) -> str:
    """Return minutes with three digits, and whole ones where there are more."""
    return shown_text(seconds, "duration", ".0f" if display_value(seconds, "duration") >= 999.5 else ".3g")


def strides_text(strides: float) -> str:
    """Return a number of strides as it is shown: a decimal of few, such as of task sequences, whole ones of many."""
    return f"{strides:.1f}" if strides < 99.5 else f"{strides:.0f}"


def run_on_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    progress: Callable[[float, float], None],
) -> tuple[BatchResult, SupplyCourse]:
    """Return what a run gives on a bottle, up to where that ends it, and the course of the bottle.

    ``device`` is what the run was planned for; ``stride_time`` [s] is how long a stride takes; ``progress`` gets the
    minutes done and in all.
    """
    use = _Use([(0.0, supply.start(), supply.offers_first())])
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
    use = _Use([(0.0, supply.start(), supply.offers_first())])
    while use.ending is None and use.walked + use.rested < schedule.longest:
        _use_bottle(run, device, supply, stride_time, use, progress, schedule)
    length = batch_of(run).clock.step_count * run.step if run.program.takes_task_sequence else stride_time
    return BottleLife(_course_of_use(supply, use), use.walked, use.walked + use.rested, use.walked / length)


def _course_of_use(supply: BottleSupply, use: _Use) -> SupplyCourse:
    """Return what a bottle went through; a use that nothing ended went to the end of the walk."""
    met, (end, last, _) = use.met, use.met[-1]
    over = f"the walk is over, and {_grams(last.mass)} are left in the bottle"
    # In the order of ``UNITS``.
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
    return SupplyCourse(
        supply=supply,
        times=np.array([time for time, _, _ in met]),
        values=values,
        first=met[0][1],
        last=last,
        regulated=use.regulated,
        ending=use.ending or SupplyEnding(WALKED, over, end),
    )


def _use_bottle(
    run: Run,
    device: Device,
    supply: BottleSupply,
    stride_time: float,
    use: _Use,
    progress: Callable[[float, float], None],
    schedule: Schedule | None = None,
) -> tuple[BatchResult, int]:
    """Walk a run on a bottle in ``use``, which is brought up to date; return its rows and the steps that were done."""
    batch = batch_of(run)
    count = batch.clock.step_count
    block = begin_block(batch)
    states = row_numbers(batch.program.state_rows())
    regulated, lines = ([row for path, row in states.items() if path.endswith(end)] for end in (REGULATED, _LINE))
    every = max(1, round(supply.coupling / run.step))
    table, met, walked_before = supply.bottle.fluid.table, use.met, use.walked
    assert run.lines is not None, "a bottle feeds lines"
    names = row_numbers(run.program.parameter_rows())
    effects = tuple(effect for effect in run.program.effects if effect.is_of_device)
    rows = [path for effect in effects for path in leaf_paths(effect.parameters, effect.name)]
    lanes = _Lanes(
        rows=[names[path] for path in (*_PARAMETERS, *rows)],
        plant=run.plant,
        volume=run.lines.parameters.volume_1,
        start=met[0][2].gas_temperature,
        device=device,
        effects=effects,
    )
    # The line falls for a moment at each draw: its best over some strides counts, of two meetings at least.
    window = max(2, math.ceil(_STRIDES * stride_time / (every * run.step))) * every
    # The line starts at the set pressure.
    gauges = [(0, 1.0)]
    done, first = 0, float(batch.states[regulated, 0].sum())
    before, until_rest = first, count
    if schedule is not None and schedule.rest > 0.0:
        until_rest = max(1, round((schedule.walk - use.walked % schedule.walk) / run.step))
    while use.ending is None and done < count:
        steps = min(_steps_to_meet(met[-1], run.step, every), count - done, until_rest)
        block.set_parameters(lanes.rows, lanes.offered(met[-1][2]))
        block.advance(steps)
        done, until_rest = done + steps, until_rest - steps
        use.walked = walked_before + done * run.step
        time, state = use.walked + use.rested, met[-1][1]
        progress(use.walked / 60.0, (walked_before + count * run.step) / 60.0)
        # Divergence first: a gas mass that is no number must not reach the supply.
        use.ending = _divergence(block.states, states["result.failure_time"], state, time)
        if use.ending is not None:
            break
        now_regulated = float(block.states[regulated, 0].sum())
        mass, before = now_regulated - before, now_regulated
        content = met[-1][2].content
        state = advance_supply(table, supply.line, supply.bottle.supply, state, content, mass, steps * run.step)
        now = supply.offers(state, content.temperature, mass)
        met.append((time, state, now))
        gauges = [
            *(old for old in gauges if old[0] > done - window),
            (done, min(lanes.gauge(float(block.states[line, 0]), now) for line in lines)),
        ]
        use.ending = _ending(supply, state, now, max(gauge for _, gauge in gauges), time)
        if schedule is not None and use.ending is None:
            if time >= schedule.longest:
                break
            if until_rest <= 0 and schedule.rest > 0.0:
                _rest(supply, use, min(schedule.rest, schedule.longest - time))
                # Gauges of before the rest say nothing of the bottle that has warmed in it.
                gauges, until_rest = [(done, 1.0)], round(schedule.walk / run.step)
                if use.walked + use.rested >= schedule.longest:
                    break
    use.regulated += before - first
    return block.result(), done


def _rest(supply: BottleSupply, use: _Use, rest: float) -> None:
    """Let a bottle warm for a time [s] in which no gas flows."""
    parts = max(1, math.ceil(rest / _RESTING))
    for _ in range(parts):
        time, state, now = use.met[-1]
        content = now.content
        state = advance_supply(
            supply.bottle.fluid.table, supply.line, supply.bottle.supply, state, content, 0.0, rest / parts
        )
        use.met.append((time + rest / parts, state, supply.offers(state, content.temperature, 0.0)))
    use.rested += rest


def _steps_to_meet(last: tuple[float, SupplyState, SupplyNow], step: float, every: int) -> int:
    """Return how many steps [of ``step`` s] the lanes go until they meet the supply again, at most ``every``."""
    _, state, now = last
    # A regulator that passes nothing must not divide by zero.
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
    """The lanes as their supply sees them: rows that follow it, and the numbers with gas of the ``start`` [K].

    ``effects`` are the effects of the ``device`` that are on, whose rows may be of the temperature of its gas.
    """

    rows: list[int]
    plant: PlantParameters
    volume: float
    start: float
    device: Device
    effects: tuple[Effect, ...]

    def offered(self, now: SupplyNow) -> Floats:
        """Return the parameters: gas of its temperature, flows through openings with 1 over its root, the regulator.

        Then the rows of the effects, prepared anew for gas of that temperature.
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


def _ending(
    supply: BottleSupply, state: SupplyState, now: SupplyNow, reached: float, time: float
) -> SupplyEnding | None:
    """Return what ends a walk, None while it goes on; ``reached`` is the best gauge pressure of late over the set."""
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
    return f"{mass * GRAMS_PER_KILOGRAM:.3g} g"
