"""The curves of a measured actuator, from the volumes in its file: splines over the angle, straight over the pressure.

``model/actuators/table.py`` has what they are in a run.
"""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np

from ppafo.documents.toml_text import label
from ppafo.errors import ParameterError
from ppafo.model.actuators.table import BENDS, RISES, Chamber, Curve, Rise, Table
from ppafo.parameters.measured_volumes import MeasuredVolumes, read_measured_volumes
from ppafo.signals.recording import Floats

_POWERS = 4
"""Coefficients of the cubic that a spline is over its first stretches."""
_UNREACHED = 1.0e12
"""A gauge pressure [Pa] and a share of the range [-] that nothing comes to, where a stretch or a bend is not needed:
compiled code has room for a fixed number of both."""
_NOTHING = Curve((0.0,) * _POWERS, (0.0,) * BENDS)
_CHECKED_SHARES = np.linspace(0.0, 1.0, 201)
"""Shares of the range of angles [-] at which a curve is looked at; at most 12 angles were measured."""
_ROUNDING_VOLUME = 1.0e-12
"""Size of a negative volume [m^3] that is rounding of the spline."""
_ROUNDING_SHARE = 1.0e-9
"""Size of a fall with the pressure, over the largest growth, that is rounding of the spline."""


def read_actuator_table(path: Path) -> Table:
    """Return the curves of a measured actuator from its file; ParameterError, with the file, for one without curves."""
    return table_of(read_measured_volumes(path), label(str(path)))


def table_of(measured: MeasuredVolumes, file: str) -> Table:
    """Return the curves through measured volumes; ``file`` is what messages call them.

    ParameterError for angles so far apart that a curve between them is negative, or falls with the pressure.
    """
    angles = measured.angles
    shares = (angles - angles[0]) / (angles[-1] - angles[0])
    # A bend at each angle but the first two and the last two, so that there are as many coefficients as angles.
    bends = shares[2:-2]
    chamber_1 = _chamber(measured.volume_1, measured.pressures, shares)
    _check_curves(chamber_1, bends, angles, "volume_1", file)
    if measured.volume_2 is None:
        chamber_2 = Chamber(_NOTHING, tuple(rise._replace(gain=_NOTHING) for rise in chamber_1.rises))
    else:
        chamber_2 = _chamber(measured.volume_2, measured.pressures, shares)
        _check_curves(chamber_2, bends, angles, "volume_2", file)
    return Table(
        first_angle=float(angles[0]),
        last_angle=float(angles[-1]),
        per_angle=1.0 / float(angles[-1] - angles[0]),
        bends=(*bends.tolist(), *[_UNREACHED] * (BENDS - bends.size)),
        chamber_1=chamber_1,
        chamber_2=chamber_2,
    )


def highest_pressure(table: Table) -> float:
    """Return the highest pressure measured [Pa, gauge]; infinity where one pressure stands for all."""
    ends = [rise.lower + rise.length for rise in table.chamber_1.rises if rise.lower < _UNREACHED]
    return max(ends, default=math.inf)


def _chamber(volume: Floats, pressures: Floats, shares: Floats) -> Chamber:
    """Return a chamber from its volumes [m^3] (angles, pressures) at gauge pressures [Pa] and shares of the range."""
    rises = [
        Rise(float(lower), float(upper - lower), _curve(volume[:, index + 1] - volume[:, index], shares))
        for index, (lower, upper) in enumerate(pairwise(pressures))
    ]
    unreached = Rise(_UNREACHED, 1.0, _NOTHING)
    return Chamber(_curve(volume[:, 0], shares), (*rises, *[unreached] * (RISES - len(rises))))


def _curve(values: Floats, shares: Floats) -> Curve:
    """Return the spline through values (angles,) that is one cubic over its first two and last two stretches."""
    coefficients = np.linalg.solve(_basis(shares, shares[2:-2])[:, : values.size], values).tolist()
    powers, bends = coefficients[:_POWERS], coefficients[_POWERS:]
    return Curve((*powers, *[0.0] * (_POWERS - len(powers))), (*bends, *[0.0] * (BENDS - len(bends))))


def _basis(shares: Floats, bends: Floats) -> Floats:
    """Return what the coefficients of a curve stand before, (shares, coefficients).

    These are the powers of the share, and the cube of what it is beyond each bend.
    """
    powers = shares[:, None] ** np.arange(_POWERS)
    return np.hstack([powers, np.maximum(shares[:, None] - bends, 0.0) ** 3])


def _check_curves(chamber: Chamber, bends: Floats, angles: Floats, name: str, file: str) -> None:
    """Refuse a chamber of which a curve swings so far between the angles that it is negative."""
    basis = _basis(_CHECKED_SHARES, bends)
    for curve in (chamber.lowest, *(rise.gain for rise in chamber.rises)):
        values = basis @ np.array([*curve.powers, *curve.bends[: bends.size]])
        is_volume = curve is chamber.lowest
        rounding = _ROUNDING_VOLUME if is_volume else _ROUNDING_SHARE * float(np.abs(values).max())
        if values.min() < -rounding:
            angle = angles[0] + _CHECKED_SHARES[int(np.argmin(values))] * (angles[-1] - angles[0])
            problem = "is negative" if is_volume else "falls with the pressure"
            raise ParameterError(
                f"{file}: between its angles the curve of {name} {problem} near {math.degrees(angle):.4g} deg; smooth "
                "the numbers, or measure more angles there"
            )
