"""Recordings: measured and simulated alike, time and named channels with units, never changed once made."""

from ppafo.signals.channels import CHANNELS, ChannelKind
from ppafo.signals.recording import Channel, Recording

__all__ = ["CHANNELS", "Channel", "ChannelKind", "Recording"]
