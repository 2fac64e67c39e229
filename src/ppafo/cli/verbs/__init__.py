"""Verbs: one typed, documented function a command, which loads what does the work when it is called."""
