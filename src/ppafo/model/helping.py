"""Codes of a walking controller in state and recordings: phase of the stride."""

SWING = 0.0
LANDING = 1.0
MID_STANCE = 2.0
PUSH_OFF = 3.0
