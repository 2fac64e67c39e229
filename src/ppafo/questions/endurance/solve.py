"""How long one bottle lasts for a gas use, with and without reuse of the exhaust; for several uses side by side."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ppafo.answers import Solved
from ppafo.errors import DataError, ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.questions.endurance.discharge import Discharge, discharge
from ppafo.questions.endurance.draw import (
    Draw,
    OtherGas,
    Schedule,
    WalkGas,
    draw_of_numbers,
    draw_of_recording,
    draw_of_walk,
    full_chambers,
    is_walk_folder,
    read_walk_gas,
    walk_gas,
)
from ppafo.questions.endurance.ending import smallest_mass_when_warm
from ppafo.questions.endurance.other_chambers import other_draws
from ppafo.questions.endurance.reuse import Reuse, ReusePlan, parse_reuse
from ppafo.questions.endurance.reuse import reuse as reuse_exhaust
from ppafo.signals import Recording
from ppafo.storage.recordings import read_recording
from ppafo.walking import WalkResult

GasUse = str | Path | Recording | WalkResult
"""A file, a result folder, the folder of a walk, or what was read or returned of them."""

_STEP_TIME = 1.1
_LONGEST = 24.0 * 3600.0
WITHOUT_REST = Schedule(_LONGEST, 0.0, _LONGEST)


@dataclass(frozen=True, slots=True)
class Endurance(Solved):
    """The request and its result.

    ``discharge`` is the requested course; ``without_reuse`` the same without reuse, where there is one.
    ``steps_when_warm`` is the number of steps that a bottle which stays at room temperature gives: what cooling costs.
    ``is_of_course`` is true where a step is a course, ``is_whole`` unless the walk ended before it did. ``others`` is
    the same for a walk or a run with other readings of the paper's chambers, by their names.
    """

    bottle: Bottle
    draw: Draw
    schedule: Schedule
    discharge: Discharge
    reuse: Reuse | None
    without_reuse: Discharge | None
    steps_when_warm: float
    is_of_course: bool = False
    others: Mapping[str, "Endurance"] = field(default_factory=dict)
    is_whole: bool = True


@dataclass(frozen=True, slots=True)
class Endurances(Solved):
    """Several gas uses on the same bottle, by name."""

    uses: Mapping[str, Endurance]


def endurance(
    recordings: GasUse | Sequence[GasUse] = (),
    gas_per_step: float | None = None,
    step_time: float | None = None,
    peak_flow: float | None = None,
    bottle: str | Path = PAPER_BOTTLE,
    walk: float = 600.0,
    rest: float = 0.0,
    longest: float = _LONGEST,
    reuse: Iterable[str] = (),
    overrides: Iterable[str] = (),
) -> Endurance | Endurances:
    """Return how long a full bottle lasts for a gas use that continues; ``Endurances`` for several recordings.

    The gas use is that of ``recordings``, or else ``gas_per_step`` [kg] every ``step_time`` [s] (default 1.1 s)
    with at most ``peak_flow`` [kg/s] (the mean flow). ``walk`` [s] and ``rest`` [s] take turns, for at most ``longest``
    [s]. ``reuse`` are texts such as ``reservoir_volume=50 cm^3``, ``overrides`` such as ``room.temperature=5 degC``.
    ParameterError or DataError for bad input, SimulationError where the solver fails.
    """
    given = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(given) == (gas_per_step is not None):
        raise ParameterError("give either a recording or --gas-per-step, for example --gas-per-step '0.3 g'")
    full, schedule, changes = load_bottle(bottle, overrides), Schedule(walk, rest, longest), tuple(reuse)
    if gas_per_step is not None:
        draw = draw_of_numbers(gas_per_step, _STEP_TIME if step_time is None else step_time, peak_flow)
        return follow_bottle(full, draw, schedule, parse_reuse(changes, full) if changes else None)
    if peak_flow is not None:
        raise ParameterError("--peak-flow belongs to --gas-per-step; a recording has its own largest flow")
    names = [_name(use) for use in given]
    if len(set(names)) < len(names):
        raise ParameterError("the same recording is given twice")
    found = {
        name: _endurance_of_use(use, step_time, full, schedule, changes) for name, use in zip(names, given, strict=True)
    }
    return found[names[0]] if len(found) == 1 else Endurances(found)


def endurance_of_walk(
    result: WalkResult, bottle: str | Path = PAPER_BOTTLE, reuse: Iterable[str] = ()
) -> Endurance | None:
    """Return how long a bottle lasts when the walk continues without rest; None where the walk took no gas.

    A step is a stride of the leg with the
    device, or a whole course. ``reuse`` are texts such as ``reservoir_volume=50 cm^3``: what they
    do not say of the chambers is taken from the walk.
    """
    gas = walk_gas(result)
    if gas.gas_per_stride <= 0.0:
        return None
    return endurance_of_walk_gas(gas, load_bottle(bottle), WITHOUT_REST, reuse)


def endurance_of_walk_gas(gas: WalkGas, bottle: Bottle, schedule: Schedule, reuse: Iterable[str] = ()) -> Endurance:
    """Return how long a bottle lasts when a walk continues; DataError where it took no gas."""
    changes, draw = tuple(reuse), draw_of_walk(gas)
    zero = gas.atmospheric_pressure
    plan = parse_reuse(changes, bottle, full_chambers(gas), zero) if changes else None
    others = {name: _other(bottle, other, schedule, changes, zero) for name, other in gas.others.items()}
    return replace(
        follow_bottle(bottle, draw, schedule, plan), others=others, is_of_course=bool(gas.course), is_whole=gas.is_whole
    )


def _other(bottle: Bottle, other: OtherGas, schedule: Schedule, changes: tuple[str, ...], zero: float) -> Endurance:
    """Return how long the bottle lasts with other chambers; without reuse where theirs is not known or not possible."""
    if changes and other.chambers is not None:
        try:
            return follow_bottle(bottle, other.draw, schedule, parse_reuse(changes, bottle, other.chambers, zero))
        except ParameterError:
            pass
    return follow_bottle(bottle, other.draw, schedule)


def follow_bottle(bottle: Bottle, draw: Draw, schedule: Schedule, plan: ReusePlan | None = None) -> Endurance:
    """Return how long a full bottle lasts; ``plan`` takes the gas that a reservoir gives back off every step."""
    reused = None if plan is None else reuse_exhaust(plan, draw.mass_per_step)
    taken = draw if reused is None else draw.less(reused.balance.returned_mass)
    usable = bottle.mass - smallest_mass_when_warm(bottle, taken)
    return Endurance(
        bottle=bottle,
        draw=taken,
        schedule=schedule,
        discharge=discharge(bottle, taken, schedule),
        reuse=reused,
        without_reuse=None if reused is None else discharge(bottle, draw, schedule),
        steps_when_warm=usable / taken.mass_per_step,
    )


def _name(use: GasUse) -> str:
    if isinstance(use, Recording):
        return use.label
    return use.scenario.name if isinstance(use, WalkResult) else str(use)


def _endurance_of_use(
    use: GasUse, step_time: float | None, bottle: Bottle, schedule: Schedule, reuse: tuple[str, ...]
) -> Endurance:
    gas = walk_gas(use) if isinstance(use, WalkResult) else None
    if isinstance(use, str | Path) and is_walk_folder(Path(use)):
        gas = read_walk_gas(Path(use))
    if gas is not None:
        step = f"its whole course '{gas.course}'" if gas.course else "one stride of its walk"
        if step_time is not None:
            raise ParameterError(f"--step-time: a step of {_name(use)} is {step}; omit --step-time")
        if not gas.is_whole:
            raise DataError(
                f"{_name(use)}: the walk ended after {gas.stride_time:.4g} s of the {gas.course_time:.4g} s of course "
                f"'{gas.course}', so it cannot be repeated as a whole; walk the whole course, without a bottle"
            )
        return endurance_of_walk_gas(gas, bottle, schedule, reuse)
    recording = use if isinstance(use, Recording) else read_recording(Path(str(use)))
    draw = draw_of_recording(recording, step_time)
    found = follow_bottle(bottle, draw, schedule, parse_reuse(reuse, bottle) if reuse else None)
    if isinstance(use, Recording | WalkResult):
        return found
    others = other_draws(use, step_time)
    return replace(found, others={name: follow_bottle(bottle, other, schedule) for name, other in others.items()})
