"""Metric: declaration, value and readings from meters; ramp and hold of a reference."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
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
from ppafo.wording import known_names

Floats = NDArray[np.float64]
_WAY = "the largest way of the reference from the start"


@dataclass(frozen=True, slots=True)
class Metric:
    """Value of a metric of a recording, in SI units, with its unit and meaning."""

    value: float
    unit: str
    summary: str

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the SI value as a zero-dimensional array for NumPy; ``copy`` is ignored, the array is always new."""
        return np.array(self.value, dtype)

    def __float__(self) -> float:
        """Return the SI value as a float."""
        return float(self.value)

    def in_unit(self, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
        """Return the value in a unit, such as ``g`` or ``psi_g``; gauge relative to ``atmosphere`` [Pa absolute].

        The metric's own ``unit`` gives the SI value, also ``-`` of a number without dimension; a ``Pa`` is absolute.

        Raises UnitError for a unit that does not fit.
        """
        if unit == self.unit:
            return self.value
        return from_si(self.value, unit, {"Pa": "Pa_a", "-": ""}.get(self.unit, self.unit), atmosphere)


class Metrics(dict[str, Metric]):
    """Metrics by name; an unknown name raises DataError with the nearest name."""

    def __missing__(self, name: str) -> Metric:
        """Raise DataError with the nearest metric name."""
        raise DataError(f"there is no metric '{name}'{known_names(name, self)}")


@dataclass(frozen=True, slots=True)
class Readings:
    """Final meter states of runs without recording; numbers are arrays (runs,), or floats for a single run.

    ``meters`` maps each meter's name to its final state. ``course`` is the summary of the reference, () if no meter
    needs one. ``interval`` is the time between two samples [s] and ``samples`` their number. ``traces`` maps channels
    to their samples (samples, runs).
    """

    meters: Mapping[str, Any]
    course: Any
    interval: Floats
    samples: int
    traces: Mapping[str, Floats]


@dataclass(frozen=True, slots=True)
class ReadAt:
    """Reading of a metric from meters: number at a path such as ``meters.motion.work``, or a function of several.

    Declared as data, so that an exported library has one expression for the metric instead of a function.
    """

    places: tuple[str, ...]
    function: PlainFunction | None = None

    def __call__(self, readings: Readings) -> Floats:
        """Return the metric of runs without recording (runs,)."""
        numbers = []
        for place in self.places:
            number: Any = readings
            for name in place.split("."):
                number = number[name] if isinstance(number, Mapping) else getattr(number, name)
            numbers.append(number)
        found: Floats = numbers[0] if self.function is None else self.function(*numbers)
        return found


def less(number: Floats, other: Floats) -> Floats:
    """Difference of two numbers in the same unit (runs,)."""
    return number - other


def mean_of(total: Floats, count: Floats) -> Floats:
    """Mean from a sum and a number of summands; nan without summands (runs,)."""
    # Both sides of a choice are computed, in the lanes too: the divisor is never 0.
    mean: Floats = choose(count > 0.0, total / larger(count, 1.0), math.nan)
    return mean


def root_mean(squares: Floats, count: Floats) -> Floats:
    """Root mean square from a sum of squares and their number; nan without squares (runs,)."""
    found: Floats = root(mean_of(squares, count))
    return found


@dataclass(frozen=True, slots=True)
class MetricKind:
    """Metric in the catalogue: unit, required channels, and pure functions that compute the value.

    ``compute(recording)`` gives the value from a recording with the ``channels``, or None if the metric does not apply,
    such as an error on the hold without a hold. ``read(readings)`` gives the values of many runs (runs,), nan instead
    of None, from the meters in ``meters`` and the traces of the channels in ``traced``; without traces it must be a
    ``ReadAt`` or a plain function, no closure, that uses arithmetic and the functions of ``model.columns``, because it
    is translated too. It is called only for runs that have the channels and the requirements in ``needs``.
    ``of_reference`` is the controlled quantity of a metric about a reference. A metric without ``compute`` cannot be
    computed from a recording. ``better`` is -1 if a smaller value is better, 1 if a larger one is, 0 if neither; one
    with None is compared on request only.
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
    better: int | None = None


def metered(
    compute: Callable[[Recording], float | None],
    unit: str,
    summary: str,
    channels: tuple[str, ...],
    *numbers: tuple[MeterKind, str],
    function: PlainFunction | None = None,
    needs: tuple[str, ...] = (),
    better: int | None = None,
) -> MetricKind:
    """Declare the metric that a function computes, by its name, read as numbers of meters or a ``function`` of them."""
    read = ReadAt(tuple(f"meters.{meter.name}.{number}" for meter, number in numbers), function)
    meters = tuple({meter.name: meter for meter, _ in numbers}.values())
    return MetricKind(compute.__name__, unit, summary, channels, compute, read, meters, needs=needs, better=better)


def for_each_reference(kinds: tuple[MetricKind, ...], rename: Callable[[str, str], str]) -> tuple[MetricKind, ...]:
    """Return metrics of a torque reference, and their counterparts for every other controlled quantity.

    ``rename(name, controlled)`` gives the names of the latter.
    """
    others = (
        replace(
            kind,
            name=rename(kind.name, name),
            unit=controlled.difference if kind.unit == "N m" else kind.unit,
            summary=kind.summary.replace("torque", controlled.words).replace("the largest reference", _WAY),
            channels=(controlled.name, controlled.reference),
            of_reference=name,
        )
        for name, controlled in CONTROLLED.items()
        if name != TORQUE
        for kind in kinds
    )
    return (*(replace(kind, of_reference=TORQUE) for kind in kinds), *others)


def controlled_in(recording: Recording) -> ControlledQuantity | None:
    """Return the controlled quantity of the reference in a recording; None without a reference."""
    return next((kind for kind in CONTROLLED.values() if kind.reference in recording), None)


def reference_of(recording: Recording) -> Floats:
    """Return the reference in a recording [SI unit of the controlled quantity]."""
    return next(recording[kind.reference] for kind in CONTROLLED.values() if kind.reference in recording)


def followed(recording: Recording) -> tuple[Floats, Floats]:
    """Return reference and controlled quantity of a recording with a reference [SI]."""
    channel = next(kind.name for kind in CONTROLLED.values() if kind.reference in recording)
    return reference_of(recording), recording[channel]


def extent(recording: Recording) -> float:
    """Return the largest distance of the reference from 0 for a torque, else from the initial controlled value."""
    if CONTROLLED[TORQUE].reference in recording:
        return float(np.max(np.abs(recording[CONTROLLED[TORQUE].reference])))
    reference, value = followed(recording)
    return float(np.max(np.abs(reference - value[0])))


def hold_start(recording: Recording) -> int | None:
    """Return the first sample of the final hold of a reference; None without a hold."""
    reference = reference_of(recording)
    tolerance = SAME_LEVEL * extent(recording)
    away = np.flatnonzero(np.abs(reference - reference[-1]) > tolerance)
    first = int(away[-1]) + 1 if away.size else 0
    # One sample at rest has no time over which a mean could be taken.
    return first if len(recording) - first >= 2 else None


def ramp(recording: Recording) -> slice | None:
    """Return the samples of the ramp, up to the start of the hold; None without a ramp or a hold."""
    # With the first sample of the hold, so that ramp and hold together are the whole task.
    start = hold_start(recording)
    return slice(start + 1) if start else None


def hold(recording: Recording) -> slice | None:
    """Return the samples of the hold at the final level; None without a hold."""
    start = hold_start(recording)
    return None if start is None else slice(start, None)


def spans(readings: Readings) -> tuple[Floats, Floats]:
    """Return the number of samples before the hold, and of intervals in the hold (runs,); nan if absent."""
    # Read at the end of a run, where the course has seen the whole reference.
    start = readings.course.hold_start
    length = readings.samples - 1 - start
    ramp_samples = choose(length >= 1.0, choose(start > 0.0, start, math.nan), math.nan)
    return ramp_samples, choose(length >= 1.0, length, math.nan)
