"""A validation as a finding: verdict, errors of each recording in a table, its panels, and the replayed recordings."""

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ppafo.analyses.validate.figure import KIND_WORDS, MILLISECONDS, agreement_panels, panels_across
from ppafo.analyses.validate.result import Validation, kind_of_channel, verdict
from ppafo.errors import count_of
from ppafo.report.display_units import display_value
from ppafo.report.finding import Finding, Part, columns_of, facts
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units.shown import in_units
from ppafo.validation import ChannelAgreement
from ppafo.validation.agreement import RecordingAgreement

_HEAD = ("channel", "RMS error", "in noise", "variation", "of range", "limit", "bias", "largest", "at", "verdict")
"""Titles of the table of errors, as ``channel_cells`` fills it."""
_UNUSUAL = re.compile(r"[^A-Za-z0-9_.-]+")
"""Letters that the name of a file is better without."""
_WRITTEN_AS_ZERO = 5.0e-4
"""Size of a number below which it is written as 0, for nobody measures that."""


@in_units(lambda validation: validation.device.shown)
def finding_of(validation: Validation) -> Finding[Validation]:
    """Return a validation in words, tables and panels; it has passed where every error is within its limit."""
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
    return Finding(
        name="validate",
        kicker="Validation of a parameter set",
        title=f"{validation.device.name} against {count_of(len(validation.recordings), 'recording')}",
        said=said,
        parts=(
            Part(said=[_method(validation)], is_detail=True),
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


def _method(validation: Validation) -> str:
    """Return how the errors were computed."""
    return (
        f"The model with the valve '{validation.device.valve_name}' was run with the inputs of each recording, from "
        "the state of its first samples. A residual is measured - model. Percentages are of the full range: the "
        "angle between the stops, the gauge pressure of the supply, and twice that for the pressure difference. One "
        "common delay was removed before the errors were computed."
    )


def recording_names(files: Sequence[str]) -> list[str]:
    """Return a name for the files of each recording: its file's or folder's, with a number where two are alike."""
    stems = [_UNUSUAL.sub("-", Path(file).stem).strip("-.") or "recording" for file in files]
    return [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]


def _part(validation: Validation, name: str, agreement: RecordingAgreement) -> Part:
    """Return the errors of a recording in a table, with its panels; ``name`` is that of its files."""
    measured, kind = agreement.measured, KIND_WORDS[agreement.measured.kind]
    late = f"{MILLISECONDS * agreement.delay.correction:.3g} ms" if agreement.delay.correction else "none found"
    replayed = (
        f"{len(measured)} samples over {measured.duration:.4g} s; inputs from the recording: "
        f"{', '.join(agreement.inputs)}; delay of the measurement: {late}"
    )
    across = panels_across(agreement)
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
    """Return an error [SI] of a channel in the unit that people are shown."""
    kind = kind_of_channel(channel)
    return f"{_number(display_value(value, kind.quantity))} {kind.shown_unit}"


def _number(value: float) -> str:
    """Return three digits, or 0."""
    return "0" if abs(value) < _WRITTEN_AS_ZERO else f"{value:.3g}"
