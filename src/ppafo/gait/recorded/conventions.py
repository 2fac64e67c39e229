"""The gait map of files that come without one: labels, axes and units as laboratories and programs write them."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.mapping import (
    AngleMap,
    Axis,
    ForceMap,
    GaitMap,
    KneeMap,
    MomentMap,
    PressureMap,
    ShankMap,
    Side,
    Vertical,
    opensim_map,
    package_map,
)
from ppafo.gait.recorded.table import CSV, OPENSIM, PLATE, MotionTable
from ppafo.signals.recording import Floats

_FORWARDS: tuple[Axis, ...] = ("x", "y", "z", "-x", "-y", "-z")
_UPWARDS: tuple[Vertical, ...] = ("x", "y", "z")
_WORD = re.compile(r"[a-z]+|\d+")
_SIDES = {"right": {"r", "right"}, "left": {"l", "left"}}
_ANGLES = "ankleangles?v?"
_MOMENTS = "anklemoments?v?"
_REACTIONS = ("groundreactionforcev?", "normali[sz]edgrfv?")
_KNEES = ("kne", "kneelat", "knee", "kneestudy", "kjc", "feo")
_ANKLES = ("ank", "anklelat", "ankle", "anklestudy", "ajc", "tio")
_HEELS = ("hee", "heel", "calc", "calcstudy")
_TOES = ("toe", "toetip", "toestudy", "mt2")
_LEAST_WAY = 0.5
"""Metres; a marker that goes further shows the direction of walking, a shorter way is that of a treadmill."""
_MOST_OBLIQUE = 25.0
"""Degrees between walk and axis; the lean of the shank is short by 10 % there."""


@dataclass(frozen=True, slots=True)
class Convention:
    """The map of files that come without one, columns of force plates to choose by the foot's motion, and remarks."""

    columns: GaitMap
    plates: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def find_convention(tables: Sequence[MotionTable], side: Side, body_mass: float) -> Convention:
    """Return the map of files by what is in them; ``body_mass`` [kg] tells moments of a body from those per mass."""
    forms = sorted({table.form for table in tables})
    if CSV in forms and len(forms) > 1:
        raise DataError(
            f"the files have different formats ({', '.join(forms)}); name the columns of all of them in a gait map"
        )
    if forms == [CSV]:
        if side != "right":
            raise DataError(
                "a CSV file without a gait map has the columns of one foot; --side left has no meaning there"
            )
        return Convention(package_map(side))
    found = [
        _of_opensim(table, side) if table.form == OPENSIM else _of_markers(table, side, body_mass) for table in tables
    ]
    # One convention for all files: each curve is from the first file that has its columns.
    known = {name for table in tables for name in table.columns}
    columns = {}
    for name in GaitMap.model_fields:
        choices = [getattr(item.columns, name) for item in found]
        fitting = [item for item in choices if name != "schema_version" and item and _is_there(item, known)]
        columns[name] = fitting[0] if fitting else choices[0]
    plates = tuple(dict.fromkeys(plate for item in found for plate in item.plates))
    remarks = tuple(dict.fromkeys(remark for item in found for remark in item.remarks))
    has_force = columns["vertical_force"] is not None and _is_there(columns["vertical_force"], known)
    return Convention(GaitMap(**columns), () if has_force else plates, remarks)


def _is_there(mapped: object, known: set[str]) -> bool:
    return all(name.removeprefix("-") in known for name in column_names(mapped))


def column_names(mapped: object) -> tuple[str, ...]:
    """Return the columns that the map of one curve names, a minus before those that are taken away."""
    if isinstance(mapped, KneeMap):
        return (*mapped.forward, *mapped.up, *(mapped.thigh or ()))
    if isinstance(mapped, ShankMap) and mapped.terms is None:
        return _marker_columns((mapped.knee, mapped.ankle), mapped.forward, mapped.vertical)
    if isinstance(mapped, AngleMap) and mapped.terms is None:
        return _marker_columns((mapped.heel, mapped.toe), mapped.forward, mapped.vertical)
    terms: tuple[str, ...] = getattr(mapped, "terms")  # noqa: B009  # every other map has them, by its own class
    return terms


def _marker_columns(markers: Sequence[str | None], forward: str, vertical: str) -> tuple[str, ...]:
    return tuple(f"{marker}.{axis}" for marker in markers for axis in (forward.removeprefix("-"), vertical))


def _of_opensim(table: MotionTable, side: Side) -> Convention:
    """Return the map of OpenSim's labels; a force plate with a number only is of the foot that moves with it."""
    usual = opensim_map(side).model_copy(update=_own_columns(table, side[0]))
    own, other, numbered = _forces(table.columns, side)
    if own or (other and len(numbered) == 1):
        terms = own or numbered
        said = (f"vertical force: the sum of {' and '.join(terms)}",) if len(terms) > 1 else ()
        return Convention(usual.model_copy(update={"vertical_force": ForceMap(terms=terms)}), (), said)
    if len(numbered) == 1 and side == "right":
        return Convention(usual.model_copy(update={"vertical_force": ForceMap(terms=numbered)}))
    return Convention(usual.model_copy(update={"vertical_force": None}), numbered)


_ALONG = np.radians(5.0)
"""Mean rotation of the pelvis up to which a walk counts as one along x."""


def turned_forward(table: MotionTable) -> MotionTable:
    """Return an OpenSim table with ``pelvis_tx``, ``_tz`` and ``_tilt`` of a walk along x, whichever way it goes.

    The pelvis is turned about z by the tilt t, about x by the list l, then about y by the rotation. A walker who faces
    by r (its mean) to the left of x goes along h = (cos r, 0, -sin r) and leans against it by what the upright of the
    pelvis, (-sin t cos l, cos t cos l, sin l), has in that direction. A walk within 5 deg of x stays as it is.
    """
    names = ("pelvis_tx", "pelvis_tz", "pelvis_rotation")
    if table.form != OPENSIM or any(name not in table.columns for name in names):
        return table
    degree = {name: np.pi / 180.0 if table.units.get(name) == "deg" else 1.0 for name in table.columns}
    rotation = table.columns["pelvis_rotation"] * degree["pelvis_rotation"]
    facing = float(np.arctan2(np.nanmean(np.sin(rotation)), np.nanmean(np.cos(rotation))))
    if abs(facing) <= _ALONG:
        return table
    cosine, sine = np.cos(facing), np.sin(facing)
    x, z = table.columns["pelvis_tx"], table.columns["pelvis_tz"]
    columns = {**table.columns, "pelvis_tx": cosine * x - sine * z, "pelvis_tz": sine * x + cosine * z}
    if "pelvis_tilt" in columns:
        tilt = columns["pelvis_tilt"] * degree["pelvis_tilt"]
        tipped = columns["pelvis_list"] * degree["pelvis_list"] if "pelvis_list" in columns else 0.0 * tilt
        forward = -np.sin(tilt) * np.cos(tipped) * cosine - np.sin(tipped) * sine
        columns["pelvis_tilt"] = np.arctan2(-forward, np.cos(tilt) * np.cos(tipped)) / degree["pelvis_tilt"]
    said = (
        f"the walk goes {np.degrees(facing):.0f} deg to the left of x (pelvis_rotation): the pelvis is turned into it"
    )
    return replace(table, columns=columns, remarks=(*table.remarks, said))


def _own_columns(table: MotionTable, foot: str) -> dict[str, object]:
    """Return the maps of what this package writes for OpenSim beside its coordinates (``storage/opensim.py``)."""
    found: dict[str, object] = {}
    if f"shank_angle_{foot}" in table.columns:
        found["shank_angle"] = ShankMap(terms=(f"shank_angle_{foot}",))
    if {"knee_forward", "knee_up"} <= set(table.columns):
        found["knee"] = KneeMap(forward=("knee_forward",), up=("knee_up",), unit="m/s^2")
    if "centre_of_pressure" in table.columns:
        found["centre_of_pressure"] = PressureMap(terms=("centre_of_pressure",), unit="m")
    return found


def _forces(names: Iterable[str], side: Side) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return the columns of vertical force that name this foot, the other foot, or none."""
    own: list[str] = []
    other: list[str] = []
    numbered: list[str] = []
    for name in names:
        words = _WORD.findall(name.lower())
        if "force" not in words or words[-1] != "vy":
            continue
        sides = {foot for foot, marks in _SIDES.items() if marks & set(words)}
        (numbered if len(sides) != 1 else own if side in sides else other).append(name)
    return tuple(own), tuple(other), tuple(numbered)


def _of_markers(table: MotionTable, side: Side, body_mass: float) -> Convention:
    """Return the map of markers and outputs of Plug-in Gait, with the axes of the laboratory found in the markers."""
    foot = side[0]
    labels = list(dict.fromkeys(name.rpartition(".")[0] for name in table.columns if "." in name))
    knee, ankle = _pair(labels, foot)
    forward, vertical, remarks = _axes(table, knee, ankle, foot, labels)
    backwards = "-" if forward.startswith("-") else ""
    angle, said = _ankle_map(labels, foot, (forward, vertical))
    loads, units = _load_maps(table, labels, foot, vertical, body_mass)
    columns = GaitMap(
        shank_angle=ShankMap(knee=knee, ankle=ankle, forward=forward, vertical=vertical),
        ankle_angle=angle,
        knee=KneeMap(forward=(f"{backwards}{knee}.{forward[-1]}",), up=(f"{knee}.{vertical}",)),
        **loads,
    )
    plates = tuple(name for name in table.columns if name.startswith(PLATE) and name.endswith(f".{vertical}"))
    return Convention(columns, plates, (*remarks, *said, *units))


def _pair(labels: Sequence[str], foot: str) -> tuple[str, str]:
    """Return the labels of knee and ankle; those of Plug-in Gait where there are none, for the message that says so."""
    for names in zip(_KNEES, _ANKLES, strict=True):
        knee, ankle = (_label(labels, f"{foot}{name}") for name in names)
        if knee is not None and ankle is not None:
            return knee, ankle
    return f"{foot.upper()}KNE", f"{foot.upper()}ANK"


def _label(labels: Sequence[str], pattern: str) -> str | None:
    """Return the shortest label that matches, whatever its case; points and lines in it do not count."""
    matching = [label for label in labels if re.fullmatch(pattern, re.sub(r"[.\s_-]", "", label), re.IGNORECASE)]
    return min(matching, key=len, default=None)


def _first(labels: Sequence[str], foot: str, names: Sequence[str]) -> str | None:
    """Return the label of a foot's marker by the first of its usual names that is there."""
    return next(filter(None, (_label(labels, foot + name) for name in names)), None)


def _ankle_map(labels: Sequence[str], foot: str, axes: tuple[Axis, Vertical]) -> tuple[AngleMap, tuple[str, ...]]:
    """Return the ankle angle of the model, or from heel and toe where the file has only markers."""
    angles = _label(labels, foot + _ANGLES)
    heel, toe = (_first(labels, foot, names) for names in (_HEELS, _TOES))
    if angles is None and heel is not None and toe is not None:
        forward, vertical = axes
        said = f"ankle angle from the markers {heel} and {toe}; its zero is the foot that stands flat"
        mapped = AngleMap(heel=heel, toe=toe, forward=forward, vertical=vertical, positive="plantarflexion")
        return mapped, (said,)
    column = f"{angles or foot.upper() + 'AnkleAngles'}.x"
    return AngleMap(terms=(column,), positive="dorsiflexion", unit="deg"), ()


def _load_maps(
    table: MotionTable, labels: Sequence[str], foot: str, vertical: str, body_mass: float
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the maps of the loads that were measured, each with the unit that its size shows, and remarks."""
    found: dict[str, Any] = {}
    remarks: list[str] = []
    moment = _label(labels, foot + _MOMENTS)
    if moment is not None and _is_measured(table, f"{moment}.x"):
        unit, said = load_unit(table, f"{moment}.x", "moment", body_mass)
        found["ankle_moment"] = MomentMap(terms=(f"{moment}.x",), positive="plantarflexion", unit=unit)
        remarks += said
    reactions = (_label(labels, foot + name) for name in _REACTIONS)
    force = next(
        (f"{name}.{vertical}" for name in reactions if name and _is_measured(table, f"{name}.{vertical}")), None
    )
    if force is not None:
        unit, said = load_unit(table, force, "force", body_mass)
        found["vertical_force"] = ForceMap(terms=(force,), unit=unit or "-")
        remarks += said
    return found, tuple(remarks)


def _is_measured(table: MotionTable, name: str) -> bool:
    values = table.columns[name]
    return bool(np.any(np.isfinite(values) & (values != 0.0)))


def _axes(
    table: MotionTable, knee: str, ankle: str, foot: str, labels: Sequence[str]
) -> tuple[Axis, Vertical, tuple[str, ...]]:
    """Return the axes along the walk and upwards, and a remark where they are not x and z.

    Upwards is from ankle to knee; the walk follows the ankle's travel, or the foot where the ankle hardly travels. The
    foot gives the sign: over part of a stride on a treadmill the ankle may travel backwards.
    """
    at_knee, at_ankle = _point(table, knee), _point(table, ankle)
    if at_knee is None or at_ankle is None:
        return "x", "z", ()
    apart = at_knee - at_ankle
    up = int(np.argmax(np.abs(np.nanmean(apart, axis=1)) - 2.0 * np.nanstd(apart, axis=1)))
    # How far a point went, (3,), from where it is first seen to where it is last seen.
    seen = np.flatnonzero(np.isfinite(at_ankle).all(axis=0))
    way = at_ankle[:, seen[-1]] - at_ankle[:, seen[0]] if seen.size else np.zeros(3)
    pointing = _pointing(table, foot, labels)
    if np.hypot(*np.delete(way, up)) < _LEAST_WAY * _per_metre(table, ankle):
        if pointing is None:
            return "x" if up else "y", _UPWARDS[up], ()
        way = pointing
    elif pointing is not None and np.delete(pointing, up) @ np.delete(way, up) < 0.0:
        way = -way
    along = max((axis for axis in range(3) if axis != up), key=lambda axis: abs(float(way[axis])))
    across = 3 - up - along
    oblique = float(np.degrees(np.arctan2(abs(way[across]), abs(way[along]))))
    if oblique > _MOST_OBLIQUE:
        raise DataError(
            f"{table.file}: the walk goes {oblique:.0f} deg off the axis {'xyz'[along]} of the laboratory, and "
            f"the lean of the shank is seen along an axis, to {_MOST_OBLIQUE:g} deg; rotate "
            "the coordinates so that one axis points along the walk"
        )
    forward = _FORWARDS[along + 3 * bool(way[along] < 0.0)]
    said = () if (forward, up) == ("x", 2) else (f"the walk goes along {forward}, upwards is {'xyz'[up]}",)
    return forward, _UPWARDS[up], said


def _point(table: MotionTable, label: str) -> Floats | None:
    rows = [table.columns.get(f"{label}.{axis}") for axis in "xyz"]
    return None if any(row is None for row in rows) else np.array(rows)


def _pointing(table: MotionTable, foot: str, labels: Sequence[str]) -> Floats | None:
    """Return the mean way from heel to toes, (3,); None where the markers are not there or never seen together."""
    at_heel, at_toe = (_point(table, _first(labels, foot, names) or "") for names in (_HEELS, _TOES))
    if at_heel is None or at_toe is None:
        return None
    apart = at_toe - at_heel
    seen = np.isfinite(apart).all(axis=0)
    return np.asarray(apart[:, seen].mean(axis=1)) if seen.any() else None


def _per_metre(table: MotionTable, label: str) -> float:
    return {"m": 1.0, "cm": 100.0}.get(table.units.get(f"{label}.x", ""), 1000.0)


_FACTORS = {
    "moment": {"N m/kg": 1.0, "N mm/kg": 1.0e-3, "N m": None, "N mm": None},
    "force": {"N/kg": 1.0, "N": None, "": 9.8, "percent": 0.098},
}
"""What makes N m/kg or N/kg of a number in the unit; None where the body mass does."""

_PLAUSIBLE = {"moment": (0.35, 2.6), "force": (5.5, 20.0)}
"""Peaks of walking in N m/kg and N/kg, narrow enough for no two units to fit up to a body mass of 130 kg."""


def load_unit(table: MotionTable, name: str, kind: str, body_mass: float) -> tuple[str, list[str]]:
    """Return the unit of a column of ``kind`` "moment" or "force", and a remark where it is not what the file states.

    The stated unit is taken where the numbers can be walking in it, else the only one in which they can.
    """
    values = np.abs(table.columns[name][np.isfinite(table.columns[name])])
    stated = table.units.get(name, "")
    peak = float(np.percentile(values, 99.5)) if values.size else 0.0
    low, high = _PLAUSIBLE[kind]
    fitting = []
    for unit, factor in _FACTORS[kind].items():
        per_mass = (1.0e-3 if unit == "N mm" else 1.0) / body_mass if factor is None else factor
        fitting += [unit] if low <= per_mass * peak <= high else []
    if stated in fitting or (not fitting and stated in _FACTORS[kind]):
        return stated, []
    if len(fitting) != 1:
        known = ", ".join(repr(unit) for unit in _FACTORS[kind])
        raise DataError(
            f"{table.file}: column {name!r} reaches {peak:.4g} and its unit, {stated or 'not stated'!r}, does not fit "
            f"a {kind} of walking; give it in a gait map: {known}"
        )
    was = f"the file states {stated!r}" if stated in _FACTORS[kind] else "the file does not state it"
    return fitting[0], [f"column '{name}' was read in {fitting[0] or 'body weights'} by its size: {was}"]
