"""The recording that a gait is imported from: tables, map and signals of its files, gaps filled, with what they say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.gait.plausible import SignSource
from ppafo.gait.recorded.footfalls import FORCE, force_of_plates
from ppafo.gait.recorded.form import Convention
from ppafo.gait.recorded.mapping import GaitMap, ImportSettings, column_names, unsaid_axes
from ppafo.gait.recorded.reading import FORMS, find_convention, read_table
from ppafo.gait.recorded.table import MotionTable, fill_gaps
from ppafo.gait.recorded.walk import Person, Signal, walk_signals
from ppafo.units import format_quantity

_SAME = 0.02
"""Fraction by which two statements of one body mass may differ without a remark."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Tables, map and signals of a recording, settings with what the files say, and remarks on what was mended."""

    tables: Sequence[MotionTable]
    columns: GaitMap
    walk: Mapping[str, Signal]
    settings: ImportSettings
    signs_from: SignSource
    remarks: tuple[str, ...]


def read_source(files: Sequence[str | Path], settings: ImportSettings, wrong: list[PpafoError]) -> Source:
    """Return the signals in recorded files; what is wrong but leaves both angles usable is added to ``wrong``.

    DataError for what ends the import, with everything in ``wrong``.
    """
    if not files:
        raise DataError("no file was given; a gait needs at least the angles of shank and ankle")
    cut, tables = (settings.longest_gap, settings.start, settings.end), []
    for path in files:
        with noted_in(wrong):
            tables.append(read_table(path, *cut, settings.form))
    if len(tables) < len(files):
        raise_noted(wrong)
    if settings.columns is None:
        # Only without a map: a user's map names the columns as the file has them.
        tables = [FORMS[table.form].arrange(table) for table in tables]
    settings, said = _with_subject(settings, tables, wrong)
    # Without a body mass loads are looked at per kg of 1 kg, and scaled to 1 below.
    person = Person(settings.body_mass or 1.0, settings.stature)
    convention = (
        find_convention(tables, settings.side, person.body_mass)
        if settings.columns is None
        else Convention(settings.columns)
    )
    columns = convention.columns
    if settings.ankle_neutral is not None:
        neutral = {"neutral": format_quantity(settings.ankle_neutral, "rad")}
        columns = columns.model_copy(update={"ankle_angle": columns.ankle_angle.model_copy(update=neutral)})
    mapped = [getattr(columns, name) for name in GaitMap.model_fields if name != "schema_version"]
    names = [name.removeprefix("-") for mapping in mapped if mapping is not None for name in column_names(mapping)]
    # Only the columns in use: a gap elsewhere needs no word.
    tables = [fill_gaps(table, names, settings.longest_gap) for table in tables]
    walk = walk_signals(tables, columns, person, settings.columns is None, wrong)
    if settings.body_mass is None:
        walk |= {name: of_largest_one(walk[name]) for name in ("ankle_moment", FORCE) if name in walk}
    if convention.plates and FORCE not in walk and settings.body_mass is not None:
        with noted_in(wrong):
            force, more = force_of_plates(tables, convention.plates, walk["shank_angle"], person.body_mass)
            walk |= {} if force is None else {FORCE: force}
            said += more
    mended = [f"{Path(table.file).name}: {remark}" for table in tables for remark in table.remarks]
    mended += _ends(walk, tables)
    said += [] if settings.columns is None else unsaid_axes(settings.columns)
    signs_from: SignSource = "columns" if settings.columns is None else "map"
    return Source(tables, columns, walk, settings, signs_from, (*said, *convention.remarks, *mended))


def of_largest_one(signal: Signal, is_upwards: bool = False) -> Signal:
    """Return a load whose largest number is 1: its scale is wrong or not known, and the rest is looked at with it."""
    largest = float(signal.values[np.argmax(np.abs(signal.values))]) or 1.0
    return replace(signal, values=signal.values / (largest if is_upwards else abs(largest)))


def _with_subject(
    settings: ImportSettings, tables: Sequence[MotionTable], wrong: list[PpafoError]
) -> tuple[ImportSettings, list[str]]:
    """Return the settings with body mass and stature that a C3D file states; what the user states wins.

    A body mass that is stated nowhere is added to ``wrong``.
    """
    masses, statures = (
        [(table.file, value) for table in tables if table.trial and (value := getattr(table.trial, name)) is not None]
        for name in ("body_mass", "stature")
    )
    said = []
    if settings.body_mass is None and not masses:
        wrong.append(
            DataError(
                f"{tables[0].file}: does not state the body mass; give it, such as --body-mass '62 kg' (until then "
                "loads are taken relative to their largest value)"
            )
        )
    elif settings.body_mass is None:
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
