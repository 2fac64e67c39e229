"""Declaration of a component: its numbers, with name, unit, range and meaning, and its laws, plain functions.

A number is declared once, as a field of a frozen dataclass or of a NamedTuple:
``area: Annotated[float, Number("m^2", "area of the opening")]``.
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
    """None where it must be given."""
    minimum: float = -math.inf
    maximum: float = math.inf
    minimum_allowed: bool = True
    """False where it must be above ``minimum``."""
    follows: tuple[str, ...] = ()
    """Names of numbers that are added to the default: of ``control.kind``, or of a loop in ``control``."""


Number = partial(Quantity, "")
"""The quantity that is declared of a field, which has its name."""


@cache
def quantities_of(section: type) -> tuple[Quantity, ...]:
    """Return the numbers that a dataclass or a NamedTuple declares, those of nested NamedTuples in their place.

    They are in the order of its fields; a field without a ``Number`` is none.
    """
    quantities: list[Quantity] = []
    for name, hint in get_type_hints(section, include_extras=True).items():
        if isinstance(hint, type) and issubclass(hint, tuple):
            quantities += quantities_of(hint)
        elif (number := number_of(hint)) is not None:
            quantities.append(replace(number, name=name))
    return tuple(quantities)


def row_with(name: str, row: Any, **hints: Any) -> Any:
    """Return a NamedTuple class like ``row``, whose named fields have other types; new ones stand behind its own."""
    namedtuple: Any = collections.namedtuple
    annotations = {**row.__annotations__, **hints}
    made = namedtuple(name, annotations, module=row.__module__)
    made.__annotations__ = annotations
    return made


def number_of(hint: Any) -> Quantity | None:
    """Return what the type of a field declares of a number, None where it declares none."""
    declared = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((item for item in declared if isinstance(item, Quantity)), None)


def range_rule(quantity: Quantity, limits: str) -> str:
    """Return what a value out of range must be, such as "must be at least 0 m^2 (open area)"."""
    return f"must be {limits}" + (f" ({quantity.summary})" if quantity.summary else "")


class EmptyRow(NamedTuple):
    """Row without a number: settings of a component that has none, or state of one that remembers nothing."""


class PlainFunction(Protocol):
    """A function as ``def`` makes it, of whatever parameters: its source, its code and the names that it sees are read.

    A partial function, a method or an object that can be called is none.
    """

    __name__: str
    __qualname__: str
    __module__: str
    __code__: CodeType

    @property
    def __globals__(self) -> Mapping[str, Any]:
        """Names of its module."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call it as Python does."""

    def __hash__(self) -> int:
        """Every function is itself alone: what was made of it is kept by it."""
