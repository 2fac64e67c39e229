"""Recordings as sources of estimates: file hash, check for double use, origin, remarks on readings."""

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.estimate import shown_text
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, number_in_si
from ppafo.signals import Recording, RecordingKind
from ppafo.signals.faults import FEWEST_AT_LIMIT, is_at_limit, plateaus, scatters
from ppafo.signals.recording import TIME, Floats
from ppafo.storage.column_map import ColumnMap, MappedChannel
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import read_trials
from ppafo.storage.reading import TEXT_SUFFIXES, read_recording
from ppafo.storage.result_folder import RUN_FILE

_NO_SENSORS = ("command", "direction", "repetition")
"""Channels without a sensor, hence without a sensor limit."""
_KINDS: tuple[RecordingKind, ...] = ("synthetic", "simulated", "measured")
"""Origins of recordings, in decreasing priority for the origin of a result."""


@dataclass(frozen=True, slots=True)
class RecordingSource:
    """Recording with its source: ``static.csv sha256:0123...``, or the recording's label if it has no file.

    ``user`` is the procedure that messages name.
    """

    recording: Recording
    reference: str = ""
    user: str = ""

    @property
    def name(self) -> str:
        """Name in messages: file name, or the label of the recording."""
        return self.reference.partition(" sha256:")[0] or self.recording.label

    @property
    def trace(self) -> str:
        """Reference of the recording among the sources of an estimate."""
        return self.reference or self.recording.label

    @property
    def where(self) -> str:
        """Beginning of a message: name of the recording, and its user."""
        return f"{self.name}: {self.user}".removesuffix(": ")

    def refuse(self, fault: str) -> NoReturn:
        """Raise IdentificationError for a fault of the recording."""
        raise IdentificationError(f"{self.where}: {fault}")

    def shown(self, name: str, value: float) -> str:
        """Return a channel value [SI] as text, in the unit of the file."""
        channel = self.recording.channels[name]
        return shown_text(value, channel.unit, channel.stated)


Sources = tuple[RecordingSource, ...]
"""Recordings of one procedure."""


def source_of(path: Path, recording: Recording, trial: str = "") -> RecordingSource:
    """Return a recording with name and hash of its file. Raises DataError if the file no longer exists.

    ``trial`` is appended to the name if the file has several recordings.
    """
    return RecordingSource(recording, f"{path.name}{trial} sha256:{hashlib.sha256(read_bytes(path)).hexdigest()}")


class RecordingReader(NamedTuple):
    """Reader of the recordings that a problem file names.

    ``columns`` are its column maps by name, ``folder`` is the base of relative paths, ``file`` the name of the problem
    in messages. ``parameter_set`` has the atmosphere of gauge pressures, and the gas of volume flows if none is given.
    """

    columns: Mapping[str, ColumnMap]
    folder: Path
    file: str
    parameter_set: ParameterSet

    def read(
        self, name: str, columns: str | None, row_time: float | None = None, gas: str | None = None
    ) -> tuple[RecordingSource, ...]:
        """Return the recordings in a file, read through the column map ``columns`` if one is given.

        ``row_time`` [s] is the time between the rows of a table of text, or of a column map, without a time column;
        None requires the column. ``gas`` is the gas of volume flows.
        """
        path = self.folder / name
        atmosphere = atmospheric_pressure(self.parameter_set)
        if columns is None:
            is_text = path.suffix.lower() in TEXT_SUFFIXES and not (path.parent / RUN_FILE).exists()
            if row_time is not None and is_text:
                return (source_of(path, read_csv(path, atmosphere=atmosphere, row_time=row_time)),)
            return (source_of(path, read_recording(path, atmosphere=atmosphere)),)
        molar_mass = number_in_si(self.parameter_set, "gas.molar_mass")
        flowing = gas or ("" if molar_mass is None else f"{molar_mass!r} kg/mol")
        column_map = self.columns[columns]
        # A direction from a rate, and trials that begin anew, need the times of the bench.
        if row_time is not None and not (TIME in column_map.channels or column_map.direction or column_map.trial):
            time = MappedChannel(rate=f"{1.0 / row_time!r} Hz")
            column_map = replace(column_map, channels={TIME: time, **column_map.channels})
        recordings = read_trials(path, column_map, atmosphere, f"{self.file}:{columns}", flowing)
        return tuple(source_of(path, recording, recording.label.removeprefix(path.stem)) for recording in recordings)


@dataclass(frozen=True, slots=True)
class UsedRecording:
    """Recording as used by a procedure or a fit.

    ``by`` names the user in messages, ``trace`` the file; ``channels`` are the channels used (empty for all), from
    ``first`` to ``last`` [s]. Users of two different procedures (``kind``) may share a recording.
    """

    by: str
    trace: str
    recording: Recording
    channels: frozenset[str] = frozenset()
    first: float = -math.inf
    last: float = math.inf
    kind: str = ""


def double_use(uses: Iterable[UsedRecording]) -> str:
    """Return a message on samples used twice; empty if none are.

    Recordings are compared by their numbers, independent of file names.
    """
    for use, other in combinations(uses, 2):
        first = use.recording
        second = other.recording
        is_other_procedure = use.kind and other.kind and use.kind != other.kind
        shares = not (use.channels and other.channels) or bool(use.channels & other.channels)
        is_at_once = use.first < other.last and other.first < use.last
        is_same = {*first.names} == {*second.names} and np.array_equal(first.time, second.time)
        is_same = is_same and all(np.array_equal(first[name], second[name]) for name in first.names)
        if is_same and not is_other_procedure and shares and is_at_once:
            users = f"{use.by} ({use.trace}) and {other.by} ({other.trace})"
            return f"{users} are the same recording, so its samples would count twice"
    return ""


def together(sources: Sources) -> RecordingSource:
    """Return the first of several recordings with the names of all, for messages on their pooled readings."""
    return replace(sources[0], reference=", ".join(source.name for source in sources))


def pool(sources: tuple[RecordingSource, ...], name: str) -> Floats:
    """Return the values of a channel [SI], concatenated over recordings."""
    return np.concatenate([source.recording[name] for source in sources])


def window(recording: Recording, start: float | None, end: float | None) -> Recording:
    """Return the part of a recording between two times [s]; None means the start or end of the recording."""
    if start is None and end is None:
        return recording
    first = float(recording.time[0]) if start is None else start
    last = float(recording.time[-1]) if end is None else end
    return recording.between(first, last)


def kind_of(kinds: Iterable[RecordingKind]) -> RecordingKind:
    """Return the origin of a result: synthetic if any recording is, else simulated if any is, else measured."""
    return min(kinds, key=_KINDS.index, default="measured")


def remarks_on_readings(sources: tuple[RecordingSource, ...]) -> tuple[str, ...]:
    """Return remarks on values at the limit of a sensor."""
    remarks = []
    for source in sources:
        for name in source.recording.names:
            if name in _NO_SENSORS:
                continue
            values = source.recording[name]
            remarks += [
                f"{source.name}: '{name}' stays at {source.shown(name, plateau.value)} for {plateau.count} "
                f"samples, from sample {plateau.first + 1}: the sensor may be at its limit"
                for plateau in plateaus(values)
                # Values that scatter elsewhere do not stay at an extreme for long by themselves.
                if is_at_limit(values, plateau) or (plateau.count >= FEWEST_AT_LIMIT and scatters(values))
            ]
    return tuple(remarks)
