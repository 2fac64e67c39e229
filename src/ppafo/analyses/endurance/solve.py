"""Duration of a bottle for one gas demand, or for several compared."""

from collections.abc import Iterable
from pathlib import Path

from ppafo.analyses.endurance.answer import Endurance
from ppafo.analyses.endurance.discharge import check_schedule, discharge, discharge_of_life, smallest_mass_when_warm
from ppafo.analyses.endurance.gas_demand import GasDemand
from ppafo.analyses.endurance.walk_gas import WalkGas, demand_of_walk, walk_gas
from ppafo.arguments import checked
from ppafo.errors import DataError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle
from ppafo.report.kind import Kind
from ppafo.walking import WalkResult
from ppafo.walking.bottle.coupling import Schedule
from ppafo.walking.loading import on_bottle
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import bottle_life

BETWEEN_RESTS = 600.0
"""Default walking time between two rests [s]."""
STRIDE_TIME = 1.1
"""Default stride time [s]."""
LONGEST = 24.0 * 3600.0
"""Default of the longest simulated time [s]: one day."""
WITHOUT_REST = Schedule(LONGEST, 0.0, LONGEST)


@checked
def endurance_of_walk(result: WalkResult, *, bottle: str | Path | None = None) -> Endurance | None:
    """Return the duration of a bottle when the walk continues without rest, or None if the walk took no gas.

    The same device, without faults, walks on the bottle until the bottle is exhausted, as with ``ppafo walk --bottle``.
    The default of ``bottle`` is the bottle of the walk, or else the paper's. A stride is one of the leg with the
    device, or a whole task sequence.

    >>> import ppafo
    >>> endurance = ppafo.endurance_of_walk(ppafo.walk("solenoid", minutes=0.1))
    >>> print(f"{endurance.discharge.walking_time / 60.0:.1f} min: {endurance.discharge.ending.kind}")
    5.2 min: frozen
    """
    gas = walk_gas(result)
    # A walk that takes no gas lasts for ever on any bottle.
    return None if gas.gas_per_stride <= 0.0 else endurance_of_walk_gas(gas, bottle, WITHOUT_REST)


def endurance_of_walk_gas(
    gas: WalkGas, bottle: str | Path | None, schedule: Schedule, overrides: Iterable[str] = ()
) -> Endurance:
    """Return the duration of a bottle for a walk that continues.

    Raises DataError if the walk took no gas or its scenario is unknown.
    """
    at_set_pressure = demand_of_walk(gas)
    if gas.scenario is None:
        raise DataError(
            f"{gas.name}: the folder does not state the scenario of the walk; repeat the walk with 'ppafo walk'"
        )
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
    taken = GasDemand(mass, stride_time, max(at_set_pressure.peak_flow, mass / stride_time), origin)
    usable = supply.mass - smallest_mass_when_warm(supply.bottle, taken)
    return Endurance(
        bottle=supply.bottle,
        draw=taken,
        schedule=schedule,
        discharge=discharge_of_life(life, taken),
        strides_when_warm=usable / taken.mass_per_stride,
        is_of_task_sequence=bool(gas.task_sequence),
        device_units=gas.scenario.device.shown,
    )


def follow_bottle(bottle: Bottle, draw: GasDemand, schedule: Schedule) -> Endurance:
    """Return the duration of a full bottle for a gas demand, with a schedule of walking and rest."""
    usable = bottle.mass - smallest_mass_when_warm(bottle, draw)
    return Endurance(
        bottle=bottle,
        draw=draw,
        schedule=schedule,
        discharge=discharge(bottle, draw, schedule),
        strides_when_warm=usable / draw.mass_per_stride,
    )
