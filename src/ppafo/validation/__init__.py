"""Validation of the model against recordings: replay, then errors channel by channel, in units and in percent."""

from ppafo.validation.agreement import ChannelAgreement, RecordingAgreement, compare_recording
from ppafo.validation.settings import ReplaySettings, parse_thresholds

__all__ = ["ChannelAgreement", "RecordingAgreement", "ReplaySettings", "compare_recording", "parse_thresholds"]
