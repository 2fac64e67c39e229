"""Simulation of a scenario: the experiment, the run, and its result."""
