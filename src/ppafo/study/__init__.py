"""Ensemble runs and stored results of studies, shared by all analyses."""
