"""Report of a validation: verdict, table of errors and panels for each recording, replayed recordings."""

import re
from functools import partial
from pathlib import Path

import numpy as np

from ppafo.analyses.validate.result import Validation, kind_of_channel, verdict
from ppafo.report.display_units import display_value
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import FittedCurve, course_panels
from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units.shown import in_units
from ppafo.validation import ChannelAgreement
from ppafo.validation.agreement import RecordingAgreement, measured_values
from ppafo.validation.compared import COMPARED, PRESSURE_1, PRESSURE_2
from ppafo.wording import count_of

KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""Words of the report for the origin of a recording, so that model output does not pass for a measurement."""
MILLISECONDS = 1.0e3
"""Milliseconds per second."""
_LOOKS = {PRESSURE_1: CHAMBER_1, PRESSURE_2: CHAMBER_2}
_NEAR_LIMIT = 0.25
"""Least ratio of the largest residual to the RMS limit at which the panel shows the limit; else it would be flat."""
_SHORT = 3.0
"""Duration [s] below which the time axis is in milliseconds."""

_HEAD = ("channel", "RMS error", "in noise", "variation", "of range", "limit", "bias", "largest", "at", "verdict")
"""Column heads of the table of errors, in the order of ``channel_cells``."""
_UNUSUAL = re.compile(r"[^A-Za-z0-9_.-]+")
"""Pattern of characters that are replaced in file names."""
_WRITTEN_AS_ZERO = 5.0e-4
"""Absolute value below which a number in the table of errors is written as 0."""


def agreement_panels(agreement: RecordingAgreement, across: int) -> list[Panel]:
    """Return the panels of a recording in rows of ``across`` channels: samples with the model, and residuals below."""
    samples, residuals = [], []
    for channel in agreement.channels:
        upper, lower = _channel_panels(agreement, channel)
        samples.append(upper)
        residuals.append(lower)
    # An odd number of channels leaves one place in the last row empty.
    if len(samples) % across:
        samples.append(Panel(TIME, TIME, ()))
        residuals.append(Panel(TIME, TIME, (), tall=0.5))
    panels: list[Panel] = []
    for start in range(0, len(samples), across):
        row = slice(start, start + across)
        panels += [*samples[row], *residuals[row]]
    return panels


def _channel_panels(agreement: RecordingAgreement, channel: ChannelAgreement) -> list[Panel]:
    """Return two panels of a channel over time: samples with model, and below the residual."""
    name, measured, model = channel.channel, agreement.measured, agreement.model
    measurement = measured_values(measured, name)
    assert measurement is not None, "a compared channel was measured"
    is_short, is_chamber = measured.duration < _SHORT, name in (PRESSURE_1, PRESSURE_2)
    time, scale = (Kind("Time", "ms"), MILLISECONDS) if is_short else (TIME, 1.0)
    quantity, limit = COMPARED[name], channel.limit * channel.full_range
    is_first = channel is agreement.channels[0]
    curve = FittedCurve(
        time=time,
        level=Kind(quantity.title, "", "pressure" if is_chamber else quantity.quantity),
        change=Kind(f"Measured - model, RMS {100 * channel.fraction:.2g} %", "", quantity.quantity),
        times=scale * measured.time,
        samples=measurement,
        # The measurement is late by the delay, so the model is read that much earlier.
        model=np.interp(measured.time - agreement.delay.correction, model.time, model[name]),
        names=(KIND_WORDS[measured.kind], "model on the recorded inputs") if is_first else ("", ""),
        colour=_LOOKS.get(name, ACTUAL).colour,
    )
    is_near = float(np.abs(curve.model - measurement).max()) >= _NEAR_LIMIT * limit
    return course_panels(curve, "dots", "figure" if is_first else "", (-limit, limit) if is_near else ())


@in_units(lambda validation: validation.device.shown)
def finding_of(validation: Validation) -> Finding[Validation]:
    """Return a validation as a finding; passed if every error is within its limit."""
    # Stems of the written files, numbered if recordings have one name.
    stems = [_UNUSUAL.sub("-", Path(row.file).stem).strip("-.") or "recording" for row in validation.recordings]
    names = [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]
    kinds = {agreement.measured.kind for agreement in validation.recordings}
    pairs = list(zip(names, validation.recordings, strict=True))
    sentences, unmeasured = [verdict(validation)], sorted(kinds - {"measured"})
    # The verdict must not be read without these.
    if unmeasured:
        sentences.append(
            f"Not everything here was measured: {', '.join(KIND_WORDS[kind] for kind in unmeasured)}. Agreement with "
            "such a recording shows how well two models agree, not how well the model agrees with a device."
        )
    method = (
        f"The model with the valve '{validation.device.valve_name}' was run with the inputs of each recording, from "
        "the state of its first samples. A residual is measured - model. Percentages are of the full range: the "
        "angle between the stops, the gauge pressure of the supply, and twice that for the pressure difference. One "
        "common delay was removed before the errors were computed."
    )
    hashes = [(recording.file, f"sha256 {recording.sha256}") for recording in validation.recordings if recording.sha256]
    return Finding(
        name="validate",
        kicker="Validation of a parameter set",
        title=f"{validation.device.name} against {count_of(len(validation.recordings), 'recording')}",
        said=sentences,
        parts=(
            Section(said=[method], is_detail=True),
            *(_part(name, agreement) for name, agreement in pairs),
            Section("Files" if hashes else "", facts(hashes), is_detail=True),
        ),
        found=validation,
        passed=validation.passes,
        kind=next(iter(kinds)) if len(kinds) == 1 else "measured",
        overrides=validation.overrides,
        files={
            f"{name}-replayed.csv": partial(marked_csv_bytes, agreement.model.resample(agreement.measured.time))
            for name, agreement in pairs
        },
    )


def _part(name: str, agreement: RecordingAgreement) -> Section:
    """Return the section of one recording: table of errors, and panels. ``name`` is the stem of its files."""
    measured, kind = agreement.measured, KIND_WORDS[agreement.measured.kind]
    delay = f"{MILLISECONDS * agreement.delay.correction:.3g} ms" if agreement.delay.correction else "none found"
    replayed = (
        f"{len(measured)} samples over {measured.duration:.4g} s; inputs from the recording: "
        f"{', '.join(agreement.inputs)}; delay of the measurement: {delay}"
    )
    across = 1 if len(agreement.channels) == 1 else 2
    return Section(
        f"{agreement.file} ({kind})",
        columns_of(_HEAD, map(channel_cells, agreement.channels)),
        [replayed],
        remarks=[f"note: {remark}" for remark in agreement.remarks],
        panels=partial(agreement_panels, agreement, across),
        name=f"{name}-agreement",
        caption=f"Dots: {kind}. Lines: the model on the recorded inputs. Below each: the residual, measured - "
        "model, the limit of its RMS value dashed where it is in range.",
        across=across,
        size=(6.0 / across, 1.9),
    )


def channel_cells(channel: ChannelAgreement) -> tuple[str, ...]:
    """Return the cells of a channel's row in the table of errors.

    The cells are name, RMS error, RMS error divided by noise, variation, RMS error and limit as percentages of full
    range, bias, largest error, time of the largest error, and verdict.
    """
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
    """Return an error [SI] of a channel as text in the display unit."""
    kind = kind_of_channel(channel)
    return f"{_number(display_value(value, kind.quantity))} {kind.shown_unit}"


def _number(value: float) -> str:
    return "0" if abs(value) < _WRITTEN_AS_ZERO else f"{value:.3g}"
