"""Is the model good enough? Replays what was recorded and compares, channel by channel, in units and in percent."""

from ppafo.validation.agreement import ChannelAgreement, RecordingAgreement
from ppafo.validation.thresholds import Thresholds, parse_thresholds
from ppafo.validation.validate import ReplaySettings, Validation, compare_recording, validate

__all__ = [
    "ChannelAgreement",
    "RecordingAgreement",
    "ReplaySettings",
    "Thresholds",
    "Validation",
    "compare_recording",
    "parse_thresholds",
    "validate",
]
