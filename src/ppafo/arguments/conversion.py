"""Conversion of Python values to argument values; a ValueError for an unsuitable value.

Numbers, flags and texts are also accepted from NumPy. The module imports nothing that is slow to load.
"""

import contextlib
import math
import numbers
import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ppafo.arguments.reading import ANY, MAXIMUM_DIGITS, NUMBER, NumberRange, NumberWithUnit, task
from ppafo.errors import ArgumentError
from ppafo.units import SI, carried

_MAXIMUM_LEVELS = 60
"""Maximum depth of nested dictionaries and lists that are copied."""


_QUOTED = reprlib.Repr()
_QUOTED.maxstring = _QUOTED.maxother = 60


def shown(value: Any) -> str:
    """Return a value as quoted in a message: shortened, or the name of its class."""
    with contextlib.suppress(Exception):  # the class attribute of a foreign object may raise anything
        if isinstance(value, str | bytes | int | float | complex | Path | list | tuple | dict | set | None):
            return _QUOTED.repr(value)
    return f"<{type(value).__name__}>"


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
    if (with_unit := carried(value)) is not None:
        number, unit = _scalar(with_unit[0]), with_unit[1]
        is_number = isinstance(number, numbers.Real) and not isinstance(number, bool)
        return f"{float(number)!r} {unit}" if is_number and unit != "1" else number
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


def taken_whole(lowest: int) -> Callable[[Any], Any]:
    """Return a converter of whole numbers not below ``lowest``, also from NumPy, with ValueError for others."""
    return taken_number(NumberRange(lowest, highest=10**MAXIMUM_DIGITS - 1), of=int)


def taken_number(
    allowed: NumberRange = ANY, read: Callable[[str], Any] | None = None, of: type[float] = float
) -> Callable[[Any], Any]:
    """Return a converter of finite numbers in a range, also from NumPy, or of texts converted by ``read``."""
    kind: Any = numbers.Integral if of is int else numbers.Real

    def take(value: Any) -> Any:
        number = _scalar(value)
        if isinstance(number, str) and read is not None and not NUMBER.fullmatch(number.strip()):
            return read(taken_text(number))
        if read is not None and carried(value) is not None:
            # What carries no dimension is no number in SI: a share is one, a mass is not.
            return read(f"{number!r} 1")
        if isinstance(number, bool) or not isinstance(number, kind) or not math.isfinite(number):
            raise ValueError
        if of(number) not in allowed:
            raise ValueError
        return number if isinstance(number, NumberWithUnit) else of(number)

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
            requirement = "must be a finite number in SI units, True, False or a text such as '12.6 mm^2'"
            raise ArgumentError(f"{path} = {shown(value)}: {requirement}")


def taken_document(value: Any) -> Any:
    """Return a copy of nested dictionaries as the plain data of a file; ValueError for anything but a dictionary.

    Accepts mappings of any class, lists, iterators, texts and numbers, also from NumPy. Raises ArgumentError for None.
    """
    if not isinstance(value, Mapping):
        raise ValueError
    return _plain(value, "", 0, {})


def _plain(value: Any, path: str, level: int, copies: dict[int, tuple[Any, Any]]) -> Any:
    """Return a value as plain data; ``copies`` has each container copied so far with its copy, by identity."""
    # A container that occurs several times is copied once, and one that contains itself has a copy that does too. The
    # container is kept with its copy, so that no other object gets its identity.
    if id(value) in copies:
        return copies[id(value)][1]
    scalar = _scalar(value)
    if scalar is None:
        raise ArgumentError(f"{path} = {shown(value)}: has no value; omit the key for the default")
    if isinstance(scalar, str):
        return str.__str__(scalar)
    # Values nested deeper than in any file are refused by the check of the document.
    if isinstance(scalar, bytes) or level > _MAXIMUM_LEVELS or not isinstance(scalar, Iterable):
        return scalar
    if isinstance(scalar, Mapping):
        table: dict[str, Any] = {}
        copies[id(value)] = value, table
        for name, item in scalar.items():
            table[taken_text(name)] = _plain(item, f"{path}.{name}".lstrip("."), level + 1, copies)
        return table
    if hasattr(scalar, "keys"):
        return scalar
    items: list[Any] = []
    copies[id(value)] = value, items
    items += (_plain(item, f"{path}[{index}]", level + 1, copies) for index, item in enumerate(scalar))
    return items


def taken_tasks(value: Any) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return pairs of a name and overrides, from a dictionary, pairs or texts; ValueError for anything else."""
    if isinstance(value, Mapping):
        pairs: Iterable[Any] = value.items()
    else:
        items = (value,) if isinstance(value, str) else value
        pairs = [task(item) if isinstance(item, str) else item for item in items]
    return tuple((taken_text(name), taken_overrides(overrides)) for name, overrides in pairs)
