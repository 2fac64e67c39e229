"""What an audit says: one contradiction or remark, with the values and the numbers on both sides."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal

Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True, slots=True)
class NamedValue:
    """A value of the set that a finding rests on, as it was given."""

    path: str
    value: float | str
    unit: str
    origin: str


@dataclass(frozen=True, slots=True)
class Side:
    """One of the numbers that are compared; SI units, pressures absolute."""

    label: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class Finding:
    """A contradiction (error), something to know before trusting a result (warning), or a check that holds (note).

    ``paragraph`` says in words what was compared and what would reconcile it. ``accepted`` is the reason why the
    author of the set keeps a contradiction; it lowers an error to a warning and is empty otherwise.
    """

    id: str
    severity: Severity
    title: str
    values: tuple[NamedValue, ...]
    sides: tuple[Side, ...]
    paragraph: str
    accepted: str = ""

    def document(self) -> dict[str, Any]:
        """Return the finding as plain data for JSON, which knows no infinite numbers: those become null."""
        plain = asdict(self)
        for side in plain["sides"]:
            side["value"] = side["value"] if math.isfinite(side["value"]) else None
        return plain
