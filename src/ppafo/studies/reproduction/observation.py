"""One sentence of the paper's text about its recordings, held against ours."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Observation:
    """What the text tells, whether the simulated recording shows it, and the numbers that decide it."""

    id: str
    statement: str
    holds: bool
    evidence: str
    source: str
