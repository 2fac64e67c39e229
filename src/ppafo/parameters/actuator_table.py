"""Volume table of a measured actuator, and curves through it: cubic splines in angle, linear in pressure.

    angle [deg],pressure [kPa_g],volume_1 [mL],volume_2 [mL]

One line of the file for each angle and pressure, columns and lines in any order; a line that begins with # is a
comment. Without a column ``volume_2`` the actuator has one chamber, and chamber 2 consists only of its dead volume.
``model/actuators/table.py`` evaluates these curves in a run.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise, product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.toml_text import label
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.actuators.table import BENDS, MOST_ANGLES, MOST_PRESSURES, RISES, Curve, Rise, Table, TabulatedChamber
from ppafo.parameters.number_table import LONGEST, lines_of_table, numbers_of_table
from ppafo.signals.recording import Floats
from ppafo.units import to_si
from ppafo.units.shown import counted_from, shown_in, shown_text
from ppafo.wording import nearest_name, one_line, said_missing

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
_NEEDED = ("angle", "pressure", "volume_1")
_NEAREST_ANGLES = 0.01
"""Least distance of two angles, as a fraction of their range [-], for a smooth spline."""
_NEAREST_PRESSURES = 1.0
"""Least distance of two pressures [Pa] that are not the same pressure."""
_STEPS = (1, 2, 5, 10, 20, 50, 100)
"""Possible rounding steps of readings, in units of the last digit."""
_TELLING = 10
"""Number of different values from which a common step is no coincidence."""


class _VolumeColumn(NamedTuple):
    """Column of a volume table: SI unit, largest accepted magnitude [SI], and an example of a unit."""

    unit: str
    largest: float
    example: str


COLUMNS = {
    "angle": _VolumeColumn("rad", 10.0, "deg"),
    "pressure": _VolumeColumn("Pa_a", 1.0e7, "kPa_g"),
    "volume_1": _VolumeColumn("m^3", 1.0, "mL"),
    "volume_2": _VolumeColumn("m^3", 1.0, "mL"),
}


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredVolumes:
    """Measured chamber volumes [m^3], each of shape (angles, pressures).

    ``angles`` [rad] and ``pressures`` [Pa, gauge] increase. ``volume_2`` is None for an actuator with one chamber.
    ``resolution_1`` and ``resolution_2`` [m^3] are the rounding steps of the volumes.
    """

    angles: Floats
    pressures: Floats
    volume_1: Floats
    volume_2: Floats | None
    resolution_1: float = 0.0
    resolution_2: float = 0.0


def read_measured_volumes(path: Path) -> MeasuredVolumes:
    """Read the volume table of a measured actuator. Raises ParameterError with file and line of a fault."""
    file = label(str(path))
    (_, header), *rows = lines_of_table(path, file, "angle [deg],pressure [kPa_g],volume_1 [mL]")
    units = _units(header, file)
    numbers = numbers_of_table(rows, tuple(units), file)
    columns: dict[str, Floats] = {}
    digits: dict[str, float] = {}
    for index, (name, unit) in enumerate(units.items()):
        declared = COLUMNS[name]
        # Over a vacuum a gauge pressure is its own SI value.
        column = np.array([to_si(row[index], unit, declared.unit, 0.0) for row in numbers])
        worst = int(np.argmax(np.abs(column)))
        if abs(column[worst]) > declared.largest:
            raise ParameterError(
                f"{file}, line {rows[worst][0]}: {name} = {numbers[worst][index]:g} {unit} exceeds "
                f"{declared.largest:g} {declared.unit.removesuffix('_a')}"
            )
        columns[name] = column
        step = _step([Decimal(cells[index]) for _, cells in rows])
        digits[name] = abs(to_si(step, unit, declared.unit, 0.0) - to_si(0.0, unit, declared.unit, 0.0))
    angles = np.unique(columns["angle"])
    pressures = np.unique(columns["pressure"])
    # Refusals are in the units of the table.
    with shown_in(counted_from({COLUMNS[name].unit: unit for name, unit in units.items()}, 0.0)):
        _check_grid(columns["angle"], columns["pressure"], file)
        order = np.lexsort((columns["pressure"], columns["angle"]))
        volumes = {
            name: columns[name][order].reshape(angles.size, pressures.size)
            for name in sorted(columns)
            if name.startswith("volume")
        }
        for name, volume in volumes.items():
            _check_volume(name, volume, angles, pressures, digits[name], file)
    return MeasuredVolumes(
        angles=angles,
        pressures=pressures,
        volume_1=volumes["volume_1"],
        volume_2=volumes.get("volume_2"),
        resolution_1=digits["volume_1"],
        resolution_2=digits.get("volume_2", 0.0),
    )


def _step(numbers: Sequence[Decimal]) -> float:
    """Return the step to which numbers are rounded: 0.1 for 7.4 and 3, and 5 for many multiples of 5."""
    exponents = [number.as_tuple().exponent for number in numbers]
    last = min(exponent for exponent in exponents if isinstance(exponent, int))
    different = {int(number.scaleb(-last)) for number in numbers}
    common = math.gcd(*different) if len(different) >= _TELLING else 1
    return math.pow(10.0, last) * max(step for step in _STEPS if common % step == 0)


def _units(header: Sequence[str], file: str) -> dict[str, str]:
    """Return the unit of each column by name, in file order."""
    units: dict[str, str] = {}
    for cell in header:
        name, bracket, unit = (part.strip() for part in cell.strip().removesuffix("]").partition("["))
        if name not in COLUMNS:
            shown = one_line(name)[:LONGEST]
            hint = nearest_name(name, COLUMNS)
            hint = "; how volumes follow from torques is in docs/how-to/extend.md" if "torque" in name.lower() else hint
            raise ParameterError(f"{file}: unknown column '{shown}'{hint}; allowed: {', '.join(COLUMNS)}")
        if name in units:
            raise ParameterError(f"{file}: the column '{name}' occurs twice")
        if not bracket:
            example = f"{name} [{COLUMNS[name].example}]"
            raise ParameterError(f"{file}: column '{name}' has no unit; write for example '{example}'")
        if name == "pressure" and not unit.endswith("_g"):
            shown = one_line(unit)[:LONGEST]
            raise ParameterError(f"{file}: column 'pressure' must be in a gauge unit such as kPa_g, not '{shown}'")
        with refused_as(ParameterError, f"{file}: column '{name}'", UnitError):
            to_si(1.0, unit, COLUMNS[name].unit, 0.0)
        units[name] = unit
    missing = [name for name in _NEEDED if name not in units]
    if missing:
        raise ParameterError(f"{file}: column{'s' if len(missing) > 1 else ''} {said_missing(missing)}")
    return units


def _check_grid(angle: Floats, pressure: Floats, file: str) -> None:
    """Raise ParameterError if columns (lines,) of angles [rad] and gauge pressures [Pa] do not form a full grid.

    The number of angles and pressures is limited, and the volumes at zero pressure are required.
    """
    angles = np.unique(angle)
    pressures = np.unique(pressure)
    if angles.size < 2:
        raise ParameterError(f"{file}: has one angle only; at least 2 angles are needed")
    if pressures[0] <= -STANDARD_ATMOSPHERE:
        raise ParameterError(f"{file}: pressure = {shown_text(pressures[0], 'Pa_a')} is below a perfect vacuum")
    if pressures.size > 1 and 0.0 not in pressures:
        closest = shown_text(pressures[int(np.argmin(np.abs(pressures)))], "Pa_a")
        raise ParameterError(
            f"{file}: has no volumes of the vented actuator; add lines at {shown_text(0.0, 'Pa_a')} (nearest pressure: "
            f"{closest})"
        )
    for name, values, most, nearest in (
        ("angle", angles, MOST_ANGLES, _NEAREST_ANGLES * float(np.ptp(angles))),
        ("pressure", pressures, MOST_PRESSURES, _NEAREST_PRESSURES),
    ):
        if values.size > most:
            raise ParameterError(f"{file}: has {values.size} values of {name}; at most {most} are allowed")
        if values.size > 1 and float(np.diff(values).min()) < nearest:
            raise ParameterError(f"{file}: two values of {name} are almost equal")
    lines = Counter(zip(angle.tolist(), pressure.tolist(), strict=True))
    repeated = next((pair for pair, count in lines.items() if count > 1), None)
    if repeated is not None:
        raise ParameterError(f"{file}: has more than one line for {_point_text(*repeated)}")
    for pair in product(angles.tolist(), pressures.tolist()):
        if pair not in lines:
            raise ParameterError(f"{file}: there is no line for {_point_text(*pair)}")


def _check_volume(name: str, volume: Floats, angles: Floats, pressures: Floats, resolution: float, file: str) -> None:
    """Raise ParameterError for impossible volumes [m^3] (angles, pressures), rounded to ``resolution`` [m^3].

    Impossible volumes are negative, fall with the pressure by more than ``resolution``, or at the highest pressure do
    not grow with the angle (chamber 1) or shrink with it (chamber 2).
    """
    # Half of the last digit each, and what the last bit of two numbers makes of it.
    unseen = resolution * (1.0 + 1.0e-6)
    if volume.min() < 0.0:
        row, column = np.unravel_index(int(np.argmin(volume)), volume.shape)
        point = _point_text(angles[row], pressures[column])
        least = shown_text(float(volume.min()), "m^3")
        raise ParameterError(f"{file}: {name} = {least} at {point} is negative")
    falls = np.argwhere(np.diff(volume, axis=1) < -unseen)
    if falls.size:
        row, column = falls[0]
        fall = -float(np.diff(volume, axis=1)[row, column])
        raise ParameterError(
            f"{file}: {name} decreases with pressure at {_point_text(angles[row], pressures[column + 1])}, by "
            f"{shown_text(fall, 'm^3', '.3g')}; allowed is the last digit, {shown_text(resolution, 'm^3', '.3g')}"
        )
    sign, direction = (1.0, "grow") if name == "volume_1" else (-1.0, "shrink")
    wrong = (
        np.arange(1) if np.ptp(volume[:, -1]) <= unseen else np.flatnonzero(sign * np.diff(volume[:, -1]) <= -unseen)
    )
    if wrong.size:
        raise ParameterError(
            f"{file}: {name} must {direction} with the angle at the highest pressure, but does not at "
            f"{shown_text(angles[wrong[0] + 1], 'rad')}"
        )


def _point_text(angle: float, pressure: float) -> str:
    return f"{shown_text(angle, 'rad')} and {shown_text(pressure, 'Pa_a')}"


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
    first, *second = fitted_chambers(measured)
    chamber_1 = _chamber(first.volume, measured.pressures, shares)
    _check_curves(chamber_1, bends, angles, "volume_1", file)
    chamber_2 = TabulatedChamber(_NOTHING, tuple(rise._replace(gain=_NOTHING) for rise in chamber_1.rises))
    for fitted in second:
        chamber_2 = _chamber(fitted.volume[::-1], measured.pressures, shares)
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


def fitted_chambers(measured: MeasuredVolumes) -> list[FittedVolumes]:
    """Return the fitted volumes of each chamber; those of chamber 2 with falling angle."""
    shares = (measured.angles - measured.angles[0]) / (measured.angles[-1] - measured.angles[0])
    found = [within_resolution(measured.volume_1, shares, measured.pressures, measured.resolution_1)]
    if measured.volume_2 is not None:
        turned = 1.0 - shares[::-1]
        falling = measured.volume_2[::-1]
        found.append(within_resolution(falling, turned, measured.pressures, measured.resolution_2))
    return found


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
        limits = found / resolution - _CLEAR
        moved = ((fitted - volume) / resolution).ravel()
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
    rough = roughness[3:]
    amplitudes = modes.T @ volume
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
    powers = coefficients[:_POWERS]
    bends = coefficients[_POWERS:]
    return Curve((*powers, *[0.0] * (_POWERS - len(powers))), (*bends, *[0.0] * (BENDS - len(bends))))


def _basis(shares: Floats, bends: Floats) -> Floats:
    """Return the design matrix of a spline, of shape (shares, coefficients).

    The columns are the powers of the fraction of the angle range, then the cubes of its excess above each knot.
    """
    powers = shares[:, None] ** np.arange(_POWERS)
    return np.hstack([powers, np.maximum(shares[:, None] - bends, 0.0) ** 3])


def _check_curves(chamber: TabulatedChamber, bends: Floats, angles: Floats, name: str, file: str) -> None:
    """Raise ParameterError if a curve of a chamber becomes negative between the measured angles."""
    basis = _basis(_CHECKED_SHARES, bends)
    curves = (chamber.lowest, *(rise.gain for rise in chamber.rises))
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
                f"{math.degrees(angle):.4g} deg"
            )
