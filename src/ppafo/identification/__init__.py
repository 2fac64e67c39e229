"""Identification of device parameters from recordings, each with a confidence interval and a verdict."""

from ppafo.identification.estimate import Estimate, Verdict

__all__ = ["Estimate", "Verdict"]
