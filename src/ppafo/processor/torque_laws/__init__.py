"""Torque laws on whole numbers, as a small processor computes them: on/off control, with a dead zone, and PID."""
