"""Actuators of our own, offered to ppafo by the entry point in pyproject.toml."""
