"""Design of a device for a torque profile."""
