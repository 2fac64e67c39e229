"""Sampled controllers and the profiles they follow. Pure functions: state in, command and state out."""
