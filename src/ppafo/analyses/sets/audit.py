"""What parameter sets changed against their parents, and where they contradict themselves, in words and as data."""

import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ppafo.errors import ParameterError, refused_as
from ppafo.parameters import ParameterSet, apply_overrides, load_parameter_set
from ppafo.parameters.audit import Finding, audit, changed_paths
from ppafo.parameters.audit.changes import changes
from ppafo.report.writing import align_columns

_WIDTH = 100
_INDENT = "    "
_SEVERITIES = ("error", "warning", "note")


@dataclass(frozen=True, slots=True)
class Audited:
    """The audit of one set, or of several: text, document, name of its files, and whether no finding is an error."""

    text: str
    document: dict[str, Any]
    name: str
    passed: bool


def audited(names: Sequence[str], parent: str | None, is_whole: bool, overrides: Sequence[str]) -> Audited:
    """Return changes and findings of one set, or a table of several.

    Where ``is_whole`` is false, findings that concern no changed value of a set with a parent or overrides are counted.
    """
    sets = [apply_overrides(load_parameter_set(name), overrides) for name in names]
    parents = [_parent(parameter_set, parent) for parameter_set in sets]
    found = [(one, audit(one, other)) for one, other in zip(sets, parents, strict=True)]
    documents = [
        _document(*one, overrides) | _changes_document(one[0], other) for one, other in zip(found, parents, strict=True)
    ]
    passed = not any(_counts(findings)["error"] for _, findings in found)
    if len(found) > 1:
        return Audited(_table(found), {"sets": documents}, "audit", passed)
    compares = parents[0] is not None or bool(overrides)
    changed = changed_paths(sets[0], parents[0]) if compares and not is_whole else None
    text = _text(*found[0], changed)
    if documents[0]["parent"] is not None:
        text = f"{_changes_text(documents[0])}\n\n{text}"
    return Audited(text, documents[0], f"audit-{sets[0].name}", passed)


def _parent(parameter_set: ParameterSet, given: str | None) -> ParameterSet | None:
    """Return the set to compare with: the one given, else the one that the file names, if it names any."""
    name = given or parameter_set.parent
    if not name:
        return None
    with refused_as(ParameterError, "--parent" if given else f"{parameter_set.file}: parent", ParameterError):
        return load_parameter_set(name)


def _changes_document(parameter_set: ParameterSet, parent: ParameterSet | None) -> dict[str, Any]:
    changed = [] if parent is None else [asdict(change) for change in changes(parameter_set, parent)]
    return {"parent": None if parent is None else parent.name, "changes": changed}


def _changes_text(document: dict[str, Any]) -> str:
    name, parent, changed = document["set"], document["parent"], document["changes"]
    count = f"{len(changed)} value{'' if len(changed) == 1 else 's'}" if changed else "nothing"
    rows = [(one["path"], one["before"] or "-", one["after"] or "-", one["origin"]) for one in changed]
    table = align_columns([("value", parent, name, "origin"), *rows], 4) if changed else []
    return "\n".join([f"{name} changes {count} of its parent {parent}", *(_INDENT + line for line in table)])


def _document(parameter_set: ParameterSet, findings: list[Finding], overrides: Sequence[str]) -> dict[str, Any]:
    return {
        "set": parameter_set.name,
        "overrides": list(overrides),
        "counts": _counts(findings),
        "findings": [finding.document() for finding in findings],
    }


def _counts(findings: list[Finding]) -> dict[str, int]:
    return {severity: sum(finding.severity == severity for finding in findings) for severity in _SEVERITIES}


def _table(found: list[tuple[ParameterSet, list[Finding]]]) -> str:
    """Return a row for each finding and a column for each set, with how serious it is there."""
    columns = [{finding.id: _verdict(finding) for finding in findings} for _, findings in found]
    names = dict.fromkeys(name for column in columns for name in column)
    head = ["finding", *(parameter_set.name for parameter_set, _ in found)]
    return "\n".join(align_columns([head, *([name, *(column.get(name, "-") for column in columns)] for name in names)]))


def _verdict(finding: Finding) -> str:
    return "accepted" if finding.accepted else finding.severity


def _text(parameter_set: ParameterSet, findings: list[Finding], changed: frozenset[str] | None) -> str:
    """Return the errors and what concerns a ``changed`` value, all findings for None, then how many there are."""
    shown = [one for one in findings if one.severity == "error" or _concerns(one, changed)]
    counts = _counts(findings)
    summary = ", ".join(f"{count} {severity}{'' if count == 1 else 's'}" for severity, count in counts.items())
    left = len(findings) - len(shown)
    rest = f"; {left} of them concern{'s' if left == 1 else ''} no changed value: --all" if left else ""
    return "\n\n".join([*("\n".join(_lines(one)) for one in shown), f"{parameter_set.name}: {summary}{rest}"])


def _concerns(finding: Finding, changed: frozenset[str] | None) -> bool:
    return changed is None or not finding.values or any(value.path in changed for value in finding.values)


def _lines(finding: Finding) -> list[str]:
    lines = [f"{finding.severity}: {finding.title} [{finding.id}]"]
    lines += [
        f"{_INDENT}{value.path} = {_format_value(value.value)} {value.unit} ({value.origin})"
        for value in finding.values
    ]
    lines += textwrap.wrap(finding.paragraph, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
    if finding.accepted:
        accepted = f"Accepted by the set: {finding.accepted}"
        lines += textwrap.wrap(accepted, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
    return lines


def _format_value(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
