"""Play of the spool of a proportional valve."""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction

DIRECTION = Direction(
    name="spool_play",
    title="play of the spool",
    seems="the spool seems to have a play of {size} of its command",
    unless="the spool has no play of more than {size} of its command",
    size_in_words=lambda size: f"{100.0 * size:.2g} %",
    sizes=(0.005, 0.02, 0.08, 0.2),
    settings=lambda size, _: {"effects.spool_play.width": size},
    neutral={"effects.spool_play.width": TRACE},
    suits=lambda scenario: scenario.device.valve.kind == "proportional",
)
