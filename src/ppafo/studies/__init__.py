"""Named studies: many runs, one question, the same answer every time."""
