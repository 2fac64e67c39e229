"""Statements of publications on this device and its kin, one file each: all that a simulation could meet."""
