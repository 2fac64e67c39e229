"""Turns what pydantic found into one line: the key, the value, what is allowed, the nearest name."""

from collections.abc import Callable, Iterable
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from ppafo.errors import nearest_name

_LONGEST_VALUE = 60


def first_problem(error: ValidationError, model: type[BaseModel]) -> str:
    """Return one problem as a sentence, and how many more there are; a misspelt key also makes another one missing."""
    details = error.errors(include_url=False)
    first = next((detail for detail in details if detail["type"] == "extra_forbidden"), details[0])
    keys, place = _walk(model, first["loc"])
    sentence = _SENTENCES.get(first["type"], _any_other)(".".join(keys), first, place)
    more = len(details) - 1
    return f"{sentence} (and {more} more)" if more else sentence


def _walk(model: Any, location: Iterable[int | str]) -> tuple[list[str], Any]:
    """Return the keys of the file along a location, and the model that holds the last key."""
    keys: list[str] = []
    place: Any = model
    node: Any = model
    for part in location:
        if get_origin(node) is Annotated:
            node = _by_tag(node, part)
            continue
        place = node
        keys.append(str(part))
        node = _below(node, part)
    return keys, place


def _below(node: Any, part: int | str) -> Any:
    if isinstance(node, type) and issubclass(node, BaseModel):
        field = node.model_fields.get(str(part))
        return None if field is None else field.annotation
    arguments = get_args(node)
    return arguments[-1] if arguments else None


def _by_tag(union: Any, tag: int | str) -> Any:
    """Return the member of a tagged union; pydantic puts the tag into the location, the file has no such key."""
    members = get_args(get_args(union)[0]) or (get_args(union)[0],)
    return next((member for member in members if get_args(member.model_fields["kind"].annotation) == (tag,)), None)


def _unknown_key(path: str, _detail: Any, place: Any) -> str:
    allowed = list(place.model_fields)
    hint = nearest_name(path.rpartition(".")[2], allowed)
    return f"unknown key '{path}'{hint}; allowed here: {', '.join(allowed)}"


def _missing(path: str, _detail: Any, _place: Any) -> str:
    return f"'{path}' is missing"


def _unknown_choice(path: str, detail: Any, _place: Any) -> str:
    allowed = [part.strip(" '") for part in detail["ctx"]["expected"].replace(" or ", ",").split(",")]
    hint = nearest_name(str(detail["input"]), allowed)
    return f"{path} = {_shown(detail['input'])} is not allowed{hint}; allowed: {', '.join(allowed)}"


def _unknown_kind(path: str, detail: Any, _place: Any) -> str:
    allowed = [name.strip(" '") for name in detail["ctx"]["expected_tags"].split(",")]
    hint = nearest_name(str(detail["ctx"]["tag"]), allowed)
    return f"{path}.kind = {_shown(detail['ctx']['tag'])} is not known{hint}; allowed: {', '.join(allowed)}"


def _no_kind(path: str, _detail: Any, _place: Any) -> str:
    return f"'{path}.kind' is missing"


def _not_a_table(path: str, detail: Any, _place: Any) -> str:
    return f"{path} = {_shown(detail['input'])} must be a table, for a value with the keys value, unit, origin, source"


def _any_other(path: str, detail: Any, _place: Any) -> str:
    message = detail["msg"].removeprefix("Input should be ").removeprefix("String should ")
    return f"{path} = {_shown(detail['input'])}: must be {message}"


def _shown(value: object) -> str:
    quoted = " ".join(repr(value).split())
    return quoted if len(quoted) <= _LONGEST_VALUE else f"{quoted[:_LONGEST_VALUE]}..."


_SENTENCES: dict[str, Callable[[str, Any, Any], str]] = {
    "extra_forbidden": _unknown_key,
    "missing": _missing,
    "literal_error": _unknown_choice,
    "union_tag_invalid": _unknown_kind,
    "union_tag_not_found": _no_kind,
    "model_type": _not_a_table,
    "model_attributes_type": _not_a_table,
    "dict_type": _not_a_table,
}
