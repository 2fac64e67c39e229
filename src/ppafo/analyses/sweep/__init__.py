"""Distributions of a study's metrics over many runs, and their dependence on the varied values."""
