"""Runs that follow a recording: clock, inputs at each step, initial state, and checks of the recording."""
