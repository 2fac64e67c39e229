"""Design of a device for a wearer or for a torque profile."""
