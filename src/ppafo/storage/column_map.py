"""Column maps: channels, units and signs of the columns of a foreign table.

A map is part of a TOML file, ``[columns.NAME]``. ``foreign.py`` reads a recording through a map.
"""

from collections.abc import Collection, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, refused_as
from ppafo.model.declaration import Number, Quantity
from ppafo.parameters.declared import Many, Words
from ppafo.parameters.records import checked_record, keyed, record_schema
from ppafo.signals import RecordingKind
from ppafo.signals.recording import TIME, Between, Floats
from ppafo.storage.clock import ClockForm, DateOrder
from ppafo.wording import LONGEST_SHOWN, known_names, one_line

Thousands = Literal["point", "comma", "apostrophe", "blank"]


_Place = Annotated[int | str | None, Words("number of the column from 1, or its name", form=int)]
_Sign = Literal[1, -1]
_KEYS_OF_TIME = ("rate", "date", "date_order", "clock")
_MOST_SHOWN = 20
"""Largest number of names listed in a message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MappedChannel:
    """Source of a channel: column or constant. Value in ``unit`` = sign * (factor * number + offset)."""

    column: _Place = None
    constant: str | None = keyed("constant value instead of a column, such as '1 bar_a'", None)
    unit: str = keyed("unit of the value, such as 'bar_g'; '-' for a plain number", "-")
    sign: _Sign = keyed("-1 if the file uses the opposite sign", 1)
    factor: float = keyed("conversion factor to the unit, such as bar per volt of a sensor", 1.0)
    offset: float = keyed("offset added after the factor, in the unit", 0.0)
    times: str | None = keyed("quantity that multiplies the column, such as a lever arm '0.13 m'", None)
    thousands: Thousands | None = keyed("thousands separator", None)
    between: Between | None = keyed(
        "value between samples: 'hold' the earlier one, or 'linear'; default: 'hold' for a command", None
    )
    words: dict[str, float] | None = keyed(
        "numbers that replace words in the column; 'direction' also knows up, down, auf, ab and others", None
    )
    at: str | None = keyed("reference condition of a volume flow: 'ANR', 'DIN 1343' or '0 degC, 1.01325 bar_a'", None)
    gas: str | None = keyed(
        "gas of a volume flow, such as 'air' or '0.044 kg/mol'; default: gas of the parameter set", None
    )
    rate: str | None = keyed("time only: sample rate instead of a column, such as '100 Hz'", None)
    date: _Place = keyed(Words("time only: column of the date that belongs to a time of day", form=int), None)
    date_order: DateOrder | None = keyed("time only: order of day and month in a date such as 03/04/2026", None)
    clock: ClockForm | None = keyed("time only: meaning of a text such as 08:10", None)


@dataclass(frozen=True, slots=True)
class MappedDirection:
    """Direction of motion from the rate of a channel: 1, -1, or 0 if too slow; the sweeps are numbered."""

    of: str = keyed("channel whose rate of change gives the direction")
    threshold: str = keyed("smallest rate that counts as motion, such as '2 mm/s'")
    window: str = keyed("time over which the channel is smoothed, such as '0.2 s'")
    sign: _Sign = keyed("-1 if a rising channel means falling pressure", 1)


_TRIALS = Many(
    Quantity("", "", "number from 1", minimum=1, whole=True),
    "trials to read, where each trial starts at time 0: a number from 1, a list, or 'all'",
    least=1,
    words=("all",),
    may_be_one=True,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnMap:
    """Column map: format of a foreign table, and the channels in its columns."""

    delimiter: Literal["comma", "semicolon", "tab", "whitespace"] = keyed("column delimiter", "comma")
    decimal: Literal["point", "comma"] = keyed("decimal mark", "point")
    encoding: Literal["utf-8", "latin-1"] = keyed("encoding of the text", "utf-8")
    header: bool = keyed("true if a header line names the columns", True)
    skip_lines: int = keyed(Number("", "lines before the header, or before the first row", minimum=0, whole=True), 0)
    skip_rows: int = keyed(
        Number("", "rows to skip below the header, such as a line of units", minimum=0, whole=True), 0
    )
    trial: Literal["all"] | int | tuple[int, ...] | None = keyed(_TRIALS, None)
    channels: dict[str, MappedChannel] = keyed("channels by name, with 'time'")
    direction: MappedDirection | None = keyed("direction from the rate of a channel", None)


@dataclass(frozen=True, slots=True)
class _ColumnMaps:
    """Column maps of a file, by name; a problem file of ``ppafo identify`` has further tables."""

    columns: dict[str, ColumnMap] = keyed("column maps by name")


_FILE = TomlKind("file of column maps", "columns", resources.files("ppafo.storage"), DataError)


def load_column_map(path: str | Path, name: str | None = None) -> ColumnMap:
    """Load a column map by name from a TOML file; without a name, the only map in the file.

    Raises DataError if there is no such map, or if there are several and no name is given.
    """
    source = _FILE.load(path)
    file = source.label
    document = {key: table for key, table in source.document.items() if key == "columns"}
    maps = checked_record(_ColumnMaps, replace(source, document=document)).columns
    if name is None and len(maps) > 1:
        raise DataError(f"{file}: has several column maps; name one as {file}:NAME; available: {', '.join(maps)}")
    if name is not None and name not in maps:
        raise DataError(f"{file}: there is no column map '{name}'{known_names(name, maps)}")
    return maps[name or next(iter(maps))]


json_schema = partial(record_schema, _ColumnMaps, "ppafo column maps")
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


def shown_names(names: Collection[str]) -> str:
    """Format names as a list for a message: at most twenty, each shortened to one line."""
    shown = ", ".join(one_line(name)[:LONGEST_SHOWN] for name in islice(names, _MOST_SHOWN))
    return f"{shown}, ..." if len(names) > _MOST_SHOWN else shown
