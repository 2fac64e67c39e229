"""Numbers for what a controller of walking sees and does, in lanes and recordings: phase of stride, level of help."""

SWING = 0.0
LANDING = 1.0
MID_STANCE = 2.0
PUSH_OFF = 3.0

HELPS = 0.0
LIFTS = 1.0
PAUSED = 2.0
STOPPED = 3.0
"""Level of help: in all phases, in the swing only, none until some good strides, none for good."""
