"""Column maps: channels, units and signs of the columns of a foreign table.

A map is part of a TOML file, ``[columns.NAME]``. ``foreign.py`` reads a recording through a map.
"""

from collections.abc import Collection, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from ppafo.documents.models import StrictTable, Text, make_schema, read_model
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, refused_as
from ppafo.signals import RecordingKind
from ppafo.signals.recording import TIME, Between, Floats
from ppafo.storage.clock import ClockForm, DateOrder
from ppafo.wording import LONGEST_SHOWN, known_names, one_line

Thousands = Literal["point", "comma", "apostrophe", "blank"]


class MappedChannel(StrictTable):
    """Source of a channel: column or constant. Value in ``unit`` = sign * (factor * number + offset)."""

    column: Annotated[
        Annotated[int, Field(ge=1)] | Text | None, Field(description="number of the column from 1, or its name")
    ] = None
    constant: Annotated[Text | None, Field(description="constant value instead of a column, such as '1 bar_a'")] = None
    unit: Annotated[str, Field(description="unit of the value, such as 'bar_g'; '-' for a plain number")] = "-"
    sign: Annotated[Literal[1, -1], Field(description="-1 if the file uses the opposite sign")] = 1
    factor: Annotated[float, Field(description="conversion factor to the unit, such as bar per volt of a sensor")] = 1.0
    offset: Annotated[float, Field(description="offset added after the factor, in the unit")] = 0.0
    times: Annotated[
        Text | None, Field(description="quantity that multiplies the column, such as a lever arm '0.13 m'")
    ] = None
    thousands: Annotated[Thousands | None, Field(description="thousands separator")] = None
    between: Annotated[
        Between | None,
        Field(description="value between samples: 'hold' the earlier one, or 'linear'; default: 'hold' for a command"),
    ] = None
    words: Annotated[
        dict[str, float] | None,
        Field(
            description="numbers that replace words in the column; 'direction' also knows up, down, auf, ab and others"
        ),
    ] = None
    at: Annotated[
        Text | None,
        Field(description="reference condition of a volume flow: 'ANR', 'DIN 1343' or '0 degC, 1.01325 bar_a'"),
    ] = None
    gas: Annotated[
        Text | None,
        Field(description="gas of a volume flow, such as 'air' or '0.044 kg/mol'; default: gas of the parameter set"),
    ] = None
    rate: Annotated[Text | None, Field(description="time only: sample rate instead of a column, such as '100 Hz'")] = (
        None
    )
    date: Annotated[
        Annotated[int, Field(ge=1)] | Text | None,
        Field(description="time only: column of the date that belongs to a time of day"),
    ] = None
    date_order: Annotated[
        DateOrder | None, Field(description="time only: order of day and month in a date such as 03/04/2026")
    ] = None
    clock: Annotated[ClockForm | None, Field(description="time only: meaning of a text such as 08:10")] = None


class MappedDirection(StrictTable):
    """Direction of motion from the rate of a channel: 1, -1, or 0 if too slow; the sweeps are numbered."""

    of: Annotated[Text, Field(description="channel whose rate of change gives the direction")]
    threshold: Annotated[Text, Field(description="smallest rate that counts as motion, such as '2 mm/s'")]
    window: Annotated[Text, Field(description="time over which the channel is smoothed, such as '0.2 s'")]
    sign: Annotated[Literal[1, -1], Field(description="-1 if a rising channel means falling pressure")] = 1


Trials = Annotated[tuple[Annotated[int, Field(ge=1)], ...], Field(strict=False, min_length=1)]


class ColumnMap(StrictTable):
    """Column map: format of a foreign table, and the channels in its columns."""

    delimiter: Annotated[Literal["comma", "semicolon", "tab", "whitespace"], Field(description="column delimiter")] = (
        "comma"
    )
    decimal: Annotated[Literal["point", "comma"], Field(description="decimal mark")] = "point"
    encoding: Annotated[Literal["utf-8", "latin-1"], Field(description="encoding of the text")] = "utf-8"
    header: Annotated[bool, Field(description="true if a header line names the columns")] = True
    skip_lines: Annotated[int, Field(ge=0, description="lines before the header, or before the first row")] = 0
    skip_rows: Annotated[
        int, Field(ge=0, description="number of rows to skip below the header, such as a line of units")
    ] = 0
    trial: Annotated[
        Literal["all"] | Annotated[int, Field(ge=1)] | Trials | None,
        Field(description="trials to read, where each trial starts at time 0: a number from 1, a list, or 'all'"),
    ] = None
    channels: Annotated[dict[str, MappedChannel], Field(min_length=1, description="channels by name, with 'time'")]
    direction: Annotated[MappedDirection | None, Field(description="direction from the rate of a channel")] = None


class _ColumnMaps(BaseModel):
    """Column maps of a file, by name; a problem file of ``ppafo identify`` has further tables."""

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)

    columns: Annotated[dict[str, ColumnMap], Field(min_length=1, description="column maps by name")]


_FILE = TomlKind("file of column maps", "columns", resources.files("ppafo.storage"), DataError)


def load_column_map(path: str | Path, name: str | None = None) -> ColumnMap:
    """Load a column map by name from a TOML file; without a name, the only map in the file.

    Raises DataError if there is no such map, or if there are several and no name is given.
    """
    parsed, file = read_model(_FILE, _ColumnMaps, path)
    maps = parsed.columns
    if name is None and len(maps) > 1:
        raise DataError(f"{file}: has several column maps; name one as {file}:NAME; available: {', '.join(maps)}")
    if name is not None and name not in maps:
        raise DataError(f"{file}: there is no column map '{name}'{known_names(name, maps)}")
    return maps[name or next(iter(maps))]


json_schema = partial(make_schema, _ColumnMaps, "ppafo column maps")
"""JSON Schema of a file of column maps."""


def column_map_of(columns: ColumnMap | str | Path) -> tuple[ColumnMap, str]:
    """Return a column map and its label in messages: ``logger.toml:bench`` from a file, empty for an object.

    Raises DataError if the file has no such map.
    """
    if isinstance(columns, ColumnMap):
        return columns, ""
    text = str(columns)
    path, separator, name = text.rpartition(".toml:")
    return load_column_map(f"{path}.toml", name) if separator and name else load_column_map(text), text


def in_map(map_name: str) -> AbstractContextManager[None]:
    """Return a context manager that prepends the name of a map, if any, to each DataError raised within."""
    return refused_as(DataError, f"column map {one_line(map_name)}", DataError) if map_name else nullcontext()


_KEYS_OF_TIME = ("rate", "date", "date_order", "clock")


def check_sources(columns: ColumnMap) -> None:
    """Raise DataError for a missing time, a channel without exactly one source, or a misplaced key."""
    if TIME not in columns.channels:
        raise DataError(f'channels.{TIME} is missing; add it with a column, or as {TIME} = {{ rate = "100 Hz" }}')
    for name, mapped in columns.channels.items():
        for key in () if name == TIME else _KEYS_OF_TIME:
            if getattr(mapped, key) is not None:
                raise DataError(f"channels.{name}.{key} is allowed only in channels.{TIME}; remove the key")
        sources = [key for key in ("column", "constant", "rate") if getattr(mapped, key) is not None]
        if not sources:
            allowed = "column, constant or rate" if name == TIME else "column or constant"
            raise DataError(f"channels.{name} needs a {allowed}")
        if len(sources) > 1:
            several = "both" if len(sources) == 2 else "all of"
            raise DataError(f"channels.{name} has {several} a {' and a '.join(sources)}; keep one of them")


class MappedTable(NamedTuple):
    """Content of a file selected by a column map.

    ``size``: number of samples. ``numbers``: columns by channel, in the units of the file. ``clock``: cells of a time
    of day, if time is given so; ``dates``: cells of a separate date column. ``rows``: number of each sample in the
    file, counted in ``noun`` ("line", "sample"). ``kind``: kind of recording stated in the file.
    """

    size: int
    numbers: dict[str, Floats]
    clock: list[str] | None
    dates: list[str] | None
    rows: Sequence[int]
    noun: str
    kind: RecordingKind


_MOST_SHOWN = 20
"""Largest number of names listed in a message."""


def shown_names(names: Collection[str]) -> str:
    """Format names as a list for a message: at most twenty, each shortened to one line."""
    shown = ", ".join(one_line(name)[:LONGEST_SHOWN] for name in islice(names, _MOST_SHOWN))
    return f"{shown}, ..." if len(names) > _MOST_SHOWN else shown
