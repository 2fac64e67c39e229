"""A recording with the name and the hash of its file, so that a value can be traced back to what was measured."""

from dataclasses import dataclass

from ppafo.signals import Recording


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


def traces(sources: tuple[Source, ...]) -> tuple[str, ...]:
    """Return what an estimate from these recordings names as its origin."""
    return tuple(source.trace for source in sources)
