"""Sweeps and samples: a study file in, a row for every run out, in chunks that can be resumed and shared out."""
