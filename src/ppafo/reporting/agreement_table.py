"""Agreement of a model with recordings as text and as data."""

from typing import Any

import ppafo
from ppafo.units import from_si
from ppafo.validation import ChannelAgreement, RecordingAgreement, Validation
from ppafo.validation.compared import COMPARED

_MILLISECONDS = 1.0e3
_HEAD = ("channel", "RMS error", "of range", "limit", "bias", "largest", "at", "own delay", "")
KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""What the recording is called beside the model: nobody may take a model's output for a measurement."""


def shown(value: float, channel: str) -> float:
    """Return an error in the SI unit of a channel in the unit that is shown: degrees, psi, N m."""
    kind = COMPARED[channel]
    return from_si(value, kind.shown_unit, kind.unit)


def shown_unit(channel: str) -> str:
    """Return the unit in which errors of a channel are shown."""
    return COMPARED[channel].shown_unit.removesuffix("_d")


def agreement_table(validation: Validation) -> list[str]:
    """Return one block of aligned lines for each recording, and a last line with the verdict."""
    lines: list[str] = []
    for agreement in validation.recordings:
        lines += [*_block(agreement), ""]
    return [*lines, verdict_sentence(validation)]


def verdict_sentence(validation: Validation) -> str:
    """Return in one sentence whether every error is within its limit and, if not, which are not."""
    count = len(validation.recordings)
    noun = "recording" if count == 1 else "recordings"
    if validation.passes:
        return f"{validation.device.name} agrees with {count} {noun}: every RMS error is within its limit"
    failed = [
        f"{channel.channel} in {agreement.file} ({100 * channel.share:.3g} %, limit {100 * channel.limit:.3g} %)"
        for agreement in validation.recordings
        for channel in agreement.channels
        if not channel.passes
    ]
    return f"{validation.device.name} does not agree: {', '.join(failed)}"


def replay_sentence(agreement: RecordingAgreement) -> str:
    """Return how a recording was replayed, as plain words."""
    measured = agreement.measured
    late = f"{_MILLISECONDS * agreement.delay.taken_out:.3g} ms" if agreement.delay.taken_out else "none found"
    return (
        f"{len(measured)} samples over {measured.duration:.4g} s; taken from the recording: "
        f"{', '.join(agreement.inputs)}; delay of the measurement: {late}"
    )


def channel_cells(channel: ChannelAgreement) -> tuple[str, ...]:
    """Return the cells of a row: name, RMS error, share, limit, bias, largest error, its time, delay, verdict."""
    name, unit = channel.channel, shown_unit(channel.channel)
    return (
        name,
        f"{_number(shown(channel.rms, name))} {unit}",
        f"{_number(100 * channel.share)} %",
        f"{_number(100 * channel.limit)} %",
        f"{_number(shown(channel.bias, name))} {unit}",
        f"{_number(shown(channel.largest, name))} {unit}",
        f"{channel.largest_time:.4g} s",
        f"{'limit, ' if channel.delay_is_at_limit else ''}{_number(_MILLISECONDS * channel.delay)} ms",
        "pass" if channel.passes else "FAIL",
    )


def agreement_document(validation: Validation) -> dict[str, Any]:
    """Return what ``agreement.json`` says, in SI units, with the paper's units beside them for reading."""
    return {
        "format": "ppafo agreement",
        "schema_version": 1,
        "parameter_set": validation.parameter_set,
        "device": validation.device.name,
        "valve": validation.device.valve_name,
        "overrides": list(validation.overrides),
        "longest_delay": validation.settings.longest_delay,
        "passes": validation.passes,
        "summary": verdict_sentence(validation),
        "recordings": [_recording_document(agreement) for agreement in validation.recordings],
        "versions": {"ppafo": ppafo.__version__},
    }


def _recording_document(agreement: RecordingAgreement) -> dict[str, Any]:
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
        "delay": agreement.delay.taken_out,
        "delay_is_at_limit": agreement.delay.is_at_limit,
        "passes": agreement.passes,
        "remarks": list(agreement.remarks),
        "channels": {channel.channel: _channel_document(channel) for channel in agreement.channels},
    }


def _channel_document(channel: ChannelAgreement) -> dict[str, Any]:
    return {
        "unit": channel.unit,
        "rms": channel.rms,
        "rms_share": channel.share,
        "limit_share": channel.limit,
        "passes": channel.passes,
        "full_range": channel.full_range,
        "rms_unaligned": channel.rms_unaligned,
        "bias": channel.bias,
        "largest": channel.largest,
        "largest_time": channel.largest_time,
        "delay": channel.delay,
        "delay_is_at_limit": channel.delay_is_at_limit,
        "shown": {"unit": shown_unit(channel.channel), "rms": shown(channel.rms, channel.channel)},
    }


def _block(agreement: RecordingAgreement) -> list[str]:
    rows = [_HEAD, *(channel_cells(channel) for channel in agreement.channels)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEAD))]
    return [
        f"{agreement.file} ({KIND_WORDS[agreement.measured.kind]})",
        replay_sentence(agreement),
        *(f"note: {remark}" for remark in agreement.remarks),
        *(_line(row, widths) for row in rows),
    ]


def _line(row: tuple[str, ...], widths: list[int]) -> str:
    first = f"{row[0]:<{widths[0]}}"
    rest = [f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True)]
    return "  ".join([first, *rest]).rstrip()


def _number(value: float) -> str:
    """Return three digits; what is below a thousandth is written as 0, for nobody measures that."""
    return "0" if abs(value) < 5.0e-4 else f"{value:.3g}"
