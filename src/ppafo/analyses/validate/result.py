"""Result of a validation: agreement of each recording, causes of the residual, and the verdict in a sentence."""

from dataclasses import dataclass
from typing import Any

from ppafo.documents.json_text import fields_of
from ppafo.parameters.device import Device
from ppafo.report.display_units import display_value
from ppafo.report.kind import Kind
from ppafo.simulation.recorded.usual_errors import PRESSURE_ERRORS
from ppafo.units.shown import quantity_of_unit
from ppafo.validation import ChannelAgreement
from ppafo.validation.agreement import RecordingAgreement
from ppafo.validation.causes import Diagnosis, ResidualCause
from ppafo.validation.compared import COMPARED
from ppafo.validation.settings import ReplaySettings
from ppafo.version import __version__
from ppafo.wording import argument_text, count_of

_EXPLAINS = 0.5
"""Largest ratio of the residual with the nearest cause to the residual without a cause at which a cause is named."""


@dataclass(frozen=True, slots=True)
class Validation:
    """Result of the validation of a parameter set against recordings.

    ``device``: device of the set after the ``overrides``
    ``settings``: settings of the replay
    ``recordings``: agreement of each recording with the model
    ``causes``: diagnosed causes of the residual
    """

    parameter_set: str
    device: Device
    overrides: tuple[str, ...]
    settings: ReplaySettings
    recordings: tuple[RecordingAgreement, ...]
    causes: Diagnosis

    @property
    def passes(self) -> bool:
        """True if every RMS error is within its limit; causes of the residual do not affect the verdict."""
        return all(recording.passes for recording in self.recordings)

    def json_document(self) -> dict[str, Any]:
        """Return errors, causes and recordings as plain data in SI."""
        return {
            "format": "ppafo agreement",
            "schema_version": 1,
            **fields_of(self, "parameter_set", "passes"),
            "device": self.device.name,
            "valve": self.device.valve_name,
            "overrides": list(self.overrides),
            "longest_delay": self.settings.longest_delay,
            "summary": verdict(self),
            "causes": {
                "tried": self.causes.tried,
                "found": _cause_data(self.causes.found),
                "nearest": _cause_data(self.causes.nearest),
            },
            "recordings": [_recording_data(agreement) for agreement in self.recordings],
            "versions": {"ppafo": __version__},
        }


def verdict(validation: Validation) -> str:
    """Return a sentence on the agreement of the set, with the largest deviation and its probable cause, if any."""
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
    why, causes = _why(validation.causes, worst.in_noise, validation.passes), validation.causes
    motion_remedy = ""
    if not validation.passes and causes.found is None and any(row.motion == "free" for row in validation.recordings):
        # A cause is searched with the motion as it was said, which is wrong for a device that something else moved.
        motion = argument_text("motion", "leg")
        motion_remedy = f"if the device was on a leg, locked or driven, give {motion}, locked or measured first"
    texts = ("nothing but noise is left",) if causes.is_noise else (size, motion_remedy, why)
    explanation = "; ".join(filter(None, (*texts, _removed_delay(validation))))
    if not validation.passes:
        return f"{name} does not agree: {failed}; {explanation}"
    wide = f" ({worst.channel}: {100 * worst.limit:.3g} %, which is wider than the noise and may hide a wrong number)"
    limit = f"every RMS error is within its limit{'' if causes.is_noise else wide}"
    return f"{name} agrees with {count_of(count, 'recording')}: {limit}; {explanation}"


def _removed_delay(validation: Validation) -> str:
    """Return what was removed as common delay, if it is longer than usual of sensors: a valve may be late as well."""
    removed = max(agreement.delay.correction for agreement in validation.recordings)
    if removed <= PRESSURE_ERRORS.delay:
        return ""
    delay = validation.device.valve.settings.get("delay")
    of_valve = (
        "" if delay is None else f", of the sensors or of the valve (valve.delay = {1.0e3 * (delay + removed):.3g} ms)"
    )
    return f"a delay of {1.0e3 * removed:.3g} ms was removed{of_valve}"


def _why(causes: Diagnosis, without: float, passes: bool) -> str:
    """Return the cause of a residual in words, or the nearest cause; empty if only noise is left.

    ``without`` is the largest error divided by noise [-] without any cause. A nearest cause is named if it at least
    halves this error, or if it concerns wrong samples, which are detectable whatever else is wrong.
    """
    if causes.found is not None:
        verdict = in_words(causes.found)
        # What is beyond a limit is more than usual, of whatever kind it is.
        verdict += ", as on any bench" if causes.found.is_usual and passes else ""
        same = ", ".join(cause.name for cause in causes.found.same)
        return f"{verdict} (indistinguishable with these recordings: {same})" if same else verdict
    if not (causes.tried or causes.kinds):
        return ""
    tried = f"; tried: {causes.kinds}" if causes.kinds else ""
    nearest = causes.nearest
    if nearest is None or not (nearest.is_of_samples or nearest.left <= _EXPLAINS * without):
        return f"no single change explains the residual{tried}"
    texts = [
        f"{in_words(cause)}, which leaves {_times(cause.left)} times the noise" for cause in (nearest, *nearest.same)
    ]
    return f"no single change explains the residual; nearest: {', or '.join(texts)}{tried}"


def _times(size: float) -> str:
    """Return a multiple of the noise as text with two digits and without a power of ten."""
    return f"{size:.2g}" if size < 100.0 else f"{size:.0f}"


def in_words(cause: ResidualCause) -> str:
    """Return a cause in words, with values of the set in display units."""
    if len(cause.numbers) != 1:
        return cause.in_words
    ((value, unit),) = cause.numbers.values()
    # An atmosphere in gauge pressure says nothing.
    absolute = unit == "Pa_a"
    quantity = "pressure change" if absolute else quantity_of_unit(unit)
    text = Kind("", "" if unit == "-" else unit, quantity).text(value)
    return f"{cause.in_words} ({text})"


def _cause_data(cause: ResidualCause | None) -> dict[str, Any] | None:
    """Return a cause as plain data in SI; None without a cause."""
    if cause is None:
        return None
    return {
        **fields_of(cause, "name", "gain", "left", "is_usual"),
        "words": in_words(cause),
        "same": [other.name for other in cause.same],
        "numbers": {path: value for path, (value, _) in cause.numbers.items()},
    }


def kind_of_channel(channel: ChannelAgreement) -> Kind:
    """Return display unit and number format of the errors of a channel, which are differences."""
    return Kind("", "", COMPARED[channel.channel].quantity)


_OF_CHANNEL = (
    *("unit", "rms", "noise", "passes", "full_range", "variation"),
    *("rms_unaligned", "bias", "largest", "largest_time"),
)
"""Errors of a channel that its data has under the names of the fields."""


def _recording_data(agreement: RecordingAgreement) -> dict[str, Any]:
    """Return the errors of a recording as plain data in SI."""
    return {
        **fields_of(agreement, "file", "sha256", "motion", "step", "passes"),
        **fields_of(agreement.measured, "label", "kind", "duration"),
        "samples": len(agreement.measured),
        "inputs": list(agreement.inputs),
        "delay": agreement.delay.correction,
        "delay_is_at_limit": agreement.delay.is_at_limit,
        "remarks": list(agreement.remarks),
        "channels": {
            channel.channel: {
                **fields_of(channel, *_OF_CHANNEL),
                "rms_share": channel.fraction,
                "limit_share": channel.limit,
                # In the unit that people are shown.
                "shown": {
                    "unit": kind_of_channel(channel).shown_unit,
                    "rms": display_value(channel.rms, kind_of_channel(channel).quantity),
                },
            }
            for channel in agreement.channels
        },
    }
