"""Torque laws in integer arithmetic: on/off control, dead zone, and PID."""
