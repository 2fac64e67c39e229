"""A recording with the name and the hash of its file, so that a value can be traced back to what was measured."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path

from ppafo.signals import Recording
from ppafo.storage.files import read_bytes


@dataclass(frozen=True, slots=True)
class Source:
    """A recording and its reference, ``static.csv sha256:0123...``; one that comes from no file has its label."""

    recording: Recording
    reference: str = ""

    @property
    def name(self) -> str:
        """What messages call it: the file's name, else the recording's label."""
        return self.reference.partition(" sha256:")[0] or self.recording.label

    @property
    def trace(self) -> str:
        """What an estimate says of it."""
        return self.reference or self.recording.label


def source_of(path: Path, recording: Recording) -> Source:
    """Return a recording with the name and the hash of the file that it was read from; DataError if that is gone."""
    return Source(recording, f"{path.name} sha256:{hashlib.sha256(read_bytes(path)).hexdigest()}")


def traces(sources: tuple[Source, ...]) -> tuple[str, ...]:
    """Return what an estimate from these recordings names as its origin."""
    return tuple(source.trace for source in sources)


@dataclass(frozen=True, slots=True)
class Use:
    """A recording as it is used: by what, the file's trace, the channels that count, first and last time [s]."""

    by: str
    trace: str
    recording: Recording
    channels: frozenset[str]
    first: float
    last: float

    def overlaps(self, other: "Use") -> bool:
        """Whether both use samples of one time in one channel, should they be the same recording.

        Without channels all of them count.
        """
        is_alike = not (self.channels and other.channels) or bool(self.channels & other.channels)
        return is_alike and self.first < other.last and other.first < self.last


def double_use(uses: Iterable[Use]) -> str:
    """Return why some samples would count twice, an empty text where none do.

    Recordings are the same where the hash of their numbers is, under whatever names their files go.
    """
    return _overlap_message(combinations([(use, _digest(use.recording)) for use in uses], 2))


def common_use(ones: Iterable[Use], others: Iterable[Use]) -> str:
    """Return why some samples would count twice, once in each of two groups of uses; an empty text where none do."""
    first, second = ([(use, _digest(use.recording)) for use in group] for group in (ones, others))
    return _overlap_message(product(first, second))


def _overlap_message(pairs: Iterable[tuple[tuple[Use, str], tuple[Use, str]]]) -> str:
    for (one, digest), (other, second) in pairs:
        if digest == second and one.overlaps(other):
            return (
                f"{one.by} ({one.trace}) and {other.by} ({other.trace}) are the same recording, sha256 {digest[:12]} "
                f"of its numbers: its samples would count twice"
            )
    return ""


def _digest(recording: Recording) -> str:
    """Return the hash of times and values, whatever the file looks like."""
    total = hashlib.sha256(recording.time.tobytes())
    for name in sorted(recording.names):
        total.update(name.encode())
        total.update(recording[name].tobytes())
    return total.hexdigest()
