"""Records read from files: frozen dataclasses whose annotations declare the keys of a file, and their reading.

A field is a key of the file, optional if it has a default. Its type says what may stand there: a text, a word of a
``Literal``, a number, a list (``tuple``), tables by name (``dict``), another record, or one of several records that
their ``kind`` tells apart. ``keyed``, or a ``Number``, ``Words`` or ``Many`` in its annotation, states the rest. Lists
and tables that are required have at least one item, and a text is empty only if that is its default.
"""

import types
import typing
from collections.abc import Mapping
from dataclasses import MISSING, field, fields, is_dataclass, replace
from functools import cache, partial
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

from ppafo.documents.toml_text import TomlFile
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import (
    ANY_KEY,
    FILLED,
    KIND,
    Declare,
    Field,
    Fields,
    InnerTable,
    Many,
    Words,
    check_keys,
    inside,
    number_in,
    schema_of,
)

Record = TypeVar("Record")
SchemaVersion = Annotated[int, Words("version of this layout", allowed=(1,))]
"""Version of a file layout; all layouts have version 1 so far."""
_TABLES = (dict, Mapping)
"""Types of a table with free names."""


def keyed(declared: str | Field, default: Any = MISSING) -> Any:
    """Return a field of a record by its declaration, or by what its key means; a class as default is called."""
    mark = Words(declared) if isinstance(declared, str) else declared
    if isinstance(default, type):
        return field(default_factory=default, metadata={KIND: mark})
    return field(default=default, metadata={KIND: mark})


def checked_record(record: type[Record], source: TomlFile) -> Record:
    """Return the document of a file as a record. Raises the error of the file with all faults, by line."""
    layout: Any = record
    check_keys(source, fields_of(layout))
    return record_from(record, source.document)


def record_schema(record: Any, title: str) -> dict[str, Any]:
    """Return the JSON Schema of the files of a record."""
    return schema_of(title, lambda _: fields_of(record))


@cache
def fields_of(record: Any) -> dict[str, Field]:
    """Return the fields that a record declares, by path; one with a default may be omitted."""
    found: dict[str, Field] = {}
    for name, (base, declared), default in _keys(record):
        is_required = default is MISSING
        is_open = isinstance(declared, Words) and not declared.pattern
        mark = replace(declared, pattern=FILLED) if is_open and default not in (MISSING, "") else declared
        if "" in (records := _records(base)):
            found |= inside(name, fields_of(records[""]), mark.summary, is_required)
            words = (word for item in get_args(base) if get_origin(item) is Literal for word in get_args(item))
            found[name] = InnerTable(mark.summary, is_required, words=tuple(words))
        else:
            found[name] = _field(base, mark, is_required)
    return found


@cache
def _keys(record: Any) -> list[tuple[str, tuple[Any, Any], Any]]:
    """Return name, type with declaration, and default of each field; MISSING for no default, None for one made."""
    hints = typing.get_type_hints(record, include_extras=True)
    return [
        (
            item.name,
            _parts(Annotated[hints[item.name], item.metadata[KIND]] if item.metadata else hints[item.name]),
            item.default if item.default_factory is MISSING else None,
        )
        for item in fields(record)
    ]


def _parts(hint: Any) -> tuple[Any, Any]:
    """Return the type of a field without None, and its declaration: the outermost one of several."""
    mark = None
    base = hint
    while True:
        if get_origin(base) is Annotated:
            base, *marks = get_args(base)
            mark = mark or next((item for item in reversed(marks) if isinstance(item, Field)), None)
        elif get_origin(base) in (typing.Union, types.UnionType) and types.NoneType in get_args(base):
            others = tuple(item for item in get_args(base) if item is not types.NoneType)
            base = typing.Union[others]  # noqa: UP007 - of a tuple
        else:
            return base, mark or Words()


def _field(base: Any, mark: Any, is_required: bool) -> Field:
    """Return the declaration of a field of a type that is no record."""
    if isinstance(mark, Quantity):
        return replace(mark, optional=not is_required)
    if isinstance(mark, Many):
        return replace(mark, required=is_required)
    inner: Any = get_args(base)
    origin: Any = get_origin(base)
    if origin in (tuple, *_TABLES):
        item, own = _parts(inner[0 if origin is tuple else 1])
        of_kinds = {kind: fields_of(record) for kind, record in _records(item).items()}
        of: Field | Declare = partial(_fields_of_kind, of_kinds) if of_kinds else _field(item, own, True)
        of = replace(of, least=0) if isinstance(of, Many) else of
        return Many(of, mark.summary, is_required, int(is_required), keys="" if origin is tuple else ANY_KEY)
    if base in (int, float) and not mark.allowed:
        return Quantity("", "", mark.summary, optional=not is_required, whole=base is int, plain=base is float)
    allowed = inner if origin is Literal else mark.allowed
    words: Words = replace(mark, required=is_required, allowed=allowed, form=bool if base is bool else mark.form)
    return words


@cache
def _records(base: Any) -> Mapping[str, Any]:
    """Return the records of a union by their kind, or a single one under ""; empty for any other type."""
    each = get_args(base) if get_origin(base) in (typing.Union, types.UnionType) else (base,)
    records = [item for item in each if is_dataclass(item)]
    if len(records) == 1:
        return {"": records[0]}
    return {kind: item for item in records for kind in get_args(typing.get_type_hints(item)[KIND])}


def _fields_of_kind(fields: Mapping[str, Fields], table: Mapping[str, Any]) -> Fields:
    """Return the fields of a table by its kind; those of a record alone are under ""."""
    if "" in fields:
        return fields[""]
    kind = table.get(KIND)
    return {**fields.get(kind if isinstance(kind, str) else "", {}), KIND: Words("", True, tuple(fields))}


def record_from(record: type[Record], table: Mapping[str, Any]) -> Record:
    """Return the record of a table that has been checked, with quantities in SI units."""
    layout: Any = record
    declared = {name: parts for name, parts, _ in _keys(layout)}
    return record(**{name: _value(*declared[name], value) for name, value in table.items()})


def _value(base: Any, mark: Any, value: Any) -> Any:
    """Return a checked value as its field has it; a word in place of a number stands for 0."""
    origin = get_origin(base)
    kinds = _records(base)
    if isinstance(mark, Quantity):
        return 0.0 if value in mark.words else value if mark.whole else number_in(value, mark)
    if kinds and isinstance(value, Mapping):
        return record_from(kinds[value[KIND] if "" not in kinds else ""], value)
    if origin is tuple and not isinstance(value, str):
        return tuple(_value(*_parts(get_args(base)[0]), item) for item in value)
    if origin in _TABLES:
        return {name: _value(*_parts(get_args(base)[1]), item) for name, item in value.items()}
    return float(value) if base is float else tuple(value) if isinstance(value, list) else value
