"""Verdict on reference tracking: the rule, the causes, and the remedies that were tried."""

from ppafo.simulation.tracking.rule import REVERSALS, most_reversals
from ppafo.simulation.tracking.verdict import Tracking, tracking_in

__all__ = ["REVERSALS", "Tracking", "most_reversals", "tracking_in"]
