"""Problems of a document as one-line text: key, value, allowed values and nearest name."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from ppafo.wording import nearest_name, one_line, said_missing

NAME = r"^[a-z0-9][a-z0-9_-]*$"
"""Pattern of the name of a set or scenario."""
LABEL = r"^[^\x00-\x20\x7f-\xa0](?:[^\x00-\x1f\x7f-\x9f]*[^\x00-\x20\x7f-\xa0])?$"
"""Pattern of a display name: a line of text without leading or trailing space."""
QUANTITY = r"^\s*[+-]?(\d|\.\d)"
"""Pattern of the start of a number with its unit."""
_LONGEST_VALUE = 60
_MAXIMUM_SAID = 5
_MAXIMUM_HOMES = 3


def is_gap(detail: ErrorDetails) -> bool:
    """Return True if a problem is only a missing key."""
    return detail["type"] in _GAPS


def is_unknown_kind(detail: ErrorDetails) -> bool:
    """Return True if a problem is an unknown kind; tables with a single kind report it as a wrong literal."""
    return detail["type"] == "union_tag_invalid" or (detail["type"] == "literal_error" and detail["loc"][-1] == "kind")


def all_problems(details: list[ErrorDetails], model: type[BaseModel]) -> str:
    """Return all problems as one line: unknown keys, which make others missing, then values, then missing keys.

    For a value that matches none of several types only the first reason is given. The number of problems is limited.
    """
    above = {detail["loc"][:length] for detail in details for length in range(len(detail["loc"]))}
    # What is wrong with a table or list because of something in it is said there.
    spots = {detail["loc"]: (_spot(model, detail["loc"]), detail) for detail in details if detail["loc"] not in above}
    of_values = {spot.path: (spot, detail) for spot, detail in reversed(spots.values()) if not is_gap(detail)}
    ordered = sorted(reversed(of_values.values()), key=lambda problem: problem[1]["type"] != "extra_forbidden")
    said = []
    for spot, detail in ordered[:_MAXIMUM_SAID]:
        if detail["type"] == "extra_forbidden":
            said.append(_unknown_key(spot, model))
        else:
            said.append(_SENTENCES.get(detail["type"], _any_other)(spot, detail))
    if len(ordered) > _MAXIMUM_SAID:
        said.append(f"and {len(ordered) - _MAXIMUM_SAID} more like these")
    gaps = [f"{spot.path}{_GAPS[detail['type']]}" for spot, detail in spots.values() if is_gap(detail)]
    if gaps:
        said.append(said_missing(gaps))
    return "; ".join(said)


def quote(value: object) -> str:
    """Return a short quotation of a value on one line."""
    quoted = one_line(repr(value))
    return quoted if len(quoted) <= _LONGEST_VALUE else f"{quoted[:_LONGEST_VALUE]}..."


@dataclass(frozen=True, slots=True)
class _Spot:
    """Location of a problem in a file: dotted path, model of its last key, and type of its value."""

    path: str
    holder: Any
    wanted: Any


def _spot(model: Any, location: Iterable[int | str]) -> _Spot:
    """Return the spot at a pydantic location, which names the kind of a union as if it were a key."""
    keys: list[str] = []
    holder = wanted = model
    for part in map(str, location):
        if kinds := _kinds(wanted):
            wanted = kinds.get(part)
            continue
        holder = wanted
        keys.append(one_line(part))
        if not _is_model(holder):
            # A table or list by names or numbers has the same at any.
            members = [member for member in get_args(holder) if member is not Ellipsis]
            wanted = members[-1] if members else None
        elif part not in holder.model_fields:
            wanted = None
        else:
            wanted = holder.model_fields[part].annotation
            # What may be left out, as X | None, is an X where it is there.
            members = [member for member in get_args(wanted) if member is not type(None)]
            if get_origin(wanted) in (Union, UnionType) and len(members) == 1:
                wanted = members[0]
    return _Spot(".".join(keys), holder, wanted)


def _kinds(node: Any) -> dict[str, Any]:
    """Return the members of a union of kinds by kind; empty for any other type."""
    tables = [table for table in _models_in(node) if "kind" in table.model_fields]
    return {get_args(table.model_fields["kind"].annotation)[0]: table for table in tables}


def _is_model(node: Any) -> bool:
    return isinstance(node, type) and issubclass(node, BaseModel)


def _unknown_key(spot: _Spot, model: type[BaseModel]) -> str:
    """Return the message on an unknown key, with the tables that have such a key or the nearest allowed name."""
    allowed, key = list(spot.holder.model_fields), spot.path.rpartition(".")[2]
    homes: list[str] = []
    left: list[tuple[str, Any]] = [("", model)]
    seen = set()
    while left:
        path, node = left.pop(0)
        for member in [node] if _is_model(node) else _models_in(node):
            if (path, member) in seen or len(path) > _LONGEST_VALUE:
                continue
            seen.add((path, member))
            if key in member.model_fields and (table := f"[{path}]" if path else "the top of the file") not in homes:
                homes.append(table)
            left += [(f"{path}.{name}".strip("."), field.annotation) for name, field in member.model_fields.items()]
    is_elsewhere = 0 < len(homes) <= _MAXIMUM_HOMES
    hint = f", which is a key of {' and '.join(homes)}" if is_elsewhere else nearest_name(key, allowed)
    return f"unknown key '{spot.path}'{hint}; allowed here: {', '.join(allowed)}"


def _models_in(node: Any) -> list[Any]:
    """Return the tables that a value of a type can be, except those in lists or under free names."""
    if get_origin(node) is Annotated:
        return _models_in(get_args(node)[0])
    return [member for member in get_args(node) if _is_model(member)] if get_origin(node) in (Union, UnionType) else []


def _unknown_word(spot: _Spot, detail: ErrorDetails) -> str:
    """Return the message on an unknown word, with the allowed words; also for the kind of a table."""
    is_kind, context = detail["type"] == "union_tag_invalid", detail["ctx"]
    word = context["tag"] if is_kind else detail["input"]
    said = context["expected_tags"] if is_kind else context["expected"].replace(" or ", ",")
    allowed = [name.strip(" '") for name in said.split(",")]
    refused = (
        f"{spot.path}.kind = {quote(word)} is not known" if is_kind else f"{spot.path} = {quote(word)} is not allowed"
    )
    return f"{refused}{nearest_name(str(word), allowed)}; allowed: {', '.join(allowed)}"


def _wrong_name(spot: _Spot, detail: ErrorDetails) -> str:
    """Return the message on an invalid name or quantity; pydantic marks a name that is the key of a table."""
    if detail["loc"][-1] == "[key]":
        table = one_line(".".join(map(str, detail["loc"][:-2])))
        return f"{table}: the name {quote(detail['input'])} must consist of letters, digits, '-' and '_'"
    if detail["ctx"]["pattern"] == QUANTITY:
        return f"{spot.path} = {quote(detail['input'])} does not start with a number; write for example '1.3 m/s'"
    if detail["ctx"]["pattern"] == LABEL:
        return f"{spot.path} = {quote(detail['input'])} must be a line of text without spaces around it"
    return f"{spot.path} = {quote(detail['input'])} must consist of lower-case letters, digits, '-' and '_'"


def _not_a_table(spot: _Spot, detail: ErrorDetails) -> str:
    fields = spot.wanted.model_fields if _is_model(spot.wanted) else {}
    required = [name for name, field in fields.items() if field.is_required()]
    keys = f" with the key{'s' * (len(required) > 1)} {', '.join(required)}" if required else f", [{spot.path}]"
    return f"{spot.path} = {quote(detail['input'])} must be a table{keys}"


def _any_other(spot: _Spot, detail: ErrorDetails) -> str:
    """Return pydantic's message in ppafo's wording: "Input should be less than 5" becomes "must be less than 5"."""
    if detail["type"] == "string_type":
        return f"{spot.path} = {quote(detail['input'])} must be a text in quotation marks"
    _, wanted, must = detail["msg"].partition(" should ")
    said = f"must {must}" if wanted else f"must be {detail['msg']}"
    return f"{spot.path} = {quote(detail['input'])}: {one_line(said)}"


_GAPS = {"missing": "", "union_tag_not_found": ".kind"}
"""Problem types of missing keys, with the suffix to append to the path."""
_SENTENCES: dict[str, Callable[[_Spot, ErrorDetails], str]] = {
    "literal_error": _unknown_word,
    "string_pattern_mismatch": _wrong_name,
    "union_tag_invalid": _unknown_word,
    "model_type": _not_a_table,
    "model_attributes_type": _not_a_table,
    "dict_type": _not_a_table,
}
