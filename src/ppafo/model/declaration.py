"""Declaration of a component: parameters with name, unit, range and meaning, and laws as plain functions.

A parameter is declared once, as a field of a frozen dataclass or of a NamedTuple:
"""

import collections
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from types import CodeType
from typing import Annotated, Any, NamedTuple, Protocol, get_args, get_origin, get_type_hints


@dataclass(frozen=True, slots=True)
class Quantity:
    """Declared parameter of a component: default and range in the SI ``unit``, ``summary`` its meaning."""

    name: str
    unit: str
    summary: str
    default: float | None = None
    """Default value; None if a value must be given."""
    minimum: float = -math.inf
    maximum: float = math.inf
    minimum_allowed: bool = True
    """False if the value must be above ``minimum``."""
    follows: "PlainFunction | str" = ""
    """Source of the default: a rule of a loop in ``control``, or the name of a number that a law believes."""
    words: tuple[str, ...] = ()
    """Words that a file may have in place of the number."""
    optional: bool = False
    """True if a file may omit a number without a default."""
    whole: bool = False
    """True for a whole number, which a file gives bare."""
    plain: bool = False
    """True if a file gives the bare number, its unit beside it."""


Number = partial(Quantity, "")
"""Quantity declared for a field, without the name, which is the name of the field."""


@cache
def quantities_of(section: type) -> tuple[Quantity, ...]:
    """Return the quantities that a dataclass or a NamedTuple declares, with nested NamedTuples flattened.

    Quantities are in the order of the fields; fields without a ``Number`` are omitted.
    """
    quantities: list[Quantity] = []
    for name, hint in get_type_hints(section, include_extras=True).items():
        if isinstance(hint, type) and issubclass(hint, tuple):
            quantities += quantities_of(hint)
        elif (number := number_of(hint)) is not None:
            quantities.append(replace(number, name=name))
    return tuple(quantities)


def row_with(name: str, row: Any, **hints: Any) -> Any:
    """Return a NamedTuple class like ``row`` with other types for the named fields; new fields are appended."""
    namedtuple: Any = collections.namedtuple
    annotations = {**row.__annotations__, **hints}
    made = namedtuple(name, annotations, module=row.__module__)
    made.__annotations__ = annotations
    return made


def number_of(hint: Any) -> Quantity | None:
    """Return the quantity declared by the type of a field, None if the type declares none."""
    declared = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((item for item in declared if isinstance(item, Quantity)), None)


class EmptyRow(NamedTuple):
    """Row without numbers, for a component without settings or without state."""


class PlainFunction(Protocol):
    """Function made by ``def``, with any parameters; its source, its code and its global names are read.

    Partial functions, methods and callable objects are not plain functions.
    """

    __name__: str
    __qualname__: str
    __module__: str
    __code__: CodeType

    @property
    def __globals__(self) -> Mapping[str, Any]:
        """Global names of the module."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the function."""

    def __hash__(self) -> int:
        """Hash by identity: compiled results are cached for each function object."""
