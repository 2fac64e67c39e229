"""Analyses beyond a single run: a package for each, with arguments, computation and report."""
