"""Files that people write: TOML into plain data, and what is wrong with it into one line."""
