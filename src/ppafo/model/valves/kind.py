"""What a valve declares of itself."""

from dataclasses import dataclass

from ppafo.model.declaration import Quantity


@dataclass(frozen=True, slots=True)
class ValveKind:
    """A valve as the catalogue knows it: name, what it is, and its parameters beside the orifice's own."""

    name: str
    summary: str
    quantities: tuple[Quantity, ...]
