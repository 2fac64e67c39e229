"""A question that what is left unexplained answers: is this good enough to be believed?"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """A question that the residuals answer: its name, whether the answer is good, and the answer in words."""

    name: str
    holds: bool
    statement: str
