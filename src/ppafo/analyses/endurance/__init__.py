"""Discharge of a gas bottle: duration, temperature, and the reason of the end."""
