"""Files written by users: TOML parsed to plain data, and faults as one-line messages."""
