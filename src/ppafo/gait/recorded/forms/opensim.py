"""OpenSim's tables of motion and force (.mot, .sto), and CSV files with OpenSim's column names, as gait recordings.

The header of a table ends with the line ``endheader``; it has ``nRows=211`` and ``inDegrees=yes`` (or the sentence
"Angles are in degrees."), or ``datarows 9009`` in the older style. One line of labels and the rows follow.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, refused_as
from ppafo.gait.recorded.delimited import NumberBlock, cells_of, tabbed_lines, table_of
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.forms.comma_separated import plain_names, read_plain_csv
from ppafo.gait.recorded.mapping import AngleMap, ForceMap, GaitMap, KneeMap, MomentMap, PressureMap, ShankMap, Side
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import TIME
from ppafo.storage.files import read_bytes
from ppafo.storage.opensim import END, KIND
from ppafo.wording import LONGEST_SHOWN, finite_number, one_line

_CSV = ".csv"
_STATE = re.compile(r".*/([^/]+)/value")
"""Pattern of a coordinate among OpenSim's states, such as ``/jointset/ankle_r/ankle_angle_r/value``."""
_COUNT = re.compile(r"(nRows|nColumns|datarows|datacolumns)\s*(?:=|\s)\s*(\S+)", re.IGNORECASE)
_DEGREES = re.compile(r"inDegrees\s*=\s*(\w+)", re.IGNORECASE)
_SENTENCE = re.compile(r"angles are in (degrees|radians)", re.IGNORECASE)
_ANGLES = {"yes": "deg", "degrees": "deg", "no": "rad", "radians": "rad"}
_MOST_DIGITS = 11
"""Largest number of digits in a header count."""
_KNEE = "knee_angle_"
_TURN = 45.0
"""Rotation of the pelvis [deg] above which a walk is not straight; a straight walk has 5 to 30 deg."""


def _is_table(path: str | Path) -> bool:
    """Return True for a table with a single header line, by the suffix of the file or the content of a .txt file."""
    suffix = Path(path).suffix.lower()
    if suffix == ".txt":
        return re.search(rb"(?mi)^\s*endheader\s*$", read_bytes(path)) is None
    return suffix in (_CSV, ".tsv")


def _read(path: str | Path) -> MotionTable:
    """Return the table of either form with the units implied by OpenSim's labels."""
    if not _is_table(path):
        return read_opensim(path)
    plain = read_plain_csv(path)
    return replace(plain, units={name: unit or unit_of_label(name, name, "") for name, unit in plain.units.items()})


def read_opensim(path: str | Path) -> MotionTable:
    """Return the table of a ``.mot`` or ``.sto`` file. Raises DataError with file, line and column of an error.

    A coordinate that is named by its path among the states is also available under its own name. A column count in the
    header that contradicts all rows, and last rows that repeat a time, are repaired with a remark.
    """
    lines = tabbed_lines(path)
    with refused_as(DataError, path, DataError):
        counts, angle, kind, end = _header(lines)
        at = next((number for number in range(end + 1, len(lines)) if lines[number].strip()), None)
        if at is None:
            raise DataError(f"has nothing after '{END}': the file is cut off")
        # Labels may hold blanks where tabs separate them.
        labels = cells_of(lines[at].strip(), "\t" if "\t" in lines[at] else None)
        if labels[0].lower() != TIME:
            first = one_line(labels[0])[:LONGEST_SHOWN]
            raise DataError(f"line {at + 1}: the first column must be '{TIME}', not {first!r}")
        if "" in labels:
            raise DataError(f"line {at + 1}: column {labels.index('') + 1} has no name")
        rows = "\n".join(lines[at + 1 :]).rstrip().split("\n")
        remarks = []
        if rows == [""]:
            raise DataError("has labels but no rows")
        empty = next((number for number, row in enumerate(rows, at + 2) if not row.strip()), None)
        if empty is not None:
            raise DataError(f"line {empty} has 0 values for {len(labels)} columns")
        stated = counts.get("nrows", counts.get("datarows", len(rows)))
        if stated != len(rows):
            raise DataError(f"has {len(rows)} rows, but the header states {stated}: the file is cut off or was edited")
    count = counts.get("ncolumns", counts.get("datacolumns", len(labels)))
    if count != len(labels):
        remarks.append(f"the header states {count} columns, but labels and rows have {len(labels)}, which were read")
    # Some tools repeat the last time.
    kept = len(rows)
    while kept > 1 and _time_of(rows[kept - 1]) == _time_of(rows[kept - 2]):
        kept -= 1
    if kept < len(rows):
        remarks.append(f"{len(rows) - kept} of the last rows repeat the time {_time_of(rows[-1])} s and were dropped")
    block = NumberBlock(lines[: at + 1 + kept], at + 1, None, is_ragged=False)
    table = table_of(path, block, labels, [""] * len(labels), labels[0], kind=kind)
    # The older style of SIMM has its angles in degrees.
    is_unstated = not angle and "datacolumns" in counts
    angle = "deg" if is_unstated else angle
    paths = {match[1]: name for name in table.columns if (match := _STATE.fullmatch(name))}
    columns = {**table.columns, **{name: table.columns[path] for name, path in paths.items()}}
    units = {name: unit_of_label(paths.get(name, name), name, angle) for name in columns}
    remarks += table.remarks
    if is_unstated and "deg" in units.values():
        remarks.append("the header states no unit of angles; degrees assumed, as in older OpenSim files")
    return replace(table, columns=columns, units=units, remarks=tuple(remarks))


def _time_of(row: str) -> float | str:
    cell = row.split(maxsplit=1)[0]
    time = finite_number(cell)
    return cell if time is None else time


def _header(lines: Sequence[str]) -> tuple[dict[str, int], str, str, int]:
    """Return counts by key in lower case, unit of angles, kind and last line of a header. Raises DataError."""
    end = next((index for index, line in enumerate(lines) if line.strip().lower() == END), None)
    if end is None:
        raise DataError(f"has no line '{END}': the header is cut off, or this is not a .mot or .sto file")
    counts = {}
    angle = ""
    kind = ""
    for number, line in enumerate(map(str.strip, lines[:end]), start=1):
        if count := _COUNT.match(line):
            text = count[2]
            if not (text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS):
                raise DataError(f"line {number}: {count[1]} is {one_line(text)[:LONGEST_SHOWN]!r}, not a whole number")
            counts[count[1].lower()] = int(text)
        if stated := _DEGREES.match(line) or _SENTENCE.search(line):
            unit = _ANGLES.get(stated[1].lower())
            if unit is None:
                word = one_line(stated[1])[:LONGEST_SHOWN]
                raise DataError(f"line {number}: inDegrees is {word!r}; it must be 'yes' or 'no'")
            if angle not in ("", unit):
                raise DataError(f"line {number}: the header states both degrees and radians")
            angle = unit
        kind = kind or next((known for known in ("simulated", "synthetic") if line == f"{KIND}{known}"), "")
    return counts, angle, kind or "measured", end


def unit_of_label(path: str, label: str, angle: str) -> str:
    """Return the unit implied by an OpenSim label; ``angle`` is the unit of angles, ``path`` the path of a state."""
    if path != label:
        # States are in radians and metres whatever the header says of other columns.
        angle = angle or "rad"
    if label.endswith("_moment") or "torque" in label or label.endswith(("_mx", "_my", "_mz")):
        return "N m"
    if label.endswith("_force") or label.endswith(("_vx", "_vy", "_vz")):
        return "N"
    return "m" if label.endswith(("_tx", "_ty", "_tz", "_px", "_py", "_pz")) else angle


_WORD = re.compile(r"[a-z]+|\d+")
_SIDES = {"right": {"r", "right"}, "left": {"l", "left"}}


def opensim_convention(table: MotionTable, side: Side, _body_mass: float) -> Convention:
    """Return the map of OpenSim's labels; a force plate known only by number belongs to the foot that moves with it.

    In OpenSim's gait models the knee is negative in flexion as in gait2392, the ankle positive in dorsiflexion. The
    shank angle is the sum of pelvis tilt, hip flexion and knee flexion in the sagittal plane. The lean of the thigh is
    computed in the same way, with the hip at the origin of the pelvis.
    """
    foot = side[0]
    terms = []
    for name in ("pelvis_tilt", f"hip_flexion_{foot}", f"{_KNEE}{foot}"):
        flexion = table.columns.get(name) if name.startswith(_KNEE) else None
        # Where its flexion counts above 0, as in the newer OpenSim models, the knee is subtracted.
        counts_above = flexion is not None and bool(np.nanmax(flexion) > -np.nanmin(flexion))
        terms.append(f"-{name}" if counts_above else name)
    # Columns that this package adds to the coordinates of OpenSim (``storage/opensim.py``) are read as they are.
    own_shank = f"shank_angle_{foot}"
    own_knee = {"knee_forward", "knee_up"} <= set(table.columns)
    has_pressure = "centre_of_pressure" in table.columns
    usual = GaitMap(
        shank_angle=ShankMap(terms=(own_shank,) if own_shank in table.columns else tuple(terms)),
        ankle_angle=AngleMap(terms=(f"ankle_angle_{foot}",), positive="dorsiflexion"),
        ankle_moment=MomentMap(terms=(f"ankle_angle_{foot}_moment",), positive="dorsiflexion"),
        centre_of_pressure=PressureMap(terms=("centre_of_pressure",), unit="m") if has_pressure else None,
        knee=KneeMap(forward=("knee_forward",), up=("knee_up",), unit="m/s^2")
        if own_knee
        else KneeMap(forward=("pelvis_tx",), up=("pelvis_ty",), thigh=("pelvis_tilt", f"hip_flexion_{foot}")),
    )
    # Columns of vertical force that name this foot, the other foot, or none.
    forces: tuple[list[str], list[str], list[str]] = ([], [], [])
    own, other, numbered = forces
    for name in table.columns:
        words = _WORD.findall(name.lower())
        if "force" not in words or words[-1] != "vy":
            continue
        sides = {foot for foot, marks in _SIDES.items() if marks & set(words)}
        (numbered if len(sides) != 1 else own if side in sides else other).append(name)
    if own or (other and len(numbered) == 1):
        plates = tuple(own or numbered)
        summed = f"vertical force: the sum of {' and '.join(plates)}"
        remarks = (("vertical_force", summed),) if len(plates) > 1 else ()
        return Convention(replace(usual, vertical_force=ForceMap(terms=plates)), curve_remarks=remarks)
    if len(numbered) == 1 and side == "right":
        return Convention(replace(usual, vertical_force=ForceMap(terms=tuple(numbered))))
    return Convention(usual, tuple(numbered))


_ALONG = np.radians(5.0)
"""Mean rotation of the pelvis [rad] up to which a walk counts as parallel to x."""


def _turned_forward(table: MotionTable) -> MotionTable:
    """Return an OpenSim table with ``pelvis_tx``, ``_tz`` and ``_tilt`` rotated such that the walk is along x.

    The orientation of the pelvis is a rotation about z by the tilt t, about x by the list l, then about y by the
    rotation. A walker with the mean rotation r to the left of x walks along h = (cos r, 0, -sin r). The new tilt
    follows from the component along h of the pelvis axis (-sin t cos l, cos t cos l, sin l). A walk within 5 deg of x
    is returned unchanged.
    """
    names = ("pelvis_tx", "pelvis_tz", "pelvis_rotation")
    if any(name not in table.columns for name in names):
        return table
    degree = {name: np.pi / 180.0 if table.units.get(name) == "deg" else 1.0 for name in table.columns}
    rotation = table.columns["pelvis_rotation"] * degree["pelvis_rotation"]
    facing = float(np.arctan2(np.nanmean(np.sin(rotation)), np.nanmean(np.cos(rotation))))
    seen = rotation[np.isfinite(rotation)]
    turned = float(np.degrees(np.ptp(np.unwrap(seen)))) if seen.size else 0.0
    if turned > _TURN:
        table = replace(
            table,
            remarks=(
                *table.remarks,
                f"the walker turns by {turned:.0f} deg (pelvis_rotation); angles refer to the mean walking direction",
            ),
        )
    if abs(facing) <= _ALONG:
        return table
    cosine = np.cos(facing)
    sine = np.sin(facing)
    x = table.columns["pelvis_tx"]
    z = table.columns["pelvis_tz"]
    columns = {**table.columns, "pelvis_tx": cosine * x - sine * z, "pelvis_tz": sine * x + cosine * z}
    if "pelvis_tilt" in columns:
        tilt = columns["pelvis_tilt"] * degree["pelvis_tilt"]
        tipped = columns["pelvis_list"] * degree["pelvis_list"] if "pelvis_list" in columns else 0.0 * tilt
        forward = -np.sin(tilt) * np.cos(tipped) * cosine - np.sin(tipped) * sine
        columns["pelvis_tilt"] = np.arctan2(-forward, np.cos(tilt) * np.cos(tipped)) / degree["pelvis_tilt"]
    remarks = (
        f"walking direction is {np.degrees(facing):.0f} deg to the left of x (pelvis_rotation); the pelvis was rotated "
        "to x"
    )
    return replace(table, columns=columns, remarks=(*table.remarks, remarks))


FORM = GaitForm(
    name="opensim",
    summary="OpenSim's .mot and .sto, and CSV files with OpenSim's names of columns",
    suffixes=(".mot", ".sto", _CSV, ".txt", ".tsv"),
    read=_read,
    convention=opensim_convention,
    # A plain CSV file has OpenSim's name of an ankle coordinate.
    recognises=lambda path: not _is_table(path) or any(name.startswith("ankle_angle_") for name in plain_names(path)),
    arrange=_turned_forward,
)
