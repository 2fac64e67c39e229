"""Audit of parameter sets: changes against their parents and contradictions, in words and as data."""

import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ppafo.errors import ParameterError, refused_as
from ppafo.parameters import ParameterSet, apply_overrides, load_parameter_set
from ppafo.parameters.audit import AuditFinding, audit, changed_paths
from ppafo.parameters.audit.changes import changes
from ppafo.report.finding import Finding, Section, columns_of
from ppafo.wording import count_of

_WIDTH = 100
_INDENT = "    "
_SEVERITIES = ("error", "warning", "note")


def audited(
    names: Sequence[str], parent: str | None, is_whole: bool, overrides: Sequence[str]
) -> Finding[dict[str, Any]]:
    """Return changes and findings of one set, or a table of several; it has not passed where one is an error.

    Where ``is_whole`` is false, findings that concern no changed value of a set with a parent or overrides are counted.
    """
    sets = [apply_overrides(load_parameter_set(name), overrides) for name in names]
    parents = [_parent(parameter_set, parent) for parameter_set in sets]
    findings = [audit(parameter_set, parent=before) for parameter_set, before in zip(sets, parents, strict=True)]
    documents = [_document(*audited_set, overrides) for audited_set in zip(sets, parents, findings, strict=True)]
    if len(sets) == 1:
        compares = parents[0] is not None or bool(overrides)
        changed = changed_paths(sets[0], parents[0]) if compares and not is_whole else None
        parts = _parts(sets[0], findings[0], changed)
        if parents[0] is not None:
            parts.insert(0, _changes_part(sets[0].name, parents[0].name, documents[0]["changes"]))
    else:
        parts = [_table(sets, findings)]
    return Finding(
        name=f"audit-{sets[0].name}" if len(sets) == 1 else "audit",
        kicker="Audit",
        title=", ".join(parameter_set.name for parameter_set in sets),
        said=(),
        parts=parts,
        found=documents[0] if len(sets) == 1 else {"sets": documents},
        passed=not any(document["counts"]["error"] for document in documents),
        kind="measured",
        command="sets audit",
    )


def _parent(parameter_set: ParameterSet, parent: str | None) -> ParameterSet | None:
    """Return the set to compare with: the one of the argument, else the one that the file names, if it names any."""
    name = parent or parameter_set.parent
    if not name:
        return None
    with refused_as(ParameterError, "--parent" if parent else f"{parameter_set.file}: parent", ParameterError):
        return load_parameter_set(name)


def _document(
    parameter_set: ParameterSet, parent: ParameterSet | None, findings: list[AuditFinding], overrides: Sequence[str]
) -> dict[str, Any]:
    return {
        "set": parameter_set.name,
        "overrides": list(overrides),
        "counts": _counts(findings),
        "findings": [finding.document() for finding in findings],
        "parent": None if parent is None else parent.name,
        "changes": [] if parent is None else [asdict(change) for change in changes(parameter_set, parent)],
    }


def _counts(findings: list[AuditFinding]) -> dict[str, int]:
    return {severity: sum(finding.severity == severity for finding in findings) for severity in _SEVERITIES}


def _changes_part(name: str, parent: str, changed: list[dict[str, Any]]) -> Section:
    """Return what a set changes of its parent."""
    rows = [(change["path"], change["before"] or None, change["after"] or None, change["origin"]) for change in changed]
    changes = count_of(len(rows), "value") if rows else "nothing"
    said = f"{name} changes {changes} of its parent {parent}"
    return Section(said=[said], columns=columns_of(("value", parent, name, "origin"), rows), left=4)


def _table(sets: list[ParameterSet], findings: list[list[AuditFinding]]) -> Section:
    """Return a row for each finding and a column for each set, with how serious it is there."""
    verdicts = [
        {finding.id: "accepted" if finding.accepted else finding.severity for finding in of_set} for of_set in findings
    ]
    head = ["finding", *(parameter_set.name for parameter_set in sets)]
    ids = dict.fromkeys(name for verdict in verdicts for name in verdict)
    return Section(columns=columns_of(head, ([name, *(verdict.get(name) for verdict in verdicts)] for name in ids)))


def _parts(parameter_set: ParameterSet, findings: list[AuditFinding], changed: frozenset[str] | None) -> list[Section]:
    """Return the errors and what concerns a ``changed`` value, all findings for None, then how many there are."""
    shown = [
        finding
        for finding in findings
        if changed is None
        or finding.severity == "error"
        or not finding.values
        or any(value.path in changed for value in finding.values)
    ]
    summary = ", ".join(count_of(count, severity) for severity, count in _counts(findings).items())
    left = len(findings) - len(shown)
    if left:
        concern = "concerns" if left == 1 else "concern"
        summary += f"; {left} of them {concern} no changed value: --all"
    return [*(Section(said=_lines(finding)) for finding in shown), Section(said=[f"{parameter_set.name}: {summary}"])]


def _lines(finding: AuditFinding) -> list[str]:
    lines = [f"{finding.severity}: {finding.title} [{finding.id}]"]
    for value in finding.values:
        text = value.value if isinstance(value.value, str) else f"{value.value:.6g}"
        lines.append(f"{_INDENT}{value.path} = {text} {value.unit} ({value.origin})")
    lines += textwrap.wrap(finding.paragraph, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
    if finding.accepted:
        accepted = f"Accepted by the set: {finding.accepted}"
        lines += textwrap.wrap(accepted, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
    return lines
