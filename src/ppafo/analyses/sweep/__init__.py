"""Distributions of the metrics of a study over many runs, and their dependence on the varied values."""
