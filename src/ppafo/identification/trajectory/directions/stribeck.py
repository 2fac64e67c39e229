"""Friction that is higher near standstill, with the rise that leaves the vane a tenth of its fall to break away."""

from ppafo.identification.trajectory.directions.kind import Direction

DIRECTION = Direction(
    name="stribeck",
    title="friction that is higher near standstill (Stribeck)",
    seems="friction near standstill seems to be higher, up to some {size} (Stribeck)",
    unless="friction is not higher near standstill, or up to less than {size} (Stribeck)",
    size_in_words=lambda size: f"{size:.2g} rad/s",
    sizes=(0.02, 0.1, 0.4, 1.6),
    settings=lambda size, _: {"effects.stribeck.velocity": size, "effects.stribeck.share": 0.9},
    neutral={"effects.stribeck.velocity": 1.0, "effects.stribeck.share": 0.0},
)
