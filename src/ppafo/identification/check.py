"""Questions about a fit: what can be had, asked before it; is it good enough to be believed, asked after it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """A question that the residuals answer: its name, whether the answer is good, and the answer in words."""

    name: str
    holds: bool
    statement: str


@dataclass(frozen=True, slots=True)
class Prospect:
    """What recordings can give or cannot, known before anything is fitted: its name, whether, and why in words."""

    name: str
    can_be_had: bool
    statement: str
