"""Document of a scenario: request to build from it, values by dotted path, conversion of a text with its unit to SI."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.problems import quote
from ppafo.errors import PpafoError, ScenarioError, UnitError, noted_in, raise_noted
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.parameters import ParameterSet
from ppafo.parameters.declaration import is_within, range_rule
from ppafo.parameters.overrides import Override
from ppafo.units import format_quantity, parse_quantity, split_quantity
from ppafo.units.shown import shown_unit
from ppafo.wording import one_line

PLAIN = ("", "1")
"""Units of a plain number."""
REFERENCE_OF = "reference.of"
"""Path of the name of the controlled quantity, one of ``CONTROLLED``."""


def kind_at(document: Mapping[str, Any], section: str) -> str:
    """Return the value of ``kind`` in a section; "" if the section has no ``kind``."""
    kind = value_at(document, f"{section}.kind")
    # Anything but a text is refused by the layout, with its place.
    return kind if isinstance(kind, str) else ""


def value_at(document: Mapping[str, Any], path: str) -> Any:
    """Return the value of a document at a dotted path; None if there is none."""
    node: Any = document
    for part in path.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    return node


def controlled_in(document: Mapping[str, Any]) -> str:
    """Return the controlled quantity of a document's reference: a torque by default, and also for an unknown word."""
    name = value_at(document, REFERENCE_OF)
    return name if isinstance(name, str) and name in CONTROLLED else TORQUE


@dataclass(frozen=True, slots=True)
class ScenarioRequest:
    """Request to build a scenario.

    ``file`` is the name of the scenario in messages, ``path`` the file, if there is one, ``folder`` the folder from
    which relative paths start, and ``content`` the document as given. ``parameter_set`` replaces the parameter set that
    the document names. ``instead`` maps a path in the document to the name of another file; relative names in
    ``instead`` start from the working folder.
    """

    file: str
    path: str | None
    folder: Path
    content: dict[str, Any]
    overrides: tuple[Override, ...]
    parameter_set: ParameterSet | None = None
    instead: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DocumentReader:
    """Document with its name in messages, ``file``; ``overridden`` are the paths set by overrides."""

    file: str
    document: Mapping[str, Any]
    overridden: frozenset[str] = frozenset()

    def quote(self, path: str) -> str:
        """Return file, key and value as given."""
        value = value_at(self.document, path)
        if path in self.overridden:
            return f"{self.file}: override {path}={one_line(value)}"
        return f"{self.file}: {path} = {quote(value)}"

    def refusal(self, path: str, reason: str) -> ScenarioError:
        """Return the error for an unusable value at a path, with the reason."""
        return ScenarioError(f"{self.quote(path)}: {reason}")

    def number(self, path: str, quantity: Quantity, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
        """Return the value at a path in the quantity's SI unit; its default if the document gives none.

        Raises ScenarioError if the value is not a number, has a wrong unit or is out of range.
        """
        value = value_at(self.document, path)
        if value is None:
            if quantity.default is None:
                raise ScenarioError(f"{self.file}: '{path}' is missing: {quantity.summary or quantity.name}")
            return quantity.default
        # True and false are whole numbers to Python.
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.refusal(path, f"must be {_form(quantity, 1.0)}")
        try:
            result = parse_quantity(value, quantity.unit, atmosphere) if isinstance(value, str) else float(value)
        # A whole number of a file may be larger than any float.
        except (UnitError, OverflowError) as error:
            # What decides the unit of a level of the reference or of a gain.
            controlled = controlled_in(self.document)
            followed = CONTROLLED[controlled]
            is_level = path.startswith("reference.") and quantity.unit in (followed.level.unit, followed.difference)
            is_gain = path.startswith("controller.") and controlled != TORQUE and followed.plain_unit in quantity.unit
            of_what = f"; {REFERENCE_OF} is '{controlled}'" if is_level or is_gain else ""
            raise self.refusal(path, f"{error}{of_what}") from error
        if not isinstance(value, str) and not math.isfinite(result):
            raise self.refusal(path, "is not a finite number")
        if not isinstance(value, str) and quantity.unit not in PLAIN:
            raise self.refusal(path, f"a number without a unit; must be {_form(quantity, result)}")
        if not is_within(result, quantity):
            given = split_quantity(value)[1] if isinstance(value, str) else quantity.unit
            raise self.refusal(path, range_rule(quantity, given))
        return result

    def section(
        self, section: str, quantities: tuple[Quantity, ...], atmosphere: float = STANDARD_ATMOSPHERE
    ) -> dict[str, float]:
        """Return all values of a section by name, in SI; gauge pressures refer to ``atmosphere`` [Pa absolute]."""
        values, wrong = dict[str, float](), list[PpafoError]()
        for quantity in quantities:
            with noted_in(wrong):
                values[quantity.name] = self.number(f"{section}.{quantity.name}", quantity, atmosphere)
        raise_noted(wrong)
        return values


def _form(quantity: Quantity, number: float) -> str:
    if quantity.unit in PLAIN:
        return "a number"
    return f"a text with its unit, for example '{format_quantity(number, shown_unit(quantity.unit))}'"
