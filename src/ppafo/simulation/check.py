"""Whether a run can be repeated: it runs again with less error, and with start and measurements moved a little.

A loop with coarse sensors or repeated impacts may amplify a difference that is too small to measure into other results.
Then its metrics are numerically sensitive: they hold for one run among many, and a check says so.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import plain
from ppafo.simulation.accuracy import ErrorEstimate

MOVE = 1.0e-7
"""How far a start or a measurement is moved, as a fraction of its range."""
ALLOWED_CHANGE = 1.0e-3
"""Largest change of a metric that counts as none, as a fraction of its value or of the range of its quantity."""

FINER, MOVED_START, MOVED_MEASUREMENT = "finer steps", "start moved", "measurement moved"
Shown = Callable[[float, str], tuple[float, str]]
"""A value in SI units and its unit, as people are shown them."""
_MOVES = frozenset({MOVED_START, MOVED_MEASUREMENT})


@dataclass(frozen=True, slots=True)
class NumberCheck:
    """A number in SI units and how much it changed in each repeat, by name; inf where a repeat has no such number.

    ``value`` is a metric, or the range of an angle or a pressure whose ``changes`` are the largest over time;
    ``allowed`` is the largest change that counts as none, ``allowed_error`` the largest of the run with finer steps.
    """

    name: str
    unit: str
    value: float
    allowed: float
    changes: Mapping[str, float]
    allowed_error: float

    @property
    def is_determined(self) -> bool:
        """True where no repeat changed it by more than is allowed."""
        return not self.changed_by

    @property
    def changed_by(self) -> frozenset[str]:
        """The repeats that changed it by more than is allowed."""
        return frozenset(
            name
            for name, change in self.changes.items()
            if not abs(change) <= (self.allowed_error if name == FINER else self.allowed)
        )


@dataclass(frozen=True, slots=True, repr=False)
class Check:
    """What of a run is determined: its metrics, and its angle and pressures over time.

    ``error`` is the estimated error of the run from its steps, of which the one with finer steps has a sixteenth.
    ``parts_at`` is the first time [s] at which a repeat is elsewhere by more than 1e-2 of a range, None where none is;
    ``failed`` names the repeats that diverged. Pressures are shown above ``atmosphere`` [Pa absolute].
    """

    scenario: str
    metrics: tuple[NumberCheck, ...]
    courses: tuple[NumberCheck, ...]
    error: ErrorEstimate
    parts_at: float | None
    failed: tuple[str, ...]
    atmosphere: float = STANDARD_ATMOSPHERE

    @property
    def is_determined(self) -> bool:
        """True where every repeat gave the same metrics and stayed with the run all the time."""
        return not self.failed and all(row.is_determined for row in (*self.metrics, *self.courses))

    @property
    def sentence(self) -> str:
        """What the check found, in plain words."""
        if self.is_determined:
            return (
                f"All metrics are repeatable: none changes by more than {ALLOWED_CHANGE:.0e} of its value or its "
                f"range. {self.error.sentence}"
            )
        lost = [row for row in (*self.metrics, *self.courses) if not row.is_determined]
        by_move = [row.name for row in lost if row.changed_by & _MOVES]
        by_error = [row.name for row in lost if not row.changed_by & _MOVES]
        what = " or ".join(sorted({name.split()[0] for row in lost for name in row.changed_by & _MOVES}, reverse=True))
        causes = [
            (
                by_move,
                f"a {what} moved by {MOVE:.0e} of its range, far less than anybody can measure, changes them. One run "
                f"says nothing about them; give the spread over many (ppafo sweep --statistic).",
            ),
            (
                by_error,
                "finer steps with a sixteenth of the error change them. Take a smaller run.tolerance and check again; "
                "what still changes cannot be repeated.",
            ),
            (("how it ends",) if self.failed else (), f"the run with {' and that with '.join(self.failed)} diverged."),
        ]
        found = [f"{', '.join(names)}: {cause}" for names, cause in causes if names]
        parting = [] if self.parts_at is None else [f"The runs part at t = {self.parts_at:.4g} s."]
        return " ".join([f"Numerically sensitive: {' Also: '.join(found)}", self.error.sentence, *parting])

    def __repr__(self) -> str:
        """Return the table of all changes in the units that people are shown, and the sentence."""
        from ppafo.report.display_units import metric_change, metric_level
        from ppafo.report.writing import align_columns

        names = list(self.metrics[0].changes) if self.metrics else []
        above = partial(metric_level, atmosphere=self.atmosphere)
        rows = [_cells(row, names, above, metric_change) for row in self.metrics]
        rows += [_cells(row, names, metric_change, metric_change) for row in self.courses]
        head = f"Check of '{self.scenario}': what changes in runs that should be the same"
        return "\n".join([head, *align_columns([["", "value", *names, ""], *rows]), "", self.sentence])

    def document(self) -> dict[str, Any]:
        """Return the check as data that JSON can hold, in SI units."""
        document: dict[str, Any] = plain(self)
        rows = {"metrics": self.metrics, "courses": self.courses}
        judged = {
            group: [{**plain(row), "is_determined": row.is_determined} for row in found]
            for group, found in rows.items()
        }
        return {"is_determined": self.is_determined, "sentence": self.sentence, **document, **judged}


def _cells(row: NumberCheck, names: list[str], level: Shown, change: Shown) -> list[str]:
    """The row of a number: its ``level``, each ``change`` of it, and what they come to."""
    value, unit = level(row.value, row.unit)
    changes = [f"{change(row.changes[name], row.unit)[0]:+.1e}" if row.changes[name] else "0" for name in names]
    return [row.name, f"{value:.4g} {unit}".rstrip(), *changes, "" if row.is_determined else "sensitive"]
