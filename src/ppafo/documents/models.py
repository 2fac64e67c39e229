"""Building blocks of closed file layouts: strict tables, their validation with all problems by path, JSON Schema."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeGuard, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import CoreSchema, ErrorDetails, PydanticCustomError, PydanticKnownError
from pydantic_core.core_schema import no_info_after_validator_function, str_schema

from ppafo.documents.faults import line_of, no_table, refuse, unknown_key
from ppafo.documents.regular_file import decoded
from ppafo.documents.toml_text import NAME, NAME_RULE, SCHEMA, TomlKind, label, quote
from ppafo.errors import PpafoError, UnitError
from ppafo.plugins import nearest_kind
from ppafo.units import parse_quantity
from ppafo.wording import nearest_name, one_line

Model = TypeVar("Model", bound=BaseModel)
LABEL = r"^[^\x00-\x20\x7f-\xa0](?:[^\x00-\x1f\x7f-\x9f]*[^\x00-\x20\x7f-\xa0])?$"
"""Pattern of a display name: one line of text without leading or trailing space."""
_TEXT_RULES = {
    NAME: NAME_RULE,
    LABEL: "must be one line of text without leading or trailing spaces",
}
"""Message endings for a text that does not match a pattern, by pattern."""
_FORMS = {"int": "a whole number", "float": "a number", "bool": "true or false"}
_MISSING = {"missing": "", "union_tag_not_found": ".kind"}
"""Suffix of the path of a missing key, by problem type."""


def faults_of(details: list[ErrorDetails], model: type[BaseModel]) -> dict[str, str]:
    """Return all problems by path, "" for a gap.

    For a value that matches none of several types only the first reason is given.
    """
    containers = {detail["loc"][:length] for detail in details for length in range(len(detail["loc"]))}
    faults: dict[str, str] = {}
    for detail in details:
        # A table or list that is wrong because of a value in it has the problem of this value.
        if detail["loc"] in containers:
            continue
        key = _key_at(detail["loc"], model)
        if detail["type"] in _MISSING:
            # Of a table that is missing its required keys are named, which the next refusal would ask for.
            faults |= dict.fromkeys(_required(key) or [f"{key.path}{_MISSING[detail['type']]}"], "")
        else:
            faults.setdefault(key.path, _message(key, detail))
    return faults


@dataclass(frozen=True, slots=True)
class _Key:
    """Key of a document: dotted path, type of its table, and type of its value (None if unknown)."""

    path: str
    table: Any
    value_type: Any


def _key_at(location: Iterable[int | str], model: type[BaseModel]) -> _Key:
    """Return the key at a pydantic location, in which the kind of a union appears as a key."""
    names: list[str] = []
    table: Any = model
    value_type: Any = model
    # Of a list the first item is number 1.
    for name in (str(part + 1 if isinstance(part, int) else part) for part in location):
        tables = [item for item in _tables_in(value_type) if "kind" in item.model_fields]
        if tables:
            kinds = {get_args(item.model_fields["kind"].annotation)[0]: item for item in tables}
            value_type = kinds.get(name)
            continue
        table = value_type
        names.append(one_line(name))
        if not _is_model(table):
            # The values of a list, or of a table with free names, have one type.
            types = [item for item in get_args(table) if item is not Ellipsis]
            value_type = types[-1] if types else None
        elif name not in table.model_fields:
            value_type = None
        else:
            value_type = table.model_fields[name].annotation
            # The value of an optional key, X | None, is an X if it is given.
            types = [item for item in get_args(value_type) if item is not type(None)]
            if get_origin(value_type) in (Union, UnionType) and len(types) == 1:
                value_type = types[0]
    return _Key(".".join(names), table, value_type)


def _is_model(value_type: Any) -> TypeGuard[type[BaseModel]]:
    return isinstance(value_type, type) and issubclass(value_type, BaseModel)


def _tables_in(value_type: Any) -> list[type[BaseModel]]:
    """Return the table models of a union; empty for any other type."""
    if get_origin(value_type) is Annotated:
        return _tables_in(get_args(value_type)[0])
    is_union = get_origin(value_type) in (Union, UnionType)
    return [item for item in get_args(value_type) if _is_model(item)] if is_union else []


def _required(key: _Key) -> list[str]:
    """Return the paths of the keys that the table at a key must have."""
    fields = key.value_type.model_fields if _is_model(key.value_type) else {}
    return [f"{key.path}.{name}" for name, field in fields.items() if field.is_required()]


def _message(key: _Key, detail: ErrorDetails) -> str:
    """Return the message on a problem at a key of a document."""
    assignment = f"{key.path} = {quote(detail['input'])}"
    match detail["type"]:
        case "extra_forbidden":
            return unknown_key(key.path, key.path.rpartition(".")[2], (), list(key.table.model_fields))
        case "literal_error":
            words = detail["ctx"]["expected"].replace(" or ", ",")
            return f"{assignment} is not allowed{_allowed_words(detail['input'], words)}"
        case "union_tag_invalid":
            kind = detail["ctx"]["tag"]
            words = _allowed_words(kind, detail["ctx"]["expected_tags"], nearest_kind)
            return f"{key.path}.kind = {quote(kind)} is not known{words}"
        case "int_type" | "int_from_float" | "float_type" | "bool_type":
            return f"{assignment} must be {_FORMS[detail['type'].partition('_')[0]]}"
        case "string_pattern_mismatch":
            return f"{assignment} {_TEXT_RULES.get(detail['ctx']['pattern'], _TEXT_RULES[NAME])}"
        case "string_type":
            return f"{assignment} must be a text in quotation marks"
        case "model_type" | "model_attributes_type" | "dict_type":
            return no_table(key.path, detail["input"], [name.rpartition(".")[2] for name in _required(key)])
    # "Input should be less than 5" becomes "must be less than 5".
    _, separator, requirement = detail["msg"].partition(" should ")
    requirement = requirement if separator else f"be {detail['msg']}"
    return f"{assignment}: {detail['msg'] if detail['type'] == 'quantity' else f'must {one_line(requirement)}'}"


def _allowed_words(word: object, allowed: str, nearest: Callable[[str, list[str]], str] = nearest_name) -> str:
    """Return the message ending for an unknown word: nearest and allowed words; pydantic separates these by commas."""
    words = [item.strip(" '") for item in allowed.split(",")]
    return f"{nearest(str(word), words)}; allowed: {', '.join(words)}"


class StrictTable(BaseModel):
    """Table of a file that accepts only declared keys and types, and finite numbers; built at first use."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


def _no_flag(value: Any) -> Any:
    # Python takes True for 1.
    if isinstance(value, bool):
        raise PydanticKnownError("literal_error", {"expected": "1"})
    return value


SchemaVersion = Annotated[Literal[1], BeforeValidator(_no_flag), Field(description="version of this layout")]
"""Version of a file layout; all layouts have version 1 so far."""
Text = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[Text, ...], Field(strict=False)]


@dataclass(frozen=True, slots=True)
class Quantified:
    """Quantity of a file, a text with its unit, as a number in ``unit`` from ``low`` to ``high``, or above ``above``.

    The text ``nothing`` stands for 0, whatever the limits are.

    >>> from pydantic import TypeAdapter
    >>> TypeAdapter(Annotated[float, Quantified("s", above=0.0)]).validate_python("5 ms")
    0.005
    """

    unit: str
    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf
    nothing: str = ""

    def read(self, text: str) -> float:
        """Return the number of a text. Raises PydanticCustomError for another unit, or beyond the limits."""
        if self.nothing and text == self.nothing:
            return 0.0
        try:
            value = parse_quantity(text, self.unit)
        except UnitError as error:
            raise PydanticCustomError("quantity", "{why}", {"why": str(error)}) from error
        if not (self.low <= value <= self.high and value > self.above):
            above = f"above {self.above:g}" if self.above > -math.inf else f"at least {self.low:g}"
            below = f" and at most {self.high:g}" if self.high < math.inf else ""
            limits = f"must be {above}{below} {self.unit}".removesuffix(" 1")
            raise PydanticCustomError("quantity", "{why}", {"why": limits})
        return value

    def __get_pydantic_core_schema__(self, *_: object) -> CoreSchema:
        """Return the schema of a text that is read."""
        return no_info_after_validator_function(self.read, str_schema(min_length=1))


def read_model(kind: TomlKind, model: type[Model], name_or_path: str | Path) -> tuple[Model, str]:
    """Load and validate a file by bundled name or path. Returns the model and the label used in messages."""
    file = label(str(name_or_path))
    content = kind.read(name_or_path)
    return validate(model, kind.parse(content, file), file, kind.error, content), file


def validate(model: type[Model], document: object, file: str, refusal: type[PpafoError], content: bytes = b"") -> Model:
    """Validate a document as a model. Raises ``refusal`` with all problems, by line of the ``content`` of its file."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        faults = faults_of(error.errors(include_url=False), model)
    text = decoded(content)
    return refuse(faults, file, refusal, lambda path: line_of(text, path))


def make_schema(model: type[BaseModel], title: str) -> dict[str, Any]:
    """Return the JSON Schema of a file layout."""
    return {"$schema": SCHEMA, **model.model_json_schema(), "title": title}
