"""Figures of walks: the mean stride, the leg and the phases, and the whole walk over time."""
