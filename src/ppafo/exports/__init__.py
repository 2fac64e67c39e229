"""What leaves the package for other tools: thin layers around the translation of a program."""
