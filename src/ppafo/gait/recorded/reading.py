"""The forms of gait recordings, tables of files in any of them, and the one map of files that come without one.

To add a form: a module of its own with a ``GaitForm`` and one line below. Forms of other packages are found by an
entry point, and are asked first whether a file is theirs.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ppafo.errors import DataError, nearest_name, one_line
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.mapping import GaitMap, Side, column_names
from ppafo.gait.recorded.table import MotionTable, cut_table
from ppafo.kinds import Kinds

FORMS: Kinds[GaitForm] = Kinds(
    "ppafo.gait_forms",
    "gait form",
    GaitForm,
    {
        "opensim": "ppafo.gait.recorded.forms.opensim:FORM",
        "csv": "ppafo.gait.recorded.forms.comma_separated:FORM",
        "c3d": "ppafo.gait.recorded.forms.c3d:FORM",
        "trc": "ppafo.gait.recorded.forms.markers:TRC",
        "matlab": "ppafo.gait.recorded.forms.matlab:FORM",
    },
)


def form_of(path: str | Path, name: str = "") -> GaitForm:
    """Return the form of a file: the named one, else the first that recognises it. DataError where there is none."""
    if name:
        form = FORMS.get(name)
        if form is None:
            raise DataError(
                f"there is no gait form '{one_line(name)}'{nearest_name(name, FORMS)}; available: {', '.join(FORMS)}"
            )
        return form
    # Any form may know the suffix: forms of other packages are loaded before it is refused.
    FORMS.load_all()
    # Forms of other packages are asked first: a user who installs one wants it for his files.
    forms = sorted(FORMS.loaded().values(), key=lambda form: FORMS.is_own(form.name))
    suffix = Path(path).suffix.lower()
    for form in forms:
        if suffix in form.suffixes and form.recognises(path):
            return form
    *others, last = dict.fromkeys(suffix for form in FORMS.loaded().values() for suffix in form.suffixes)
    raise DataError(f"{path}: is not a {', '.join(others)} or {last} file")


def read_table(
    path: str | Path,
    longest_gap: float = 0.0,
    start: float | None = None,
    end: float | None = None,
    form: str = "",
) -> MotionTable:
    """Return the table in a file of any form, from ``start`` to ``end`` [s]; ``form`` names its form.

    Its clock runs without a gap there: rows missing for no longer than ``longest_gap`` [s] are bridged and remarked.
    """
    chosen = form_of(path, form)
    return cut_table(replace(chosen.read(path), form=form or chosen.name), longest_gap, start, end)


def find_convention(tables: Sequence[MotionTable], side: Side, body_mass: float) -> Convention:
    """Return the map of files by what is in them; ``body_mass`` [kg] tells moments from moments per mass."""
    names = sorted({table.form for table in tables})
    if len(names) > 1 and any(FORMS[name].is_whole for name in names):
        raise DataError(
            f"the files have different formats ({', '.join(names)}); name the columns of all of them in a gait map"
        )
    conventions = [FORMS[table.form].convention(table, side, body_mass) for table in tables]
    # One convention for all files: each curve is from the first file that has its columns.
    columns = {}
    for name in GaitMap.model_fields:
        choices = [getattr(convention.columns, name) for convention in conventions]
        pairs = zip(choices, tables, strict=True)
        fitting = [
            convention for convention, table in pairs if name != "schema_version" and _is_there(convention, table)
        ]
        columns[name] = fitting[0] if fitting else choices[0]
    plates = tuple(dict.fromkeys(plate for convention in conventions for plate in convention.plates))
    remarks = tuple(dict.fromkeys(remark for convention in conventions for remark in convention.remarks))
    # A force by the name of this foot is surer than contacts chosen by the lean of the shank.
    has_force = any(_is_there(columns["vertical_force"], table) for table in tables)
    return Convention(GaitMap(**columns), () if has_force else plates, remarks)


def _is_there(mapped: object, table: MotionTable) -> bool:
    """Return whether a table has all columns of a curve that is mapped."""
    return mapped is not None and all(name.removeprefix("-") in table.columns for name in column_names(mapped))
