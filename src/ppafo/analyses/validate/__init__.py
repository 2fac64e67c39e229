"""Validation of a parameter set: comparison of the model with recordings, channel by channel."""
