"""Figures of walks: mean stride, stick figures of the leg, gait phases, and the whole walk over time."""
