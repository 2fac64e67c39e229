"""What a bench procedure returns: estimates, checks of the residuals, and what to draw."""

import math
from dataclasses import dataclass

from ppafo.identification.bench.picture import Panel
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.signals import RecordingKind

IDENTIFIED_WITHIN = 0.25
"""Half width over value up to which a value is called identified."""

WEAK_WITHIN = 1.0
"""Half width over value from which the interval reaches zero: such a value is not identifiable."""


@dataclass(frozen=True, slots=True)
class BenchResult:
    """Result of one procedure. ``kind`` is that of its recordings; figures say so where nobody measured them.

    ``checks`` can fail; ``remarks`` are what else is to be known, and nothing is tested by them.
    """

    procedure: str
    summary: str
    estimates: tuple[Estimate, ...]
    checks: tuple[Check, ...]
    panels: tuple[Panel, ...]
    kind: RecordingKind
    remarks: tuple[str, ...] = ()

    def __getitem__(self, path: str) -> Estimate:
        """Return the estimate at a path; KeyError where the procedure gave none."""
        for estimate in self.estimates:
            if estimate.path == path:
                return estimate
        raise KeyError(path)

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that did not hold."""
        return tuple(check for check in self.checks if not check.holds)


def verdict_of(value: float, low: float, high: float, scale: float | None = None, is_capped: bool = False) -> Verdict:
    """Return what an interval says of a value; ``scale`` stands in for a value that may well be zero.

    ``is_capped`` says that the model does not explain the recordings, so that the value belongs to this model only.
    """
    size = abs(value) if scale is None else scale
    half_width = (high - low) / 2.0
    if not math.isfinite(half_width) or half_width >= WEAK_WITHIN * size:
        return "not identifiable"
    if half_width > IDENTIFIED_WITHIN * size:
        return "weak"
    return "holds for this model only" if is_capped else "identified"


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, ``1 decay`` or ``3 decays``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
