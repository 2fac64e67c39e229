"""Tables from elsewhere, with their own columns, units and signs, read through a column map as recordings.

What cannot be read is named with file, line and column, and what is wrong in the map with its key.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, UnitError, one_line, refused_as
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME, Floats
from ppafo.storage.clock import clock_seconds
from ppafo.storage.column_map import ColumnMap, MappedChannel, MappedTable, check_sources, in_map
from ppafo.storage.comma_separated import Column, check_clock, in_si
from ppafo.storage.counter import counted_on
from ppafo.storage.files import read_bytes
from ppafo.storage.mapped_direction import with_direction
from ppafo.storage.mapped_matlab import read_mapped_matlab
from ppafo.storage.mapped_text import read_mapped_text
from ppafo.storage.matlab import MATLAB_SUFFIX, read_matlab

_MASS_FLOW = "kg/s"


class _Surroundings(NamedTuple):
    """What a file does not say: the atmosphere [Pa absolute], and the gas of its volume flows, empty where unknown."""

    atmosphere: float
    gas: str


def read_foreign(
    path: str | Path,
    columns: ColumnMap,
    label: str | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
    gas: str = "",
) -> Recording:
    """Return the recording in a table through a column map, in SI units; gauge counts from ``atmosphere`` [Pa abs].

    ``gas`` is the gas of a volume flow whose map does not say it. DataError names the file and the column; of a fault
    in the map its key, and the map where ``map_name`` says which.
    """
    suffix = Path(path).suffix.lower()
    # Both name the file themselves where it cannot be read.
    content = read_matlab(path) if suffix == MATLAB_SUFFIX else read_bytes(path)
    with refused_as(DataError, path, DataError):
        if suffix == ".nc":
            raise DataError("is a NetCDF file, which names its own channels and units: read it without a column map")
        with in_map(map_name):
            check_sources(columns)
        if isinstance(content, bytes):
            table = read_mapped_text(content, columns, map_name)
        else:
            table = read_mapped_matlab(content, columns, map_name)
        surroundings = _Surroundings(atmosphere, gas)
        with in_map(map_name):
            channels = {
                name: _channel(name, mapped, table, surroundings)
                for name, mapped in columns.channels.items()
                if name != TIME
            }
            time = _time(columns.channels[TIME], table, atmosphere)
        check_clock(time, table.rows, table.noun)
        # A synthetic recording stays one through a column map.
        recording = Recording(label or one_line(Path(path).stem), time, channels, table.kind)
        with in_map(map_name):
            return recording if columns.direction is None else with_direction(recording, columns.direction)


def _channel(name: str, mapped: MappedChannel, table: MappedTable, surroundings: _Surroundings) -> Channel:
    """Return a channel in SI, a constant one too; the quantity that it is multiplied by brings its own unit."""
    from ppafo.units import split_number

    if mapped.constant is not None:
        with refused_as(DataError, f"channels.{name}.constant = {mapped.constant!r}", UnitError):
            value, unit = split_number(mapped.constant)
            column = Column(name, _flow_unit(name, unit, mapped, surroundings.gas) or PLAIN_NUMBER)
            values = in_si(column, np.full(table.size, value), surroundings.atmosphere)
            return Channel(values, column.si_unit, mapped.between)
    numbers = table.numbers.get(name, np.empty(0))
    values, unit = mapped.sign * (mapped.factor * numbers + mapped.offset), mapped.unit
    key = f"unit = {mapped.unit!r}"
    if mapped.times is not None:
        with refused_as(DataError, f"channels.{name}.times = {mapped.times!r}", UnitError):
            multiple, unit_of_multiple = split_number(mapped.times)
        values, unit = values * multiple, f"{unit} {unit_of_multiple}".removeprefix(f"{PLAIN_NUMBER} ").strip()
        key += f" with times = {mapped.times!r}"
    with refused_as(DataError, f"channels.{name}.{key}", UnitError):
        column = Column(name, _flow_unit(name, unit, mapped, surroundings.gas))
        return Channel(in_si(column, values, surroundings.atmosphere), column.si_unit, mapped.between)


def _flow_unit(name: str, unit: str, mapped: MappedChannel, gas: str) -> str:
    """Return the unit of a channel, with reference condition and gas where it is a volume flow for a mass flow."""
    from ppafo.units import is_volume_flow, with_condition

    is_flow = Column(name, unit).si_unit == _MASS_FLOW and unit not in ("", PLAIN_NUMBER) and is_volume_flow(unit)
    if not is_flow:
        if mapped.at is not None or mapped.gas is not None:
            raise UnitError("at and gas belong to a volume flow, such as 'L/min', in the place of a mass flow")
        return unit
    return with_condition(unit, mapped.at, mapped.gas or gas) if mapped.at else unit


def _time(mapped: MappedChannel, table: MappedTable, atmosphere: float) -> Floats:
    """Return the time [s] of the rows: by their number and a rate, from a clock, or from numbers with a unit."""
    if mapped.rate is not None:
        with refused_as(DataError, f"channels.{TIME}.rate = {mapped.rate!r}", UnitError):
            rate = _rate(mapped.rate)
        return np.arange(table.size) / rate
    if table.clock is None:
        return counted_on(_channel(TIME, mapped, table, _Surroundings(atmosphere, gas="")).values)
    rows = [f"{table.noun} {row}, channels.{TIME}" for row in table.rows]
    time = clock_seconds(table.clock, rows, table.dates, mapped.date_order, mapped.clock)
    steps = np.diff(time)
    # Loggers that write whole seconds may write many rows in each.
    if table.size > 2 and (steps == 0.0).any() and time[-1] > 0.0 and (steps >= 0.0).all():
        mean_rate = float(f"{(table.size - 1) / time[-1]:.3g}")
        raise DataError(
            f"channels.{TIME}: several rows have the same time of day; give the rate of the rows in place of the "
            f'column, such as {TIME} = {{ rate = "{mean_rate:g} Hz" }}, which is the mean of this file'
        )
    return time


def _rate(text: str) -> float:
    """Return rows per second of ``100 Hz``, ``100 1/s`` or ``10 1/min``; UnitError for another text."""
    from ppafo.units import parse_quantity

    rate = parse_quantity(text, "1/s")
    if rate <= 0.0:
        raise UnitError("must be above 0 Hz")
    return rate
