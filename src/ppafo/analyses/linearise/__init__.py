"""Linear model of a scenario's plant at an operating point: A, B, C and D with names and units."""
