"""Experiments on the rig, one module for each kind of bench."""
