"""Runs that follow a recording: its clock, its inputs step by step, where it starts, and what is refused of it."""
