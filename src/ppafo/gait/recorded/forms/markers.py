"""Markers and model outputs under their usual laboratory names, and detection of the laboratory axes."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.form import Convention
from ppafo.gait.recorded.mapping import (
    AngleMap,
    Axis,
    ForceMap,
    GaitMap,
    KneeMap,
    MomentMap,
    ShankMap,
    Side,
    Vertical,
    unsaid_axes,
)
from ppafo.gait.recorded.table import MotionTable, metres_in
from ppafo.signals.recording import Floats

PLATE = "force plate "
"""Prefix of the columns ``force plate 1.x``, ``.y``, ``.z`` [N]: force on a plate in laboratory axes."""

_FORWARDS: tuple[Axis, ...] = ("x", "y", "z", "-x", "-y", "-z")

_UPWARDS: tuple[Vertical, ...] = ("x", "y", "z")

_ANGLES = "ankleangles?v?"

_MOMENTS = "anklemoments?v?"

_REACTIONS = ("groundreactionforcev?", "normali[sz]edgrfv?")

_KNEES = ("kne", "kneelat", "knee", "kneestudy", "kjc", "feo")

_ANKLES = ("ank", "anklelat", "ankle", "anklestudy", "ajc", "tio")

_HEELS = ("hee", "heel", "calc", "calcstudy")

_TOES = ("toe", "toetip", "toestudy", "mt2")

_LEAST_WAY = 0.5
"""Travel of a marker [m] above which it shows the direction of walking; on a treadmill the travel is shorter."""

_MOST_OF_A_WALK = 0.9
"""Fraction of the samples in which the toe is behind the heel along a reversed axis."""

_MOST_OBLIQUE = 25.0
"""Largest angle [deg] between walking direction and laboratory axis; the shank lean is then 10 % too small."""


def marker_convention(table: MotionTable, side: Side, body_mass: float) -> Convention:
    """Return the map of Plug-in Gait markers and outputs, with the laboratory axes detected from the markers."""
    foot = side[0]
    labels = _recorded_labels(table)
    pairs = (tuple(_label(labels, f"{foot}{name}") for name in names) for names in zip(_KNEES, _ANKLES, strict=True))
    # Where there are none Plug-in Gait's, for the message that says so.
    usual = (f"{foot.upper()}KNE", f"{foot.upper()}ANK")
    shin = next(((str(knee), str(ankle)) for knee, ankle in pairs if knee and ankle), None)
    knee, ankle = shin or usual
    forward, vertical, remarks = _axes(table, knee, ankle, foot, labels)
    backwards = "-" if forward.startswith("-") else ""
    angles = _label(labels, foot + _ANGLES)
    heel, toe = (_first(labels, foot, names) for names in (_HEELS, _TOES))
    # The model's own angle is preferred: its zero comes from a static trial.
    if angles is None and heel is not None and toe is not None:
        # Without markers of the shank the axes are unknown: those of a gait map's shank follow later.
        axes: dict[str, Any] = {"forward": forward, "vertical": vertical} if shin else {}
        angle = AngleMap(heel=heel, toe=toe, positive="plantarflexion", **axes)
    else:
        column = f"{angles or foot.upper() + 'AnkleAngles'}.x"
        angle = AngleMap(terms=(column,), positive="dorsiflexion", unit="deg")
    # The measured loads, each in the unit that its magnitude shows. Without the axis upwards there is no force.
    loads = dict[str, Any]()
    on_loads = list[tuple[str, str]]()
    moment = _label(labels, foot + _MOMENTS)
    if moment is not None and _is_measured(table, f"{moment}.x"):
        unit, said = load_unit(table, f"{moment}.x", "moment", body_mass)
        loads["ankle_moment"] = MomentMap(terms=(f"{moment}.x",), positive="plantarflexion", unit=unit)
        on_loads += [("ankle_moment", remark) for remark in said]
    reactions = [f"{name}.{vertical}" for each in _REACTIONS if shin and (name := _label(labels, foot + each))]
    force = next((name for name in reactions if _is_measured(table, name)), None)
    if force is not None:
        unit, said = load_unit(table, force, "force", body_mass)
        loads["vertical_force"] = ForceMap(terms=(force,), unit=unit or "-")
        on_loads += [("vertical_force", remark) for remark in said]
    columns = GaitMap(
        shank_angle=ShankMap(knee=knee, ankle=ankle, forward=forward, vertical=vertical),
        ankle_angle=angle,
        knee=KneeMap(forward=(f"{backwards}{knee}.{forward[-1]}",), up=(f"{knee}.{vertical}",)),
        **loads,
    )
    plates = tuple(name for name in table.columns if name.startswith(PLATE) and name.endswith(f".{vertical}"))
    return Convention(columns, plates, remarks, tuple(on_loads))


def convention_of_map(columns: GaitMap, tables: Sequence[MotionTable], side: Side) -> Convention:
    """Return a user's map, completed from the markers with laboratory axes and force plates.

    Force plates are added only if the map names no vertical force.
    """
    shank = columns.shank_angle
    table = next((table for table in tables if f"{shank.knee}.x" in table.columns), None)
    if table is None or shank.knee is None or shank.ankle is None:
        return Convention(columns, (), tuple(unsaid_axes(columns)))
    labels = _recorded_labels(table)
    _check_forward(table, columns, side[0], labels)
    mapped: dict[str, ShankMap | AngleMap] = {"shank_angle": shank, "ankle_angle": columns.ankle_angle}
    unsaid = [name for name, each in mapped.items() if each.terms is None and not (each.forward and each.vertical)]
    remarks: tuple[str, ...] = ()
    if unsaid and {shank.knee, shank.ankle} <= set(labels):
        forward, vertical, remarks = _axes(table, shank.knee, shank.ankle, side[0], labels)
        changed: dict[str, Any] = {
            name: replace(each, forward=each.forward or forward, vertical=each.vertical or vertical)
            for name, each in mapped.items()
            if name in unsaid
        }
        columns = replace(columns, **changed)
    else:
        remarks = tuple(unsaid_axes(columns))
    vertical = columns.shank_angle.axes[1]
    is_free = columns.vertical_force is None
    plates = tuple(name for name in table.columns if is_free and name.startswith(PLATE) and name.endswith(vertical))
    return Convention(columns, plates, remarks)


def _check_forward(table: MotionTable, columns: GaitMap, foot: str, labels: Sequence[str]) -> None:
    """Raise DataError for a forward axis of a map against which the foot points or, without a foot, the ankle moves."""
    shank = columns.shank_angle
    ankle = columns.ankle_angle
    heel = ankle.heel or _first(labels, foot, _HEELS)
    toe = ankle.toe or _first(labels, foot, _TOES)
    for name, mapped in (("shank_angle", shank), ("ankle_angle", ankle)):
        if mapped.terms is not None or mapped.forward is None:
            continue
        axis = mapped.forward[-1]
        sign = -1.0 if mapped.forward.startswith("-") else 1.0
        tip, back, way = (table.columns.get(f"{label}.{axis}") for label in (toe, heel, shank.ankle))
        is_reversed = False
        if tip is not None and back is not None:
            ahead = sign * (tip - back)[np.isfinite(tip - back)]
            # A foot swings about its axis, but never points back for most of a walk.
            is_reversed = ahead.size > 0 and float(np.quantile(ahead, _MOST_OF_A_WALK)) < 0.0
            why = f"{toe!r} is behind {heel!r} along it"
        elif way is not None and np.isfinite(way).any():
            seen = way[np.isfinite(way)]
            is_reversed = sign * float(seen[-1] - seen[0]) < -_LEAST_WAY / metres_in(table, f"{shank.ankle}.{axis}")
            why = f"{shank.ankle!r} travels against it"
        if is_reversed:
            other = axis if sign < 0.0 else f"-{axis}"
            raise DataError(
                f"{table.file}: {name}.forward = {mapped.forward!r} is reversed: {why}; the axis is {other!r}"
            )


def _recorded_labels(table: MotionTable) -> list[str]:
    """Return the labels of points that have a value in at least one frame; a joint centre of a model may have none."""
    names = [name for name in table.columns if "." in name and _is_measured(table, name)]
    return list(dict.fromkeys(name.rpartition(".")[0] for name in names))


def _label(labels: Sequence[str], pattern: str) -> str | None:
    """Return the shortest label that matches a pattern, or None; case, punctuation and blanks are ignored."""
    # The shortest: model outputs often add a suffix to the plain name.
    matching = [label for label in labels if re.fullmatch(pattern, re.sub(r"[.\s_-]", "", label), re.IGNORECASE)]
    return min(matching, key=len, default=None)


def _first(labels: Sequence[str], foot: str, names: Sequence[str]) -> str | None:
    """Return the label of a foot's marker by the first usual name that is present, or None."""
    return next(filter(None, (_label(labels, foot + name) for name in names)), None)


def _is_measured(table: MotionTable, name: str) -> bool:
    values = table.columns[name]
    return bool(np.any(np.isfinite(values) & (values != 0.0)))


def _axes(
    table: MotionTable, knee: str, ankle: str, foot: str, labels: Sequence[str]
) -> tuple[Axis, Vertical, tuple[str, ...]]:
    """Return the axes along the walk and upwards, and a remark if these are not x and z.

    Upwards is the direction from ankle to knee. The direction of walking follows from the ankle's travel, or from the
    foot if the ankle hardly travels. The foot determines the sign, because over a part of a stride on a treadmill the
    ankle may travel backwards.
    """
    at_knee = _point(table, knee)
    at_ankle = _point(table, ankle)
    if at_knee is None or at_ankle is None:
        return "x", "z", ()
    apart = at_knee - at_ankle
    # From ankle to knee is large and steady upwards alone: forwards it is small or swings.
    up = int(np.argmax(np.abs(np.nanmean(apart, axis=1)) - 2.0 * np.nanstd(apart, axis=1)))
    # How far a point went, (3,), from where it is first seen to where it is last seen.
    seen = np.flatnonzero(np.isfinite(at_ankle).all(axis=0))
    travel = at_ankle[:, seen[-1]] - at_ankle[:, seen[0]] if seen.size else np.zeros(3)
    # The mean direction from heel to toes, (3,), of the samples at which both are seen.
    pointing = None
    at_heel, at_toe = (_point(table, _first(labels, foot, names) or "") for names in (_HEELS, _TOES))
    if at_heel is not None and at_toe is not None:
        shoe = at_toe - at_heel
        both = np.isfinite(shoe).all(axis=0)
        pointing = shoe[:, both].mean(axis=1) if both.any() else None
    if np.hypot(*np.delete(travel, up)) < _LEAST_WAY / metres_in(table, f"{ankle}.x"):
        if pointing is None:
            return "x" if up else "y", _UPWARDS[up], ()
        travel = pointing
    elif pointing is not None and np.delete(pointing, up) @ np.delete(travel, up) < 0.0:
        # The ankle's travel says the axis, the foot the direction: on a treadmill both may differ.
        travel = -travel
    along = max((axis for axis in range(3) if axis != up), key=lambda axis: abs(float(travel[axis])))
    # Indices of the axes are 0, 1 and 2, whose sum is 3.
    across = 3 - up - along
    oblique = float(np.degrees(np.arctan2(abs(travel[across]), abs(travel[along]))))
    if oblique > _MOST_OBLIQUE:
        raise DataError(
            f"{table.file}: walking direction is {oblique:.0f} deg off axis {'xyz'[along]}, at most {_MOST_OBLIQUE:g}"
        )
    forward = _FORWARDS[along + 3 * bool(travel[along] < 0.0)]
    remarks = () if (forward, up) == ("x", 2) else (f"walking direction is {forward}, upwards is {'xyz'[up]}",)
    return forward, _UPWARDS[up], remarks


def _point(table: MotionTable, label: str) -> Floats | None:
    rows = [table.columns.get(f"{label}.{axis}") for axis in "xyz"]
    return None if any(row is None for row in rows) else np.array(rows)


_FACTORS = {
    "moment": {"N m/kg": 1.0, "N mm/kg": 1.0e-3, "N m": None, "N mm": None},
    "force": {"N/kg": 1.0, "N": None, "": 9.8, "percent": 0.098},
}
"""Factors from units to N m/kg or N/kg; None if the factor is the inverse of the body mass."""


_PLAUSIBLE = {"moment": (0.35, 2.6), "force": (5.5, 20.0)}
"""Plausible peaks in walking [N m/kg] and [N/kg]; up to a body mass of 130 kg only one unit fits."""


def load_unit(table: MotionTable, name: str, kind: str, body_mass: float) -> tuple[str, list[str]]:
    """Return the unit of a column of ``kind`` "moment" or "force", and a remark if it differs from the file's.

    The stated unit is used if the values are plausible for walking in that unit, or in no unit; otherwise the only
    plausible unit is used.
    """
    values = np.abs(table.columns[name][np.isfinite(table.columns[name])])
    stated = table.units.get(name, "")
    # Not the largest: one spike would choose another unit.
    peak = float(np.percentile(values, 99.5)) if values.size else 0.0
    low, high = _PLAUSIBLE[kind]
    fitting = []
    for unit, factor in _FACTORS[kind].items():
        per_mass = (1.0e-3 if unit == "N mm" else 1.0) / body_mass if factor is None else factor
        fitting += [unit] if low <= per_mass * peak <= high else []
    # The stated unit is believed where it can be true, and where nothing else can.
    if stated in fitting or (not fitting and stated in _FACTORS[kind]):
        return stated, []
    if len(fitting) != 1:
        known = ", ".join(repr(unit) for unit in _FACTORS[kind])
        raise DataError(
            f"{table.file}: column {name!r} reaches {peak:.4g} ({stated or 'no unit'}), which is implausible for a "
            f"{kind} in walking, in any of {known}"
        )
    was = f"the file states {stated!r}" if stated in _FACTORS[kind] else "the file states no unit"
    return fitting[0], [f"column '{name}' was read in {fitting[0] or 'body weights'}, from its magnitude: {was}"]
