"""Declaration and value of a metric; the two parts of a torque task, the ramp and the hold after it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError
from ppafo.model.columns import choose, larger, root
from ppafo.model.controlled import CONTROLLED, TORQUE, ControlledQuantity
from ppafo.model.declaration import PlainFunction
from ppafo.signals import Recording
from ppafo.signals.meter import SAME_LEVEL, MeterKind
from ppafo.units import from_si
from ppafo.wording import nearest_name

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Metric:
    """Value of a metric of a recording, in SI units, and its meaning."""

    value: float
    unit: str
    summary: str

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the value in SI as an array without axes, for NumPy; ``copy`` means nothing, it is always new."""
        return np.array(self.value, dtype)

    def __float__(self) -> float:
        """Return the value in SI, for arithmetic."""
        return float(self.value)

    def in_unit(self, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
        """Return the value in a unit, such as ``g`` or ``psi_g``; gauge counts from ``atmosphere`` [Pa absolute].

        UnitError for a unit that does not fit.
        """
        return from_si(self.value, unit, "Pa_a" if self.unit == "Pa" else self.unit, atmosphere)


class Metrics(dict[str, Metric]):
    """Metrics by name; an unknown name is refused with the nearest one."""

    def __missing__(self, name: str) -> Metric:
        """Refuse a name. DataError with the nearest one, as for a channel of a recording."""
        raise DataError(
            f"there is no metric '{name}'{nearest_name(name, self)}; available: {', '.join(self) or 'none'}"
        )


@dataclass(frozen=True, slots=True)
class Readings:
    """Final meter states of runs that were not recorded; every number is an array (runs,), or a float for one run.

    ``meters`` has the last state of each meter by its name; ``course`` the reference's, () where none needs it;
    ``interval`` is the time between two samples [s] and ``samples`` their number; ``traces`` has channels sample by
    sample (samples, runs).
    """

    meters: Mapping[str, Any]
    course: Any
    interval: Floats
    samples: int
    traces: Mapping[str, Floats]


@dataclass(frozen=True, slots=True)
class ReadAt:
    """Reads a metric that is a number at a place of the readings, ``meters.work.work``, or a function of several.

    Declared, so that an exported library has one expression for it and no function of its own.
    """

    places: tuple[str, ...]
    function: PlainFunction | None = None

    def __call__(self, readings: Readings) -> Floats:
        """The metric of metered runs (runs,)."""
        row: Any = readings
        numbers = [reduce(_entry, place.split("."), row) for place in self.places]
        found: Floats = numbers[0] if self.function is None else self.function(*numbers)
        return found


def _entry(row: Any, name: str) -> Any:
    return row[name] if isinstance(row, Mapping) else getattr(row, name)


def less(number: Floats, other: Floats) -> Floats:
    """Difference of two numbers of one unit (runs,)."""
    return number - other


def mean_of(total: Floats, count: Floats) -> Floats:
    """A sum over how many there are, in its unit; nan for none (runs,)."""
    # Both sides of a choice are computed, in the lanes too: the divisor is never 0.
    mean: Floats = choose(count > 0.0, total / larger(count, 1.0), math.nan)
    return mean


def root_mean(squares: Floats, count: Floats) -> Floats:
    """Root of the mean of some squares; nan for none (runs,)."""
    found: Floats = root(mean_of(squares, count))
    return found


def time_if_any(time: Floats) -> Floats:
    """A time [s] of something; nan below 0, which stands for what has not happened."""
    # The state of a run is floats alone, and a column has no other word for None.
    found: Floats = choose(time >= 0.0, time, math.nan)
    return found


@dataclass(frozen=True, slots=True)
class MetricKind:
    """A metric in the catalogue: the channels it needs, and a pure function that gives the value.

    ``compute(recording)`` returns None where the recording has the channels but not what the metric is about, for
    example no hold for the error on the hold. ``read(readings)`` returns the same for many runs (runs,), nan in place
    of None, from the meters in ``meters`` and the traces of the channels in ``traced``; without a trace it is a
    ``ReadAt``, or a plain function, no closure, of arithmetic with the functions of ``model.columns``, which is
    translated too. It is asked only of runs that have the channels, and what is in ``needs``; of a metric about a
    reference, ``of_reference`` says of what that is. Without ``compute`` it is counted while a run goes on, and no
    recording of its channels alone has it.
    """

    name: str
    unit: str
    summary: str
    channels: tuple[str, ...]
    compute: Callable[[Recording], float | None] | None
    read: Callable[[Readings], Floats]
    meters: tuple[MeterKind, ...] = ()
    traced: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    of_reference: str = ""


_WAY = "the largest way of the reference from the start"


def for_each_reference(kinds: tuple[MetricKind, ...], rename: Callable[[str, str], str]) -> tuple[MetricKind, ...]:
    """Return metrics of a torque's reference, and the same of each other one, in its unit.

    ``rename(name, controlled)`` makes the names of the others.
    """
    others = (
        replace(
            kind,
            name=rename(kind.name, name),
            unit=controlled.difference if kind.unit == "N m" else kind.unit,
            summary=kind.summary.replace("torque", controlled.words).replace("the largest reference", _WAY),
            channels=(controlled.channel, controlled.reference),
            of_reference=name,
        )
        for name, controlled in CONTROLLED.items()
        if name != TORQUE
        for kind in kinds
    )
    return (*(replace(kind, of_reference=TORQUE) for kind in kinds), *others)


def controlled_in(recording: Recording) -> ControlledQuantity | None:
    """Return what the reference of a recording is of; None where it has none."""
    return next((kind for kind in CONTROLLED.values() if kind.reference in recording), None)


def reference_of(recording: Recording) -> Floats:
    """Return the reference of a recording, which has one."""
    return next(recording[kind.reference] for kind in CONTROLLED.values() if kind.reference in recording)


def followed(recording: Recording) -> tuple[Floats, Floats]:
    """Return the reference of a recording, which has one, and what follows it."""
    channel = next(kind.channel for kind in CONTROLLED.values() if kind.reference in recording)
    return reference_of(recording), recording[channel]


def extent(recording: Recording) -> float:
    """Return how far the reference goes: from 0 for a torque, else from what is controlled at the start."""
    if CONTROLLED[TORQUE].reference in recording:
        return float(np.max(np.abs(recording[CONTROLLED[TORQUE].reference])))
    reference, value = followed(recording)
    return float(np.max(np.abs(reference - value[0])))


def hold_start(recording: Recording) -> int | None:
    """Return the sample from which on the reference stays at its final level; None where it never rests there."""
    reference, tolerance = reference_of(recording), SAME_LEVEL * extent(recording)
    away = np.flatnonzero(np.abs(reference - reference[-1]) > tolerance)
    first = int(away[-1]) + 1 if away.size else 0
    # One sample at rest has no time over which a mean could be taken.
    return first if len(recording) - first >= 2 else None


def ramp(recording: Recording) -> slice | None:
    """Return the samples until the reference reaches the level it keeps; None where there is no ramp or no hold."""
    # With the first sample of the hold, so that ramp and hold together are the whole task.
    start = hold_start(recording)
    return slice(start + 1) if start else None


def hold(recording: Recording) -> slice | None:
    """Return the samples from where the reference stays at its final level; None where it never does."""
    start = hold_start(recording)
    return None if start is None else slice(start, None)


def spans(readings: Readings) -> tuple[Floats, Floats]:
    """Number of samples before the hold and of intervals on it, of metered runs; nan where there is no such part."""
    # Read at the end of a run, where the course has seen the whole reference.
    start = readings.course.hold_start
    length = readings.samples - 1 - start
    ramp_samples = choose(length >= 1.0, choose(start > 0.0, start, math.nan), math.nan)
    return ramp_samples, choose(length >= 1.0, length, math.nan)
