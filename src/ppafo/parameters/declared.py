"""Declared content of a file with kinds: a field for each dotted path.

``declare(document)`` returns the fields of a file; each ``kind`` in the document decides which there are. Checks,
refusals, overrides and the JSON Schema follow from these fields alone.
"""

import contextlib
import copy
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.faults import line_of, refuse
from ppafo.documents.regular_file import decoded
from ppafo.documents.toml_text import NAME, NAME_RULE, SCHEMA, TomlFile, quote
from ppafo.errors import KindError, UnitError
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import is_within, range_rule
from ppafo.plugins import nearest_kind
from ppafo.units import format_quantity, parse_quantity, split_quantity
from ppafo.units.shown import shown_unit
from ppafo.wording import folded, nearest_name, one_line

KIND = "kind"
"""Key of a section that names its component, such as a controller, and so decides the other keys of the section."""
PLAIN = ("", "1")
"""Units of a plain number."""
SHORT_NAME = r"^[a-z0-9][a-z0-9_-]{0,99}$"
"""Pattern of the name of a scenario."""
# Patterns of a name that may be any text, and of a text that is not empty.
ANY_KEY = r"(?s).*"
FILLED = r"(?s).+"
FREE_KEY = r"^[A-Za-z0-9_-]+$"
"""Pattern of a free key: a dotted path names it, so a dot or a blank in it would make it another path."""
IDENTIFIER = r"^[a-z][a-z0-9_]*$"
JOINT_WORDS = r"^[a-z][a-z ]{0,39}$"
LABEL = r"^(?=.{1,100}$)[^\x00-\x20\x7f-\xa0](?:[^\x00-\x1f\x7f-\x9f]*[^\x00-\x20\x7f-\xa0])?$"
"""Pattern of a display name."""
RULES = {
    NAME: NAME_RULE,
    ANY_KEY: "must be a text",
    FILLED: "must not be empty",
    SHORT_NAME: f"{NAME_RULE}, at most 100",
    FREE_KEY: "must consist of letters, digits, '-' and '_'",
    IDENTIFIER: "must begin with a lower-case letter, and consist of lower-case letters, digits and '_'",
    JOINT_WORDS: "must consist of lower-case letters and blanks, at most 40",
    LABEL: "must be one line of text without leading or trailing spaces, of at most 100 characters",
}
"""Message endings for a text that does not match a pattern, by pattern."""
_FORMS: Mapping[type, str] = {
    str: "a text in quotation marks",
    bool: "true or false",
    float: "a finite number, or a text with its unit",
    int: "a whole number from 1 on, or a text in quotation marks",
}
_MAXIMUM_TABLES = 3
"""Largest number of tables named in a message as containing an unknown key."""
_TAKEN: Mapping[type, Any] = {float: str | int | float, int: str | int}


@dataclass(frozen=True, slots=True)
class Words:
    """Field that is no number in a known unit: a text, true or false, or another ``form``.

    With ``form`` float it is a number or a text with its unit, with
    int a whole number from 1 on or a text. A ``default`` is the value of a ``kind`` that may be omitted.
    """

    summary: str = ""
    required: bool = False
    allowed: Iterable[Any] = ()
    form: type = str
    pattern: str = ""
    is_filled: bool = True
    """False if a required text may be empty."""
    default: str = ""


@dataclass(frozen=True, slots=True)
class InnerTable:
    """Table of a file, or one of the ``words`` in its place; with ``keys``, a pattern, its keys are free names."""

    summary: str = ""
    required: bool = False
    keys: str = ""
    words: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Many:
    """List of at least ``least`` values of one field, or of tables, whose fields ``of`` returns for each.

    With ``keys``, a pattern, it is a table of them with free names. A file may have one of the ``words`` in its place,
    or, if it ``may_be_one``, a value alone.
    """

    of: "Field | Declare"
    summary: str = ""
    required: bool = False
    least: int = 0
    most: float = math.inf
    words: tuple[str, ...] = ()
    keys: str = ""
    may_be_one: bool = False

    def holds(self, value: Any) -> bool:
        """Return whether a value is such a list or table, whatever is in it."""
        is_form = isinstance(value, Mapping) if self.keys else isinstance(value, list | tuple)
        return is_form and self.least <= len(value) <= self.most


Field = Quantity | Words | InnerTable | Many
Fields = Mapping[str, Field]
Declare = Callable[[Mapping[str, Any]], Fields]


@dataclass(frozen=True, slots=True)
class Content:
    """Possible content of the files of one type.

    ``same`` maps a path to an equivalent path under which the document keeps the value. ``appended`` maps a path to the
    section in whose own list of overrides the value belongs, and to the path within that section.
    """

    declare: Declare
    same: Mapping[str, str] = field(default_factory=dict)
    appended: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def paths(self, document: Mapping[str, Any]) -> tuple[str, ...]:
        """Return every path that an override can set, apart from the paths of the device."""
        found = self.declare(document)
        texts = [path for path, item in found.items() if isinstance(item, Words) and item.form is str]
        return (*texts, *quantities_in(found), *self.appended)


def numbers(section: str, quantities: Iterable[Quantity]) -> dict[str, Quantity]:
    """Return the declarations of a section, keyed by path."""
    return {f"{section}.{quantity.name}": quantity for quantity in quantities}


def inside(path: str, fields: Fields, summary: str = "", required: bool = False) -> dict[str, Field]:
    """Return the fields of a table at a path."""
    return {path: InnerTable(summary, required), **{f"{path}.{name}": field for name, field in fields.items()}}


def quantities_in(fields: Fields) -> dict[str, Quantity]:
    """Return the numbers among fields."""
    return {path: field for path, field in fields.items() if isinstance(field, Quantity)}


def value_at(document: Mapping[str, Any], path: str) -> Any:
    """Return the value of a document at a dotted path; None if there is none."""
    node: Any = document
    for part in path.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    return node


def kind_at(document: Mapping[str, Any], section: str) -> str:
    """Return the value of ``kind`` in a section; "" if the section has no ``kind``."""
    kind = value_at(document, _joined(section, KIND))
    return kind if isinstance(kind, str) else ""


def _joined(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def number_in(value: Any, quantity: Quantity, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return a value of a file in the quantity's SI unit. Raises UnitError with the reason for an unusable one."""
    is_text = isinstance(value, str)
    unit = quantity.unit
    # True and false are whole numbers to Python.
    if quantity.whole and (isinstance(value, bool) or not isinstance(value, int)):
        raise UnitError("must be a whole number")
    if isinstance(value, bool) or not isinstance(value, str | int | float) or (is_text and quantity.plain):
        raise UnitError(f"must be {_form(quantity, 1.0)}")
    try:
        result = parse_quantity(value, unit, atmosphere) if isinstance(value, str) else float(value)
    except OverflowError as error:  # a whole number of a file may be larger than any float
        raise UnitError(str(error)) from error
    if not is_text and not math.isfinite(result):
        raise UnitError("is not a finite number")
    if not is_text and not quantity.plain and unit not in PLAIN:
        raise UnitError(f"a number without a unit; must be {_form(quantity, result)}")
    if not is_within(result, quantity):
        raise UnitError(range_rule(quantity, split_quantity(str(value))[1] if is_text else unit))
    return result


def _form(quantity: Quantity, number: float) -> str:
    if quantity.plain or quantity.unit in PLAIN:
        return "a number"
    return f"a text with its unit, for example '{format_quantity(number, shown_unit(quantity.unit))}'"


def is_required(field: Field) -> bool:
    """Return whether a field must be given wherever its table is."""
    if isinstance(field, Quantity):
        return field.default is None and not (field.follows or field.words or field.optional)
    return field.required


@dataclass(frozen=True, slots=True)
class FieldLayout:
    """Fields of a document by table, for its check."""

    fields: Fields
    names: Mapping[str, list[str]]
    reads_numbers: bool

    def faults(self, table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
        """Yield the path of each unknown key, wrong value or missing key in a table, with the fault; "" for a gap."""
        inner = {name: _joined(path, name) for name in self.names.get(path, ())}
        is_decided = KIND in inner and (KIND in table or is_required(self.fields[inner[KIND]]))
        if is_decided and (fault := self._of_value(inner[KIND], self.fields[inner[KIND]], table.get(KIND, ""))):
            yield inner[KIND], fault if KIND in table else ""
            yield from self._of_unknown_kind(table, path, inner)
            return
        field = self.fields.get(path)
        keys = field.keys if isinstance(field, InnerTable) else ""
        for name, value in table.items():
            at = _joined(path, one_line(name))
            if keys and not re.fullmatch(keys, str(name)):
                yield at, f"{path}: the name {quote(name)} {RULES[keys]}"
            elif name not in inner:
                tables = [
                    f"[{each}]" if each else "the top of the file" for each in self.names if name in self.names[each]
                ]
                is_elsewhere = 0 < len(tables) <= _MAXIMUM_TABLES
                hint = f", which is a key of {' and '.join(tables)}" if is_elsewhere else nearest_name(str(name), inner)
                yield at, f"unknown key '{at}'{hint}; allowed here: {', '.join(folded(inner))}"
            else:
                yield from self._inside(inner[name], value)
        for name, at in inner.items():
            if name not in table:
                yield from self._gaps(at)

    def _of_unknown_kind(
        self, table: Mapping[str, Any], path: str, inner: Mapping[str, str]
    ) -> Iterator[tuple[str, str]]:
        """Yield the faults of a table without a known kind: of the keys that it has for every kind."""
        outer, _, name = path.rpartition(".")
        is_named = isinstance(parent := self.fields.get(outer), InnerTable) and parent.keys
        for key, value in table.items():
            if key in inner and key != KIND:
                yield from self._inside(inner[key], value)
            elif is_named and isinstance(value, Mapping) and KIND in value:
                joined = f"[{outer}.{name}-{one_line(key)}]"
                yield _joined(path, one_line(key)), f"[{path}.{one_line(key)}]: a name has no dot; write {joined}"

    def _inside(self, path: str, value: Any) -> Iterator[tuple[str, str]]:
        field: Any = self.fields.get(path, InnerTable())
        if isinstance(field, Many) and field.may_be_one and not isinstance(value, list | tuple | str):
            field = field.of
        if isinstance(field, InnerTable) and isinstance(value, Mapping):
            yield from self.faults(value, path)
        elif isinstance(field, InnerTable | Many) and isinstance(value, str) and value in field.words:
            return
        elif isinstance(field, InnerTable):
            required = [gap.rpartition(".")[2] for gap, _ in self._gaps(path, is_given=True)]
            keys = (
                f" with the key{'s' if len(required) > 1 else ''} {', '.join(required)}" if required else f", [{path}]"
            )
            words = "".join(f", or '{word}'" for word in field.words)
            yield path, f"{path} = {quote(value)} must be a table{keys}{words}"
        elif isinstance(field, Many) and field.holds(value):
            for name, item in value.items() if field.keys else enumerate(value, 1):
                at = f"{path}.{one_line(name)}"
                of = field.of
                if field.keys and not (isinstance(name, str) and re.fullmatch(field.keys, name)):
                    yield at, f"{path}: the name {quote(name)} {RULES[field.keys]}"
                    continue
                own = {at: of} if isinstance(of, Field) else inside(at, of(item if isinstance(item, Mapping) else {}))
                yield from layout_of(own, self.reads_numbers)._inside(at, item)
        elif isinstance(field, Many):
            count = f"{field.least} or more " if field.least > 0 else ""
            what = {Quantity: "numbers", Words: "texts"}.get(type(field.of), "tables")
            what += f", [[{path}]]" if what == "tables" and not field.keys else ""
            most = f", at most {field.most:g}" if math.isfinite(field.most) else ""
            word = "".join(f", or '{word}'" for word in field.words)
            yield (
                path,
                f"{path} = {quote(value)} must be a {'table' if field.keys else 'list'} of {count}{what}{most}{word}",
            )
        elif fault := self._of_value(path, field, value):
            yield path, fault

    def _gaps(self, path: str, is_given: bool = False) -> Iterator[tuple[str, str]]:
        """Yield the keys that are missing where a field is not given: of a table its required keys."""
        field = self.fields.get(path, InnerTable())
        inner = self.names.get(path, ()) if isinstance(field, InnerTable) and (field.required or is_given) else ()
        gaps = [gap for name in inner for gap in self._gaps(f"{path}.{name}")]
        yield from gaps
        if not gaps and not is_given and is_required(field):
            yield path, ""

    def _of_value(self, path: str, field: Any, value: Any) -> str:
        """Return what is wrong with a number or text; empty if nothing is."""
        given = f"{path} = {quote(value)}"
        if isinstance(field, Quantity):
            if self.reads_numbers and not (isinstance(value, str) and value.strip() in field.words):
                try:
                    number_in(value, field)
                except UnitError as error:
                    return f"{given}: {error}"
            return ""
        if field.allowed:
            # A catalogue looks a text up, and knows nothing else.
            known = field.allowed if isinstance(value, str) else tuple(field.allowed)
            if not isinstance(value, bool | float | list | dict) and value in known:
                return ""
            names = [str(name) for name in field.allowed]
            is_kind = path.rpartition(".")[2] == KIND
            # All are listed: a word that is only somewhat alike says less.
            hint = nearest_kind(str(value), names) if is_kind else nearest_name(str(value), names, 0.75)
            hint = ", without quotation marks" if str(value) in names else hint
            return f"{given} is not {'known' if is_kind else 'allowed'}{hint}; allowed: {', '.join(names)}"
        is_taken = isinstance(value, _TAKEN.get(field.form, field.form)) and isinstance(value, bool) == (
            field.form is bool
        )
        is_below = field.form is int and isinstance(value, int) and value < 1
        if not is_taken or is_below or (isinstance(value, float) and not math.isfinite(value)):
            return f"{given} must be {_FORMS[field.form]}{': ' if field.summary else ''}{field.summary}"
        if field.pattern and isinstance(value, str) and not re.fullmatch(field.pattern, value):
            return f"{given} {RULES[field.pattern]}"
        return f"{given} must not be empty" if field.required and field.is_filled and value == "" else ""


def layout_of(fields: Fields, reads_numbers: bool = True) -> FieldLayout:
    """Return the layout of a file with these fields."""
    names: dict[str, list[str]] = {}
    for path in fields:
        section = path
        while section:
            section, _, name = section.rpartition(".")
            if name in names.setdefault(section, []):
                break
            names[section].append(name)
    return FieldLayout(fields, names, reads_numbers)


def check_keys(source: TomlFile, fields: Fields) -> None:
    """Raise the error of a file with what is wrong in its document, by line of the file."""
    if faults := dict(layout_of(fields).faults(source.document)):
        refuse(faults, source.label, source.error, lambda path: line_of(decoded(source.content), path))


def schema_of(title: str, *declares: Declare) -> dict[str, Any]:
    """Return the JSON Schema of a file with the fields of one declaration, or of any of several."""
    definitions: dict[str, dict[str, Any]] = {}
    forms = [_table_schema(declare, {}, "", definitions) for declare in declares]
    whole = forms[0] if len(forms) == 1 else {"anyOf": forms}
    return {"$schema": SCHEMA, "title": title, **whole, "$defs": definitions}


def _table_schema(
    declare: Declare, document: Mapping[str, Any], path: str, definitions: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Return the schema of a table as a reference to one of the ``definitions``, for a ``kind`` to one of each kind."""
    fields = declare(document)
    kind = fields.get(_joined(path, KIND))
    chosen = kind_at(document, path)
    if isinstance(kind, Words) and chosen not in kind.allowed:
        forms = []
        for name in kind.allowed:
            with contextlib.suppress(KindError):  # a kind of another file, such as a walk in a scenario
                forms.append(_table_schema(declare, _with(document, _joined(path, KIND), name), path, definitions))
        return {"oneOf": forms} if len(forms) > 1 else forms[0]
    described: dict[str, Any] = {"type": "object", "additionalProperties": False}
    table = fields.get(path)
    if isinstance(table, InnerTable) and table.keys:
        at = f"{path}.NAME"
        named = _with(document, at, {})
        described["patternProperties"] = {
            table.keys: _schema(declare(named).get(at, InnerTable()), declare, named, at, definitions)
        }
        described["minProperties"] = int(table.required)
    else:
        inner = {name: _joined(path, name) for name in layout_of(fields).names.get(path, ())}
        # The name of a kind has the meaning of the kind, where a catalogue has it.
        known = kind.allowed if isinstance(kind, Words) else ()
        summary = getattr(known[chosen], "summary", "") if isinstance(known, Mapping) and chosen else ""
        described["properties"] = {
            name: {"const": chosen} | ({"description": summary} if summary else {})
            if name == KIND and isinstance(kind, Words)
            else _schema(fields.get(at, InnerTable()), declare, document, at, definitions)
            for name, at in inner.items()
        }
        is_default = isinstance(kind, Words) and chosen == kind.default
        described["required"] = [
            name
            for name, at in inner.items()
            if is_required(fields.get(at, InnerTable()))
            or (name == KIND and isinstance(kind, Words) and not is_default)
        ]
    if not path:
        return described
    # One definition for tables of the same content, such as the entries of a parameter set.
    wanted = f"{path}.{chosen}" if chosen else path
    name = next((known for known, other in definitions.items() if other == described), "")
    while not name:
        name, wanted = (wanted, "") if wanted not in definitions else ("", f"{wanted}'")
    definitions[name] = described
    return {"$ref": f"#/$defs/{name}"}


def _with(document: Mapping[str, Any], path: str, value: Any) -> dict[str, Any]:
    """Return a copy of a document with another value at a path."""
    changed = copy.deepcopy(dict(document))
    *tables, name = path.split(".")
    node = changed
    for table in tables:
        node = node.setdefault(table, {})
    node[name] = value
    return changed


def _schema(
    field: Field, declare: Declare, document: Mapping[str, Any], path: str, definitions: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Return the schema of a field with its description."""
    summary = ""
    form = {}
    if isinstance(field, Quantity):
        default = "" if field.default is None else f"; {field.default:g} unless given"
        default = "; the device's unless given" if field.default is None and field.follows else default
        summary = f"{field.summary} [{field.unit or '-'}]{default}".lstrip()
        form = _number_schema(field)
    else:
        summary = field.summary
    if isinstance(field, InnerTable):
        form = _table_schema(declare, document, path, definitions)
    elif isinstance(field, Many):
        of = field.of
        items = (
            _schema(of, declare, document, path, definitions)
            if isinstance(of, Field)
            else _table_schema(of, {}, "", definitions)
        )
        named = {"type": "object", "patternProperties": {field.keys: items}, "minProperties": field.least}
        form = named if field.keys else {"type": "array", "items": items, "minItems": field.least}
        form = {"anyOf": [form, {"enum": list(field.words)}]} if field.words else form
    elif isinstance(field, Words):
        texts: dict[str, Any] = {"type": "string"} | ({"pattern": field.pattern} if field.pattern else {})
        texts |= {"minLength": 1} if field.required and field.is_filled and not field.pattern else {}
        forms: dict[type, dict[str, Any]] = {
            bool: {"type": "boolean"},
            float: {"type": ["string", "number"]},
        }
        form = {"enum": list(field.allowed)} if field.allowed else forms.get(field.form, texts)
    return form | ({"description": summary} if summary else {})


def _number_schema(quantity: Quantity) -> dict[str, Any]:
    if quantity.whole or quantity.plain:
        limits = {"minimum": quantity.minimum, "maximum": quantity.maximum}
        given = {name: limit for name, limit in limits.items() if math.isfinite(limit)}
        return {"type": "integer" if quantity.whole else "number", **given}
    forms: list[dict[str, Any]] = [{"type": "string", "pattern": r"^\s*[+-]?(\d|\.\d)"}]
    forms += [{"type": "number"}] if quantity.unit in PLAIN else []
    forms += [{"enum": list(quantity.words)}] if quantity.words else []
    return {"anyOf": forms} if len(forms) > 1 else forms[0]
