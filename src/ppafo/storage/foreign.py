"""Foreign tables, with other columns, units and signs, read as recordings through a column map.

Error messages name file, line and column of an invalid cell, and the key of an error in the map.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, PpafoError, UnitError, noted_in, raise_noted, refused_as
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, Floats
from ppafo.storage.clock import clock_seconds, counted_on
from ppafo.storage.column_map import ColumnMap, MappedChannel, MappedDirection, MappedTable, check_sources, in_map
from ppafo.storage.comma_separated import HeaderColumn, check_clock, in_si
from ppafo.storage.files import read_bytes
from ppafo.storage.mapped_text import read_mapped_text
from ppafo.storage.matlab import MATLAB_SUFFIX, read_mapped_matlab, read_matlab
from ppafo.wording import one_line

_SHORTEST = 1e-12
"""Least time [s] between the two means of samples that give a slope; a shorter time is rounding."""
_MASS_FLOW, _SAME_DENSITY = "kg/s", 5.0e-3
"""Unit of a mass flow, and relative difference [-] below which two reference densities count as the same."""


def read_foreign(
    path: str | Path,
    columns: ColumnMap,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
    gas: str = "",
) -> Recording:
    """Read a single recording from a table through a column map, in SI units; arguments and errors as ``read_trials``.

    Gauge pressure is relative to ``atmosphere`` [Pa absolute]. Raises DataError if the map selects several trials.
    """
    recordings = read_trials(path, columns, atmosphere, map_name, gas)
    if len(recordings) > 1:
        with refused_as(DataError, path, DataError), in_map(map_name):
            raise DataError(f"trial selects {len(recordings)} recordings; give the number of one trial")
    return recordings[0]


def read_trials(
    path: str | Path,
    columns: ColumnMap,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
    gas: str = "",
) -> tuple[Recording, ...]:
    """Read all recordings from a table through a column map: one, or one for each trial that the map selects.

    ``gas`` is the gas of volume flows if the map states none. Raises DataError with file and column or, for an error in
    the map, with the key and the name of the map.
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
        with in_map(map_name):
            faults, channels = list[PpafoError](), dict[str, Channel]()
            for name, mapped in columns.channels.items():
                with noted_in(faults):
                    if name == TIME:
                        time = _time(mapped, table, atmosphere)
                    else:
                        channels[name] = _channel(name, mapped, table, atmosphere, gas)
            raise_noted(faults)
            falls = np.flatnonzero(np.diff(time) < 0.0) + 1
            if columns.trial is None and falls.size and np.all(time[falls] < np.mean(time[:2])):
                line = f"{table.noun} {table.rows[falls[0]]}"
                raise DataError(
                    f"{line}: the clock restarts, {falls.size + 1} trials; give trial: a number, list or 'all'"
                )
            trials = {"": slice(None)} if columns.trial is None else _rows_of_trials(time, columns.trial)
        recordings = []
        for suffix_of_label, rows in trials.items():
            check_clock(time[rows], table.rows[rows], table.noun)
            trial = {name: replace(channel, values=channel.values[rows]) for name, channel in channels.items()}
            trial_label = f"{one_line(Path(path).stem)}{suffix_of_label}"
            # A synthetic recording stays one through a column map.
            recording = Recording(trial_label, time[rows], trial, table.kind)
            with in_map(map_name):
                recordings.append(
                    recording if columns.direction is None else _with_direction(recording, columns.direction)
                )
        return tuple(recordings)


def _rows_of_trials(time: Floats, wanted: str | int | tuple[int, ...]) -> dict[str, slice]:
    """Return the rows of each selected trial by label suffix; a trial starts where the time [s] falls."""
    starts = [0, *(np.flatnonzero(np.diff(time) < 0.0) + 1).tolist(), time.size]
    count = len(starts) - 1
    numbers = range(1, count + 1) if isinstance(wanted, str) else np.atleast_1d(wanted).tolist()
    for trial in numbers:
        if trial > count:
            raise DataError(
                f"trial = {trial}: the clock restarts {count - 1} times, so the file has trials 1 to {count}"
            )
    rows = {f" trial {number}": slice(starts[number - 1], starts[number]) for number in numbers}
    return {"": rows[f" trial {wanted}"]} if isinstance(wanted, int) else rows


def _channel(name: str, mapped: MappedChannel, table: MappedTable, atmosphere: float, gas: str = "") -> Channel:
    """Return a channel in SI units, from a column or a constant; a factor ``times`` contributes its own unit.

    ``atmosphere`` [Pa absolute] and ``gas`` (empty if unknown) complete gauge pressures and volume flows.
    """
    from ppafo.units import split_number

    if mapped.constant is not None:
        with refused_as(DataError, f"channels.{name}.constant = {mapped.constant!r}", UnitError):
            value, unit = split_number(mapped.constant)
            column = HeaderColumn(name, _flow_unit(name, unit, mapped, gas) or PLAIN_NUMBER)
            values = in_si(column, np.full(table.size, value), atmosphere)
            return Channel(values, column.si_unit, mapped.between, column.unit)
    numbers = table.numbers.get(name, np.empty(0))
    values, unit = mapped.sign * (mapped.factor * numbers + mapped.offset), mapped.unit
    key = f"unit = {mapped.unit!r}"
    if mapped.times is not None:
        with refused_as(DataError, f"channels.{name}.times = {mapped.times!r}", UnitError):
            multiple, unit_of_multiple = split_number(mapped.times)
        values, unit = values * multiple, f"{unit} {unit_of_multiple}".removeprefix(f"{PLAIN_NUMBER} ").strip()
        key += f" with times = {mapped.times!r}"
    with refused_as(DataError, f"channels.{name}.{key}", UnitError):
        column = HeaderColumn(name, _flow_unit(name, unit, mapped, gas))
        return Channel(in_si(column, values, atmosphere), column.si_unit, mapped.between, column.unit)


def _flow_unit(name: str, unit: str, mapped: MappedChannel, gas: str) -> str:
    """Return the unit of a channel; a volume flow measured as mass flow gets its reference condition and gas."""
    from ppafo.units.spelling import flow_of, is_volume_flow, read_unit

    is_flow = HeaderColumn(name, unit).si_unit == _MASS_FLOW and unit not in ("", PLAIN_NUMBER) and is_volume_flow(unit)
    if not is_flow:
        if mapped.at is not None or mapped.gas is not None:
            raise UnitError("'at' and 'gas' are allowed only for a volume flow, such as 'L/min'")
        return unit
    flow = flow_of(unit)
    by_unit = flow.at(mapped.at or "", mapped.gas or gas)
    by_map = flow_of(flow.unit).at(mapped.at or flow.condition, mapped.gas or "".join(flow.gases[:1]) or gas)
    if not math.isclose(read_unit(by_unit).scale, read_unit(by_map).scale, rel_tol=_SAME_DENSITY):
        raise UnitError(f"means '{by_map}' by 'at' and 'gas', but '{by_unit}' by 'unit'; give each only once")
    return by_unit


def _time(mapped: MappedChannel, table: MappedTable, atmosphere: float) -> Floats:
    """Return the time [s] of the rows: from a rate, from times of day, or from numbers with a unit."""
    if mapped.rate is not None:
        from ppafo.units import parse_quantity

        with refused_as(DataError, f"channels.{TIME}.rate = {mapped.rate!r}", UnitError):
            rate = parse_quantity(mapped.rate, "1/s")
            if rate <= 0.0:
                raise UnitError("must be above 0 Hz")
        return np.arange(table.size) / rate
    if table.clock is None:
        return counted_on(_channel(TIME, mapped, table, atmosphere).values)
    rows = [f"{table.noun} {row}, channels.{TIME}" for row in table.rows]
    time = clock_seconds(table.clock, rows, table.dates, mapped.date_order, mapped.clock)
    steps = np.diff(time)
    # Loggers that write whole seconds may write many rows in each.
    if table.size > 2 and (steps == 0.0).any() and time[-1] > 0.0 and (steps >= 0.0).all():
        mean_rate = float(f"{(table.size - 1) / time[-1]:.3g}")
        raise DataError(
            f"channels.{TIME}: several rows have the same time of day; give the sample rate instead of the column: "
            f'{TIME} = {{ rate = "{mean_rate:g} Hz" }} (mean of this file)'
        )
    return time


def _with_direction(recording: Recording, wanted: MappedDirection) -> Recording:
    """Add the channel ``direction`` to a recording: 1 up, -1 down, 0 for slower than the threshold.

    Unless the recording has a channel ``repetition``, one is added that numbers the sweeps from 1; it is 0 where the
    motion is too slow. Raises DataError for a channel that is absent or never moves, and for an invalid threshold or
    window.
    """
    from ppafo.units import parse_quantity

    with refused_as(DataError, f"direction.of = {wanted.of!r}", DataError):
        unit = recording.unit(wanted.of)
    rate_unit = "1/s" if unit == PLAIN_NUMBER else f"{unit.removesuffix('_d')}/s"
    with refused_as(DataError, f"direction.threshold = {wanted.threshold!r}", UnitError):
        threshold = parse_quantity(wanted.threshold, rate_unit)
    with refused_as(DataError, f"direction.window = {wanted.window!r}", UnitError):
        window = parse_quantity(wanted.window, TIME_UNIT)
    # The slope [1/s] between the means of the half windows [s] before and after each sample.
    sums = np.pad(np.cumsum([recording[wanted.of], recording.time], axis=1), ((0, 0), (1, 0)))
    here = np.arange(recording.time.size)
    # At least the sample itself on either side, where the window is shorter than a sample.
    first = np.minimum(np.searchsorted(recording.time, recording.time - 0.5 * window), here)
    end = np.maximum(np.searchsorted(recording.time, recording.time + 0.5 * window, side="right"), here + 1)
    before = (sums[:, here + 1] - sums[:, first]) / (here - first + 1)
    change, elapsed = (sums[:, end] - sums[:, here]) / (end - here) - before
    rate = wanted.sign * (change / np.maximum(elapsed, _SHORTEST))
    direction = np.where(rate > threshold, 1.0, np.where(rate < -threshold, -1.0, 0.0))
    moving = np.flatnonzero(direction)
    if moving.size == 0:
        raise DataError(
            f"direction.threshold = {wanted.threshold!r}: '{wanted.of}' never changes faster; give a lower threshold"
        )
    directed = recording.with_channel("direction", direction, PLAIN_NUMBER)
    if "repetition" in recording:
        return directed
    sweeps = np.zeros(direction.size)
    is_reversed = np.diff(direction[moving]) != 0.0
    sweeps[moving] = np.concatenate(([1], 1 + np.cumsum(is_reversed)))
    return directed.with_channel("repetition", sweeps, PLAIN_NUMBER)
