"""How long one bottle lasts for a gas use; for several uses side by side."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.analyses.endurance.answer import Endurance, Endurances, finding_of, finding_of_several
from ppafo.analyses.endurance.discharge import check_schedule, discharge, discharge_of_life, smallest_mass_when_warm
from ppafo.analyses.endurance.draw import (
    Draw,
    WalkGas,
    draw_of_numbers,
    draw_of_recording,
    draw_of_walk,
    is_walk_folder,
    read_walk_gas,
    walk_gas,
)
from ppafo.errors import DataError, ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.report.finding import Finding
from ppafo.report.kind import Kind
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.storage.result_folder import read_recording
from ppafo.walking import WalkResult
from ppafo.walking.bottle import Schedule
from ppafo.walking.loading import on_bottle
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import bottle_life

GasUse = str | Path | Recording | WalkResult
"""A file, a result folder, the folder of a walk, or what was read or returned of them."""
_BETWEEN_RESTS = 600.0
_STRIDE_TIME = 1.1
_LONGEST = 24.0 * 3600.0
WITHOUT_REST = Schedule(_LONGEST, 0.0, _LONGEST)


def endurance(
    recordings: GasUse | Sequence[GasUse] = (),
    gas_per_stride: float | None = None,
    stride_time: float | None = None,
    peak_flow: float | None = None,
    bottle: str | Path | None = None,
    walk: float | None = None,
    rest: float | None = None,
    longest: float = _LONGEST,
    overrides: Iterable[str] = (),
) -> Finding[Endurance] | Finding[Endurances]:
    """Return how long a full bottle lasts for a gas use that continues; ``Endurances`` for several recordings.

    A walk, its result or its folder, walks on the bottle until that ends it; ``bottle`` is its own, or the paper's,
    unless given. Any other gas use comes from ``recordings``, or else ``gas_per_stride`` [kg] every ``stride_time`` [s]
    (default 1.1 s) with at most ``peak_flow`` [kg/s] (the mean flow). ``walk`` [s], 10 min unless given, and ``rest``
    [s] take turns, for at most ``longest`` [s]. ``overrides`` are texts such as ``room.temperature=5 degC``.
    ParameterError or DataError for bad input, SimulationError where the solver fails.
    """
    given = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(given) == (gas_per_stride is not None):
        raise ParameterError("give either a recording or --gas-per-stride, for example --gas-per-stride '0.3 g'")
    if walk is not None and rest is None:
        raise ParameterError("--walk: is the time between two rests: give --rest too, or --longest for the whole time")
    schedule = Schedule(_BETWEEN_RESTS if walk is None else walk, rest or 0.0, longest)
    chosen = _Bottle(bottle, tuple(overrides))
    if gas_per_stride is not None:
        draw = draw_of_numbers(gas_per_stride, _STRIDE_TIME if stride_time is None else stride_time, peak_flow)
        return finding_of(follow_bottle(chosen.load(), draw, schedule))
    if peak_flow is not None:
        raise ParameterError("--peak-flow belongs to --gas-per-stride; a recording has its own largest flow")
    names = [_name(use) for use in given]
    if len(set(names)) < len(names):
        raise ParameterError("the same recording is given twice")
    found = {
        name: _endurance_of_use(use, stride_time, chosen, schedule) for name, use in zip(names, given, strict=True)
    }
    return finding_of(found[names[0]]) if len(found) == 1 else finding_of_several(Endurances(found))


def endurance_of_walk(result: WalkResult, bottle: str | Path | None = None) -> Endurance | None:
    """Return how long a bottle lasts when the walk continues without rest; None where the walk took no gas.

    The same device, without faults, walks on the bottle until that ends it, as ``ppafo walk --bottle`` does;
    ``bottle`` is its own, or the paper's, unless given. A stride is one of the leg with the device, or a whole
    course.
    """
    gas = walk_gas(result)
    return None if gas.gas_per_stride <= 0.0 else endurance_of_walk_gas(gas, bottle, WITHOUT_REST)


def endurance_of_walk_gas(
    gas: WalkGas, bottle: str | Path | None, schedule: Schedule, overrides: Iterable[str] = ()
) -> Endurance:
    """Return how long a bottle lasts when a walk continues; DataError where it took no gas, or is not known."""
    at_set_pressure = draw_of_walk(gas)
    if gas.scenario is None:
        raise DataError(f"{gas.name}: its folder does not say what was walked; write the walk again")
    own = walk_of(gas.scenario).bottle
    carried = on_bottle(gas.scenario, PAPER_BOTTLE if bottle is None and own is None else bottle, overrides)
    found = _walked_to_its_end(carried, at_set_pressure, schedule)
    return replace(found, is_of_course=bool(gas.course))


def _walked_to_its_end(carried: Scenario, at_set_pressure: Draw, schedule: Schedule) -> Endurance:
    """Return how long the bottle of a walk lasts; ``at_set_pressure`` is the draw of the same walk at room warmth."""
    supply = walk_of(carried).bottle
    assert supply is not None, "a walk on a bottle"
    check_schedule(schedule)
    life = bottle_life(carried, schedule)
    if not walk_of(carried).is_led:  # whose strides no gait sets
        life = replace(life, repeats=life.walked / at_set_pressure.stride_time)
    strides = max(life.repeats, 1.0e-9)
    stride_time = life.walked / strides
    mass = life.course.regulated / strides
    of_walk = Kind("", "kg", "gas mass", ".3g").text(at_set_pressure.mass_per_stride)
    origin = f"{at_set_pressure.origin} on the bottle, mean over its strides ({of_walk} before, at the set pressure)"
    taken = Draw(mass, stride_time, max(at_set_pressure.peak_flow, mass / stride_time), origin)
    usable = supply.mass - smallest_mass_when_warm(supply.bottle, taken)
    return Endurance(
        bottle=supply.bottle,
        draw=taken,
        schedule=schedule,
        discharge=discharge_of_life(life, taken),
        strides_when_warm=usable / taken.mass_per_stride,
    )


@dataclass(frozen=True, slots=True)
class _Bottle:
    """The bottle that was named, if any, and what is set of it."""

    name: str | Path | None
    overrides: tuple[str, ...]

    def load(self) -> Bottle:
        return load_bottle(PAPER_BOTTLE if self.name is None else self.name, self.overrides)


def follow_bottle(bottle: Bottle, draw: Draw, schedule: Schedule) -> Endurance:
    """Return how long a full bottle lasts."""
    usable = bottle.mass - smallest_mass_when_warm(bottle, draw)
    return Endurance(
        bottle=bottle,
        draw=draw,
        schedule=schedule,
        discharge=discharge(bottle, draw, schedule),
        strides_when_warm=usable / draw.mass_per_stride,
    )


def _name(use: GasUse) -> str:
    if isinstance(use, Recording):
        return use.label
    return use.scenario.name if isinstance(use, WalkResult) else str(use)


def _endurance_of_use(use: GasUse, stride_time: float | None, chosen: _Bottle, schedule: Schedule) -> Endurance:
    gas = walk_gas(use) if isinstance(use, WalkResult) else None
    if isinstance(use, str | Path) and is_walk_folder(Path(use)):
        gas = read_walk_gas(Path(use))
    if gas is not None:
        stride = f"its whole course '{gas.course}'" if gas.course else "one stride of its walk"
        if stride_time is not None:
            raise ParameterError(f"--stride-time: a stride of {_name(use)} is {stride}; omit --stride-time")
        return endurance_of_walk_gas(gas, chosen.name, schedule, chosen.overrides)
    bottle = chosen.load()
    recording = use if isinstance(use, Recording) else read_recording(Path(str(use)))
    draw = draw_of_recording(recording, stride_time)
    return follow_bottle(bottle, draw, schedule)
