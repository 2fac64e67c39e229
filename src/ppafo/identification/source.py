"""Recordings as sources of estimates: file hash, check for double use, origin, remarks on readings."""

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import NoReturn

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.estimate import in_shown_unit
from ppafo.signals import Recording, RecordingKind
from ppafo.signals.faults import FEWEST_AT_LIMIT, is_at_limit, plateaus, scatters
from ppafo.signals.recording import Floats
from ppafo.storage.files import read_bytes

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
        number, unit = in_shown_unit(value, channel.unit, channel.stated)
        return f"{number:.6g} {unit}".removesuffix(" -")


Sources = tuple[RecordingSource, ...]
"""Recordings of one procedure."""


def source_of(path: Path, recording: Recording, trial: str = "") -> RecordingSource:
    """Return a recording with name and hash of its file. Raises DataError if the file no longer exists.

    ``trial`` is appended to the name if the file has several recordings.
    """
    return RecordingSource(recording, f"{path.name}{trial} sha256:{hashlib.sha256(read_bytes(path)).hexdigest()}")


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

    def overlaps(self, other: "UsedRecording") -> bool:
        """Return whether two uses of the same recording share samples of a channel."""
        if self.kind and other.kind and self.kind != other.kind:
            return False
        is_alike = not (self.channels and other.channels) or bool(self.channels & other.channels)
        return is_alike and self.first < other.last and other.first < self.last


def double_use(uses: Iterable[UsedRecording]) -> str:
    """Return a message on samples used twice; empty if none are.

    Recordings are compared by the hash of their numbers, independent of file names.
    """
    digests = [(use, _digest(use.recording)) for use in uses]
    for (use, digest), (other, other_digest) in combinations(digests, 2):
        if digest == other_digest and use.overlaps(other):
            return (
                f"{use.by} ({use.trace}) and {other.by} ({other.trace}) are the same recording (SHA-256 "
                f"{digest[:12]}), so its samples would count twice"
            )
    return ""


def _digest(recording: Recording) -> str:
    """Return the hash of times and values, independent of the file format."""
    total = hashlib.sha256(recording.time.tobytes())
    for name in sorted(recording.names):
        # The name too: two channels that are exchanged make another recording.
        total.update(name.encode())
        total.update(recording[name].tobytes())
    return total.hexdigest()


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
