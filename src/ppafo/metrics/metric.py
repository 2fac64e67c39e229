"""What a metric declares of itself, and what it gives."""

from collections.abc import Callable
from dataclasses import dataclass

from ppafo.signals import Recording


@dataclass(frozen=True, slots=True)
class Metric:
    """One number about a recording, in SI units, with what it means."""

    value: float
    unit: str
    summary: str


@dataclass(frozen=True, slots=True)
class MetricKind:
    """A metric in the catalogue: the channels it needs, and a pure function that gives the value.

    ``compute(recording)`` returns None where the recording has the channels but not what the metric is about, for
    example no hold for the error on the hold.
    """

    name: str
    unit: str
    summary: str
    channels: tuple[str, ...]
    compute: Callable[[Recording], float | None]
