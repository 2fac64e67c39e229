"""Knee of a recorded walk: position from hip and thigh or from columns, walking direction, and remarks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ppafo.errors import DataError, UnitError, refused_as
from ppafo.gait.gait import HARMONICS
from ppafo.gait.recorded.columns import find_columns
from ppafo.gait.recorded.mapping import KneeMap, setting_text
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats
from ppafo.units import parse_quantity

THIGH_FRACTION = 0.245
"""Thigh length as a fraction of the stature: figure 4.1 of Winter, Biomechanics and Motor Control of Human Movement,
4th ed. 2009."""
_LENGTHS = (0.2, 0.7)
"""Plausible lengths of a thigh [m]."""
_HIP_HEIGHT = 0.3
"""Depth of the hip below the origin [m] above which the sign is wrong; laboratories have no origin above the hip."""
_FASTEST_BACK = 0.2
"""Largest backward speed [m/s] on a treadmill, averaged over the recording."""


def knee_signals(
    mapped: KneeMap, tables: Sequence[MotionTable], stature: float | None, is_default: bool
) -> dict[str, Signal]:
    """Return ``knee_forward`` and ``knee_up``, each a position [m] or an acceleration [m/s^2].

    With a thigh, they are the position of the knee, computed in the sagittal plane from the hip position in the columns
    of the map and the lean of the thigh. Raises DataError if a column, unit or length is missing or inconsistent.
    """
    if mapped.thigh is not None and mapped.thigh_length is None and stature is None:
        if is_default:
            return {}
        raise DataError("knee.thigh needs knee.thigh_length, or the stature")
    thigh = mapped.thigh or ()
    found = find_columns("knee", (*mapped.forward, *mapped.up, *thigh), tables, is_default)
    if found is None:
        return {}
    ends = len(mapped.forward), len(mapped.forward) + len(mapped.up)
    forward, unit = replace(found, terms=found.terms[: ends[0]]).in_unit(mapped.unit, ("m/s^2", "m"))
    up, other = replace(found, terms=found.terms[slice(*ends)]).in_unit(mapped.unit, ("m/s^2", "m"))
    if mapped.thigh is not None:
        if "m/s^2" in (unit, other):
            raise DataError(f"{found.table.file}: knee.thigh needs hip positions in m, not accelerations in m/s^2")
        leaning = replace(found, terms=found.terms[ends[1] :], unit_key="knee.thigh_unit")
        lean, _ = leaning.in_unit(mapped.thigh_unit, ("rad",))
        for values, terms in ((forward, mapped.forward), (up, mapped.up)):
            if np.ptp(values) == 0.0:
                raise DataError(f"{found.table.file}: the hip does not move ({', '.join(terms)} is constant)")
        height = float(np.mean(up[np.isfinite(up)]))
        if -height > _HIP_HEIGHT:
            raise DataError(
                f"{found.table.file}: the hip is {height:.2f} m high ({', '.join(mapped.up)}): the sign of knee.up is "
                "reversed"
            )
        # The file has the hip: the knee follows by the lean of the thigh.
        forward, up = knee_position(forward, up, lean, _thigh_length(mapped, stature))
    file, time = found.table.file, found.table.time
    columns = tuple(dict.fromkeys(name for _, name in found.terms))
    return {
        "knee_forward": Signal(file, time, forward, unit == "m", columns),
        "knee_up": Signal(file, time, up, other == "m", columns),
    }


def knee_remarks(mapped: KneeMap | None, walk: Mapping[str, Signal], stature: float | None) -> list[str]:
    """Return remarks on the source of the knee's acceleration, or the reason for its absence; ``stature`` in [m].

    Raises DataError for an implausible length of the thigh.
    """
    if mapped is None or "knee_forward" not in walk:
        lacks_length = mapped is not None and mapped.thigh is not None
        why = f"the thigh length is unknown without {setting_text('stature')}" if lacks_length else "it has no columns"
        return [f"no acceleration of the knee: {why}"]
    remarks = []
    if mapped.thigh is not None and mapped.thigh_length is None:
        remarks.append(
            f"thigh length is {_thigh_length(mapped, stature):.3f} m, {THIGH_FRACTION:g} of the stature (Winter 2009)"
        )
    if walk["knee_forward"].is_position:
        remarks.append(
            f"acceleration of the knee from a Fourier series of its position, {HARMONICS['knee_forward']} harmonics"
        )
    return remarks


def check_direction(walk: Mapping[str, Signal]) -> None:
    """Raise DataError for a knee that moves backwards; on a treadmill, the knee stays in about the same place."""
    knee = walk.get("knee_forward")
    if knee is None or not knee.is_position:
        return
    speed = float((knee.values[-1] - knee.values[0]) / (knee.time[-1] - knee.time[0]))
    if speed < -_FASTEST_BACK:
        raise DataError(
            f"{knee.file}: the knee moves backwards at {-speed:.2g} m/s, so knee.forward points against the "
            "walking direction"
        )


def knee_position(hip_forward: Floats, hip_up: Floats, lean: Floats, thigh_length: float) -> tuple[Floats, Floats]:
    """Return the knee position, forward and up [m]; ``lean`` of the thigh [rad], positive with the knee in front."""
    return hip_forward + thigh_length * np.sin(lean), hip_up - thigh_length * np.cos(lean)


def _thigh_length(mapped: KneeMap, stature: float | None) -> float:
    if mapped.thigh_length is None:
        return THIGH_FRACTION * (stature or 0.0)
    where, (low, high) = f"knee.thigh_length = {mapped.thigh_length!r}", _LENGTHS
    with refused_as(DataError, where, UnitError):
        length = parse_quantity(mapped.thigh_length, "m")
    if not low <= length <= high:
        raise DataError(f"{where}: must be from {low:g} to {high:g} m")
    return length
