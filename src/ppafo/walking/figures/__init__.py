"""Figures of walks: mean stride, stick figures of the leg, gait phases, and bottle and task sequences over time."""
