"""Validation of the model against recordings: replay, then comparison channel by channel, in units and in percent."""

from ppafo.validation.agreement import ChannelAgreement, RecordingAgreement, ReplaySettings, compare_recording
from ppafo.validation.compared import Thresholds, parse_thresholds

__all__ = [
    "ChannelAgreement",
    "RecordingAgreement",
    "ReplaySettings",
    "Thresholds",
    "compare_recording",
    "parse_thresholds",
]
