"""The paper run again: its experiments, its claims, and what its text tells."""

from ppafo.studies.reproduction.claim import Claim, Verdict
from ppafo.studies.reproduction.observation import Observation
from ppafo.studies.reproduction.study import Reproduction, reproduce

__all__ = ["Claim", "Observation", "Reproduction", "Verdict", "reproduce"]
