"""Valves: openings between chambers, source and atmosphere as functions of a command."""
