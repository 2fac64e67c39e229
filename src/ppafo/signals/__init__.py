"""Recordings, measured or simulated: time and named channels with units, immutable."""

from ppafo.signals.recording import CHANNELS, Channel, ChannelKind, Recording, RecordingKind, recording_kind

__all__ = ["CHANNELS", "Channel", "ChannelKind", "Recording", "RecordingKind", "recording_kind"]
