"""The position or the acceleration of the knee in the sagittal plane, from recorded columns."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ppafo.errors import DataError, UnitError
from ppafo.gait.fourier import HARMONICS, fit_curve
from ppafo.gait.plausible.checked import SignSource, other_sign
from ppafo.gait.recorded.columns import CurveColumns, find_columns
from ppafo.gait.recorded.mapping import KneeMap
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats
from ppafo.units import parse_quantity

THIGH_FRACTION = 0.245
"""Hip to knee as a fraction of the stature: figure 4.1 of Winter, Biomechanics and Motor Control of Human Movement, 4th
ed. 2009."""

_LENGTHS = (0.2, 0.7)
_FASTEST_BACK = 0.2
"""Metres a second that a walker may lose on a treadmill, over the whole recording."""


def knee_signals(
    mapped: KneeMap, tables: Sequence[MotionTable], stature: float | None, is_default: bool
) -> dict[str, Signal]:
    """Return ``knee_forward`` and ``knee_up``, each a position [m] or an acceleration [m/s^2].

    With a thigh they are the way of the hip and that of the knee about it: in the plane, with the hip where the columns
    of the map say it is. DataError where a column, unit or length is missing or does not fit.
    """
    if mapped.thigh is not None and mapped.thigh_length is None and stature is None:
        if is_default:
            return {}
        raise DataError("knee.thigh needs a length: give knee.thigh_length in the gait map, or the stature")
    thigh = mapped.thigh or ()
    found = find_columns("knee", (*mapped.forward, *mapped.up, *thigh), tables, is_default, is_default)
    if found is None:
        return {}
    ends = len(mapped.forward), len(mapped.forward) + len(mapped.up)
    forward, unit = _part(found, slice(0, ends[0])).in_unit(mapped.unit, ("m/s^2", "m"))
    up, other = _part(found, slice(*ends)).in_unit(mapped.unit, ("m/s^2", "m"))
    if mapped.thigh is not None:
        if "m/s^2" in (unit, other):
            raise DataError(f"{found.table.file}: knee.thigh is added to positions of the hip in m, not to m/s^2")
        leaning = replace(_part(found, slice(ends[1], None)), unit_key="knee.thigh_unit")
        lean, _ = leaning.in_unit(mapped.thigh_unit, ("rad",))
        _check_hip_moves(mapped, found.table.file, forward, up)
        forward, up = knee_position(forward, up, lean, _thigh_length(mapped, stature))
    file, time = found.table.file, found.table.time
    columns = tuple(dict.fromkeys(name for _, name in found.terms))
    return {
        "knee_forward": Signal(file, time, forward, unit == "m", columns),
        "knee_up": Signal(file, time, up, other == "m", columns),
    }


def knee_remarks(mapped: KneeMap | None, walk: Mapping[str, Signal], stature: float | None) -> list[str]:
    """Return where the acceleration of the knee comes from, or why there is none; ``stature`` [m].

    DataError for a length of the thigh that is not plausible.
    """
    if mapped is None:
        return []
    if "knee_forward" not in walk:
        what = "no acceleration of the knee: it needs a length of the thigh; give --stature, or a gait map with "
        return [f"{what}knee.thigh_length"] if mapped.thigh is not None else []
    remarks = []
    if mapped.thigh is not None and mapped.thigh_length is None:
        remarks.append(
            f"thigh of {_thigh_length(mapped, stature):.3f} m: {THIGH_FRACTION:g} of the stature (Winter 2009)"
        )
    if walk["knee_forward"].is_position:
        remarks.append(
            f"acceleration of the knee from a series of {HARMONICS['knee_forward']} harmonics of its position"
        )
    return remarks


def check_way(walk: Mapping[str, Signal], signs_from: SignSource) -> None:
    """Raise DataError for a knee that moves backwards; on a treadmill it stays about where it is."""
    knee = walk.get("knee_forward")
    if knee is None or not knee.is_position:
        return
    speed = float((knee.values[-1] - knee.values[0]) / (knee.time[-1] - knee.time[0]))
    if speed < -_FASTEST_BACK:
        raise DataError(
            f"{knee.file}: the knee goes back by {-speed:.2g} m/s: knee.forward points against the "
            "direction of walking; "
            f"{other_sign(signs_from, 'the sign of knee.forward')}"
        )


def knee_position(hip_forward: Floats, hip_up: Floats, lean: Floats, thigh_length: float) -> tuple[Floats, Floats]:
    """Return where the knee is, forward and up [m]; the thigh leans by this [rad], above 0 with the knee in front."""
    return hip_forward + thigh_length * np.sin(lean), hip_up - thigh_length * np.cos(lean)


def acceleration_of(position: Floats, harmonics: int, stride_time: float) -> Floats:
    """Return the acceleration [m/s^2] of a position [m] over one stride of this time [s], at as many phases.

    The mean speed is taken out, a Fourier series fitted, and the series differentiated twice.
    """
    phase = np.linspace(0.0, 1.0, position.size)
    curve, _ = fit_curve(position - (position[-1] - position[0]) * phase, harmonics)
    return curve.derivative(stride_time).derivative(stride_time).values_at(phase)


def _check_hip_moves(mapped: KneeMap, file: str, forward: Floats, up: Floats) -> None:
    for values, terms in ((forward, mapped.forward), (up, mapped.up)):
        if np.ptp(values) == 0.0:
            raise DataError(
                f"{file}: the hip does not move ({', '.join(terms)} is constant), and without its motion "
                "that of the knee "
                "is unknown; omit the stature, or knee in the gait map"
            )


def _part(found: CurveColumns, chosen: slice) -> CurveColumns:
    return replace(found, terms=found.terms[chosen])


def _thigh_length(mapped: KneeMap, stature: float | None) -> float:
    if mapped.thigh_length is None:
        return THIGH_FRACTION * (stature or 0.0)
    place, (low, high) = f"knee.thigh_length = {mapped.thigh_length!r}", _LENGTHS
    try:
        length = parse_quantity(mapped.thigh_length, "m")
    except UnitError as error:
        raise DataError(f"{place}: {error}") from error
    if not low <= length <= high:
        raise DataError(f"{place} is not plausible; a thigh is {low:g} to {high:g} m long")
    return length
