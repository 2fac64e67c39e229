"""Recordings: measured and simulated alike, time and named channels with units, never changed once made."""

from ppafo.signals.recording import CHANNELS, Channel, ChannelKind, Recording, RecordingKind, recording_kind

__all__ = ["CHANNELS", "Channel", "ChannelKind", "Recording", "RecordingKind", "recording_kind"]
