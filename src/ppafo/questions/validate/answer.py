"""The answer of a validation: for each recording a row for each channel, what is to be said of it, and a figure."""

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_unit, display_value
from ppafo.questions.validate.figure import KIND_WORDS, agreement_figure
from ppafo.questions.validate.solve import Validation
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.validation import ChannelAgreement, RecordingAgreement
from ppafo.validation.compared import COMPARED
from ppafo.version import __version__

_MILLISECONDS = 1.0e3
_HEAD = tuple(
    map(Column, ("channel", "RMS error", "of range", "limit", "bias", "largest", "at", "own delay", "verdict"))
)
_UNUSUAL = re.compile(r"[^A-Za-z0-9_.-]+")


def answer_of(validation: Validation) -> Answer:
    """Return the answer of a validation; it has passed where every error is within its limit."""
    count = len(validation.recordings)
    names = recording_names([agreement.file for agreement in validation.recordings])
    kinds = {agreement.measured.kind for agreement in validation.recordings}
    pairs = list(zip(names, validation.recordings, strict=True))
    return Answer(
        name="validate",
        kicker="Validation of a parameter set",
        title=f"{validation.device.name} against {count} recording{'' if count == 1 else 's'}",
        lead=(verdict(validation), *_departures(validation, sorted(kinds - {"measured"}))),
        sections=(
            Section(paragraphs=(_method(validation),), is_detail=True),
            *(_section(validation, name, agreement) for name, agreement in pairs),
            _origins(validation),
        ),
        data=_data(validation),
        passed=validation.passes,
        kind=next(iter(kinds)) if len(kinds) == 1 else "measured",
        files={f"{name}-replayed.csv": partial(_replay_csv, agreement) for name, agreement in pairs},
    )


def recording_names(files: Sequence[str]) -> list[str]:
    """Return a name for the files of each recording: that of its file or folder, with a number where two are alike."""
    stems = [_UNUSUAL.sub("-", Path(file).stem).strip("-.") or "recording" for file in files]
    return [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]


def verdict(validation: Validation) -> str:
    """Return in one sentence whether every error is within its limit and, if not, which are not."""
    count = len(validation.recordings)
    noun = "recording" if count == 1 else "recordings"
    if validation.passes:
        return f"{validation.device.name} agrees with {count} {noun}: every RMS error is within its limit"
    failed = [
        f"{channel.channel} in {agreement.file} ({100 * channel.fraction:.3g} %, limit {100 * channel.limit:.3g} %)"
        for agreement in validation.recordings
        for channel in agreement.channels
        if not channel.passes
    ]
    return f"{validation.device.name} does not agree: {', '.join(failed)}"


def _departures(validation: Validation, kinds: Sequence[str]) -> list[str]:
    """Return what the verdict must not be read without: recordings that nobody measured, values that were changed."""
    said = []
    if kinds:
        said.append(
            f"Not everything here was measured: {', '.join(KIND_WORDS[kind] for kind in kinds)}. Agreement with "
            "such a recording shows how well two models agree, not how well the model agrees with a device."
        )
    if validation.overrides:
        said.append(f"values changed: {', '.join(validation.overrides)}")
    return said


def _method(validation: Validation) -> str:
    return (
        f"The model with the valve '{validation.device.valve_name}' was run with the inputs of each recording, from "
        "the state of its first samples. An error is model less measured. Percentages are of the full range: the "
        "angle between the stops, the gauge pressure of the supply, and twice that for the pressure difference. One "
        "common delay was removed before the errors were computed."
    )


def _section(validation: Validation, name: str, agreement: RecordingAgreement) -> Section:
    kind = KIND_WORDS[agreement.measured.kind]
    atmosphere = validation.device.supply.atmospheric_pressure
    return Section(
        heading=f"{agreement.file} ({kind})",
        paragraphs=(replay_sentence(agreement),),
        table=Table(_HEAD, tuple(channel_cells(channel) for channel in agreement.channels)),
        remarks=tuple(f"note: {remark}" for remark in agreement.remarks),
        figure=Figure(
            f"{name}-agreement",
            f"Dots: {kind}. Lines: the model on the recorded inputs. Below each: model less measured, the limit of "
            "its RMS value dashed where it is in range.",
            lambda: agreement_figure(agreement, atmosphere),
        ),
    )


def _origins(validation: Validation) -> Section:
    """Return the checksum of each file; a recording that was no file has none."""
    rows = tuple((item.file, f"sha256 {item.sha256}") for item in validation.recordings if item.sha256)
    return Section("Files", table=Table((), rows), is_detail=True) if rows else Section()


def _replay_csv(agreement: RecordingAgreement) -> bytes:
    return marked_csv_bytes(agreement.model.resample(agreement.measured.time))


def replay_sentence(agreement: RecordingAgreement) -> str:
    """Return how a recording was replayed, as plain words."""
    measured = agreement.measured
    late = f"{_MILLISECONDS * agreement.delay.correction:.3g} ms" if agreement.delay.correction else "none found"
    return (
        f"{len(measured)} samples over {measured.duration:.4g} s; inputs from the recording: "
        f"{', '.join(agreement.inputs)}; delay of the measurement: {late}"
    )


def channel_cells(channel: ChannelAgreement) -> tuple[str, ...]:
    """Return the cells of a row: name, RMS error, share, limit, bias, largest error, its time, delay, verdict."""
    return (
        channel.channel,
        _error(channel, channel.rms),
        f"{_number(100 * channel.fraction)} %",
        f"{_number(100 * channel.limit)} %",
        _error(channel, channel.bias),
        _error(channel, channel.largest),
        f"{channel.largest_time:.4g} s",
        f"{'limit, ' if channel.delay_is_at_limit else ''}{_number(_MILLISECONDS * channel.delay)} ms",
        "pass" if channel.passes else "FAIL",
    )


def _error(channel: ChannelAgreement, value: float) -> str:
    quantity = COMPARED[channel.channel].quantity
    return f"{_number(display_value(value, quantity))} {display_unit(quantity)}"


def _number(value: float) -> str:
    """Return three digits; what is below a thousandth is written as 0, for nobody measures that."""
    return "0" if abs(value) < 5.0e-4 else f"{value:.3g}"


def _data(validation: Validation) -> dict[str, Any]:
    return {
        "format": "ppafo agreement",
        "schema_version": 1,
        "parameter_set": validation.parameter_set,
        "device": validation.device.name,
        "valve": validation.device.valve_name,
        "overrides": list(validation.overrides),
        "longest_delay": validation.settings.longest_delay,
        "passes": validation.passes,
        "summary": verdict(validation),
        "recordings": [_recording_data(agreement) for agreement in validation.recordings],
        "versions": {"ppafo": __version__},
    }


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
        "channels": {channel.channel: _channel_data(channel) for channel in agreement.channels},
    }


def _channel_data(channel: ChannelAgreement) -> dict[str, Any]:
    quantity = COMPARED[channel.channel].quantity
    return {
        "unit": channel.unit,
        "rms": channel.rms,
        "rms_share": channel.fraction,
        "limit_share": channel.limit,
        "passes": channel.passes,
        "full_range": channel.full_range,
        "rms_unaligned": channel.rms_unaligned,
        "bias": channel.bias,
        "largest": channel.largest,
        "largest_time": channel.largest_time,
        "delay": channel.delay,
        "delay_is_at_limit": channel.delay_is_at_limit,
        "shown": {"unit": display_unit(quantity), "rms": display_value(channel.rms, quantity)},
    }
