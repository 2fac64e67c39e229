"""Readings of a bench: needed channels, saturated sensors, gaps, wrong readings, flow against its direction."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np

from ppafo.identification.fit import Flags, Indices
from ppafo.identification.source import RecordingSource, Sources, pool, window
from ppafo.signals import Recording
from ppafo.signals.faults import longest_gap, noise_of, outlying_samples, plateaus, resolution_of
from ppafo.signals.recording import Floats

_MOST_IMPOSSIBLE = 0.1
"""Largest fraction of impossible flow meter readings [-]; more means wrong signs or columns."""
# Outlier limits as fractions of the usual range [-]: of samples over time (a sixth of the limit), fine and gross; of
# readings, gross. A single glitch of a third of the range, as loggers produce, must not refuse a recording.
_FINE_SAMPLE = 0.01
_GROSS_SAMPLE = 1.0 / 6.0
_GROSS_READING = 0.25
_MOST_LEFT_OUT = 0.02
"""Largest fraction of the samples of a recording over time that may be left out as outliers [-]."""
_COARSEST = 0.05
"""Largest converter step, relative to the largest valid sample [-]; a larger step may be two equal outliers."""
_NO_DECAY = 0.5
"""Largest difference of the first two samples from the median of the first five, relative to the range [-]."""
# Number of neighbours for the comparison of a reading, and least number of readings to compare.
_ALIKE = 6
_FEWEST_ALIKE = 8
# Least number and fraction of samples at an extreme value [-] from which a sensor counts as saturated.
_FEWEST_CLIPPED = 4
_SHARE_THAT_IS_CLIPPED = 0.05
_FRACTION_THAT_MOVES = 0.02
"""Least relative change of the driving quantity [-] for which a constant channel counts as saturated."""
_LARGEST_NUMBER = 1.0e12
"""Largest plausible magnitude of a measured value, in any SI unit."""


def without_wrong_samples(
    sources: Sources, names: Sequence[str], start: float | None, end: float | None
) -> tuple[Sources, tuple[str, ...]]:
    """Return recordings over time without outliers in the channels ``names``, and remarks on the samples left out.

    An outlier is far off its neighbours, by the rule of the fit of motion, between ``start`` and ``end`` [s]; a step of
    the converter is no outlier. Raises IdentificationError if more than 2 in 100 samples are outliers, with the
    recording, the sample, its value and the median of its neighbours.
    """
    cleaned = []
    remarks = []
    for source in sources:
        recording = source.recording
        inside = np.flatnonzero(np.isin(recording.time, window(recording, start, end).time))
        most = max(1, int(_MOST_LEFT_OUT * inside.size))
        is_right = np.ones(len(recording), dtype=np.bool_)
        for name in (name for name in names if name in recording):
            values = recording[name][inside]
            for share in (_FINE_SAMPLE, _GROSS_SAMPLE):
                wrong = np.flatnonzero(_outliers(values, most, share))
                if wrong.size <= most:
                    break
            if not wrong.size:
                continue
            first = wrong[0]
            if wrong.size > most:
                around = np.median(values[max(first - 2, 0) : first + 3])
                _refuse_outlier(source, name, inside[wrong], values[first], around)
            is_right[inside[wrong]] = False
            remarks.append(
                f"left out: {wrong.size} of {inside.size} samples where '{name}' is an outlier; the "
                f"first is sample {inside[first] + 1} of {source.name}, {source.shown(name, values[first])}"
            )
        named = recording.channels.items()
        kept = {name: replace(channel, values=channel.values[is_right]) for name, channel in named}
        cleaned.append(replace(source, recording=replace(recording, time=recording.time[is_right], channels=kept)))
    return tuple(cleaned), tuple(remarks)


def _outliers(values: Floats, most: int, share: float) -> Flags:
    """Return flags of samples off their neighbours by 6 times the noise, and 6 times a share of the usual range.

    With more than ``most`` outliers the converter step is estimated from all samples, outliers included.
    """
    # Of samples that stand still the noise is 0, and what moves first among them is no error.
    noise = max(noise_of(values), share * usual_range(values))
    is_out = outlying_samples(values, noise)
    # One wrong sample among samples that stand still is no step of their converter.
    step = resolution_of(values if np.count_nonzero(is_out) > most else values[~is_out])
    if step <= _COARSEST * np.abs(values[~is_out]).max(initial=0.0):
        is_out &= outlying_samples(values, math.hypot(noise, step / math.sqrt(12.0)))
    # A decay is fast at its start, with no sample before: there only what no decay does is an error.
    is_out[:2] &= np.abs(values - np.median(values[:5]))[:2] > _NO_DECAY * np.ptp(values)
    return is_out


def check_not_alone(source: RecordingSource, name: str) -> None:
    """Raise IdentificationError, naming the sample, for an isolated extreme value of a channel.

    A value is isolated if its distance from the next one exceeds twice the range of all others and their median
    magnitude. The check applies to driving quantities, for which there is no other check.
    """
    values = source.recording[name]
    if values.size <= _FEWEST_ALIKE:
        return
    order = np.argsort(values)
    for wrong, *others in (order[::-1], order):
        away = abs(values[wrong] - values[others[0]])
        if away > max(2.0 * np.ptp(values[others]), np.median(np.abs(values))):
            _refuse_outlier(source, name, [wrong], values[wrong], values[others[0]])


def check_no_wrong_reading(sources: Sources, name: str, drivers: Sequence[Floats], used: Flags) -> None:
    """Raise IdentificationError for a reading far off the six readings with the most similar driving quantities.

    An example is a typing error. ``drivers`` are the driving quantities of the readings of all recordings, ``used``
    marks the readings that count. No law is needed: far off means by more than 10 times the usual distance, a quarter
    of the usual range, and 3 times the range of the six readings, one of which may be wrong too. The message names the
    recording, the sample, its value and the median of the six.
    """
    from scipy.spatial import cKDTree

    values = pool(sources, name)[used]
    samples = np.flatnonzero(used)
    if values.size < _FEWEST_ALIKE:
        return
    # By the usual size, not the range, which one wrong reading would stretch.
    sizes = [float(np.median(np.abs(driver[used]))) or 1.0 for driver in drivers]
    points = np.stack([driver[used] / size for driver, size in zip(drivers, sizes, strict=True)], axis=1)
    _, nearest = cKDTree(points).query(points, k=_ALIKE + 1)
    is_itself = nearest == np.arange(values.size)[:, None]
    # Of more readings in one place a reading may not be among its own nearest.
    is_itself[~is_itself.any(axis=1), -1] = True
    around = np.sort(values[nearest[~is_itself].reshape(-1, _ALIKE)], axis=1)
    middle = np.median(around, axis=1)
    away = np.abs(values - middle)
    spread = np.minimum(np.ptp(around[:, 1:], axis=1), np.ptp(around[:, :-1], axis=1))
    least = max(10.0 * np.median(away), _GROSS_READING * usual_range(values))
    wrong = np.flatnonzero(away > 3.0 * spread + least)
    if wrong.size:
        # The worst one first, which the message describes.
        worst = wrong[np.argmax(away[wrong])]
        source, places = _in_recording(sources, samples[[worst, *wrong[wrong != worst]]])
        _refuse_outlier(source, name, places, values[worst], middle[worst])


def meter_readings(
    sources: Sources, direction: Floats, zero: float, used: Flags
) -> tuple[Floats, Flags, tuple[str, ...]]:
    """Return flow meter readings with sign [kg/s], flags of possible readings, and remarks on the others.

    Under every law gas flows from the higher to the lower pressure. A meter that shows no negative flow beyond its
    ``zero`` error [fraction of the largest reading] has no sign; if the flow was reversed in many readings, each
    reading gets the sign of ``direction``. Otherwise a reading against its direction is impossible, with a meter that
    shows negative flows only beyond that error.

    Arguments: ``direction`` (readings,) of all recordings, positive for a positive flow; ``used`` marks the readings
    that count. Raises IdentificationError if more than a tenth are impossible.
    """
    flow = pool(sources, "mass_flow")
    unsure = zero * np.abs(flow[used]).max(initial=0.0)
    # A shut valve gives readings of both signs by the zero of the meter.
    lowest = flow[used].min(initial=0.0)
    against = used & (direction * flow < 0.0) & (np.abs(flow) > (unsure if lowest < 0.0 else 0.0))
    wrong = np.flatnonzero(against)
    count = np.count_nonzero(used)
    many = _MOST_IMPOSSIBLE * count
    if wrong.size > many and lowest >= -unsure:
        return np.where(direction < 0.0, -flow, flow), used, ()
    if wrong.size > many:
        sources[0].refuse(
            f"the flow is opposite to the direction of pressures and command in {wrong.size} of {count} readings: a "
            "wrong sign of 'mass_flow'"
        )
    if not wrong.size:
        return flow, used, ()
    source, places = _in_recording(sources, wrong)
    remark = (
        f"left out: {wrong.size} of {count} readings with flow against the pressures and the "
        f"command; the first is sample {places[0] + 1} of {source.name}"
    )
    return flow, used & ~against, (remark,)


def _in_recording(sources: Sources, samples: Indices) -> tuple[RecordingSource, Indices]:
    """Return the recording that contains the first of some pooled samples, and the numbers in it of those it has."""
    ends = np.cumsum([len(source.recording) for source in sources])
    index = np.searchsorted(ends, samples, side="right")
    source = sources[index[0]]
    return source, samples[index == index[0]] - ends[index[0]] + len(source.recording)


def usual_range(values: Floats) -> float:
    """Return the range between the 5 % and 95 % quantiles, in the unit of the values."""
    return float(np.subtract(*np.quantile(values, (0.95, 0.05))))


def _refuse_outlier(
    source: RecordingSource, name: str, samples: Sequence[int] | Indices, value: float, around: float
) -> NoReturn:
    """Raise IdentificationError for outliers of a channel: the first one with its value, the others by number."""
    numbers = ", ".join(str(sample + 1) for sample in samples[1:4])
    others = f", and so are samples {numbers}" if numbers else ""
    source.refuse(
        f"'{name}' is {source.shown(name, value)} at sample {samples[0] + 1}, but "
        f"{source.shown(name, around)} around it: a wrong reading{others}"
    )


def check_sources(sources: Sources, fewest: int, moving: Iterable[str] = (), absolute: Iterable[str] = ()) -> None:
    """Raise IdentificationError, naming the recording, for one with too few samples or an impossible number.

    A ``moving`` channel must change, and an ``absolute`` pressure must be positive.
    """
    for source in sources:
        recording = source.recording
        for name, values in (("time", recording.time), *((name, recording[name]) for name in recording.names)):
            worst = np.argmax(np.abs(values))
            if abs(values[worst]) > _LARGEST_NUMBER:
                source.refuse(f"'{name}' is {values[worst]:g} at sample {worst + 1}: impossible")
        check_enough(source, len(recording), fewest, "samples")
        for name in moving:
            check_moves(source, name)
        for name in absolute:
            # Gauge pressures, passed for absolute, are 0 or less where the other side is open.
            low = np.argmin(recording[name])
            if recording[name][low] <= 0.0:
                source.refuse(
                    f"'{name}' is {source.shown(name, recording[name][low])} at sample {low + 1}, which is impossible "
                    "for an absolute pressure"
                )
            check_not_alone(source, name)


def check_enough(source: RecordingSource, count: int, fewest: int, noun: str) -> None:
    """Raise IdentificationError, naming the recording, for fewer than ``fewest`` samples or readings, the ``noun``."""
    if count < fewest:
        source.refuse(f"needs at least {fewest} {noun}, not {count}")


def check_moves(source: RecordingSource, name: str) -> None:
    """Raise IdentificationError, naming the recording, for a constant channel, which carries no information."""
    values = source.recording[name]
    if values.max() == values.min():
        source.refuse(f"channel '{name}' is {source.shown(name, values[0])} throughout")


def check_not_clipped(
    source: RecordingSource, name: str, driver: str, driving: Floats, fraction: float = _FRACTION_THAT_MOVES
) -> None:
    """Raise IdentificationError, naming recording and channel, for a channel at an extreme value while its cause moves.

    ``driving`` are the values of the driving quantity ``driver``, which must change by ``fraction`` [-] of its largest
    value.
    """
    values = source.recording[name]
    longest, _ = plateaus(values)
    # A reading that stays where nothing moves is right.
    moves = np.ptp(driving[longest.first : longest.last + 1]) > fraction * np.abs(driving).max()
    if moves and longest.count >= max(_FEWEST_CLIPPED, _SHARE_THAT_IS_CLIPPED * values.size):
        source.refuse(
            f"channel '{name}' stays at {source.shown(name, values.max())} for {longest.count} samples, up to sample "
            f"{longest.last + 1}, while '{driver}' moves: it is saturated"
        )


def timed_part(source: RecordingSource, start: float | None, end: float | None) -> tuple[Recording, int]:
    """Return the part between two times [s] of a recording, and the number of samples before it.

    Raises IdentificationError for a gap in it, with its time.
    """
    part = window(source.recording, start, end)
    skipped = int(np.searchsorted(source.recording.time, part.time[0]))
    if gap := longest_gap(part.time):
        source.refuse(
            f"gap of {gap[1]:.4g} s after {part.time[gap[0]]:.6g} s (sample {skipped + gap[0] + 1}), between start and "
            "end"
        )
    return part, skipped
