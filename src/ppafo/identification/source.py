"""Recordings used as evidence: traced to their files, used only once, and checked for the needs of a procedure.

Every error message names the file and a remedy.
"""

import hashlib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.wording import in_shown_unit
from ppafo.signals import CHANNELS, Recording, RecordingKind
from ppafo.signals.faults import (
    FEWEST_AT_LIMIT,
    is_at_limit,
    longest_gap,
    noise_of,
    outlying_samples,
    plateaus,
    resolution_of,
    scatters,
)
from ppafo.signals.recording import Floats
from ppafo.storage.files import read_bytes
from ppafo.wording import nearest_name


@dataclass(frozen=True, slots=True)
class RecordingSource:
    """Recording with its reference, ``static.csv sha256:0123...``, or without a file the label of the recording."""

    recording: Recording
    reference: str = ""

    @property
    def name(self) -> str:
        """Name in messages: file name, or the label of the recording."""
        return self.reference.partition(" sha256:")[0] or self.recording.label

    @property
    def trace(self) -> str:
        """Reference of the recording among the sources of an estimate."""
        return self.reference or self.recording.label


def source_of(path: Path, recording: Recording, trial: str = "") -> RecordingSource:
    """Return a recording with name and hash of its file. Raises DataError if the file no longer exists.

    ``trial`` is appended to the name if the file has several recordings.
    """
    return RecordingSource(recording, f"{path.name}{trial} sha256:{hashlib.sha256(read_bytes(path)).hexdigest()}")


@dataclass(frozen=True, slots=True)
class UsedRecording:
    """Use of a recording.

    ``by`` names the use in messages, ``trace`` the file; ``channels`` are the channels used (empty for all), from
    ``first`` to ``last`` [s].
    """

    by: str
    trace: str
    recording: Recording
    channels: frozenset[str]
    first: float
    last: float

    def overlaps(self, other: "UsedRecording") -> bool:
        """Return whether two uses of the same recording share samples of a channel; no channels means all channels."""
        is_alike = not (self.channels and other.channels) or bool(self.channels & other.channels)
        return is_alike and self.first < other.last and other.first < self.last


def double_use(uses: Iterable[UsedRecording], others: Iterable[UsedRecording] | None = None) -> str:
    """Return a message on samples used twice, within ``uses`` or also in ``others``; empty if there are none.

    Recordings are compared by the hash of their numbers, independent of file names.
    """
    known = [(use, _digest(use.recording)) for use in uses]
    more = None if others is None else [(use, _digest(use.recording)) for use in others]
    for (use, digest), (other, other_digest) in combinations(known, 2) if more is None else product(known, more):
        if digest == other_digest and use.overlaps(other):
            return (
                f"{use.by} ({use.trace}) and {other.by} ({other.trace}) are the same recording, sha256 {digest[:12]} "
                f"of its numbers: its samples would count twice"
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


_NO_SENSORS = ("command", "direction", "repetition")
_SHARE_THAT_IS_CLIPPED = 0.05
"""Fraction of samples at one extreme value [-] from which a sensor counts as saturated."""
_FEWEST_CLIPPED = 4
"""Least number of equal samples for saturation."""
_FRACTION_THAT_MOVES = 0.02
"""Least change of the driving quantity, relative to its largest value [-], for a constant channel to be saturated."""
_LARGEST_NUMBER = 1.0e12
"""Largest plausible magnitude of a measured value, in any SI unit."""
_MOST_IMPOSSIBLE = 0.1
"""Largest fraction of impossible flow meter readings [-]; more means wrong signs or columns."""
_FINE_SAMPLE, _GROSS_SAMPLE, _GROSS_READING = 0.01, 1.0 / 6.0, 0.25
"""Outlier limits as fractions of the usual range [-]: of samples over time (a sixth of the limit), fine and gross; of
readings, gross.

A glitch of a third of the range in a real logger is one of many samples, and no reason to refuse the recording.
"""
_MOST_LEFT_OUT = 0.02
"""Largest fraction of the samples of a recording over time that may be left out as outliers [-]."""
_COARSEST = 0.05
"""Converter step divided by the largest valid sample [-], above which it is no step: two outliers may be equal."""
_NO_DECAY = 0.5
"""Fraction of the range by which the first two samples may differ from the median of the first five [-]."""
_ALIKE, _FEWEST_ALIKE = 6, 8
"""Number of neighbours with which a reading is compared, and least number of readings for the comparison."""
_KINDS: tuple[RecordingKind, ...] = ("synthetic", "simulated", "measured")


def check_sources(
    sources: tuple[RecordingSource, ...],
    procedure: str,
    channels: Iterable[str],
    fewest: int,
    moving: Iterable[str] = (),
    absolute: Iterable[str] = (),
) -> None:
    """Raise IdentificationError for recordings that lack a channel or have too few samples for a procedure.

    A ``moving`` channel must change, and an ``absolute`` pressure must be positive. The message names the recording.
    """
    if not sources:
        raise IdentificationError(f"{procedure}: no recording was given")
    for source in sources:
        recording = source.recording
        for name in channels:
            if name not in recording:
                known, hint = CHANNELS[name], nearest_name(name, recording.names)
                raise IdentificationError(
                    f"{source.name}: {procedure} needs a channel '{name} [{known.unit}]', {known.summary}{hint}; "
                    f"the file has {', '.join(recording.names) or 'only time'}; a column map can name it"
                )
        for name, values in (("time", recording.time), *((name, recording[name]) for name in recording.names)):
            worst = int(np.argmax(np.abs(values)))
            if abs(values[worst]) > _LARGEST_NUMBER:
                raise IdentificationError(
                    f"{source.name}: {procedure}: '{name}' is {values[worst]:g} at sample {worst + 1}, more than any "
                    f"sensor measures: the line is damaged"
                )
        if len(recording) < fewest:
            raise IdentificationError(
                f"{source.name}: {procedure} needs at least {fewest} samples, it has {len(recording)}"
            )
        for name in moving:
            check_moves(source, procedure, name)
        for name in absolute:
            # Gauge pressures, passed for absolute, are 0 or less where the other side is open.
            low = int(np.argmin(recording[name]))
            if recording[name][low] <= 0.0:
                raise IdentificationError(
                    f"{source.name}: {procedure}: '{name}' is {_shown(source, name, recording[name][low])} at sample "
                    f"{low + 1}, which is not an absolute pressure: use psi_g, bar_g or kPa_g for gauge"
                )
            check_not_alone(source, procedure, name)


def check_not_alone(source: RecordingSource, procedure: str, name: str) -> None:
    """Raise IdentificationError for an isolated extreme value of a channel, naming the sample.

    A value is isolated if its distance from the next one exceeds twice the range of all others and their median
    magnitude. The check applies to driving quantities, for which there is no other check.
    """
    values = source.recording[name]
    order = np.argsort(values)
    for wrong, others in ((order[-1], order[:-1]), (order[0], order[1:][::-1])):
        away = abs(float(values[wrong] - values[others[-1]])) if others.size >= _FEWEST_ALIKE else 0.0
        if away > max(2.0 * float(np.ptp(values[others])), float(np.median(np.abs(values)))):
            _refuse_outlier(source, procedure, name, [int(wrong)], float(values[wrong]), float(values[others[-1]]))


def _shown(source: RecordingSource, name: str, value: float) -> str:
    channel = source.recording.channels[name]
    number, unit = in_shown_unit(value, channel.unit, channel.stated)
    return f"{number:.6g} {unit}".removesuffix(" -")


def check_moves(source: RecordingSource, procedure: str, name: str) -> None:
    """Raise IdentificationError, naming the recording, for a constant channel, which carries no information."""
    values = source.recording[name]
    if values.max() == values.min():
        raise IdentificationError(
            f"{source.name}: {procedure}: channel '{name}' is {_shown(source, name, values[0])} throughout; "
            f"the sensor is stuck, or nothing was done"
        )


def check_not_clipped(
    source: RecordingSource,
    procedure: str,
    name: str,
    driver: str,
    driving: Floats,
    fraction: float = _FRACTION_THAT_MOVES,
) -> None:
    """Raise IdentificationError for a saturated sensor: a channel constant at an extreme value while its cause changes.

    ``driving`` are the values of the driving quantity ``driver``, which must change by ``fraction`` [-] of its largest
    value. The message names the recording and the channel.
    """
    values = source.recording[name]
    longest, _ = plateaus(values)
    # A reading that stays where nothing moves is right.
    moves = float(np.ptp(driving[longest.first : longest.last + 1])) > fraction * float(np.abs(driving).max())
    if moves and longest.count >= max(_FEWEST_CLIPPED, _SHARE_THAT_IS_CLIPPED * values.size):
        raise IdentificationError(
            f"{source.name}: {procedure}: channel '{name}' stays at {_shown(source, name, values.max())} for "
            f"{longest.count} samples, up to sample {longest.last + 1}, while '{driver}' moves: the sensor is "
            f"saturated; leave those samples out"
        )


def without_wrong_samples(
    sources: tuple[RecordingSource, ...], procedure: str, names: Sequence[str], start: float | None, end: float | None
) -> tuple[tuple[RecordingSource, ...], tuple[str, ...]]:
    """Return recordings over time without outliers in the channels ``names``, and remarks on the samples left out.

    An outlier is far off its neighbours, by the rule of the fit of motion, between ``start`` and ``end`` [s]; a step of
    the converter is no outlier. Raises IdentificationError if more than 2 in 100 samples are outliers, with the
    recording, the sample, its value and the median of its neighbours.
    """
    kept, said = [], []
    for source in sources:
        recording = source.recording
        inside = np.flatnonzero(np.isin(recording.time, window(recording, start, end).time))
        right = np.ones(len(recording), dtype=np.bool_)
        for name in (name for name in names if name in recording):
            values, most = recording[name][inside], max(1, int(_MOST_LEFT_OUT * inside.size))
            fine = _off_by(values, most, _FINE_SAMPLE)
            wrong = np.flatnonzero(fine if np.count_nonzero(fine) <= most else _off_by(values, most, _GROSS_SAMPLE))
            if not wrong.size:
                continue
            first = int(wrong[0])
            if wrong.size > most:
                around = float(np.median(values[max(first - 2, 0) : first + 3]))
                _refuse_outlier(source, procedure, name, inside[wrong].tolist(), float(values[first]), around)
            right[inside[wrong]] = False
            said.append(
                f"left out: {wrong.size} of {inside.size} samples with '{name}' far off those around them; the first "
                f"is sample {inside[first] + 1} of {source.name}, {_shown(source, name, values[first])}"
            )
        channels = {name: replace(one, values=one.values[right]) for name, one in recording.channels.items()}
        kept.append(replace(source, recording=replace(recording, time=recording.time[right], channels=channels)))
    return tuple(kept), tuple(said)


def _off_by(values: Floats, most: int, share: float) -> NDArray[np.bool_]:
    """Return flags of samples off their neighbours by 6 times the noise, and 6 times a share of the usual range."""
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


def check_no_wrong_reading(
    sources: tuple[RecordingSource, ...], procedure: str, name: str, drivers: Sequence[Floats], used: NDArray[np.bool_]
) -> None:
    """Raise IdentificationError for a reading far off the six readings with the most similar driving quantities.

    An example is a typing error. ``drivers`` are the driving quantities of the readings of all recordings, ``used``
    marks the readings that count. No law is needed: far off means by more than 10 times the usual distance, a quarter
    of the usual range, and 3 times the range of the six readings, one of which may be wrong too. The message names the
    recording, the sample, its value and the median of the six.
    """
    from scipy.spatial import cKDTree

    values, places = pool(sources, name)[used], np.flatnonzero(used)
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
    least = max(10.0 * float(np.median(away)), _GROSS_READING * usual_range(values))
    wrong = np.flatnonzero(away > 3.0 * spread + least)
    if wrong.size:
        first = int(wrong[np.argmax(away[wrong])])
        source, before = _recording_with(sources, int(places[first]))
        samples = [int(place) - before for place in places[wrong] if 0 <= place - before < len(source.recording)]
        samples.sort(key=lambda sample: sample != places[first] - before)
        _refuse_outlier(source, procedure, name, samples, float(values[first]), float(middle[first]))


def _recording_with(sources: tuple[RecordingSource, ...], place: int) -> tuple[RecordingSource, int]:
    """Return the recording that contains a pooled sample, and the number of samples before that recording."""
    ends = np.cumsum([len(source.recording) for source in sources])
    at = int(np.searchsorted(ends, place, side="right"))
    return sources[at], int(ends[at]) - len(sources[at].recording)


def meter_readings(
    sources: tuple[RecordingSource, ...],
    procedure: str,
    direction: Floats,
    zero: float,
    used: NDArray[np.bool_] | None = None,
) -> tuple[Floats, NDArray[np.bool_], tuple[str, ...]]:
    """Return flow meter readings with their sign [kg/s], flags of the possible ones, and remarks on the others.

    Under every law gas flows from the higher to the lower pressure. A meter that never shows a negative flow has no
    sign; if the flow was reversed in many readings, each reading gets the sign of ``direction``. Otherwise a reading
    against its direction is impossible, with a signed meter only beyond its ``zero`` error [fraction of the largest
    reading].

    Arguments: ``direction`` (readings,) of all recordings, positive for a positive flow; ``used`` marks the readings
    that count, default all. Raises IdentificationError if more than a tenth are impossible.
    """
    flow = pool(sources, "mass_flow")
    counted = np.ones(flow.size, dtype=np.bool_) if used is None else used
    largest = float(np.abs(flow[counted]).max(initial=0.0))
    has_sign = bool((flow[counted] < 0.0).any())
    against = counted & (direction * flow < 0.0) & (np.abs(flow) > (zero * largest if has_sign else 0.0))
    many = _MOST_IMPOSSIBLE * np.count_nonzero(counted)
    if not has_sign and np.count_nonzero(against) > many:
        said = f"{procedure}: the flow meter has no sign; the flow has the direction that the other channels give it"
        return np.where(direction < 0.0, -flow, flow), counted, (said,)
    wrong = np.flatnonzero(against)
    if wrong.size > many:
        raise IdentificationError(
            f"{sources[0].name}: {procedure}: the flow runs against the direction that pressures and command give it "
            f"in {wrong.size} of {np.count_nonzero(counted)} readings; reverse the sign of 'mass_flow'"
        )
    if not wrong.size:
        return flow, counted, ()
    source, before = _recording_with(sources, int(wrong[0]))
    said = (
        f"left out: {wrong.size} of {np.count_nonzero(counted)} readings with a flow against the direction that "
        f"pressures and command give it, which no opening has; the first is sample {int(wrong[0]) - before + 1} of "
        f"{source.name}"
    )
    return flow, counted & ~against, (said,)


def usual_range(values: Floats) -> float:
    """Return the range between the 5 % and 95 % quantiles, in the unit of the values."""
    return float(np.subtract(*np.quantile(values, (0.95, 0.05))))


def _refuse_outlier(
    source: RecordingSource, procedure: str, name: str, samples: list[int], value: float, around: float
) -> NoReturn:
    more = f", and so are samples {', '.join(str(sample + 1) for sample in samples[1:4])}" if samples[1:] else ""
    raise IdentificationError(
        f"{source.name}: {procedure}: '{name}' is {_shown(source, name, value)} at sample {samples[0] + 1}, where its "
        f"neighbours are at {_shown(source, name, around)}: a wrong reading{more}; correct it or leave it out"
    )


def check_no_gap(source: RecordingSource, procedure: str, part: Recording) -> int:
    """Return the number of samples before a part of a recording. Raises IdentificationError for a part with a gap.

    The message gives the time of the gap.
    """
    skipped = int(np.searchsorted(source.recording.time, part.time[0]))
    gap = longest_gap(part.time)
    if gap is not None:
        raise IdentificationError(
            f"{source.name}: {procedure}: there is a gap of {gap.duration:.4g} s after {part.time[gap.index]:.6g} s "
            f"(sample {skipped + gap.index + 1}); give start or end to exclude it"
        )
    return skipped


def window(recording: Recording, start: float | None, end: float | None) -> Recording:
    """Return the part of a recording between two times [s]; None means the start or end of the recording."""
    if start is None and end is None:
        return recording
    first = float(recording.time[0]) if start is None else start
    last = float(recording.time[-1]) if end is None else end
    return recording.between(first, last)


def kind_of(kinds: Iterable[RecordingKind]) -> RecordingKind:
    """Return the kind of a result: synthetic if any recording is, else simulated if any is, else measured."""
    return min(kinds, key=_KINDS.index, default="measured")


def remarks_on_readings(sources: tuple[RecordingSource, ...]) -> tuple[str, ...]:
    """Return remarks on gaps in time and on values at the limit of a sensor."""
    remarks = []
    for source in sources:
        gap = longest_gap(source.recording.time)
        if gap is not None:
            remarks.append(f"{source.name} has no reading for {gap.duration:.4g} s after sample {gap.index + 1}")
        for name in source.recording.names:
            if name in _NO_SENSORS:
                continue
            values = source.recording[name]
            remarks += [
                f"{source.name}: '{name}' stays at {_shown(source, name, plateau.value)} for {plateau.count} "
                f"samples, from sample {plateau.first + 1}: a limit of the sensor?"
                for plateau in plateaus(values)
                # Values that scatter elsewhere do not stay at an extreme for long by themselves.
                if is_at_limit(values, plateau) or (plateau.count >= FEWEST_AT_LIMIT and scatters(values))
            ]
    return tuple(remarks)


def pool(sources: tuple[RecordingSource, ...], name: str) -> Floats:
    """Return a channel [SI] of all recordings, concatenated."""
    return np.concatenate([source.recording[name] for source in sources])
