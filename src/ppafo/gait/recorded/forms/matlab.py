"""MATLAB files with curves over time, named by their variables or by labels stored beside a matrix."""

import re
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.forms.opensim import opensim_convention, unit_of_label
from ppafo.gait.recorded.mapping import Side, package_map
from ppafo.gait.recorded.table import MotionTable
from ppafo.storage.matlab import MATLAB_SUFFIX, read_matlab

_TIMES = ("time", "t", "tout")
_OPENSIM = re.compile(r"ankle_angle_[rl].*|.*_force_v[xyz]|.*_moment|pelvis_.*")
"""Pattern of OpenSim's column labels."""
_DEGREES = re.compile(r"inDegrees\s*=\s*(yes|no)", re.IGNORECASE)
_THREE = re.compile(r"(?P<name>.*)\(:,(?P<number>[123])\)")


def _read(path: str | Path) -> MotionTable:
    """Read the variables that are as long as the time; a matrix of three columns is also available as a marker.

    The columns of a marker are named ``RKNE.x``, ``.y`` and ``.z``. Raises DataError if no variable is a time.
    """
    file = read_matlab(path)
    name = next((name for name in file.columns if name.rpartition(".")[2].lower() in _TIMES), None)
    if name is None:
        names = ", ".join(list(file.columns)[:12])
        raise DataError(f"{path}: there is no variable 'time' or 't'; available: {names}{file.advice_on_objects()}")
    time = file.columns[name]
    columns = {other: values for other, values in file.columns.items() if other != name and values.size == time.size}
    columns |= {
        f"{match['name']}.{'xyz'[int(match['number']) - 1]}": values
        for other, values in columns.items()
        if (match := _THREE.fullmatch(other)) and f"{match['name']}(:,4)" not in file.columns
    }
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        raise DataError(f"{path}: variable '{name}' must increase, but does not after sample {stalled[0] + 1}")
    # The unit of angles that the kept header of an OpenSim table states.
    stated = [match[1].lower() for word in file.words if (match := _DEGREES.search(word))]
    angle = {"yes": "deg", "no": "rad"}[stated[0]] if stated else ""
    is_opensim = any(map(_OPENSIM.fullmatch, columns))
    units = {other: unit_of_label(other, other, angle) if is_opensim else "" for other in columns}
    return MotionTable(str(path), time, columns, units)


def _convention(table: MotionTable, side: Side, body_mass: float) -> Convention:
    """Return the map of OpenSim's labels if the table has them, otherwise of the names of the package."""
    if any(map(_OPENSIM.fullmatch, table.columns)):
        return opensim_convention(table, side, body_mass)
    return Convention(package_map())


FORM = GaitForm(
    name="matlab",
    summary="MATLAB files with OpenSim's labels or the names of this package, or others with a gait map",
    suffixes=(MATLAB_SUFFIX,),
    read=_read,
    convention=_convention,
)
