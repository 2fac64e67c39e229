"""What the slap of the foot comes from: valves, chambers, pressure and timing, in all combinations, from one state.

The foot comes down within a tenth of a second after the heel strike. How fast depends first of all on how far it has to
fall, which the swing before decides. So a walk is stopped at a heel strike, the foot gets the angle and the rate, and
the chambers get the pressures, that the device as it is has there, and the walk goes on: controller and valves keep
what they have learnt and where they stand. What then differs is the fall alone.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import factorial

import numpy as np

from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Floats, LaneBlock, begin_block
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, gas_by_path
from ppafo.engine.scheme.walking import foot_direction
from ppafo.errors import SimulationError
from ppafo.loading import reloaded
from ppafo.model.contact import foot_angle
from ppafo.model.plant import chamber_mass, chamber_pressures, chamber_volumes
from ppafo.parameters.device import Device, Orifice
from ppafo.parameters.overrides import over
from ppafo.progress import Progress, Report
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import plan_walk
from ppafo.walking.result import REMEDY
from ppafo.walking.walk import with_device_off

LARGER = 4.0
"""Valves of so many times the area, chambers of one so manieth of the volume: about as far as virtual work allows."""
HIGHER = 20.0 * 6894.757293168361
"""Rise of both supply pressures [Pa]: 20 psi."""
FIRST_STRIKE, STRIKES = 8, 12
"""Heel strikes that are looked at: by the first of them strides are learnt."""
REACH = 0.3
"""Fraction of a stride within which a foot that strikes with its heel has come down."""
AS_IT_IS = "timing.kind=thresholds"


@dataclass(frozen=True, slots=True)
class Factor:
    """One thing that may contribute: its name, overrides of the walk, numbers by path from the device without it."""

    name: str
    overrides: tuple[str, ...]
    numbers: Callable[[Device], dict[str, float]]


@dataclass(frozen=True, slots=True)
class Strike:
    """The leg at a heel strike: angle [rad] and rate [rad/s] of the ankle, and both chambers [Pa], () for their own."""

    angle: float
    rate: float
    pressures: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Falls:
    """How a foot comes down: rate [rad/s] from the ``imposed`` state and as it ``walked``, means over strikes.

    Both are nan where a foot does not come down after its heel. ``drop`` [rad] is how far it is tilted up at the
    strike as it walked, and ``strikes`` are its states there.
    """

    imposed: float
    walked: float
    drop: float
    strikes: tuple[Strike, ...]


@dataclass(frozen=True, slots=True)
class SlapWalk:
    """A combination of factors and how the foot comes down with it."""

    factors: tuple[str, ...]
    falls: Falls


@dataclass(frozen=True, slots=True)
class SlapShare:
    """What one factor takes off the slap [rad/s]: alone, on average over all orders (Shapley), and as the last."""

    factor: str
    alone: float
    share: float
    last: float


@dataclass(frozen=True, slots=True)
class SlapStudy:
    """What the slap comes from: the device off, the combinations from none to all factors, and their shares."""

    device_off: Falls
    walks: tuple[SlapWalk, ...]
    shares: tuple[SlapShare, ...]

    @property
    def as_it_is(self) -> Falls:
        """The fall with the device and the timing as they are."""
        return self.walks[0].falls


def larger_valves(device: Device) -> dict[str, float]:
    """Valves of a larger area."""
    orifice = device.valve.orifice
    if isinstance(orifice, Orifice):
        return {"valve.area": LARGER * orifice.area}
    return {"valve.sonic_conductance": LARGER * orifice.sonic_conductance}


def smaller_chambers(device: Device) -> dict[str, float]:
    """Smaller chambers and the same torque constant."""
    names = ("volume_per_angle", "dead_volume_1", "dead_volume_2")
    return {f"actuator.{name}": getattr(device.actuator, name) / LARGER for name in names}


def higher_pressure(device: Device) -> dict[str, float]:
    """More pressure of both supplies."""
    return {f"supply.{name}": getattr(device.supply, name) + HIGHER for name in ("pressure", "dorsiflexion_pressure")}


def no_number(_device: Device) -> dict[str, float]:
    """The device as it is."""
    return {}


FACTORS = (
    Factor(f"valves {LARGER:g} times as large", (), larger_valves),
    Factor(f"chambers of 1/{LARGER:g} the volume", (), smaller_chambers),
    Factor("20 psi more pressure", (), higher_pressure),
    Factor("time in the stride known", ("timing.kind=fractional",), no_number),
)


def slap_study(walked: Scenario, progress: Report) -> SlapStudy | None:
    """Let the foot of a walk fall from one state with every combination of factors; None where no heel strikes.

    SimulationError where a walk diverges.
    """
    chosen = [sub for size in range(len(FACTORS) + 1) for sub in itertools.combinations(FACTORS, size)]
    base = _with((), walked)
    strikes = falls_of(base, ()).strikes
    walks = []
    for number, factors in enumerate(chosen):
        progress(Progress("slap, factors", number, len(chosen), noun="combinations"))
        walks.append(SlapWalk(tuple(one.name for one in factors), falls_of(_with(factors, walked), strikes)))
    slaps = {frozenset(one.factors): one.falls.imposed for one in walks}
    if not np.isfinite(list(slaps.values())).all():
        return None
    # Without the device its chambers hold nothing: the foot has the state, the chambers their own.
    bare = falls_of(with_device_off(base), [replace(strike, pressures=()) for strike in strikes])
    return SlapStudy(bare, tuple(walks), shares_of(slaps, [one.name for one in FACTORS]))


def shares_of(values: Mapping[frozenset[str], float], names: Sequence[str]) -> tuple[SlapShare, ...]:
    """What each of some names adds to the value of a set of them: alone, on average over all orders, and last.

    The averages (Shapley 1953) add up to the value of all less that of none.
    """
    count, everything = len(names), frozenset(names)
    found = []
    for name in names:
        others = [item for item in names if item != name]
        sets = [frozenset(sub) for size in range(count) for sub in itertools.combinations(others, size)]
        weights = [factorial(len(sub)) * factorial(count - len(sub) - 1) / factorial(count) for sub in sets]
        gains = [values[sub | {name}] - values[sub] for sub in sets]
        share = sum(weight * gain for weight, gain in zip(weights, gains, strict=True))
        last = values[everything] - values[everything - {name}]
        found.append(SlapShare(name, gains[0], share, last))
    return tuple(found)


def _with(factors: Sequence[Factor], walked: Scenario) -> Scenario:
    timing = over((AS_IT_IS,), (text for factor in factors for text in factor.overrides))
    configuration = reloaded(walked, timing)
    numbers = [factor.numbers(configuration.device) for factor in factors]
    return with_numbers(configuration, {path: number for some in numbers for path, number in some.items()})


def falls_of(configuration: Scenario, strikes: Sequence[Strike]) -> Falls:
    """Walk, and at each strike let another lane go on from its state in ``strikes``; the last lane just walks."""
    stride = walk_of(configuration).gait.stride_time
    run = plan_walk(replace(configuration, duration=(FIRST_STRIKE + STRIKES) * stride, output_interval=stride))
    others = lanes_of(batch_of(run).program) - 1
    groups = [range(first, min(first + others, STRIKES)) for first in range(0, STRIKES, others)]
    falls = [fall for group in groups for fall in _falls_of_block(run, stride, group, strikes)]
    if any(fall is None for fall in falls):
        raise SimulationError(f"{configuration.name} diverged as its foot came down; {REMEDY}")
    imposed, walked, drops = (float(np.mean([fall[place] for fall in falls if fall])) for place in range(3))
    return Falls(imposed, walked, drops, tuple(fall[3] for fall in falls if fall))


def _falls_of_block(
    run: Run, stride: float, group: Sequence[int], strikes: Sequence[Strike]
) -> Iterator[tuple[float, float, float, Strike] | None]:
    """Imposed and walked rate [rad/s], drop [rad] and state of some strikes, a lane for each; None where one failed."""
    batch, last = batch_of(run), len(group)
    parameters, states = (np.repeat(values, last + 1, axis=1) for values in (batch.parameters, batch.states))
    block = begin_block(replace(batch, parameters=parameters, states=states))
    rows = row_numbers(batch.program.state_rows())
    done, reach = 0, round(REACH * stride / run.step)
    for lane, number in enumerate(group):
        before = round((FIRST_STRIKE + number) * stride / run.step) - 2
        block.advance(before - done)
        done = before + _to_strike(block, rows["walk.strides"])
        own, drop = _state(run, block.states[:, last], rows), _tilt(run, block.states[:, last], rows)
        if strikes:
            _impose(run, block.states[:, lane], rows, strikes[number])
        landings = block.states[rows["walk.landings"]].copy()
        block.advance(reach)
        done += reach
        slaps = np.where(block.states[rows["walk.landings"]] > landings, block.states[rows["walk.slap_rate"]], np.nan)
        failed = (block.states[rows["result.failure_time"]] < NEVER_FAILED).any()
        yield None if failed else (float(slaps[lane]), float(slaps[last]), drop, own)


def _to_strike(block: LaneBlock, strides: int) -> int:
    """Go on to the heel strike, which is some steps ahead; the number of steps."""
    before = float(block.states[strides, 0])
    steps = 0
    while float(block.states[strides, 0]) == before:
        block.advance(1)
        steps += 1
    return steps


def _tilt(run: Run, column: Floats, rows: Mapping[str, int]) -> float:
    """How far the foot is tilted up [rad] above where it lies flat."""
    assert run.walk is not None
    foot = foot_angle(float(column[rows["walk.now.shank"]]), float(column[rows["state.angle"]]))
    return foot - run.walk.timing.ground_angle


def _state(run: Run, column: Floats, rows: Mapping[str, int]) -> Strike:
    angle, rate, *masses = (
        float(column[rows[f"state.{name}"]]) for name in ("angle", "angular_velocity", "mass_1", "mass_2")
    )
    return Strike(angle, rate, chamber_pressures(run.plant, angle, *masses))


def _impose(run: Run, column: Floats, rows: Mapping[str, int], strike: Strike) -> None:
    """Give the leg of one lane, and the gas in its chambers, another state."""
    foot = foot_direction(float(column[rows["walk.now.shank"]]), strike.angle)
    pressures = strike.pressures or _state(run, column, rows).pressures
    volumes = chamber_volumes(run.plant, strike.angle)
    column[rows["state.angle"]], column[rows["state.angular_velocity"]] = strike.angle, strike.rate
    column[rows["walk.foot.sine"]], column[rows["walk.foot.cosine"]] = foot.sine, foot.cosine
    for chamber, pressure, volume in zip("12", pressures, volumes, strict=True):
        mass = chamber_mass(pressure, volume, run.plant.gas_product)
        # Gas with an energy balance keeps its temperature: its true mass goes with what it counts.
        true = rows.get(f"masses.mass_{chamber}")
        if true is not None:
            column[true] *= mass / column[rows[f"state.mass_{chamber}"]]
        column[rows[f"state.mass_{chamber}"]] = mass
    if run.program.has_true_masses and not run.program.is_thermal:
        masses = {f"mass_{chamber}": float(column[rows[f"state.mass_{chamber}"]]) for chamber in "12"}
        imposed = replace(run, initial=run.initial._replace(angle=strike.angle, **masses))
        for path, number in gas_by_path(imposed).items():
            column[rows[path]] = number
