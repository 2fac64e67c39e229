"""Discharge of a gas bottle: duration, temperature, and the reason why it ends."""
