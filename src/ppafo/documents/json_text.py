"""JSON text of plain data, for files and ``--json``, and parsing with a limit on nesting."""

import contextlib
import dataclasses
import json
import math
import numbers
from collections.abc import Mapping
from typing import Any

MAXIMUM_LEVELS = 50
"""Maximum nesting depth, five times the depth of any file of the package; it bounds recursion over documents."""


def json_text(document: Mapping[str, Any]) -> str:
    """Format a document as indented JSON without final line break. Raises ValueError for a non-finite number.

    Bytes of a file name that are not UTF-8 are escaped and restored on reading.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def plain(value: Any) -> Any:
    """Convert a value to dicts, lists, texts and finite numbers; infinity to None, a controller to its type name.

    A result that has a method ``json_document()`` is what it returns.
    """
    if hasattr(type(value), "json_document"):
        return value.json_document()
    if hasattr(type(value), "tolist"):  # arrays of NumPy, and their numbers
        value = value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        # Links are no part of what is run: what is not compared is not shown.
        shown = {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value) if field.compare}
        if hasattr(type(value), "__getattr__"):  # then their numbers are its own attributes
            for inner in ("orifice", "settings"):
                shown |= shown.pop(inner, {})
        return shown
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, tuple | list):
        return [plain(inner) for inner in value]
    # Before whole numbers, which True and False are in Python.
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        return float(value) if math.isfinite(value) else None
    return f"{type(value).__module__}.{type(value).__qualname__}"


def fields_of(value: object, *names: str) -> dict[str, Any]:
    """Return attributes of an object by name."""
    return {name: getattr(value, name) for name in names}


def json_document(content: bytes) -> Any:
    """Parse JSON text in UTF-8. Raises ValueError for invalid or too deeply nested text."""
    with contextlib.suppress(RecursionError):
        document = json.loads(content.decode("utf-8"))
        if not is_nested_too_deeply(document):
            return document
    raise ValueError(f"nested deeper than {MAXIMUM_LEVELS} levels")


def is_nested_too_deeply(document: Any) -> bool:
    """Return True if tables and lists are nested deeper than ``MAXIMUM_LEVELS``, or contain themselves."""
    level: list[Any] = [document]
    for _ in range(MAXIMUM_LEVELS + 1):
        tables = [value for value in level if isinstance(value, Mapping | list | tuple)]
        if not tables:
            return False
        inside = (value for table in tables for value in (table.values() if isinstance(table, Mapping) else table))
        level = list({id(value): value for value in inside}.values())
    return any(isinstance(value, Mapping | list | tuple) for value in level)
