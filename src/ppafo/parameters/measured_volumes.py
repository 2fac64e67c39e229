"""Volume table of a measured actuator: chamber volumes, one line for each angle and pressure.

angle [deg],pressure [kPa_g],volume_1 [mL],volume_2 [mL]

Columns and lines may be in any order; a line that begins with # is a comment. Without a column ``volume_2`` the
actuator has one chamber, and chamber 2 consists only of its dead volume.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, decoded, read_regular_file
from ppafo.documents.toml_text import label
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.actuators.table import MOST_ANGLES, MOST_PRESSURES
from ppafo.signals.recording import Floats
from ppafo.units import to_si
from ppafo.units.shown import counted_from, shown_in, shown_text
from ppafo.wording import nearest_name, number_text, one_line, reason, said_missing


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
_NEEDED = ("angle", "pressure", "volume_1")
_NEAREST_ANGLES = 0.01
"""Least distance of two angles, as a fraction of their range [-], for a smooth spline."""
_NEAREST_PRESSURES = 1.0
"""Least distance of two pressures [Pa] that are not the same pressure."""
_STEPS = (1, 2, 5, 10, 20, 50, 100)
"""Possible rounding steps of readings, in units of the last digit."""
_TELLING = 10
"""Number of different values from which a common step is no coincidence."""
_LONGEST = 40
"""Maximum length of a cell in characters, in messages and as a number."""


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
    try:
        text = decoded(read_regular_file(path, MAXIMUM_BYTES_TYPED))
    except UnicodeDecodeError as error:
        raise ParameterError(f"{file}: is not a text file in UTF-8 (byte {error.start} is invalid)") from error
    except (OSError, ValueError) as error:
        raise ParameterError(f"{file}: cannot be read: {reason(error)}") from error
    columns, digits, units = _columns(text, file)
    angles, pressures = np.unique(columns["angle"]), np.unique(columns["pressure"])
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


def _columns(text: str, file: str) -> tuple[dict[str, Floats], dict[str, float], dict[str, str]]:
    """Return the columns of a file by name, each (lines,), their rounding steps, in SI units, and their units.

    Pressures are gauge pressures.
    """
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise ParameterError(f"{file}: is empty; its first line must be 'angle [deg],pressure [kPa_g],volume_1 [mL]'")
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if separator in lines[0][1] and "," not in lines[0][1]:
            raise ParameterError(f"{file}: columns must be separated by commas, not {name}")
    (_, header), *below = ((number, [cell.strip().strip('"') for cell in line.split(",")]) for number, line in lines)
    units = _units(header, file)
    rows = [_numbers(cells, tuple(units), f"{file}, line {number}") for number, cells in below]
    if not rows:
        raise ParameterError(f"{file}: has a header but no rows of numbers")
    columns: dict[str, Floats] = {}
    digits: dict[str, float] = {}
    for index, (name, unit) in enumerate(units.items()):
        declared = COLUMNS[name]
        # Over a vacuum a gauge pressure is its own SI value.
        column = np.array([to_si(row[index], unit, declared.unit, 0.0) for row in rows])
        worst = int(np.argmax(np.abs(column)))
        if abs(column[worst]) > declared.largest:
            raise ParameterError(
                f"{file}, line {below[worst][0]}: {name} = {rows[worst][index]:g} {unit} exceeds "
                f"{declared.largest:g} {declared.unit.removesuffix('_a')}"
            )
        columns[name] = column
        step = _step([Decimal(number_text(cells[index])) for _, cells in below])
        digits[name] = abs(to_si(step, unit, declared.unit, 0.0) - to_si(0.0, unit, declared.unit, 0.0))
    return columns, digits, units


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
            if "torque" in name.lower():
                raise ParameterError(
                    f"{file}: column '{one_line(name)[:_LONGEST]}': the table must have volumes, not torques; "
                    "integrate dV/dangle = dT/dpressure (T/p for a rigid chamber) over the angle, starting from the "
                    "volumes at the first angle; the code is in docs/how-to/extend.md under 'From torques'"
                )
            shown, hint = one_line(name)[:_LONGEST], nearest_name(name, COLUMNS)
            raise ParameterError(f"{file}: unknown column '{shown}'{hint}; allowed: {', '.join(COLUMNS)}")
        if name in units:
            raise ParameterError(f"{file}: the column '{name}' occurs twice; rename or remove one of them")
        if not bracket:
            example = f"{name} [{COLUMNS[name].example}]"
            raise ParameterError(f"{file}: column '{name}' has no unit; write for example '{example}'")
        if name == "pressure" and not unit.endswith("_g"):
            shown = one_line(unit)[:_LONGEST]
            raise ParameterError(f"{file}: column 'pressure' must be in a gauge unit such as kPa_g, not '{shown}'")
        with refused_as(ParameterError, f"{file}: column '{name}'", UnitError):
            to_si(1.0, unit, COLUMNS[name].unit, 0.0)
        units[name] = unit
    missing = [name for name in _NEEDED if name not in units]
    if missing:
        raise ParameterError(f"{file}: column{'s' * (len(missing) > 1)} {said_missing(missing)}")
    return units


def _numbers(cells: Sequence[str], names: Sequence[str], line: str) -> list[float]:
    """Parse the numbers of a line in the order of the columns ``names``."""
    if len(cells) != len(names):
        raise ParameterError(f"{line}: has {len(cells)} values, the header has {len(names)}")
    numbers = []
    for name, cell in zip(names, cells, strict=True):
        try:
            number = float(number_text(cell)) if len(cell) <= _LONGEST else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            shown = one_line(cell)[:_LONGEST]
            raise ParameterError(f"{line}: {name} = '{shown}' is not a finite number")
        numbers.append(number)
    return numbers


def _check_grid(angle: Floats, pressure: Floats, file: str) -> None:
    """Raise ParameterError if columns (lines,) of angles [rad] and gauge pressures [Pa] do not form a full grid.

    The number of angles and pressures is limited, and the volumes at zero pressure are required.
    """
    angles, pressures = np.unique(angle), np.unique(pressure)
    if angles.size < 2:
        raise ParameterError(f"{file}: has one angle only; at least 2 angles are needed")
    if pressures[0] <= -STANDARD_ATMOSPHERE:
        raise ParameterError(f"{file}: pressure = {shown_text(pressures[0], 'Pa_a')} is below a perfect vacuum")
    if pressures.size > 1 and 0.0 not in pressures:
        nearest = pressures[int(np.argmin(np.abs(pressures)))]
        raise ParameterError(
            f"{file}: has no volumes of the vented actuator; add lines at {shown_text(0.0, 'Pa_a')} (nearest pressure: "
            f"{shown_text(nearest, 'Pa_a')})"
        )
    _check_spacing("angle", angles, MOST_ANGLES, _NEAREST_ANGLES * float(np.ptp(angles)), file)
    _check_spacing("pressure", pressures, MOST_PRESSURES, _NEAREST_PRESSURES, file)
    lines = Counter(zip(angle.tolist(), pressure.tolist(), strict=True))
    repeated = next((pair for pair, count in lines.items() if count > 1), None)
    if repeated is not None:
        raise ParameterError(f"{file}: has more than one line for {_point_text(*repeated)}; keep one of them")
    for pair in product(angles.tolist(), pressures.tolist()):
        if pair not in lines:
            raise ParameterError(
                f"{file}: there is no line for {_point_text(*pair)}; every angle needs one line for every pressure"
            )


def _check_spacing(name: str, values: Floats, maximum: int, nearest: float, file: str) -> None:
    """Raise ParameterError for more than ``maximum`` values in a column, or two values closer than ``nearest`` [SI]."""
    if values.size > maximum:
        raise ParameterError(f"{file}: has {values.size} values of {name}; at most {maximum} are allowed")
    if values.size > 1 and float(np.diff(values).min()) < nearest:
        raise ParameterError(f"{file}: two values of {name} are almost equal; round them to one value")


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
        raise ParameterError(f"{file}: {name} = {least} at {point} is negative; correct the volume")
    falls = np.argwhere(np.diff(volume, axis=1) < -unseen)
    if falls.size:
        row, column = falls[0]
        fall = -float(np.diff(volume, axis=1)[row, column])
        raise ParameterError(
            f"{file}: {name} decreases with pressure at {_point_text(angles[row], pressures[column + 1])}, by "
            f"{shown_text(fall, 'm^3', '.3g')}; at most the last digit, {shown_text(resolution, 'm^3', '.3g')}, is "
            "allowed: correct the volume; round measured volumes to their resolution; for volumes from torques fit "
            "a straight line of the torque over pressure, as rounding changes the torque"
        )
    sign, direction = (1.0, "grow") if name == "volume_1" else (-1.0, "shrink")
    wrong = np.flatnonzero(sign * np.diff(volume[:, -1]) <= -unseen)
    if np.ptp(volume[:, -1]) <= unseen:
        wrong = np.arange(1)
    if wrong.size:
        raise ParameterError(
            f"{file}: {name} must {direction} with the angle at the highest pressure, but does not at "
            f"{shown_text(angles[wrong[0] + 1], 'rad')}"
        )


def _point_text(angle: float, pressure: float) -> str:
    return f"{shown_text(angle, 'rad')} and {shown_text(pressure, 'Pa_a')}"
