"""Figures of walks: mean stride, legs over one stride, and the bottle over time."""
