"""Paired comparison of configurations: difference of each metric with its interval, and the best configuration."""
