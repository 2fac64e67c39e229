"""Search for the lowest or highest value that meets a condition on a metric."""
