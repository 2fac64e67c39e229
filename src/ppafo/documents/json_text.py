"""Plain data as JSON, in the one form that files and ``--json`` have, and back; data from elsewhere has a limit."""

import json
from collections.abc import Mapping
from typing import Any

MAXIMUM_LEVELS = 50
"""No file of ours has a fifth of it; whoever goes through a document by calls of calls must come to an end."""


def json_text(document: Mapping[str, Any]) -> str:
    """Return the document as indented JSON without a final line break; ValueError for a number that is not finite.

    A file name that is not UTF-8 is written by escapes, which give the same name when they are read.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def json_document(content: bytes) -> Any:
    """Return what JSON in UTF-8 says, as plain data; ValueError where it is none, or nested too deeply."""
    try:
        document = json.loads(content.decode("utf-8"))
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    if is_nested_too_deeply(document):
        raise ValueError(f"nested deeper than {MAXIMUM_LEVELS} levels")
    return document


def is_nested_too_deeply(document: Any) -> bool:
    """Tell whether tables and lists lie in each other more than ``MAXIMUM_LEVELS`` deep, or in themselves."""
    level: list[Any] = [document]
    for _ in range(MAXIMUM_LEVELS + 1):
        level = [item for item in level if isinstance(item, Mapping | list | tuple)]
        if not level:
            return False
        inside = (item for table in level for item in (table.values() if isinstance(table, Mapping) else table))
        level = list({id(item): item for item in inside}.values())
    return any(isinstance(item, Mapping | list | tuple) for item in level)
