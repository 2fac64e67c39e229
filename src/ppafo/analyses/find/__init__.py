"""Search for the lowest or highest value of a setting at which a condition on a metric holds."""
