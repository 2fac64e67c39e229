"""Recordings: measured and simulated alike, time and named channels with units, never changed once made."""

from ppafo.signals.channels import CHANNELS, ChannelKind
from ppafo.signals.recording import Channel, Recording, RecordingKind, recording_kind

__all__ = ["CHANNELS", "Channel", "ChannelKind", "Recording", "RecordingKind", "recording_kind"]
