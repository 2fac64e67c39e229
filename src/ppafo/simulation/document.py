"""Document of a scenario: what it came with, values by dotted path, conversion of a text with its unit to SI."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.faults import line_of
from ppafo.documents.toml_text import quote
from ppafo.errors import Faults, PpafoError, ScenarioError, UnitError
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.parameters import ParameterSet
from ppafo.parameters.declared import number_in, value_at
from ppafo.parameters.overrides import Override
from ppafo.units import SI
from ppafo.wording import one_line

REFERENCE_OF = "reference.of"
"""Path of the name of the controlled quantity, one of ``CONTROLLED``."""


def controlled_in(document: Mapping[str, Any]) -> str:
    """Return the controlled quantity of a document's reference: a torque by default, and also for an unknown word."""
    name = value_at(document, REFERENCE_OF)
    return name if isinstance(name, str) and name in CONTROLLED else TORQUE


@dataclass(frozen=True, slots=True)
class DocumentReader:
    """Document of a scenario, with what it came with and what overrides made of it.

    ``file`` is its name in messages, ``text`` the text of the file, for the lines in messages, ``path`` the file, if
    there is one, ``folder`` the folder from which relative paths start. ``parameter_set`` replaces the parameter set
    that the document names. After ``override_document``: ``content`` is the document as given, ``overridden`` are the
    paths set by overrides, ``device`` the overrides of the device, not yet applied, ``kept`` is a sentence on the
    numbers that a newly chosen ``kind`` keeps, else "", and ``wrong`` are the refusals of overrides.
    """

    file: str
    document: Mapping[str, Any]
    overridden: frozenset[str] = frozenset()
    text: str = ""
    path: str | None = None
    folder: Path = Path()
    overrides: tuple[Override, ...] = ()
    parameter_set: ParameterSet | None = None
    content: Mapping[str, Any] = field(default_factory=dict)
    device: tuple[Override, ...] = ()
    kept: str = ""
    wrong: tuple[PpafoError, ...] = ()

    def quote(self, path: str) -> str:
        """Return file, key and value as given."""
        if path in self.overridden:
            return f"{self.file}: override {path}={self.written(path)}"
        return f"{self.file}: {line_of(self.text, path)}{path} = {quote(value_at(self.document, path))}"

    def written(self, path: str) -> str:
        """Return the value at a path as given."""
        return one_line(value_at(self.document, path)).removesuffix(f" {SI}")

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
        try:
            return number_in(value, quantity, atmosphere)
        except UnitError as error:
            # The controlled quantity decides the unit of a level of the reference, and of a gain.
            controlled = controlled_in(self.document)
            is_of = path.startswith("reference.") or (path.startswith("controller.") and controlled != TORQUE)
            of = f"; {REFERENCE_OF} is {controlled!r}" if is_of and "does not fit" in str(error) else ""
            raise self.refusal(path, f"{error}{of}") from error

    def section(
        self, section: str, quantities: tuple[Quantity, ...], atmosphere: float = STANDARD_ATMOSPHERE
    ) -> dict[str, float]:
        """Return all values of a section by name, in SI; gauge pressures refer to ``atmosphere`` [Pa absolute]."""
        values = {}
        wrong = Faults()
        for quantity in quantities:
            with wrong:
                values[quantity.name] = self.number(f"{section}.{quantity.name}", quantity, atmosphere)
        wrong.raise_all()
        return values
