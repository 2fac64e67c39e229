"""A parameter set as the text of a TOML file; reading it back gives the same set."""

import json
from collections.abc import Iterator

from ppafo.parameters.device import VANE
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.parameters.provenance import Citation, Entry, FlagEntry, TextEntry


def parameter_set_toml(parameter_set: ParameterSet) -> str:
    """Return the TOML text of a set: head, citation, every value with its provenance, accepted contradictions."""
    return "\n".join(_lines(parameter_set)) + "\n"


def _lines(parameter_set: ParameterSet) -> Iterator[str]:
    head = {
        "name": parameter_set.name,
        "title": parameter_set.title,
        "default_valve": parameter_set.default_valve,
        "completed_by": parameter_set.completed_by,
        "notes": parameter_set.notes,
    }
    yield "schema_version = 1"
    yield from (f"{key} = {_text(value)}" for key, value in head.items() if value)
    if parameter_set.citation is not None:
        yield from _citation(parameter_set.citation)
    if parameter_set.actuator_kind != VANE:
        yield from _actuator(parameter_set)
    for path, entry in _sorted_entries(parameter_set):
        valve = path.split(".")[1] if path.startswith("valves.") else None
        if valve is not None and path == _first_path(parameter_set, valve):
            yield from _valve(parameter_set, valve)
        yield from ("", f"[{path}]", *_entry(entry))
    for valve in parameter_set.valve_kinds:
        if _first_path(parameter_set, valve) is None:
            yield from _valve(parameter_set, valve)
    for finding, reason in parameter_set.accepted.items():
        yield from ("", "[[accepted]]", f"finding = {_text(finding)}", f"reason = {_text(reason)}")


def _actuator(parameter_set: ParameterSet) -> Iterator[str]:
    yield from ("", "[actuator]", f"kind = {_text(parameter_set.actuator_kind)}")
    if parameter_set.actuator_file:
        yield f"file = {_text(parameter_set.actuator_file)}"


def _valve(parameter_set: ParameterSet, valve: str) -> Iterator[str]:
    yield from ("", f"[valves.{valve}]", f"kind = {_text(parameter_set.valve_kinds[valve])}")


def _first_path(parameter_set: ParameterSet, valve: str) -> str | None:
    paths = (path for path, _ in _sorted_entries(parameter_set))
    return next((path for path in paths if path.startswith(f"valves.{valve}.")), None)


def _sorted_entries(parameter_set: ParameterSet) -> list[tuple[str, Entry | TextEntry | FlagEntry]]:
    """Return the values section by section, in the order in which the sections first occur."""
    entries = parameter_set.entries()
    sections = list(dict.fromkeys(path.rpartition(".")[0] for path in entries))
    return sorted(entries.items(), key=lambda item: sections.index(item[0].rpartition(".")[0]))


def _entry(entry: Entry | TextEntry | FlagEntry) -> Iterator[str]:
    if isinstance(entry, Entry):
        yield f"value = {float(entry.value)!r}"
        yield f"unit = {_text(entry.unit)}"
    elif isinstance(entry, FlagEntry):
        yield f"value = {_flag(entry.value)}"
    else:
        yield f"value = {_text(entry.value)}"
    yield f"origin = {_text(entry.origin)}"
    yield f"source = {_text(entry.source)}"
    if entry.note:
        yield f"note = {_text(entry.note)}"
    if isinstance(entry, Entry) and entry.uncertainty is not None:
        yield f"uncertainty = {float(entry.uncertainty)!r}"


def _citation(citation: Citation) -> Iterator[str]:
    yield from ("", "[citation]", f"title = {_text(citation.title)}")
    if citation.authors:
        yield f"authors = [{', '.join(map(_text, citation.authors))}]"
    if citation.year is not None:
        yield f"year = {citation.year}"
    yield from (f"{key} = {_text(value)}" for key, value in (("doi", citation.doi), ("note", citation.note)) if value)


def _flag(value: bool) -> str:
    return "true" if value else "false"


def _text(text: str) -> str:
    """Return a basic string of TOML; what JSON escapes is escaped in the same way there, but for DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
