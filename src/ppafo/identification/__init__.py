"""Identification: from recordings of a device to the values of its parameters, each with interval and verdict."""

from ppafo.identification.estimate import Estimate, Verdict

__all__ = ["Estimate", "Verdict"]
