"""Smallest valve, pressure and bottle that suffice for a torque profile."""
