"""Torque laws in integer arithmetic for a small processor: on/off control, dead zone, and PID."""
