"""Identification of a device from bench recordings: estimates, intervals and verdicts."""
