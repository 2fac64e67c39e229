"""All directions of the device, which one program has at once but for heat, whose gas is another program's."""

from ppafo.identification.trajectory.directions import (
    leak_opening,
    line_resistance,
    line_volume,
    seal_friction,
    second_virial,
    spool_play,
    stribeck,
)
from ppafo.identification.trajectory.directions.heat import HEAT
from ppafo.identification.trajectory.directions.kind import Direction

EFFECT_DIRECTIONS: tuple[Direction, ...] = (
    leak_opening.DIRECTION,
    seal_friction.DIRECTION,
    stribeck.DIRECTION,
    spool_play.DIRECTION,
    line_resistance.DIRECTION,
    line_volume.DIRECTION,
    second_virial.DIRECTION,
)
"""The sizes are those that a bench of this kind can have."""

EVERY_DIRECTION: tuple[Direction, ...] = (*EFFECT_DIRECTIONS, HEAT)
