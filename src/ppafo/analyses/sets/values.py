"""Values of a parameter set, with unit, interval and source."""

import textwrap
from dataclasses import asdict
from functools import partial
from typing import Any

from ppafo.documents.json_text import fields_of
from ppafo.parameters import ParameterSet
from ppafo.parameters.parameter_set import with_followers
from ppafo.report.finding import Finding, Section, columns_of

_wrapped = partial(textwrap.wrap, width=110)
_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow", "effects", "valves", "reported")
_COLUMNS = ("path", "value", "unit", "origin", "source")


def values_document(parameter_set: ParameterSet) -> dict[str, Any]:
    """Return every value of a set with its source, as plain data."""
    citation, parameter_set = parameter_set.citation, with_followers(parameter_set)
    # By section only, so that within a section texts come first and numbers as they are declared.
    entries = sorted(parameter_set.entries().items(), key=lambda entry: _SECTIONS.index(entry[0].partition(".")[0]))
    return {
        **fields_of(parameter_set, "name", "title", "completed_by", "parent", "default_valve"),
        "citation": None if citation is None else asdict(citation),
        "notes": parameter_set.notes.strip(),
        "valves": dict(parameter_set.valve_kinds),
        "actuator": parameter_set.actuator_kind,
        "joint": asdict(parameter_set.joint),
        "values": [{"path": path, **asdict(entry)} for path, entry in entries],
        "accepted": dict(parameter_set.accepted),
    }


def shown_values(parameter_set: ParameterSet) -> Finding[dict[str, Any]]:
    """Return every value of a set with its source as a finding with one table."""
    document = values_document(parameter_set)
    notes, citation = document["notes"], document["citation"]
    cited = ""
    if citation is not None:
        authors = f"{', '.join(citation['authors'])}: " if citation["authors"] else ""
        year = f" ({citation['year']})" if citation["year"] else ""
        doi = f" doi:{citation['doi']}" if citation["doi"] else ""
        cited = f"{authors}{citation['title']}{year}.{doi} {citation['note']}".strip()
    rows = []
    for value in document["values"]:
        number = value["value"]
        # A flag is a number to Python: it is tested first.
        written = str(number).lower() if isinstance(number, bool) else number
        written = written if isinstance(written, str) else f"{number:.6g}"
        if value.get("uncertainty") is not None:
            written += f" +- {value['uncertainty']:.3g}"
        rows.append((value["path"], written, value.get("unit", ""), value["origin"], value["source"]))
    joint = document["joint"]
    valves = ", ".join(f"{name} ({kind})" for name, kind in document["valves"].items())
    return Finding(
        name=document["name"],
        kicker="Parameter set",
        title=document["title"],
        said=[f"{document['name']}: {document['title']}", *_wrapped(notes)],
        parts=[
            Section(said=_wrapped(cited)),
            Section(said=[f"valves: {valves}; default {document['default_valve']}; actuator: {document['actuator']}"]),
            Section(
                said=[f"joint: {joint['name']}, whose angle grows in {joint['positive']}, falls in {joint['negative']}"]
            ),
            Section(
                columns=columns_of(_COLUMNS, rows),
                remarks=[
                    text
                    for value in document["values"]
                    if value["note"]
                    for text in _wrapped(f"{value['path']}: {value['note']}")
                ],
                left=len(_COLUMNS),
            ),
            *(Section(said=_wrapped(f"accepted: {name}: {why}")) for name, why in document["accepted"].items()),
        ],
        found=document,
        kind="measured",
        command="sets show",
    )
