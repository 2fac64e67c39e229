"""Search for a single cause that explains recordings whose residuals exceed noise.

A cause is a model of a sensor, y = h(model; a) + e, or another value of a parameter. Causes are tried in stages, from
errors that the samples themselves show to effects that the model lacks; the first stage with a cause that explains all
recordings ends the search. ``candidates.py`` lists them,
``record.py`` computes the residuals under a change, and ``search.py`` fits the magnitude of a change.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import PpafoError
from ppafo.linear_algebra import on_one_thread
from ppafo.parameters.device import Device
from ppafo.progress import Report, report_nothing
from ppafo.simulation.recorded.channels import COMMAND
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.simulation.recorded.usual_errors import usual_errors
from ppafo.validation.agreement import RecordingAgreement, compare_recording
from ppafo.validation.candidates import SENSORS, CandidateCause, ModelChange, effects, exchanges, numbers, sizes
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.record import Record, ScaledResiduals, at_rate, record_of
from ppafo.validation.search import CauseSearch, ResidualCause
from ppafo.validation.settings import ANGLE, EXPLAINED_FRACTION, Motion, ReplaySettings
from ppafo.wording import argument_text

_TIMES = {"milliseconds read as seconds": (1.0e3, "ms"), "seconds read as milliseconds": (1.0e-3, "s")}
"""Clock rate [-] that corrects misread times, and the correct unit, by kind of mistake."""

_LESS = 0.5
"""Largest remaining fraction of an error above its limit [-] for times in another unit to explain the error."""

_SHORT_INTERVAL = 2.0e-5
"""Longest sample interval [s] that may be milliseconds read as seconds: 50 samples per second or more in truth."""

_AT_REST = 2.0
"""Ratio of the angle's standard deviation to its noise [-] below which the vane may be locked."""

_LONGEST_SEARCHED = 10.0
"""Duration [s] of all recordings up to which a device with a measured angle is searched for causes beside samples."""

_OF_MOTION = ("friction", "foot_plate", "stribeck", "seal_friction")
"""Sections and effects that act on the motion of the vane alone, and say nothing if the angle is prescribed."""

_TRIED_WITH_MEASURED_ANGLE = "faulty samples, errors and units of the pressures, numbers of the set, effects"
_TRIED_IN_LONG_RECORDINGS = (
    "faulty samples alone (the angle is measured, over more than 10 s; validate a shorter part to try sensors, units, "
    "numbers of the set and effects)"
)

_NAMED = 3
"""Number of causes that are named where none explains the recordings, the nearest ones."""

_STARTS = (-0.05, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.05)
"""Trial initial values of a channel whose first samples are wrong, as fractions of its range [-].

The two outermost values lie outside the range, and a best fit there is rejected.
"""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Result of the search for a cause of a disagreement.

    ``found`` is the cause, if any; ``nearest`` is the best candidate if none explains the recordings. ``tried`` is the
    number of candidates compared, ``kinds`` the kinds of causes where not all were tried. ``is_noise`` is true if the
    residuals are noise, so that no cause is needed.
    """

    found: ResidualCause | None = None
    nearest: ResidualCause | None = None
    tried: int = 0
    is_noise: bool = False
    kinds: str = ""


@on_one_thread
def causes_of(
    read: Sequence[MeasuredRecording],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
    report: Report = report_nothing,
) -> Diagnosis:
    """Return the single cause that explains all recordings together, or a diagnosis without a cause.

    ``agreements`` are the comparisons of the recordings ``read``, in the same order.
    """
    if (other_unit := _in_other_unit(read, agreements, device, settings)) is not None:
        return Diagnosis(other_unit, None, 1)
    records = [
        record_of(measured, agreement, device, settings) for measured, agreement in zip(read, agreements, strict=True)
    ]
    search = CauseSearch(device, settings, records, report)
    none = search.evaluated([ModelChange()])[0]
    if none is None or none.is_noise:
        return Diagnosis(is_noise=none is not None)
    tried = list[ResidualCause]()
    for candidates in (_samples(records), _motions(records, settings)):
        tried += search.compared(candidates, none)
        if any(cause.explains for cause in tried):
            return _explained(search, none, tried, [])
    is_measured = settings.motion == "measured"
    if is_measured and sum(measured.recording.duration for measured in read) > _LONGEST_SEARCHED:
        # Hundreds of replays of a minute each would take minutes of computing time.
        return Diagnosis(tried=len(tried), kinds=_TRIED_IN_LONG_RECORDINGS)
    swaps, sized, lacking = _candidates(read, agreements, device, settings)
    # Errors that any bench has come before a fault, a mistake without a size too: they need no cause.
    of_bench = search.compared([candidate for candidate in sized if candidate.usual], none)
    # A delay that ends at its limit is longer than that, and no error of any bench.
    is_late = any(agreement.delay.is_at_limit for agreement in agreements)
    errors = None if is_late else _usual_errors(search, none, of_bench)
    if errors is not None:
        return Diagnosis(errors, None, len(tried) + len(of_bench))
    not_of_bench = [candidate for candidate in sized if not candidate.usual]
    for compared, candidates in (([], swaps), (of_bench, [*not_of_bench, *lacking])):
        tried += [*compared, *search.compared(candidates, none)]
        if any(cause.explains for cause in tried):
            return _explained(search, none, tried, sized)
    return _unexplained(search, tried, _TRIED_WITH_MEASURED_ANGLE if is_measured else "")


def _candidates(
    read: Sequence[MeasuredRecording],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
) -> tuple[list[CandidateCause], list[CandidateCause], list[CandidateCause]]:
    """Return exchanged channels and units, errors of a size with numbers of the set, and effects that the model lacks.

    With a measured angle they leave out what changes an input or the motion of the model.
    """
    names = set.intersection(*(set(measured.recording.names) for measured in read))
    # Numbers of the set are compared with sensors: the gain of a command is the area of its valve.
    stages = (
        exchanges(device, names, _units_of_moving(read, agreements, device)),
        [*sizes(device, names), *numbers(read[0], device, settings)],
        effects(device),
    )
    is_measured = settings.motion == "measured"
    swaps, sized, lacking = (
        [candidate for candidate in stage if not (is_measured and _acts_on_inputs_or_motion(candidate))]
        for stage in stages
    )
    return swaps, sized, lacking


def _acts_on_inputs_or_motion(candidate: CandidateCause) -> bool:
    """Return whether a candidate changes command, angle or clock, or the motion: with a measured angle no cause."""
    change = candidate.at(candidate.grid[0])
    sections = {name for path in (*change.numbers, *change.effects) for name in path.split(".")[:1]}
    has_delay = change.has_delay or any(sensor.delay for sensor in change.sensors.values())
    return bool(
        {COMMAND, ANGLE} & change.sensors.keys() or sections & {*_OF_MOTION} or has_delay or change.clock != 1.0
    )


def _units_of_moving(
    read: Sequence[MeasuredRecording], agreements: Sequence[RecordingAgreement], device: Device
) -> dict[str, set[str]]:
    """Return the units that files declare for each moving channel (an empty text if undeclared).

    A channel moves if it departs, measured or modelled, from atmospheric pressure by more than the usual zero error.
    """
    atmosphere = device.supply.atmospheric_pressure
    moving = {
        name
        for agreement in agreements
        for recording in (agreement.measured, agreement.model)
        for name in recording.names
        if float(np.abs(recording[name] - atmosphere).max()) > usual_errors(name).zero
    }
    recordings = [measured.recording for measured in read]
    return {name: {recording.channels[name].stated for recording in recordings if name in recording} for name in moving}


def _usual_errors(
    search: CauseSearch, none: ScaledResiduals, of_bench: Sequence[ResidualCause]
) -> ResidualCause | None:
    """Return a usual sensor error, or several together, that explains the recordings; None if no such error does.

    ``of_bench`` are the candidate errors of single sensors and sensor groups.
    """
    # Beside pressures that are nearly equal a flow bends: what is small together may fail on straight lines, and not
    # alone.
    explaining = [cause for cause in of_bench if cause.explains]
    usual = [cause for cause in explaining if cause.is_usual]
    if not usual:
        candidates = [cause.candidate for cause in of_bench]
        # One error beyond its limit explains more than several that strain to add up to it.
        least = max((cause.gain for cause in explaining), default=0.0) - search.penalty
        together = search.compared(search.together(candidates, none), none)
        usual = [cause for cause in together if cause.explains and cause.gain > least]
    return _cause_of(usual, search) if usual else None


def _explained(
    search: CauseSearch, none: ScaledResiduals, tried: Sequence[ResidualCause], sized: Sequence[CandidateCause]
) -> Diagnosis:
    """Return the best cause with its alternatives, or a diagnosis without a cause if a second one is needed.

    Some of the causes ``tried`` explain the recordings; ``sized`` are candidates with a magnitude, to combine with one.
    """
    explaining = [cause for cause in tried if cause.explains]
    first = max(explaining, key=lambda cause: cause.gain)
    # What has no size of its own to fit, a swap or a sign, cannot pass for two other changes.
    is_fitted = first.candidate.has_size and not first.candidate.is_of_samples
    # One Jacobian, at the first cause, shows what a second one would add and what could replace it.
    slopes = search.slopes(first.change, first.residuals, sized) if is_fitted else []
    if search.needs_another(first, slopes):
        return Diagnosis(None, first, len(tried))
    # With errors of sensors that any bench has, other small changes may explain as much as one alone.
    others = search.beside_usual(slopes, none, {cause.name for cause in explaining})
    return Diagnosis(_cause_of(explaining, search, others), None, len(tried))


def _unexplained(search: CauseSearch, tried: Sequence[ResidualCause], kinds: str) -> Diagnosis:
    """Return the diagnosis without a cause, with the best of the causes ``tried``, of the ``kinds`` in words."""
    # What is wrong with samples is seen in them, whatever else is wrong; a misread unit is no hint beside other faults.
    hinting = [
        cause
        for cause in tried
        if not cause.candidate.is_of_unit and (cause.gain > 0.0 or cause.candidate.is_of_samples)
    ]
    hints = sorted(
        (replace(cause, left=left) for cause, left in zip(hinting, search.left_by(hinting), strict=True)),
        # Of those that leave the same, numbers of the set come first.
        key=lambda cause: (not cause.is_of_samples, float(f"{cause.left:.2g}"), not cause.numbers, cause.left),
    )
    if not hints:
        return Diagnosis(tried=len(tried), kinds=kinds)
    nearest, *others = hints
    next_ones = tuple(other for other in others if other.is_of_samples == nearest.is_of_samples)[: _NAMED - 1]
    return Diagnosis(nearest=replace(nearest, same=next_ones), tried=len(tried), kinds=kinds)


def _in_other_unit(
    read: Sequence[MeasuredRecording],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
) -> ResidualCause | None:
    """Return milliseconds read as seconds (or the reverse) as cause if the model agrees only with the corrected times.

    With corrected times the model must explain half of the variance of every signal that moves, and every error above
    its limit must fall to less than half. This cause is tried first: with wrong times, all other trials would simulate
    a thousand times, or a thousandth of, the true duration.
    """
    if all(agreement.passes for agreement in agreements):
        return None
    # Hardly any bench samples so often, and a run a thousand times as long is not made for others.
    is_short = max(np.median(np.diff(measured.recording.time)) for measured in read) <= _SHORT_INTERVAL
    name = "seconds read as milliseconds" if is_short else "milliseconds read as seconds"
    rate, unit = _TIMES[name]
    try:
        in_other = [
            compare_recording(replace(measured, recording=at_rate(measured.recording, rate)), device, settings)
            for measured in read
        ]
    except PpafoError:
        return None
    gain, left = 0.0, 0.0
    for as_read, other in zip(agreements, in_other, strict=True):
        for before, after in zip(as_read.channels, other.channels, strict=True):
            is_better = before.passes or after.rms < _LESS * before.rms
            explains = after.passes or after.rms**2 < (1.0 - EXPLAINED_FRACTION) * after.variation**2
            if not (is_better and explains):
                return None
            if before.channel in SENSORS:
                ratio = max(before.in_noise, 1.0) / max(after.in_noise, 1.0)
                gain += 2.0 * len(as_read.measured) * math.log(ratio)
            left = max(left, after.in_noise)
    remedy = f'write time [{unit}] in the header, or unit = "{unit}" for time in a column map'
    candidate = CandidateCause(name, f"times seem to be in {name} ({remedy})", lambda rate: ModelChange(clock=rate))
    return ResidualCause(candidate, rate, ScaledResiduals(np.zeros(0), np.zeros(0)), gain, left)


def _samples(records: Sequence[Record]) -> list[CandidateCause]:
    """Return faulty samples of all channels as a single candidate cause; empty without faulty samples."""
    faulty = [record for record in records if record.words]
    if not faulty:
        return []
    has_several = len(records) > 1
    texts = [
        f"{words} ({record.measured.file})" if has_several else words for record in faulty for words in record.words
    ]
    channels = dict.fromkeys(words.split()[0] for record in faulty for words in record.words)
    # Every channel has a sample that a sensor made among those of the start.
    has_start = all(
        bool(record.good[:, : samples_at_rest(record.measured.recording)].any(axis=1).all()) for record in faulty
    )
    return [
        CandidateCause(
            f"samples of {' and '.join(channels)}",
            # No size is shown, and a file's name may have a brace.
            "; ".join(texts).replace("{", "{{").replace("}", "}}"),
            lambda share: ModelChange(start=share),
            (0.0,) if has_start else _STARTS,
            is_usual=all(record.has_few for record in faulty),
            is_of_samples=True,
        )
    ]


def _motions(records: Sequence[Record], settings: ReplaySettings) -> list[CandidateCause]:
    """Another motion as candidate: a locked vane for a recorded angle at rest, else a leg if the motion is free."""
    if settings.motion not in ("free", "leg"):
        return []
    angles = [record.values[record.channels.index(ANGLE)] for record in records if ANGLE in record.channels]
    is_at_rest = all(float(np.std(angle)) < _AT_REST for angle in angles)
    if not angles or (settings.motion == "leg" and not is_at_rest):
        return []
    motion: Motion = "locked" if is_at_rest else "leg"
    seems = "be locked, because its recorded angle is constant" if is_at_rest else "be coupled to a leg"
    words = f"the vane seems to {seems} ({argument_text('motion', motion)})"
    return [CandidateCause("motion", words, lambda _: ModelChange(motion=motion))]


def _cause_of(
    named: Sequence[ResidualCause], search: CauseSearch, others: Sequence[ResidualCause] = ()
) -> ResidualCause:
    """Return the best of the ``named`` causes, with all causes that the recordings cannot distinguish from it.

    These have about the same gain, or differ by no more than the engine errs. ``others`` explain the recordings only
    together with usual sensor errors, and are listed last.
    """
    best, alone = max(named, key=lambda cause: cause.gain), {cause.name for cause in named}

    def is_alike(cause: ResidualCause) -> bool:
        apart = cause.residuals.errors - best.residuals.errors
        return cause.gain > best.gain - search.penalty or float(apart @ apart) <= search.of_engine

    # Of those that the recordings cannot tell apart, numbers of the set come first.
    first, *rest = sorted(
        filter(is_alike, [*named, *others]),
        key=lambda cause: (cause.name not in alone, not cause.change.numbers, -cause.gain),
    )
    return replace(first, same=tuple(rest))
