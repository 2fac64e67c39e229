"""User-written files: TOML to plain data, and one-line messages on faults."""
