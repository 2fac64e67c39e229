"""Curves of a measured actuator through the volumes of its file: cubic splines in angle, linear in pressure.

``model/actuators/table.py`` evaluates these curves in a run.
"""

import math
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

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
_FELT = 0.01
"""Standard deviation of the torque from which rounded volumes are smoothed, relative to the largest torque [-]."""
_ROUNDING = 1.0e-9
"""Largest negative volume, or fall with pressure, that counts as rounding error, relative to the largest volume [-]."""


def read_actuator_table(path: Path) -> Table:
    """Read the curves of a measured actuator from its file. Raises ParameterError if they cannot be built."""
    return table_of(read_measured_volumes(path), label(str(path)))


def table_of(measured: MeasuredVolumes, file: str) -> Table:
    """Return the curves through measured volumes; ``file`` is the label used in messages.

    Volumes are moved within half of their last digit: if it matters to the torque, to the likeliest smooth curves, and
    if a curve would be negative between the angles or fall with the pressure, as little as possible. Raises
    ParameterError if moves within the last digit are not enough.
    """
    angles = measured.angles
    shares = (angles - angles[0]) / (angles[-1] - angles[0])
    # A bend at each angle but the first two and the last two, so that there are as many coefficients as angles.
    bends = shares[2:-2]
    first, second = _fitted_chambers(measured)
    chamber_1 = _chamber(first.volume, measured.pressures, shares)
    _check_curves(chamber_1, bends, angles, "volume_1", file)
    if second is None:
        chamber_2 = TabulatedChamber(_NOTHING, tuple(rise._replace(gain=_NOTHING) for rise in chamber_1.rises))
    else:
        chamber_2 = _chamber(second.volume[::-1], measured.pressures, shares)
        _check_curves(chamber_2, bends, angles, "volume_2", file)
    return Table(
        first_angle=float(angles[0]),
        last_angle=float(angles[-1]),
        per_angle=1.0 / float(angles[-1] - angles[0]),
        bends=(*bends.tolist(), *[_UNREACHED] * (BENDS - bends.size)),
        chamber_1=chamber_1,
        chamber_2=chamber_2,
    )


class FittedVolumes(NamedTuple):
    """Volumes of a chamber [m^3] (angles, pressures) on admissible curves; ``resolution`` [m^3] is their last digit.

    ``move`` is the largest move of a volume [m^3]; ``torque_error`` [-] is the largest standard deviation of the torque
    that rounding leaves, at any angle and the highest pressure, relative to the largest torque.
    """

    volume: Floats
    resolution: float
    move: float
    torque_error: float


def rounding_of_table(path: Path) -> FittedVolumes:
    """Return the fitted volumes of the chamber of a file in which rounding matters most to the torque."""
    chambers = (chamber for chamber in _fitted_chambers(read_measured_volumes(path)) if chamber is not None)
    return max(chambers, key=lambda chamber: (chamber.torque_error, chamber.move))


def _fitted_chambers(measured: MeasuredVolumes) -> tuple[FittedVolumes, FittedVolumes | None]:
    """Return the fitted volumes of both chambers; those of chamber 2 with falling angle, None if there is none."""
    shares = (measured.angles - measured.angles[0]) / (measured.angles[-1] - measured.angles[0])
    first = within_resolution(measured.volume_1, shares, measured.pressures, measured.resolution_1)
    if measured.volume_2 is None:
        return first, None
    turned, falling = 1.0 - shares[::-1], measured.volume_2[::-1]
    return first, within_resolution(falling, turned, measured.pressures, measured.resolution_2)


def within_resolution(volume: Floats, shares: Floats, pressures: Floats, resolution: float) -> FittedVolumes:
    """Return volumes [m^3] (angles, pressures) moved to give admissible curves, by half of the last digit at most.

    Admissible curves are 0 or more, grow with the pressure and, at the highest pressure, grow from angle to angle.
    Linear programming minimises the sum of the moves from the likeliest smooth curves. No volume is moved if more than
    half of the last digit ``resolution`` [m^3] would be needed.
    """
    bends = shares[2:-2]
    to_coefficients = np.asarray(np.linalg.inv(_basis(shares, bends)[:, : shares.size]), dtype=np.float64)
    spline = _basis(_CHECKED_SHARES, bends)[:, : shares.size] @ to_coefficients
    fitted, torque_error = _likeliest(volume, to_coefficients, bends, spline, pressures, resolution)
    angles, count = volume.shape
    rises = np.diff(np.eye(count), axis=0)
    rules = np.vstack(
        [
            np.kron(spline, np.eye(count)[:1]),
            *(np.kron(spline, rise[None, :]) for rise in rises),
            np.kron(np.diff(np.eye(angles), axis=0), np.eye(count)[-1:]),
        ]
    )
    found = rules @ fitted.ravel()
    if resolution > 0.0 and found.min() < -_ROUNDING * np.abs(volume).max():
        # SciPy is slow to load, and few tables need it.
        from scipy.optimize import linprog

        size = volume.size
        # In last digits. A little more than 0, for the solver is exact to 1e-7.
        limits, moved = found / resolution - _CLEAR, ((fitted - volume) / resolution).ravel()
        # Each move is the difference of two numbers of 0 or more, of which the sum is least.
        solved = linprog(
            np.ones(2 * size),
            A_ub=np.hstack([-rules, rules]),
            b_ub=limits,
            bounds=[(0.0, end) for end in (*np.maximum(0.5 - moved, 0.0), *np.maximum(0.5 + moved, 0.0))],
        )
        fitted = (
            volume if solved.status else fitted + resolution * (solved.x[:size] - solved.x[size:]).reshape(volume.shape)
        )
    return FittedVolumes(fitted, resolution, float(np.abs(fitted - volume).max()), torque_error)


def _likeliest(
    volume: Floats, to_coefficients: Floats, bends: Floats, spline: Floats, pressures: Floats, resolution: float
) -> tuple[Floats, float]:
    """Return the likeliest volumes [m^3] of smooth curves, and the standard deviation of the torque that is left [-].

    Rounding is an error of resolution / sqrt(12). The third derivatives of the splines are taken as normal, of the
    variance with the largest marginal likelihood. Volumes whose rounding does not matter to the torque stay.
    """
    # Torque at the highest pressure: the integral of dV/dangle over the pressure, here per angle range.
    weights = 0.5 * (np.diff(pressures, prepend=pressures[0]) + np.diff(pressures, append=pressures[-1]))
    weights = weights if pressures.size > 1 else np.ones(1)
    slopes = np.gradient(spline, _CHECKED_SHARES, axis=0, edge_order=2)
    largest = float(np.abs(slopes @ volume @ weights).max())
    per_error = float(np.linalg.norm(weights)) / largest if largest > 0.0 else 0.0
    noise = resolution / math.sqrt(12.0)
    as_it_is = per_error * noise * float(np.linalg.norm(slopes, axis=1).max())
    if as_it_is < _FELT or len(to_coefficients) < _POWERS:
        return volume, as_it_is
    lengths = np.diff(np.concatenate([[0.0], bends, [1.0]]))
    third = np.cumsum(to_coefficients[3:], axis=0) * np.sqrt(lengths)[:, None]
    roughness, modes = np.linalg.eigh(third.T @ third)
    # Parabolas are smooth.
    rough, amplitudes = roughness[3:], modes.T @ volume
    squares = np.square(amplitudes[3:]).sum(axis=1)
    variances = np.geomspace(1.0e-6, 1.0e6, 121)[:, None] * noise**2 * np.median(rough) / rough
    totals = noise**2 + variances
    costs = (squares / totals + pressures.size * np.log(totals)).sum(axis=1)
    best = int(np.argmin(costs))
    kept = np.concatenate([np.ones(3), variances[best] / totals[best]])
    smoothed = modes @ (kept[:, None] * amplitudes)
    left = per_error * noise * math.sqrt(float((np.square(slopes @ modes) @ kept).max()))
    return volume + np.clip(smoothed - volume, -0.5 * resolution, 0.5 * resolution), left


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
            problem = "is negative" if is_volume else "decreases with pressure"
            raise ParameterError(
                f"{file}: between the measured angles the interpolated {name} {problem} near "
                f"{math.degrees(angle):.4g} deg; smooth the volumes, or measure at more angles there"
            )
