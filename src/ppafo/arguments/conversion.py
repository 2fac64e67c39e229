"""Conversion of Python values to argument values; a ValueError for an unsuitable value.

Numbers, flags and texts are also accepted from NumPy. The module imports nothing that is slow to load.
"""

import math
import numbers
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from ppafo.arguments.reading import ANY, MAXIMUM_DIGITS, NUMBER, NumberRange, NumberWithUnit, point, task
from ppafo.errors import ArgumentError
from ppafo.units import SI
from ppafo.units.carried import carried
from ppafo.wording import one_line

_MAXIMUM_LEVELS = 60
"""Maximum depth of nested dictionaries and lists that are copied."""


def taken_text(value: Any) -> str:
    """Return a text that is not empty; ValueError for anything else.

    A member of a text enumeration or another subclass of str becomes its text content, not its ``str()``.
    """
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise ValueError
    return str.__str__(value)


def _scalar(value: Any) -> Any:
    """Return an array without axes as a Python value, None if masked or a time; any other value unchanged.

    Otherwise a NumPy time would count as a whole number, and a masked value as the hidden number. A number that carries
    a unit becomes the text of both, as a person writes it.
    """
    if type(value) is float or isinstance(value, NumberWithUnit):
        return value
    if (with_unit := carried(value)) is not None:
        number = _scalar(with_unit.magnitude)
        is_number = isinstance(number, numbers.Real) and not isinstance(number, bool)
        return f"{float(number)!r} {with_unit.unit}" if is_number and with_unit.unit != "1" else number
    if getattr(value, "ndim", None) != 0 or not hasattr(value, "item"):
        return value
    is_hidden = bool(getattr(value, "mask", False))
    return None if is_hidden or getattr(value.dtype, "kind", "") in "mM" else value.item()


def taken_flag(value: Any) -> bool:
    """Return True or False, also from NumPy; ValueError for anything else."""
    flag = _scalar(value)
    if not isinstance(flag, bool):
        raise ValueError
    return flag


def taken_whole(lowest: int) -> Callable[[Any], int]:
    """Return a converter of whole numbers not below ``lowest``, also from NumPy, with ValueError for others."""

    def take(value: Any) -> int:
        whole = _scalar(value)
        if (
            isinstance(whole, bool)
            or not isinstance(whole, numbers.Integral)
            or not lowest <= int(whole) < 10**MAXIMUM_DIGITS
        ):
            raise ValueError
        return int(whole)

    return take


def taken_number(allowed: NumberRange = ANY, read: Callable[[str], float] | None = None) -> Callable[[Any], float]:
    """Return a converter of finite numbers in a range, also from NumPy, or of texts converted by ``read``."""

    def take(value: Any) -> float:
        number = _scalar(value)
        if isinstance(number, str) and read is not None and not NUMBER.fullmatch(number.strip()):
            return read(taken_text(number))
        if read is not None and carried(value) is not None:
            # What carries no dimension is no number in SI: a share is one, a mass is not.
            return read(f"{number!r} 1")
        if isinstance(number, bool) or not isinstance(number, numbers.Real) or not math.isfinite(number):
            raise ValueError
        if float(number) not in allowed:
            raise ValueError
        return number if isinstance(number, NumberWithUnit) else float(number)

    return take


def taken_overrides(value: Any) -> tuple[str, ...]:
    """Return overrides as texts ``PATH=VALUE``, from one, several, or a dictionary; ValueError for anything else.

    The keys of a dictionary are paths or sections with nested dictionaries; values are texts, flags, or numbers in SI
    units.
    """
    if isinstance(value, Mapping):
        return tuple(_overrides_of(value, ""))
    texts = (value,) if isinstance(value, str) else value
    # Iterating over a table of pandas yields the names of its columns.
    if isinstance(texts, bytes) or hasattr(texts, "keys") or not isinstance(texts, Iterable):
        raise ValueError
    return tuple(taken_text(text) for text in texts)


def _overrides_of(table: Mapping[Any, Any], section: str) -> Iterator[str]:
    for name, value in table.items():
        path, scalar = f"{section}{taken_text(name)}", _scalar(value)
        if isinstance(scalar, Mapping):
            yield from _overrides_of(scalar, f"{path}.")
        elif isinstance(scalar, bool):
            yield f"{path}={str(scalar).lower()}"
        elif isinstance(scalar, numbers.Integral):
            yield f"{path}={int(scalar)} {SI}"
        elif isinstance(scalar, numbers.Real) and math.isfinite(scalar):
            yield f"{path}={float(scalar)!r} {SI}"
        elif isinstance(scalar, str) and scalar.strip():
            yield f"{path}={taken_text(scalar)}"
        else:
            # A pair of number and unit is to be written as one text.
            is_pair = isinstance(scalar, list | tuple) and len(scalar) == 2 and isinstance(scalar[1], str)
            example = f"'{scalar[0]} {scalar[1]}'" if is_pair else "'12.6 mm^2'"
            requirement = f"must be a finite number in SI units, True, False or a text such as {example}"
            raise ArgumentError(f"{path} = {one_line(repr(value))}: {requirement}")


def taken_document(value: Any) -> dict[str, Any]:
    """Return a copy of nested dictionaries as the plain data of a file; ValueError for anything but a dictionary.

    Accepts mappings of any class, lists, iterators, texts and numbers, also from NumPy. Raises ArgumentError for None.
    """
    if not isinstance(value, Mapping):
        raise ValueError
    copies: dict[int, tuple[Any, Any]] = {}
    return {taken_text(name): _plain(item, str(name), 1, copies) for name, item in value.items()}


def _plain(value: Any, path: str, level: int, copies: dict[int, tuple[Any, Any]]) -> Any:
    """Return a value as plain data; ``copies`` has each container copied so far with its copy, by identity."""
    # A container that occurs several times is copied once, and one that contains itself has a copy that does too. The
    # container is kept with its copy, so that no other object gets its identity.
    if id(value) in copies:
        return copies[id(value)][1]
    scalar = _scalar(value)
    if scalar is None:
        raise ArgumentError(f"{path} = {one_line(repr(value))}: has no value; omit the key for the default")
    # Values nested deeper than in any file are refused by the check of the document.
    if isinstance(scalar, bytes) or level > _MAXIMUM_LEVELS:
        return scalar
    if isinstance(scalar, str):
        return str.__str__(scalar)
    if isinstance(scalar, Mapping):
        table: dict[str, Any] = {}
        copies[id(value)] = value, table
        table.update(
            (taken_text(name), _plain(item, f"{path}.{name}", level + 1, copies)) for name, item in scalar.items()
        )
        return table
    if isinstance(scalar, Iterable) and not hasattr(scalar, "keys"):
        items: list[Any] = []
        copies[id(value)] = value, items
        items.extend(_plain(item, f"{path}[{index}]", level + 1, copies) for index, item in enumerate(scalar))
        return items
    return scalar


def taken_tasks(value: Any) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return pairs of a name and overrides, from a dictionary, pairs or texts; ValueError for anything else."""
    if isinstance(value, Mapping):
        pairs: Iterable[Any] = value.items()
    else:
        items = (value,) if isinstance(value, str) else value
        pairs = [task(item) if isinstance(item, str) else item for item in items]
    return tuple((taken_text(name), taken_overrides(overrides)) for name, overrides in pairs)


def taken_point(value: Any) -> float | str:
    """Return a time [s] from a number or a text with its unit, or ``equilibrium``; ValueError for anything else."""
    if isinstance(value, str) and not NUMBER.fullmatch(value.strip()):
        return point(value)
    return taken_number()(value)
