"""What a command to a valve means: from -1 to 1 as equation (8) says, and one value for free motion."""

VENT = 2.0
"""Joins both chambers to the atmosphere: solenoids off; a proportional valve needs a dump valve for it."""

VENTS_ABOVE = 1.5
"""Commands above this vent."""
