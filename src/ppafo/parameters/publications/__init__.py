"""Published statements on this device and similar ones, one file each, that a simulation can test."""
