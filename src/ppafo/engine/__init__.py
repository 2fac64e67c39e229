"""Time stepping: integration scheme and compiled programs that advance many runs at once."""
