"""Reproduction of the paper's experiments and of other publications, with a verdict on each claim."""
