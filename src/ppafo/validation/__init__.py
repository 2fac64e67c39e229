"""Validation of the model against recordings: replay, then errors channel by channel, in units and in percent."""
