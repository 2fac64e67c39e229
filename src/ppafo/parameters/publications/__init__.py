"""What publications state of this device and its kin: one file each, every statement that a simulation could meet."""
