"""Identification of device parameters from recordings, each with a confidence interval and a verdict."""
