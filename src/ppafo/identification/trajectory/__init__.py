"""Trajectory fit: any parameters of a device from any recordings of its motion, with intervals and verdicts."""
