"""Codes of a walking controller in state and recordings: phase of the stride, assistance level."""

SWING = 0.0
LANDING = 1.0
MID_STANCE = 2.0
PUSH_OFF = 3.0

HELPS = 0.0
LIFTS = 1.0
PAUSED = 2.0
STOPPED = 3.0
"""Assistance levels: in all phases, in the swing only, paused until some good strides, permanently stopped."""
