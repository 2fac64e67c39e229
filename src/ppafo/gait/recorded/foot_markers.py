"""Angles of lines between markers: the lean of the shank, and the foot that turns against it."""

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.columns import CurveColumns, check_finite
from ppafo.gait.recorded.mapping import AngleMap, ShankMap
from ppafo.gait.recorded.signal import Signal, without_ends
from ppafo.signals.recording import Floats

_SLOW = np.radians(25.0)
"""Radians a second; a foot that turns less while the shank leans forward stands flat."""

_LEAST_FLAT = 0.1
"""Seconds of flat foot that there must be to take the zero of the angle from."""


def between_markers(found: CurveColumns, mapped: ShankMap | AngleMap, first: str, second: str) -> tuple[Floats, Floats]:
    """Return how far the second marker is ahead of the first and above it, in the unit of the file."""
    place = {name: found.table.columns[name] for _, name in found.terms}
    for name, values in place.items():
        check_finite(values, f"{found.table.file}: column {name!r}", found.table.time)
    axis, vertical = mapped.forward.removeprefix("-"), mapped.vertical
    sign = -1.0 if mapped.forward.startswith("-") else 1.0
    ahead = sign * (place[f"{second}.{axis}"] - place[f"{first}.{axis}"])
    return ahead, place[f"{second}.{vertical}"] - place[f"{first}.{vertical}"]


def foot_markers_angle(found: CurveColumns, mapped: AngleMap, shank: Signal) -> Signal:
    """Return the ankle angle [rad] of a line from heel to toes: flat, 90 deg plus the shank, less the neutral one."""
    ahead, up = between_markers(found, mapped, str(mapped.heel), str(mapped.toe))
    pitch = Signal(found.table.file, found.table.time, np.arctan2(up, ahead))
    seen = without_ends(pitch)
    inside = (seen.time >= shank.time[0]) & (seen.time <= shank.time[-1])
    time, values = seen.time[inside], seen.values[inside]
    lean = np.interp(time, shank.time, shank.values)
    flat = _flat(time, values, lean)
    if np.count_nonzero(flat) < _LEAST_FLAT * seen.rate:
        raise DataError(
            f"{found.table.file}: the line from {mapped.heel!r} to {mapped.toe!r} never stands still while the "
            "shank leans forward, so the zero of the ankle is unknown; give the angle itself in ankle_angle.terms "
            "of a gait map"
        )
    sign, neutral = mapped.sign_and_neutral()
    angle = 0.5 * np.pi + lean - (values - float(np.median(values[flat]))) - sign * neutral
    return Signal(found.table.file, time, angle)


def _flat(time: Floats, pitch: Floats, lean: Floats) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    if time.size < 3:
        return np.zeros(time.size, dtype=np.bool_)
    return np.asarray((np.abs(np.gradient(pitch, time)) < _SLOW) & (np.gradient(lean, time) < 0.0), dtype=np.bool_)
