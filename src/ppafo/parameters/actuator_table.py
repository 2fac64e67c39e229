"""Curves of a measured actuator through the volumes of its file: cubic splines in angle, linear in pressure.

``model/actuators/table.py`` evaluates these curves in a run.
"""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np

from ppafo.documents.toml_text import label
from ppafo.errors import ParameterError
from ppafo.model.actuators.table import BENDS, RISES, Curve, Rise, Table, TabulatedChamber
from ppafo.parameters.measured_volumes import MeasuredVolumes, read_measured_volumes
from ppafo.signals.recording import Floats

_POWERS = 4
"""Number of coefficients of the cubic polynomial in the first intervals of a spline."""
_UNREACHED = 1.0e12
"""Unreachable gauge pressure [Pa] and fraction of the angle range [-] for unused pressure intervals and knots, as
compiled code has a fixed number of both."""
_NOTHING = Curve((0.0,) * _POWERS, (0.0,) * BENDS)
_CHECKED_SHARES = np.linspace(0.0, 1.0, 201)
"""Fractions of the angle range [-] at which curves are checked; at most 12 angles are measured."""
_CLEAR = 1.0e-5
"""Margin of a moved curve above 0, in units of the last digit [-]."""
_ROUNDING = 1.0e-9
"""Largest negative volume, or fall with pressure, that counts as rounding error, relative to the largest volume [-]."""


def read_actuator_table(path: Path) -> Table:
    """Read the curves of a measured actuator from its file. Raises ParameterError if they cannot be built."""
    return table_of(read_measured_volumes(path), label(str(path)))


def table_of(measured: MeasuredVolumes, file: str) -> Table:
    """Return the curves through measured volumes; ``file`` is the label used in messages.

    If a curve would be negative between the angles or fall with the pressure, the volumes are moved within their last
    digit, as little as possible. Raises ParameterError if moves within the last digit are not enough.
    """
    angles = measured.angles
    shares = (angles - angles[0]) / (angles[-1] - angles[0])
    # A bend at each angle but the first two and the last two, so that there are as many coefficients as angles.
    bends = shares[2:-2]
    volume_1, _ = within_resolution(measured.volume_1, shares, measured.resolution_1)
    chamber_1 = _chamber(volume_1, measured.pressures, shares)
    _check_curves(chamber_1, bends, angles, "volume_1", file)
    if measured.volume_2 is None:
        chamber_2 = TabulatedChamber(_NOTHING, tuple(rise._replace(gain=_NOTHING) for rise in chamber_1.rises))
    else:
        volume_2, _ = within_resolution(measured.volume_2[::-1], 1.0 - shares[::-1], measured.resolution_2)
        chamber_2 = _chamber(volume_2[::-1], measured.pressures, shares)
        _check_curves(chamber_2, bends, angles, "volume_2", file)
    return Table(
        first_angle=float(angles[0]),
        last_angle=float(angles[-1]),
        per_angle=1.0 / float(angles[-1] - angles[0]),
        bends=(*bends.tolist(), *[_UNREACHED] * (BENDS - bends.size)),
        chamber_1=chamber_1,
        chamber_2=chamber_2,
    )


def largest_move(path: Path) -> tuple[float, float]:
    """Return the largest move of a volume in a file [m^3], and the last digit [m^3]; the move is 0 for exact curves."""
    measured = read_measured_volumes(path)
    shares = (measured.angles - measured.angles[0]) / (measured.angles[-1] - measured.angles[0])
    _, first = within_resolution(measured.volume_1, shares, measured.resolution_1)
    if measured.volume_2 is None:
        return first, measured.resolution_1
    _, second = within_resolution(measured.volume_2[::-1], 1.0 - shares[::-1], measured.resolution_2)
    return max((first, measured.resolution_1), (second, measured.resolution_2))


def within_resolution(volume: Floats, shares: Floats, resolution: float) -> tuple[Floats, float]:
    """Return volumes [m^3] (angles, pressures) moved to give admissible curves, and the largest move [m^3].

    Admissible curves are 0 or more, grow with the pressure and, at the highest pressure, grow from angle to angle.
    Linear programming minimises the largest move. No volume is moved if more than half of the last digit ``resolution``
    [m^3] would be needed.
    """
    bends = shares[2:-2]
    spline = _basis(_CHECKED_SHARES, bends)[:, : shares.size] @ np.linalg.inv(_basis(shares, bends)[:, : shares.size])
    angles, pressures = volume.shape
    rises = np.diff(np.eye(pressures), axis=0)
    rules = np.vstack(
        [
            np.kron(spline, np.eye(pressures)[:1]),
            *(np.kron(spline, rise[None, :]) for rise in rises),
            np.kron(np.diff(np.eye(angles), axis=0), np.eye(pressures)[-1:]),
        ]
    )
    found = rules @ volume.ravel()
    if resolution == 0.0 or found.min() >= -_ROUNDING * np.abs(volume).max():
        return volume, 0.0
    # SciPy is slow to load, and few tables need it.
    from scipy.optimize import linprog

    size = volume.size
    cost = np.append(np.zeros(size), 1.0)
    # In last digits. A little more than 0, for the solver is exact to 1e-7.
    limits = found / resolution - _CLEAR
    rules = np.hstack([-rules, np.zeros((rules.shape[0], 1))])
    moved = np.hstack([np.vstack([np.eye(size), -np.eye(size)]), -np.ones((2 * size, 1))])
    solved = linprog(
        cost,
        A_ub=np.vstack([rules, moved]),
        b_ub=np.append(limits, np.zeros(2 * size)),
        bounds=[*[(-0.5, 0.5)] * size, (0.0, 0.5)],
    )
    if solved.status != 0:
        return volume, 0.0
    return volume + resolution * solved.x[:size].reshape(volume.shape), float(resolution * solved.x[-1])


def measured_pressures(table: Table) -> tuple[float, float]:
    """Return lowest and highest measured gauge pressure [Pa]; infinite if the file has a single pressure."""
    rises = [rise for rise in table.chamber_1.rises if rise.lower < _UNREACHED]
    lowest = min((rise.lower for rise in rises), default=-math.inf)
    return lowest, max((rise.lower + rise.length for rise in rises), default=math.inf)


def _chamber(volume: Floats, pressures: Floats, shares: Floats) -> TabulatedChamber:
    """Return the curves of a chamber from volumes [m^3] (angles, pressures), gauge pressures [Pa], angle fractions."""
    rises = [
        Rise(float(lower), float(upper - lower), _curve(volume[:, index + 1] - volume[:, index], shares))
        for index, (lower, upper) in enumerate(pairwise(pressures))
    ]
    unreached = Rise(_UNREACHED, 1.0, _NOTHING)
    return TabulatedChamber(_curve(volume[:, 0], shares), (*rises, *[unreached] * (RISES - len(rises))))


def _curve(values: Floats, shares: Floats) -> Curve:
    """Return the cubic spline through values (angles,) with not-a-knot end conditions."""
    coefficients = np.linalg.solve(_basis(shares, shares[2:-2])[:, : values.size], values).tolist()
    powers, bends = coefficients[:_POWERS], coefficients[_POWERS:]
    return Curve((*powers, *[0.0] * (_POWERS - len(powers))), (*bends, *[0.0] * (BENDS - len(bends))))


def _basis(shares: Floats, bends: Floats) -> Floats:
    """Return the design matrix of a spline, of shape (shares, coefficients).

    The columns are the powers of the fraction of the angle range, then the cubes of its excess above each knot.
    """
    powers = shares[:, None] ** np.arange(_POWERS)
    return np.hstack([powers, np.maximum(shares[:, None] - bends, 0.0) ** 3])


def _check_curves(chamber: TabulatedChamber, bends: Floats, angles: Floats, name: str, file: str) -> None:
    """Raise ParameterError if a curve of a chamber becomes negative between the measured angles."""
    basis, curves = _basis(_CHECKED_SHARES, bends), (chamber.lowest, *(rise.gain for rise in chamber.rises))
    found = [basis @ np.array([*curve.powers, *curve.bends[: bends.size]]) for curve in curves]
    # Twice what is left as it is: there the same numbers are summed in another order.
    rounding = 2.0 * _ROUNDING * float(np.abs(sum(found)).max())
    for curve, values in zip(curves, found, strict=True):
        is_volume = curve is chamber.lowest
        if values.min() < -rounding:
            angle = angles[0] + _CHECKED_SHARES[int(np.argmin(values))] * (angles[-1] - angles[0])
            problem = "is negative" if is_volume else "falls with the pressure"
            raise ParameterError(
                f"{file}: between its angles the curve of {name} {problem} near {math.degrees(angle):.4g} deg; smooth "
                "the numbers, or measure more angles there"
            )
