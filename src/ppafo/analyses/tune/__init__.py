"""Which gains are best? A search over bounds, for a weighted objective with constraints, robust where requested."""
