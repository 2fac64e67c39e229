"""The file of a measured actuator: one line for each angle and pressure, with the volumes of its chambers.

    angle [deg],pressure [kPa_g],volume_1 [mL],volume_2 [mL]

Without a column ``volume_2`` the actuator has one chamber, and chamber 2 is nothing but its dead volume.
"""

import math
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, decoded, read_regular_file
from ppafo.documents.toml_text import label
from ppafo.errors import ParameterError, UnitError, nearest_name, one_line, reason, refused_as, said_missing
from ppafo.model.actuators.table import (
    BENDS,
    MOST_ANGLES,
    MOST_PRESSURES,
    RISES,
    Chamber,
    Curve,
    Rise,
    Table,
)
from ppafo.signals.recording import Floats
from ppafo.units import number_text, to_si

COLUMNS = {"angle": "rad", "pressure": "Pa_a", "volume_1": "m^3", "volume_2": "m^3"}
LARGEST = {"angle": 10.0, "pressure": 1.0e7, "volume_1": 1.0, "volume_2": 1.0}
"""Sizes [SI] beyond which a number is a slip of the pen; pressures are above the atmosphere here."""
NEVER = 1.0e12
"""A pressure [Pa] and a share of the range that nothing comes to: there is no stretch, or no bend."""
_NEAREST = 0.01
"""Angles nearer than this share of their range make a spline swing."""
_LOOKED_AT = 201
_SHOWN = 40


def read_actuator_table(path: Path) -> Table:
    """Return the curves of a measured actuator; ParameterError says in one line what is wrong with its file."""
    file = label(str(path))
    try:
        text = decoded(read_regular_file(path, MAXIMUM_BYTES_TYPED))
    except UnicodeDecodeError as error:
        raise ParameterError(f"{file}: is not a text file in UTF-8 (byte {error.start})") from error
    except (OSError, ValueError) as error:
        raise ParameterError(f"{file}: cannot be read: {reason(error)}") from error
    return table_of(_columns(text, file), file)


def table_of(columns: dict[str, Floats], file: str) -> Table:
    """Return the curves of columns in SI units, pressures above the atmosphere; ParameterError where they cannot be."""
    angles, pressures = np.unique(columns["angle"]), np.unique(columns["pressure"])
    _check_grid(columns, angles, pressures, file)
    order = np.lexsort((columns["pressure"], columns["angle"]))
    given = [columns[name] for name in ("volume_1", "volume_2") if name in columns]
    volumes = [volume[order].reshape(angles.size, pressures.size) for volume in given]
    for number, volume in enumerate(volumes, 1):
        _check_volume(volume, angles, pressures, f"volume_{number}", file)
    shares = (angles - angles[0]) / (angles[-1] - angles[0])
    bends = (angles[2:-2] - angles[0]) / (angles[-1] - angles[0])
    nothing = Curve((0.0,) * 4, (0.0,) * BENDS)
    made = []
    for number, volume in enumerate(volumes, 1):
        rises = [
            Rise(float(lower), float(upper - lower), _curve(volume[:, index + 1] - volume[:, index], shares, bends))
            for index, (lower, upper) in enumerate(pairwise(pressures))
        ]
        # Compiled code has room for a fixed number of stretches and bends: what is beyond is never come to.
        rises += [Rise(NEVER, 1.0, nothing)] * (RISES - len(rises))
        made.append(Chamber(_curve(volume[:, 0], shares, bends), tuple(rises)))
        _check_curves(made[-1], bends, angles, f"volume_{number}", file)
    # An actuator with one chamber: the other is nothing but its dead volume.
    made.append(Chamber(nothing, tuple(rise._replace(gain=nothing) for rise in made[0].rises)))
    return Table(
        first_angle=float(angles[0]),
        last_angle=float(angles[-1]),
        per_angle=1.0 / float(angles[-1] - angles[0]),
        bends=(*bends.tolist(), *[NEVER] * (BENDS - bends.size)),
        chamber_1=made[0],
        chamber_2=made[1],
    )


def highest_pressure(table: Table) -> float:
    """Return the highest pressure measured [Pa, gauge]; infinity where one pressure stands for all."""
    ends = [rise.lower + rise.length for rise in table.chamber_1.rises if rise.lower < NEVER]
    return max(ends, default=math.inf)


def _columns(text: str, file: str) -> dict[str, Floats]:
    """Return the columns of a file in SI units, by name."""
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise ParameterError(f"{file}: is empty; its header is 'angle [deg],pressure [kPa_g],volume_1 [mL]'")
    header = lines[0][1]
    if "," not in header and (other := next((sign for sign in ";\t" if sign in header), "")):
        shown = "tabs" if other == "\t" else "semicolons"
        raise ParameterError(f"{file}: its columns are separated by {shown}; commas are needed")
    names, units = _header([cell.strip().strip('"') for cell in header.split(",")], file)
    rows: list[list[float]] = []
    for number, line in lines[1:]:
        cells = [cell.strip().strip('"') for cell in line.split(",")]
        if len(cells) != len(names):
            raise ParameterError(f"{file}, line {number}: has {len(cells)} values, the header has {len(names)}")
        rows.append([_number(cell, name, f"{file}, line {number}") for cell, name in zip(cells, names, strict=True)])
    if not rows:
        raise ParameterError(f"{file}: has a header and no line of numbers")
    columns: dict[str, Floats] = {}
    for index, (name, unit) in enumerate(zip(names, units, strict=True)):
        # Over a vacuum a gauge pressure is its own SI value.
        column = np.array([to_si(row[index], unit, COLUMNS[name], 0.0) for row in rows])
        worst = int(np.argmax(np.abs(column)))
        if abs(column[worst]) > LARGEST[name]:
            raise ParameterError(
                f"{file}, line {lines[worst + 1][0]}: {name} = {rows[worst][index]:g} {unit} is beyond "
                f"{LARGEST[name]:g} {COLUMNS[name].removesuffix('_a')}"
            )
        columns[name] = column
    return columns


def _header(cells: Sequence[str], file: str) -> tuple[list[str], list[str]]:
    """Return names and units of the columns."""
    names, units = [], []
    for cell in cells:
        name, bracket, unit = (part.strip() for part in cell.strip().removesuffix("]").partition("["))
        if name not in COLUMNS:
            shown, hint = one_line(name)[:_SHOWN], nearest_name(name, COLUMNS)
            raise ParameterError(f"{file}: unknown column '{shown}'{hint}; allowed: {', '.join(COLUMNS)}")
        if name in names:
            raise ParameterError(f"{file}: there are two columns '{name}'")
        if not bracket:
            raise ParameterError(f"{file}: column '{name}' has no unit; write for example '{name} [{_EXAMPLES[name]}]'")
        if name == "pressure" and not unit.endswith("_g"):
            raise ParameterError(
                f"{file}: column 'pressure' is in '{one_line(unit)[:_SHOWN]}'; give gauge, as in kPa_g"
            )
        with refused_as(ParameterError, f"{file}: column '{name}'", UnitError):
            to_si(1.0, unit, COLUMNS[name], 0.0)
        names.append(name)
        units.append(unit)
    missing = [name for name in ("angle", "pressure", "volume_1") if name not in names]
    if missing:
        raise ParameterError(f"{file}: column{'s' * (len(missing) > 1)} {said_missing(missing)}")
    return names, units


def _number(cell: str, name: str, where: str) -> float:
    try:
        # A longer text is no number that anybody wrote.
        value = float(number_text(cell)) if len(cell) <= _SHOWN else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ParameterError(f"{where}: {name} = '{one_line(cell)[:_SHOWN]}' is not a finite number")
    return value


_EXAMPLES = {"angle": "deg", "pressure": "kPa_g", "volume_1": "mL", "volume_2": "mL"}


def _check_grid(columns: dict[str, Floats], angles: Floats, pressures: Floats, file: str) -> None:
    """Refuse angles and pressures of which not every pair is there once, and more than there is room for."""
    if angles.size < 2:
        raise ParameterError(f"{file}: has one angle only, at least 2 are needed")
    if pressures[0] < 0.0:
        raise ParameterError(f"{file}: pressure = {pressures[0]:g} Pa_g is below the atmosphere")
    if pressures.size > 1 and pressures[0] > 0.0:
        raise ParameterError(
            f"{file}: the lowest pressure is {pressures[0] / 1e3:.4g} kPa_g; volumes at 0 kPa_g, vented, are needed too"
        )
    _check_places("angle", angles, MOST_ANGLES, _NEAREST * float(np.ptp(angles)), file)
    _check_places("pressure", pressures, MOST_PRESSURES, 1.0, file)
    pairs = list(zip(columns["angle"].tolist(), columns["pressure"].tolist(), strict=True))
    twice = [pair for pair, count in Counter(pairs).items() if count > 1]
    if twice:
        raise ParameterError(f"{file}: there is more than one line for {_place(*twice[0])}")
    for angle, pressure in product(angles.tolist(), pressures.tolist()):
        if (angle, pressure) not in pairs:
            raise ParameterError(
                f"{file}: there is no line for {_place(angle, pressure)}; every angle needs every pressure"
            )


def _place(angle: float, pressure: float) -> str:
    return f"{math.degrees(angle):.6g} deg and {pressure / 1e3:.6g} kPa_g"


def _check_places(name: str, places_given: Floats, most: int, least: float, file: str) -> None:
    """Refuse values of which there are too many, or that are nearer to each other than ``least``."""
    if places_given.size > most:
        raise ParameterError(
            f"{file}: has {places_given.size} values of {name}, at most {most} are taken: leave some out"
        )
    if places_given.size > 1 and float(np.diff(places_given).min()) < least:
        raise ParameterError(f"{file}: two values of {name} are almost equal; merge or round them")


def _check_volume(volume: Floats, angles: Floats, pressures: Floats, name: str, file: str) -> None:
    """Refuse volumes (angles, pressures) that are negative or fall with the pressure, or with the angle turn about."""
    falls = np.argwhere(np.diff(volume, axis=1) < 0.0)
    if volume.min() < 0.0:
        row, column = np.unravel_index(int(np.argmin(volume)), volume.shape)
        at = _place(angles[row], pressures[column])
        raise ParameterError(f"{file}: {name} = {volume.min() * 1e6:.6g} mL at {at} is negative")
    if falls.size:
        at = _place(angles[falls[0][0]], pressures[falls[0][1] + 1])
        raise ParameterError(f"{file}: {name} falls with the pressure at {at}")
    way = 1.0 if name == "volume_1" else -1.0
    turns = np.argwhere(way * np.diff(volume[:, -1]) <= 0.0)
    if turns.size:
        angle, must = math.degrees(angles[turns[0][0] + 1]), "grow" if way > 0.0 else "shrink"
        raise ParameterError(
            f"{file}: {name} must {must} with the angle at the highest pressure, and does not at {angle:.6g} deg"
        )


def _check_curves(chamber: Chamber, bends: Floats, angles: Floats, name: str, file: str) -> None:
    """Refuse curves that swing between the angles so far that a volume is negative or falls with the pressure."""
    shares = np.linspace(0.0, 1.0, _LOOKED_AT)
    basis = _basis(shares, bends)
    curves = [chamber.lowest, *(rise.gain for rise in chamber.rises)]
    for number, curve in enumerate(curves):
        values = basis @ np.array([*curve.powers, *curve.bends[: bends.size]])
        slack = 1.0e-12 if number == 0 else 1.0e-9 * float(np.abs(values).max())
        if values.min() < -slack:
            angle = math.degrees(angles[0] + shares[int(np.argmin(values))] * (angles[-1] - angles[0]))
            what = "is negative" if number == 0 else "falls with the pressure"
            raise ParameterError(
                f"{file}: between its angles the curve of {name} {what} near {angle:.4g} deg; smooth the numbers, or "
                "measure more angles there"
            )


def _curve(values: Floats, shares: Floats, bends: Floats) -> Curve:
    """Return the spline through some values that is one cubic over its first two and last two stretches."""
    coefficients = np.linalg.solve(_basis(shares, bends)[:, : values.size], values).tolist()
    powers, cubes = coefficients[:4], coefficients[4:]
    return Curve((*powers, *[0.0] * (4 - len(powers))), (*cubes, *[0.0] * (BENDS - len(cubes))))


def _basis(shares: Floats, bends: Floats) -> Floats:
    """Values (shares, functions) of the powers and of what begins at each bend."""
    powers = shares[:, None] ** np.arange(4)
    return np.hstack([powers, np.maximum(shares[:, None] - bends, 0.0) ** 3])
