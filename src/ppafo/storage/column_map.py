"""Column maps: how a table from elsewhere, with its own columns, units and signs, becomes a recording.

A map is part of a TOML file, ``[columns.NAME]``; ``storage.foreign`` reads a file through it.
"""

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ppafo.documents.models import STRICT, Text, make_schema, read_model
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, nearest_name

Thousands = Literal["point", "comma", "apostrophe", "blank"]


class MappedChannel(BaseModel):
    """Where one channel comes from: a column, or a constant. The value is sign * (factor * number + offset) in unit."""

    model_config = STRICT

    column: Annotated[
        Annotated[int, Field(ge=1)] | Text | None, Field(description="number of the column from 1, or its name")
    ] = None
    constant: Annotated[Text | None, Field(description="instead of a column: one value, such as '1 bar_a'")] = None
    unit: Annotated[str, Field(description="unit of the value, such as 'bar_g'; '-' for a plain number")] = "-"
    sign: Annotated[Literal[1, -1], Field(description="-1 where the file has the opposite sign")] = 1
    factor: Annotated[float, Field(description="unit per number, for a sensor's volts")] = 1.0
    offset: Annotated[float, Field(description="added after the factor, in unit")] = 0.0
    times: Annotated[Text | None, Field(description="a quantity to multiply by, such as a lever arm '0.13 m'")] = None
    thousands: Annotated[Thousands | None, Field(description="mark between groups of digits")] = None


class MappedDirection(BaseModel):
    """Direction (1 or -1, 0 for neither) from how fast a channel moves; sweeps one way are counted as repetitions."""

    model_config = STRICT

    of: Annotated[Text, Field(description="channel whose rate decides")]
    threshold: Annotated[Text, Field(description="slowest rate that counts, such as '2 mm/s'")]
    window: Annotated[Text, Field(description="time over which the channel is smoothed, such as '0.2 s'")]
    sign: Annotated[Literal[1, -1], Field(description="-1 where a growing channel means falling pressure")] = 1


class ColumnMap(BaseModel):
    """How a file is written and what its columns are."""

    model_config = STRICT

    delimiter: Annotated[
        Literal["comma", "semicolon", "tab", "whitespace"], Field(description="what separates columns")
    ] = "comma"
    decimal: Annotated[Literal["point", "comma"], Field(description="decimal mark")] = "point"
    encoding: Annotated[Literal["utf-8", "latin-1"], Field(description="encoding of the text")] = "utf-8"
    header: Annotated[bool, Field(description="whether a line names the columns")] = True
    skip_lines: Annotated[int, Field(ge=0, description="lines before the header, or before the first row")] = 0
    skip_rows: Annotated[int, Field(ge=0, description="rows of numbers to leave out at the start")] = 0
    channels: Annotated[dict[str, MappedChannel], Field(min_length=1, description="channels by name, with 'time'")]
    direction: Annotated[MappedDirection | None, Field(description="direction from the rate of a channel")] = None


class ColumnMaps(BaseModel):
    """Column maps by name, as a file has them; a problem file of ``ppafo identify`` has more beside them."""

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)

    columns: Annotated[dict[str, ColumnMap], Field(min_length=1, description="column maps by name")]


_FILE = TomlKind("file of column maps", "columns", resources.files("ppafo.storage"), DataError)


def load_column_map(path: str | Path, name: str | None = None) -> ColumnMap:
    """Return a column map of a TOML file by its name; without a name the file's only one.

    DataError where it has no such map, or several and no name is given.
    """
    parsed, file = read_model(_FILE, ColumnMaps, path)
    maps = parsed.columns
    known = ", ".join(maps)
    if name is None and len(maps) > 1:
        raise DataError(f"{file}: has several column maps; name one as {file}:NAME; available: {known}")
    if name is not None and name not in maps:
        raise DataError(f"{file}: there is no column map '{name}'{nearest_name(name, maps)}; available: {known}")
    return maps[name or next(iter(maps))]


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of column maps."""
    return make_schema(ColumnMaps, "ppafo column maps")
