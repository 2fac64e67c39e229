"""Runs over columns of values, and what an analysis found: one form for all of them."""
