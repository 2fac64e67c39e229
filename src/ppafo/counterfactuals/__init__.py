"""Counterfactuals: further runs of a scenario that fails, each with a change, as its causes and remedies."""

from ppafo.counterfactuals.verdict import verdict_of

__all__ = ["verdict_of"]
