"""A parameter set compared with recordings, channel by channel."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import count_of
from ppafo.parameters.device import Device
from ppafo.report.display_units import display_value, gauge_shift, quantity_of_unit
from ppafo.report.finding import Finding, Part, columns_of, facts
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import Course, course_panels
from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units.shown import in_units
from ppafo.validation import ChannelAgreement
from ppafo.validation.agreement import (
    RecordingAgreement,
    ReplaySettings,
    measured_values,
)
from ppafo.validation.causes import Cause, Causes
from ppafo.validation.compared import COMPARED, PRESSURE_1, PRESSURE_2
from ppafo.version import __version__

LARGEST_DELAY = 1.0
"""Seconds; a recording that is later than this was not recorded with its command."""

LITTLE = 0.03
"""RMS error over the full range up to which a residual beside the noise, of which no cause is known, is a remark."""

_EXPLAINS = 0.5
"""Residual with the nearest cause over the residual without any, up to which that cause is worth naming."""


@dataclass(frozen=True, slots=True)
class Validation:
    """A parameter set and what each recording reports of it."""

    parameter_set: str
    device: Device
    overrides: tuple[str, ...]
    settings: ReplaySettings
    recordings: tuple[RecordingAgreement, ...]
    causes: Causes
    has_limits: bool

    @property
    def passes(self) -> bool:
        """True where every error is within its limit and, without limits given, only what any bench has is left.

        A cause that is found and that not any bench has is a disagreement, however small. A residual that no single
        cause explains is one only where it is more than ``LITTLE``, for no model has all that a device has. Of a
        recorded angle that is followed causes are not searched.
        """
        causes, channels = self.causes, [channel for recording in self.recordings for channel in recording.channels]
        is_little = causes.tried == 0 or all(channel.fraction <= LITTLE for channel in channels)
        is_usual = causes.is_noise or (is_little if causes.found is None else causes.found.is_usual)
        return (self.has_limits or is_usual) and all(recording.passes for recording in self.recordings)

    def json_document(self) -> dict[str, Any]:
        """Return errors, causes and recordings as plain data in SI."""
        return {
            "format": "ppafo agreement",
            "schema_version": 1,
            "parameter_set": self.parameter_set,
            "device": self.device.name,
            "valve": self.device.valve_name,
            "overrides": list(self.overrides),
            "longest_delay": self.settings.longest_delay,
            "passes": self.passes,
            "summary": verdict(self),
            "causes": {
                "tried": self.causes.tried,
                "found": _cause_data(self.causes.found),
                "nearest": _cause_data(self.causes.nearest),
            },
            "recordings": [_recording_data(agreement) for agreement in self.recordings],
            "versions": {"ppafo": __version__},
        }


KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""What the recording is called beside the model: nobody may take a model's output for a measurement."""
_LOOKS = {PRESSURE_1: CHAMBER_1, PRESSURE_2: CHAMBER_2}
_NEAR_LIMIT = 0.25
_SHORT = 3.0
"""Recordings shorter than this [s] have an axis in milliseconds."""


def agreement_panels(agreement: RecordingAgreement, atmosphere: float) -> list[Panel]:
    """Return two panels for each channel of a recording; gauge pressures count from ``atmosphere`` [Pa absolute]."""
    pairs = [_channel_panels(agreement, channel, atmosphere) for channel in agreement.channels]
    across = 1 if len(pairs) == 1 else 2
    rows = [pairs[first : first + across] for first in range(0, len(pairs), across)]
    empty = (Panel(TIME, TIME, ()), Panel(TIME, TIME, (), tall=0.5))
    filled = [[*row, *[empty] * (across - len(row))] for row in rows]
    return [panel for row in filled for line in zip(*row, strict=True) for panel in line]


def _channel_panels(agreement: RecordingAgreement, channel: ChannelAgreement, atmosphere: float) -> list[Panel]:
    """Return samples and model over time, and below them their residual."""
    name, measured, model = channel.channel, agreement.measured, agreement.model
    measurement = measured_values(measured, name)
    assert measurement is not None, "a channel that is compared was measured"
    is_short, is_chamber = measured.duration < _SHORT, name in (PRESSURE_1, PRESSURE_2)
    time, scale = (Kind("Time", "ms"), _MILLISECONDS) if is_short else (TIME, 1.0)
    shown, limit = COMPARED[name], channel.limit * channel.full_range
    is_first = channel is agreement.channels[0]
    course = Course(
        time=time,
        level=Kind(shown.title, "", "pressure" if is_chamber else shown.quantity),
        change=Kind(f"Measured - model, RMS {100 * channel.fraction:.2g} %", "", shown.quantity),
        times=scale * measured.time,
        samples=measurement,
        # The measurement is late by the delay, so the model is read that much earlier.
        model=np.interp(measured.time - agreement.delay.correction, model.time, model[name]),
        names=(KIND_WORDS[measured.kind], "model on the recorded inputs") if is_first else ("", ""),
        colour=_LOOKS.get(name, ACTUAL).colour,
        above=gauge_shift(atmosphere) if is_chamber else 0.0,
    )
    # Where the residual is far from the limit of its RMS value, that would only press it flat.
    is_near = float(np.abs(course.model - measurement).max()) >= _NEAR_LIMIT * limit
    return course_panels(course, "dots", "figure" if is_first else "", (-limit, limit) if is_near else ())


_MILLISECONDS = 1.0e3
_HEAD = ("channel", "RMS error", "in noise", "variation", "of range", "limit", "bias", "largest", "at", "verdict")
_UNUSUAL = re.compile(r"[^A-Za-z0-9_.-]+")


@in_units(lambda validation: validation.device.shown)
def finding_of(validation: Validation) -> Finding[Validation]:
    """Return a validation in words, tables and panels; it has passed where every error is within its limit."""
    count = len(validation.recordings)
    names = recording_names([agreement.file for agreement in validation.recordings])
    kinds = {agreement.measured.kind for agreement in validation.recordings}
    pairs = list(zip(names, validation.recordings, strict=True))
    said, unmeasured = [verdict(validation)], sorted(kinds - {"measured"})
    # The verdict must not be read without these.
    if unmeasured:
        said.append(
            f"Not everything here was measured: {', '.join(KIND_WORDS[kind] for kind in unmeasured)}. Agreement with "
            "such a recording shows how well two models agree, not how well the model agrees with a device."
        )
    if validation.overrides:
        said.append(f"values changed: {', '.join(validation.overrides)}")
    hashes = [(recording.file, f"sha256 {recording.sha256}") for recording in validation.recordings if recording.sha256]
    method = (
        f"The model with the valve '{validation.device.valve_name}' was run with the inputs of each recording, from "
        "the state of its first samples. A residual is measured - model. Percentages are of the full range: the "
        "angle between the stops, the gauge pressure of the supply, and twice that for the pressure difference. One "
        "common delay was removed before the errors were computed."
    )
    return Finding(
        name="validate",
        kicker="Validation of a parameter set",
        title=f"{validation.device.name} against {count_of(count, 'recording')}",
        said=said,
        parts=(
            Part(said=[method], is_detail=True),
            *(_part(validation, name, agreement) for name, agreement in pairs),
            Part("Files" if hashes else "", facts(hashes), is_detail=True),
        ),
        found=validation,
        passed=validation.passes,
        kind=next(iter(kinds)) if len(kinds) == 1 else "measured",
        files={
            f"{name}-replayed.csv": partial(marked_csv_bytes, agreement.model.resample(agreement.measured.time))
            for name, agreement in pairs
        },
    )


def recording_names(files: Sequence[str]) -> list[str]:
    """Return a name for the files of each recording: its file's or folder's, with a number where two are alike."""
    stems = [_UNUSUAL.sub("-", Path(file).stem).strip("-.") or "recording" for file in files]
    return [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]


def verdict(validation: Validation) -> str:
    """Return in one sentence whether the set agrees and, if not, by what it is off and what would explain it."""
    count, name = len(validation.recordings), validation.device.name
    pairs = [(channel, agreement) for agreement in validation.recordings for channel in agreement.channels]
    worst = max((channel for channel, _ in pairs), key=lambda channel: channel.in_noise)
    share = f"{100 * worst.fraction:.2g} % of full range"
    size = f"{worst.channel} is off by {_times(worst.in_noise)} times its noise ({share})"
    failed = ", ".join(
        f"{channel.channel} in {agreement.file} ({100 * channel.fraction:.3g} %, limit {100 * channel.limit:.3g} %)"
        for channel, agreement in pairs
        if not channel.passes
    )
    why = _why(validation.causes, worst.in_noise)
    if not validation.passes:
        # Where no channel is beyond its limit, an unusual cause alone is what fails the set.
        parts = (why, size, f"beyond the limit: {failed}") if why else (failed, size)
        return f"{name} does not agree: {'; '.join(parts if failed else parts[:2])}"
    rest = "nothing but noise is left" if validation.causes.is_noise else "; ".join([size, *([why] if why else [])])
    return f"{name} agrees with {count} recording{'s' * (count > 1)}: every RMS error is within its limit; {rest}"


def _why(causes: Causes, without: float) -> str:
    """Return what explains a disagreement, or what comes nearest; empty where nothing but noise is left.

    ``without`` is the largest error over noise [-] without any cause: a nearest one is named that takes half of it, or
    wrong samples, which are seen whatever else is wrong.
    """
    if causes.found is not None:
        verdict = in_words(causes.found)
        verdict += ", as on any bench" if causes.found.is_usual else ""
        same = ", ".join(cause.name for cause in causes.found.same)
        return f"{verdict} (or, the same for these recordings: {same})" if same else verdict
    if not causes.tried:
        return ""
    nearest = causes.nearest
    explains = nearest is not None and (nearest.is_of_samples or nearest.left <= _EXPLAINS * without)
    if nearest is None or not explains:
        return "no single change explains it"
    left = _times(nearest.left)
    return f"no single change explains it; nearest: {in_words(nearest)}, which leaves {left} times the noise"


def _times(size: float) -> str:
    """Return how many times the noise, with two digits and without a power of ten."""
    return f"{size:.2g}" if size < 100.0 else f"{size:.0f}"


def in_words(cause: Cause) -> str:
    """Return a cause in words, numbers of the set in the unit in which people see them."""
    if len(cause.numbers) != 1:
        return cause.in_words
    ((value, unit),) = cause.numbers.values()
    # An atmosphere in gauge pressure says nothing.
    absolute = unit == "Pa_a"
    quantity = "pressure change" if absolute else quantity_of_unit(unit)
    shown = Kind("", "" if unit == "-" else unit, quantity).text(value)
    return f"{cause.in_words} ({shown})"


def _cause_data(cause: Cause | None) -> dict[str, Any] | None:
    if cause is None:
        return None
    return {
        "name": cause.name,
        "words": in_words(cause),
        "same": [other.name for other in cause.same],
        "gain": cause.gain,
        "left": cause.left,
        "numbers": {path: value for path, (value, _) in cause.numbers.items()},
        "is_usual": cause.is_usual,
    }


def _part(validation: Validation, name: str, agreement: RecordingAgreement) -> Part:
    measured, kind = agreement.measured, KIND_WORDS[agreement.measured.kind]
    late = f"{_MILLISECONDS * agreement.delay.correction:.3g} ms" if agreement.delay.correction else "none found"
    replayed = (
        f"{len(measured)} samples over {measured.duration:.4g} s; inputs from the recording: "
        f"{', '.join(agreement.inputs)}; delay of the measurement: {late}"
    )
    across = 1 if len(agreement.channels) == 1 else 2
    return Part(
        f"{agreement.file} ({kind})",
        columns_of(_HEAD, map(channel_cells, agreement.channels)),
        [replayed],
        remarks=[f"note: {remark}" for remark in agreement.remarks],
        panels=partial(agreement_panels, agreement, validation.device.supply.atmospheric_pressure),
        name=f"{name}-agreement",
        caption=f"Dots: {kind}. Lines: the model on the recorded inputs. Below each: the residual, measured - "
        "model, the limit of its RMS value dashed where it is in range.",
        across=across,
        size=(7.6 / across, 2.1),
    )


def channel_cells(channel: ChannelAgreement) -> tuple[str, ...]:
    """Return the cells of a row: name, RMS error, over noise, variation, share, limit, bias, largest to verdict."""
    return (
        channel.channel,
        _error(channel, channel.rms),
        _number(channel.in_noise),
        _error(channel, channel.variation),
        f"{_number(100 * channel.fraction)} %",
        f"{_number(100 * channel.limit)} %",
        _error(channel, channel.bias),
        _error(channel, channel.largest),
        f"{channel.largest_time:.4g} s",
        "pass" if channel.passes else "FAIL",
    )


def _error(channel: ChannelAgreement, value: float) -> str:
    kind = Kind("", "", COMPARED[channel.channel].quantity)
    return f"{_number(display_value(value, kind.quantity))} {kind.shown_unit}"


def _number(value: float) -> str:
    """Return three digits; what is below a thousandth is written as 0, for nobody measures that."""
    return "0" if abs(value) < 5.0e-4 else f"{value:.3g}"


def _recording_data(agreement: RecordingAgreement) -> dict[str, Any]:
    return {
        "file": agreement.file,
        "sha256": agreement.sha256,
        "label": agreement.measured.label,
        "kind": agreement.measured.kind,
        "samples": len(agreement.measured),
        "duration": agreement.measured.duration,
        "motion": agreement.motion,
        "inputs": list(agreement.inputs),
        "step": agreement.step,
        "delay": agreement.delay.correction,
        "delay_is_at_limit": agreement.delay.is_at_limit,
        "passes": agreement.passes,
        "remarks": list(agreement.remarks),
        "channels": {
            channel.channel: {
                "unit": channel.unit,
                "rms": channel.rms,
                "rms_share": channel.fraction,
                "noise": channel.noise,
                "limit_share": channel.limit,
                "passes": channel.passes,
                "full_range": channel.full_range,
                "variation": channel.variation,
                "rms_unaligned": channel.rms_unaligned,
                "bias": channel.bias,
                "largest": channel.largest,
                "largest_time": channel.largest_time,
                "shown": {"unit": kind.shown_unit, "rms": display_value(channel.rms, kind.quantity)},
            }
            for channel in agreement.channels
            for kind in [Kind("", "", COMPARED[channel.channel].quantity)]
        },
    }
