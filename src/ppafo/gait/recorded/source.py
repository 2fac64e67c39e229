"""Recorded files as signals: read, cut, their columns named, gaps filled, and who walked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import DataError
from ppafo.gait.plausible.checked import SignSource
from ppafo.gait.recorded.conventions import Convention, column_names, find_convention
from ppafo.gait.recorded.mapping import GaitMap
from ppafo.gait.recorded.plates import force_of_plates
from ppafo.gait.recorded.repairs import fill_gaps
from ppafo.gait.recorded.settings import ImportSettings
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.table import MotionTable, read_table
from ppafo.gait.recorded.walk import Person, walk_signals
from ppafo.units import format_quantity

_SAME = 0.02
"""Share by which two statements of one body mass may differ without a word."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Tables, map and signals of a recording, settings with what the files say, and remarks on what was mended."""

    tables: Sequence[MotionTable]
    columns: GaitMap
    walk: Mapping[str, Signal]
    settings: ImportSettings
    signs_from: SignSource
    remarks: tuple[str, ...]


def read_source(files: Sequence[str | Path], settings: ImportSettings) -> Source:
    """Return the signals in recorded files; DataError names what is wrong and what to do."""
    if not files:
        raise DataError("no file was given; a gait needs at least the angles of shank and ankle")
    tables = [read_table(path, settings.longest_gap, settings.start, settings.end) for path in files]
    settings, said = _with_subject(settings, tables)
    person = Person(settings.body_mass or 0.0, settings.stature)
    convention = (
        find_convention(tables, settings.side, person.body_mass)
        if settings.columns is None
        else Convention(settings.columns)
    )
    columns = _with_neutral(convention.columns, settings.ankle_neutral)
    names = [name.removeprefix("-") for name in _names_of(columns)]
    tables = [fill_gaps(table, names, settings.longest_gap) for table in tables]
    walk = walk_signals(tables, columns, person, is_default=settings.columns is None)
    if convention.plates and "vertical_force" not in walk:
        force, more = force_of_plates(tables, convention.plates, walk["shank_angle"], person.body_mass)
        walk |= {} if force is None else {"vertical_force": force}
        said += more
    mended = [f"{Path(table.file).name}: {remark}" for table in tables for remark in table.remarks]
    mended += _ends(walk, tables)
    signs_from: SignSource = "columns" if settings.columns is None else "map"
    return Source(tables, columns, walk, settings, signs_from, (*said, *convention.remarks, *mended))


def _names_of(columns: GaitMap) -> list[str]:
    mapped = [getattr(columns, name) for name in GaitMap.model_fields if name != "schema_version"]
    return [name for item in mapped if item is not None for name in column_names(item)]


def _with_neutral(columns: GaitMap, neutral: float | None) -> GaitMap:
    if neutral is None:
        return columns
    angle = columns.ankle_angle.model_copy(update={"neutral": format_quantity(neutral, "rad")})
    return columns.model_copy(update={"ankle_angle": angle})


def _with_subject(settings: ImportSettings, tables: Sequence[MotionTable]) -> tuple[ImportSettings, list[str]]:
    """Return the settings with body mass and stature that a C3D file states; what the user states wins."""
    masses, statures = (
        [(table.file, value) for table in tables if table.trial and (value := getattr(table.trial, name)) is not None]
        for name in ("body_mass", "stature")
    )
    said = []
    if settings.body_mass is None:
        if not masses:
            raise DataError(f"{tables[0].file}: does not state the body mass; give it, such as --body-mass '62 kg'")
        file, mass = masses[0]
        settings = replace(settings, body_mass=mass)
        said.append(f"body mass {mass:.4g} kg, as {Path(file).name} states")
    elif masses and abs(masses[0][1] - settings.body_mass) > _SAME * settings.body_mass:
        said.append(
            f"body mass {settings.body_mass:.4g} kg as stated; {Path(masses[0][0]).name} states {masses[0][1]:.4g} kg"
        )
    if settings.stature is None and statures:
        settings = replace(settings, stature=statures[0][1])
        said.append(f"stature {statures[0][1]:.4g} m, as {Path(statures[0][0]).name} states")
    return settings, said


def _ends(walk: Mapping[str, Signal], tables: Sequence[MotionTable]) -> list[str]:
    """Return a remark on each motion that was not seen at an end of its file, and on loads that were not measured."""
    spans = {table.file: (float(table.time[0]), float(table.time[-1])) for table in tables}
    seen: dict[tuple[float, float, float, float], list[str]] = {}
    loads: dict[int, list[str]] = {}
    for name, signal in walk.items():
        low, high = spans[signal.file]
        if signal.time[0] > low or signal.time[-1] < high:
            seen.setdefault((float(signal.time[0]), float(signal.time[-1]), low, high), []).append(name)
        if signal.absent is not None:
            loads.setdefault(round(100.0 * float(signal.absent.mean())), []).append(name)
    said = [
        f"{', '.join(names)} from {first:.4g} to {last:.4g} s: not seen in the rest of {low:.4g} to {high:.4g} s"
        for (first, last, low, high), names in seen.items()
    ]
    return said + [
        f"{', '.join(names)}: absent in {percent} % of the record, where no plate measured this foot"
        for percent, names in loads.items()
    ]
