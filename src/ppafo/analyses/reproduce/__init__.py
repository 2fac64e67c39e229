"""Reproduction of the paper's experiments and of other publications: verdict on each claim."""
