"""Tuning of gains: bounded search for a weighted objective with constraints, robust if requested."""
