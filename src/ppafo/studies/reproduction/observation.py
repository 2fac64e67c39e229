"""One sentence of the paper's text about its recordings, held against ours."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Observation:
    """What the text tells, whether the simulated recording shows it, and the numbers that decide it.

    ``difference`` says what the recording shows beyond the sentence, where that is not what the paper tells.
    """

    id: str
    statement: str
    holds: bool
    evidence: str
    source: str
    difference: str = ""
