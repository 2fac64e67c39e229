"""The valve, pressure and bottle that are just enough for a torque profile."""
