"""Valves: how a command becomes openings between the chambers, the source and the atmosphere."""
