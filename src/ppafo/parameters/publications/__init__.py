"""Publications on this device and similar ones: files of statements that a simulation can test."""
