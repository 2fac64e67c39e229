"""Bottles of gas with their regulators: files, properties of what is in them, and the bottle in SI units."""
