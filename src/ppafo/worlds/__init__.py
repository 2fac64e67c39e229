"""The worlds of others: where the device is one part, and somebody else's program asks and commands."""
