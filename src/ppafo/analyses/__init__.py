"""Analyses beyond a single run: a folder for each, with arguments, computation and report."""
