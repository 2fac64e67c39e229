"""How long one bottle lasts for a gas use, with and without reuse of the exhaust."""

from dataclasses import dataclass

from ppafo.studies.endurance.bottle import Bottle
from ppafo.studies.endurance.discharge import Discharge, discharge
from ppafo.studies.endurance.draw import Draw, Schedule
from ppafo.studies.endurance.ending import smallest_mass_when_warm
from ppafo.studies.endurance.reuse import Reuse, ReusePlan, reuse


@dataclass(frozen=True, slots=True)
class Endurance:
    """What was asked and what came of it.

    ``discharge`` is the course that was asked for; ``without_reuse`` the same without reuse, where there is one.
    ``steps_when_warm`` is the number of steps that a bottle which stays at room temperature gives: what cooling costs.
    """

    bottle: Bottle
    draw: Draw
    schedule: Schedule
    discharge: Discharge
    reuse: Reuse | None
    without_reuse: Discharge | None
    steps_when_warm: float


def endurance(bottle: Bottle, draw: Draw, schedule: Schedule, plan: ReusePlan | None = None) -> Endurance:
    """Return how long a full bottle lasts; ``plan`` takes the gas that a reservoir gives back off every step."""
    reused = None if plan is None else reuse(plan, draw.mass_per_step)
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
