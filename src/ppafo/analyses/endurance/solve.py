"""How long one bottle lasts for a gas use; for several uses side by side."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from ppafo.analyses.endurance.answer import Endurance, Endurances, finding_of, finding_of_several
from ppafo.analyses.endurance.discharge import check_schedule, discharge, discharge_of_life, smallest_mass_when_warm
from ppafo.analyses.endurance.draw import (
    WALK_FILE,
    Draw,
    WalkGas,
    draw_of_numbers,
    draw_of_recording,
    draw_of_walk,
    read_walk_gas,
    walk_gas,
)
from ppafo.errors import DataError, ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.report.finding import Finding
from ppafo.report.kind import Kind
from ppafo.signals import Recording
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
    named, changed = PAPER_BOTTLE if bottle is None else bottle, tuple(overrides)
    if gas_per_stride is not None:
        draw = draw_of_numbers(gas_per_stride, _STRIDE_TIME if stride_time is None else stride_time, peak_flow)
        return finding_of(follow_bottle(load_bottle(named, changed), draw, schedule))
    if peak_flow is not None:
        raise ParameterError("--peak-flow belongs to --gas-per-stride; a recording has its own largest flow")
    uses = {
        use.label if isinstance(use, Recording) else use.scenario.name if isinstance(use, WalkResult) else str(use): use
        for use in given
    }
    if len(uses) < len(given):
        raise ParameterError("the same recording is given twice")
    found = {}
    for name, use in uses.items():
        gas = walk_gas(use) if isinstance(use, WalkResult) else None
        # The folder that a walk of one wearer was written into.
        if isinstance(use, str | Path) and (Path(use) / WALK_FILE).is_file():
            gas = read_walk_gas(Path(use))
        if gas is None:
            full = load_bottle(named, changed)
            recording = use if isinstance(use, Recording) else read_recording(Path(str(use)))
            life = follow_bottle(full, draw_of_recording(recording, stride_time), schedule)
            # Whoever says how long a stride takes recorded strides; else the recording is what repeats.
            found[name] = replace(life, is_of_recording=stride_time is None)
            continue
        if stride_time is not None:
            stride = f"its whole task sequence '{gas.task_sequence}'" if gas.task_sequence else "one stride of its walk"
            raise ParameterError(f"--stride-time: a stride of {name} is {stride}; omit --stride-time")
        found[name] = endurance_of_walk_gas(gas, bottle, schedule, changed)
    return finding_of(*found.values()) if len(found) == 1 else finding_of_several(Endurances(found))


def endurance_of_walk(result: WalkResult, bottle: str | Path | None = None) -> Endurance | None:
    """Return how long a bottle lasts when the walk continues without rest; None where the walk took no gas.

    The same device, without faults, walks on the bottle until that ends it, as ``ppafo walk --bottle`` does;
    ``bottle`` is its own, or the paper's, unless given. A stride is one of the leg with the device, or a whole
    task sequence.
    """
    gas = walk_gas(result)
    # A walk that takes no gas lasts for ever on any bottle.
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
    supply = walk_of(carried).bottle
    assert supply is not None, "a walk on a bottle"
    check_schedule(schedule)
    life = bottle_life(carried, schedule)
    # A bottle may end before the first stride does.
    strides = max(life.repeats, 1.0e-9)
    stride_time, mass = life.walked / strides, life.course.regulated / strides
    before = Kind("", "kg", "gas mass", ".3g").text(at_set_pressure.mass_per_stride)
    origin = f"{at_set_pressure.origin} on the bottle, mean over its strides ({before} before, at the set pressure)"
    taken = Draw(mass, stride_time, max(at_set_pressure.peak_flow, mass / stride_time), origin)
    usable = supply.mass - smallest_mass_when_warm(supply.bottle, taken)
    return Endurance(
        bottle=supply.bottle,
        draw=taken,
        schedule=schedule,
        discharge=discharge_of_life(life, taken),
        strides_when_warm=usable / taken.mass_per_stride,
        is_of_task_sequence=bool(gas.task_sequence),
    )


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
