"""Values of a parameter set with their sources, and its audit against its parent and itself, in words and as data."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ppafo.arguments import checked
from ppafo.documents.json_text import fields_of
from ppafo.errors import ParameterError, refused_as
from ppafo.parameters import ParameterSet, apply_overrides, load_parameter_set
from ppafo.parameters.audit import AuditFinding, changed_paths, findings_of
from ppafo.parameters.audit.changes import changes
from ppafo.parameters.loading import set_or_load
from ppafo.parameters.parameter_set import with_followers
from ppafo.plugins import Plugins
from ppafo.report.finding import Finding, Section, columns_of
from ppafo.wording import argument_text, count_of

_wrapped = partial(textwrap.wrap, width=110)
_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow", "effects", "valves", "reported")
_COLUMNS = ("path", "value", "unit", "origin", "source")


def shown_values(parameter_set: ParameterSet) -> Finding[dict[str, Any]]:
    """Return every value of a set with its source as a finding with one table."""
    stated = parameter_set.citation
    parameter_set = with_followers(parameter_set)
    # By section only, so that within a section texts come first and numbers as they are declared.
    entries = sorted(parameter_set.entries().items(), key=lambda entry: _SECTIONS.index(entry[0].partition(".")[0]))
    document: dict[str, Any] = {
        **fields_of(parameter_set, "name", "title", "completed_by", "parent", "default_valve"),
        "citation": None if stated is None else asdict(stated),
        "notes": parameter_set.notes.strip(),
        "valves": dict(parameter_set.valve_kinds),
        "actuator": parameter_set.actuator_kind,
        "joint": asdict(parameter_set.joint),
        "values": [{"path": path, **asdict(entry)} for path, entry in entries],
        "accepted": dict(parameter_set.accepted),
    }
    cited = ""
    if stated is not None:
        authors = f"{', '.join(stated.authors)}: " if stated.authors else ""
        year = f" ({stated.year})" if stated.year else ""
        doi = f" doi:{stated.doi}" if stated.doi else ""
        cited = f"{authors}{stated.title}{year}.{doi} {stated.note}".strip()
    rows = []
    remarks = []
    for value in document["values"]:
        number = value["value"]
        # A flag is a number to Python: it is tested first.
        written = str(number).lower() if isinstance(number, bool) else number
        written = written if isinstance(written, str) else f"{number:.6g}"
        if value.get("uncertainty") is not None:
            written += f" +- {value['uncertainty']:.3g}"
        rows.append((value["path"], written, value.get("unit", ""), value["origin"], value["source"]))
        remarks += _wrapped(f"{value['path']}: {value['note']}") if value["note"] else []
    joint = parameter_set.joint
    valves = ", ".join(f"{name} ({kind})" for name, kind in parameter_set.valve_kinds.items())
    parts = (
        cited,
        f"valves: {valves}; default {parameter_set.default_valve}; actuator: {parameter_set.actuator_kind}",
        f"joint: {joint.name}, whose angle grows in {joint.positive}, falls in {joint.negative}",
    )
    accepted = [f"accepted: {name}: {why}" for name, why in parameter_set.accepted.items()]
    return Finding(
        name=parameter_set.name,
        kicker="Parameter set",
        title=parameter_set.title,
        said=[f"{parameter_set.name}: {parameter_set.title}", *_wrapped(document["notes"])],
        parts=[
            *(Section(said=_wrapped(text)) for text in parts),
            Section(columns=columns_of(_COLUMNS, rows), remarks=remarks, left=len(_COLUMNS)),
            *(Section(said=_wrapped(text)) for text in accepted),
        ],
        found=document,
        kind="measured",
        command="sets show",
    )


@dataclass(frozen=True, slots=True)
class AuditedSet:
    """Parameter set with the findings of the audit, errors first, and the parent set for comparison."""

    parameter_set: ParameterSet
    parent: ParameterSet | None
    findings: tuple[AuditFinding, ...]
    overrides: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[AuditFinding]:
        """Iterate over the findings of the audit."""
        return iter(self.findings)

    @property
    def counts(self) -> dict[str, int]:
        """Number of findings of the audit by severity."""
        return {
            name: sum(finding.severity == name for finding in self.findings) for name in ("error", "warning", "note")
        }

    def json_document(self) -> dict[str, Any]:
        """Return the findings, and the changes against the parent set, as plain data."""
        parent = self.parent
        return {
            "set": self.parameter_set.name,
            "overrides": list(self.overrides),
            "counts": self.counts,
            "findings": [finding.document() for finding in self.findings],
            "parent": None if parent is None else parent.name,
            "changes": [] if parent is None else [asdict(change) for change in changes(self.parameter_set, parent)],
        }


@checked
def audit(
    parameter_set: ParameterSet | str | Path, *, parent: ParameterSet | str | Path | None = None, plugins: Plugins = ()
) -> Finding[AuditedSet]:
    """Audit of a parameter set: contradictions and values that deserve attention, errors first.

    An error that the set accepts with a reason becomes a warning that states the reason. A reason inherited from the
    ``parent`` is void if the set changes a value of the finding. A reason without a matching finding is a warning, so
    that obsolete reasons are removed.

    Arguments:
        parameter_set: the set, its name or its file
        parent: the set that it was made from; default: the one that its file names
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        a Finding to go through: each item has its numbers, sentence and severity; it has passed without an error

    Raises:
        ParameterError: a set that cannot be read

    >>> import ppafo
    >>> [finding.id for finding in ppafo.audit("ppafo2011") if finding.severity == "warning"][:3]
    ['ideal-opening', 'flow-of-proportional', 'flow-of-solenoid']
    """
    return audited([parameter_set], parent)


def audited(
    names: Sequence[ParameterSet | str | Path],
    parent: ParameterSet | str | Path | None = None,
    is_whole: bool = True,
    overrides: Sequence[str] = (),
) -> Finding[Any]:
    """Return changes and findings of one set, or a table of several sets; not passed if a set has an error.

    If ``is_whole`` is false and a set has a parent or overrides, findings that concern no changed value are only
    counted.
    """
    sets = []
    for name in names:
        loaded = apply_overrides(name if isinstance(name, ParameterSet) else load_parameter_set(name), overrides)
        place = f"{loaded.file}: parent" if parent is None else argument_text("parent")
        with refused_as(ParameterError, place, ParameterError):
            parent_set = set_or_load(loaded.parent or None if parent is None else parent)
        sets.append(AuditedSet(loaded, parent_set, tuple(findings_of(loaded, parent_set)), tuple(overrides)))
    first = sets[0]
    is_single = len(sets) == 1
    if is_single:
        compares = first.parent is not None or bool(first.overrides)
        changed = changed_paths(first.parameter_set, first.parent) if compares and not is_whole else None
        parts = _parts(first, changed)
    else:
        verdicts = [
            {finding.id: "accepted" if finding.accepted else finding.severity for finding in audited_set}
            for audited_set in sets
        ]
        head = ["finding", *(audited_set.parameter_set.name for audited_set in sets)]
        ids = dict.fromkeys(name for verdict in verdicts for name in verdict)
        rows = ([name, *(verdict.get(name) for verdict in verdicts)] for name in ids)
        parts = [Section(columns=columns_of(head, rows))]
    return Finding(
        name=f"audit-{first.parameter_set.name}" if is_single else "audit",
        kicker="Audit",
        title=", ".join(audited_set.parameter_set.name for audited_set in sets),
        said=(),
        parts=parts,
        found=first if is_single else {"sets": [audited_set.json_document() for audited_set in sets]},
        passed=not any(audited_set.counts["error"] for audited_set in sets),
        kind="measured",
        command="sets audit",
        overrides=first.overrides,
    )


def _parts(audited_set: AuditedSet, changed: frozenset[str] | None) -> list[Section]:
    """Return sections on changes against the parent, on findings, and on their number.

    The findings are errors and findings on ``changed`` paths; all findings if ``changed`` is None.
    """
    name = audited_set.parameter_set.name
    parent = audited_set.parent
    findings = audited_set.findings
    parts = []
    if parent is not None:
        rows = [
            (change.path, change.before or None, change.after or None, change.origin)
            for change in changes(audited_set.parameter_set, parent)
        ]
        own = audited_set.parameter_set.entries()
        others = parent.entries()
        changed_values = {row[0] for row in rows}
        restated = sum(
            (entry.origin, entry.source) != (others[path].origin, others[path].source)
            for path, entry in own.items()
            if path in others and path not in changed_values
        )
        counts = [count_of(len(rows), "value")] if rows else []
        counts += [f"the origin or source of {count_of(restated, 'value')}"] if restated else []
        sentence = f"{name} changes {' and '.join(counts) or 'nothing'} of its parent {parent.name}"
        parts.append(Section(said=[sentence], columns=columns_of(("value", parent.name, name, "origin"), rows), left=4))
    listed = [
        finding
        for finding in findings
        if changed is None
        or finding.severity == "error"
        or not finding.values
        or any(value.path in changed for value in finding.values)
    ]
    summary = ", ".join(count_of(count, severity) for severity, count in audited_set.counts.items())
    if hidden := len(findings) - len(listed):
        concern = "concerns" if hidden == 1 else "concern"
        summary += f"; {hidden} of them {concern} no changed value; {argument_text('all_', option='--all')} shows them"
    for finding in listed:
        lines = [f"{finding.severity}: {finding.title} [{finding.id}]"]
        for value in finding.values:
            text = value.value if isinstance(value.value, str) else f"{value.value:.6g} {value.unit}".rstrip()
            lines.append(f"    {value.path} = {text} ({value.origin})")
        accepted = [f"Accepted by the set: {finding.accepted}"] if finding.accepted else []
        for paragraph in (finding.paragraph, *accepted):
            lines += textwrap.wrap(paragraph, 100, initial_indent="    ", subsequent_indent="    ")
        parts.append(Section(said=lines))
    return [*parts, Section(said=[f"{name}: {summary}"])]
