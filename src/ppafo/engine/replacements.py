"""Functions and classes of the model that a program replaces by those of its actuator and of its effects."""

from dataclasses import dataclass, field
from typing import Any

from ppafo.model.declaration import PlainFunction


@dataclass(slots=True)
class Replacements:
    """Replacements of functions and of NamedTuple classes in one program.

    Attributes:
        everywhere: replacement of a function, whichever function calls it
        inside: replacement of a called function in one caller, by caller and called function: a law that calls its own
            port calls what acted there before
        constructed: class that ``_replace`` constructs, by the declared class of a row
        rows: names of the rows that a replacement takes before the arguments of the function that it replaces
    """

    everywhere: dict[PlainFunction, PlainFunction] = field(default_factory=dict)
    inside: dict[tuple[PlainFunction, PlainFunction], PlainFunction] = field(default_factory=dict)
    constructed: dict[type, type] = field(default_factory=dict)
    rows: dict[PlainFunction, tuple[str, ...]] = field(default_factory=dict)

    def called(self, function: Any, caller: Any = None) -> Any:
        """Return the function that is called instead of a function, inside a caller if one is given.

        A NamedTuple class is returned as it is.
        """
        replacement = self.everywhere.get(function, function)
        return replacement if caller is None else self.inside.get((caller, function), replacement)
