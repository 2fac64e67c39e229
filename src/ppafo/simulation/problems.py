"""Turns what pydantic found in a scenario into one line: the key, the value, what is allowed, the nearest name."""

from collections.abc import Callable, Iterable
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from ppafo.errors import nearest_name

_LONGEST_VALUE = 60
_NOT_THERE = frozenset({"missing", "union_tag_not_found"})


def is_gap(detail: ErrorDetails) -> bool:
    """Tell whether a problem is only that something is not there yet."""
    return detail["type"] in _NOT_THERE


def first_problem(details: list[ErrorDetails], model: type[BaseModel]) -> str:
    """Return one problem as a sentence, and how many more there are; a misspelt key also makes another one missing."""
    first = next((detail for detail in details if detail["type"] == "extra_forbidden"), details[0])
    keys, place = _walk(model, first["loc"])
    sentence = _SENTENCES.get(first["type"], _any_other)(".".join(keys), first, place)
    more = len(details) - 1
    return f"{sentence} (and {more} more)" if more else sentence


def shown(value: object) -> str:
    """Return a short quotation of a value on one line."""
    quoted = " ".join(repr(value).split())
    return quoted if len(quoted) <= _LONGEST_VALUE else f"{quoted[:_LONGEST_VALUE]}..."


def _walk(model: Any, location: Iterable[int | str]) -> tuple[list[str], Any]:
    """Return the keys of the file along a location, and the model that holds the last key.

    In a union of kinds pydantic puts the kind into the location, where the file has no such key.
    """
    keys: list[str] = []
    place: Any = model
    node: Any = model
    for part in location:
        kinds = _kinds(node)
        if kinds:
            node = kinds.get(str(part))
            continue
        place = node
        keys.append(" ".join(str(part).split()))
        node = _below(node, str(part))
    return keys, place


def _kinds(node: Any) -> dict[str, Any]:
    """Return the members of a union of kinds by kind, nothing for any other type."""
    union = get_args(node)[0] if get_origin(node) is Annotated else node
    models = [item for item in get_args(union) if isinstance(item, type) and issubclass(item, BaseModel)]
    return {get_args(item.model_fields["kind"].annotation)[0]: item for item in models}


def _below(node: Any, part: str) -> Any:
    if isinstance(node, type) and issubclass(node, BaseModel):
        field = node.model_fields.get(part)
        return None if field is None else field.annotation
    return None


def _unknown_key(path: str, _detail: ErrorDetails, place: Any) -> str:
    allowed = list(place.model_fields)
    hint = nearest_name(path.rpartition(".")[2], allowed)
    return f"unknown key '{path}'{hint}; allowed here: {', '.join(allowed)}"


def _missing(path: str, _detail: ErrorDetails, _place: Any) -> str:
    return f"'{path}' is missing"


def _unknown_choice(path: str, detail: ErrorDetails, _place: Any) -> str:
    return f"{path} = {shown(detail['input'])} is not allowed; allowed: {detail['ctx']['expected']}"


def _unknown_kind(path: str, detail: ErrorDetails, _place: Any) -> str:
    allowed = [name.strip(" '") for name in detail["ctx"]["expected_tags"].split(",")]
    hint = nearest_name(str(detail["ctx"]["tag"]), allowed)
    return f"{path}.kind = {shown(detail['ctx']['tag'])} is not known{hint}; allowed: {', '.join(allowed)}"


def _no_kind(path: str, _detail: ErrorDetails, _place: Any) -> str:
    return f"'{path}.kind' is missing"


def _not_a_table(path: str, detail: ErrorDetails, _place: Any) -> str:
    return f"{path} = {shown(detail['input'])} must be a table, [{path}]"


def _not_a_text(path: str, detail: ErrorDetails, _place: Any) -> str:
    return f"{path} = {shown(detail['input'])} must be a text in quotation marks"


def _not_a_name(path: str, detail: ErrorDetails, _place: Any) -> str:
    return f"{path} = {shown(detail['input'])} must consist of small letters, digits, '-' and '_'"


def _any_other(path: str, detail: ErrorDetails, _place: Any) -> str:
    message = detail["msg"].removeprefix("Input should be ").removeprefix("String should ")
    return f"{path} = {shown(detail['input'])}: must be {message}"


_SENTENCES: dict[str, Callable[[str, ErrorDetails, Any], str]] = {
    "extra_forbidden": _unknown_key,
    "missing": _missing,
    "literal_error": _unknown_choice,
    "union_tag_invalid": _unknown_kind,
    "union_tag_not_found": _no_kind,
    "model_type": _not_a_table,
    "model_attributes_type": _not_a_table,
    "dict_type": _not_a_table,
    "string_type": _not_a_text,
    "string_pattern_mismatch": _not_a_name,
}
