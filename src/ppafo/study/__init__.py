"""Runs over columns of values and results of an analysis, in one form for all analyses."""
