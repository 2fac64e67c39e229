"""What parameter sets changed against their parents, and where they contradict themselves, in words and as data."""

import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ppafo.errors import ParameterError, refused_as
from ppafo.parameters import ParameterSet, apply_overrides, load_parameter_set
from ppafo.parameters.audit import Finding, audit, changed_paths
from ppafo.parameters.audit.changes import changes
from ppafo.report.finding import Finding as Report
from ppafo.report.finding import Part, columns_of

_WIDTH = 100
_INDENT = "    "
_SEVERITIES = ("error", "warning", "note")


def audited(
    names: Sequence[str], parent: str | None, is_whole: bool, overrides: Sequence[str]
) -> Report[dict[str, Any]]:
    """Return changes and findings of one set, or a table of several; it has not passed where one is an error.

    Where ``is_whole`` is false, findings that concern no changed value of a set with a parent or overrides are counted.
    """
    sets = [apply_overrides(load_parameter_set(name), overrides) for name in names]
    # Each is compared with the set that was given, else with the one that its file names, if it names any.
    parents: list[ParameterSet | None] = []
    for one in sets:
        with refused_as(ParameterError, "--parent" if parent else f"{one.file}: parent", ParameterError):
            parents.append(load_parameter_set(parent or one.parent) if parent or one.parent else None)
    found = [(one, audit(one, parent=other)) for one, other in zip(sets, parents, strict=True)]
    documents: list[dict[str, Any]] = [
        {
            "set": one.name,
            "overrides": list(overrides),
            "counts": _counts(findings),
            "findings": [finding.document() for finding in findings],
            "parent": None if other is None else other.name,
            "changes": [] if other is None else [asdict(change) for change in changes(one, other)],
        }
        for (one, findings), other in zip(found, parents, strict=True)
    ]
    compares = parents[0] is not None or bool(overrides)
    is_one = len(found) == 1
    if is_one:
        changed = changed_paths(sets[0], parents[0]) if compares and not is_whole else None
        parts = _parts(*found[0], changed)
        if parents[0] is not None:
            name, parent, values = sets[0].name, parents[0].name, documents[0]["changes"]
            count = f"{len(values)} value{'' if len(values) == 1 else 's'}" if values else "nothing"
            rows = [(one["path"], one["before"] or None, one["after"] or None, one["origin"]) for one in values]
            said = f"{name} changes {count} of its parent {parent}"
            parts.insert(0, Part(said=[said], columns=columns_of(("value", parent, name, "origin"), rows), left=4))
    else:
        # A row for each finding and a column for each set, with how serious it is there.
        verdicts = [{one.id: "accepted" if one.accepted else one.severity for one in findings} for _, findings in found]
        head = ["finding", *(one.name for one in sets)]
        ids = dict.fromkeys(name for verdict in verdicts for name in verdict)
        parts = [Part(columns=columns_of(head, ([name, *(each.get(name) for each in verdicts)] for name in ids)))]
    return Report(
        name=f"audit-{sets[0].name}" if is_one else "audit",
        kicker="Audit",
        title=", ".join(one.name for one in sets),
        said=(),
        parts=parts,
        found=documents[0] if is_one else {"sets": documents},
        passed=not any(_counts(findings)["error"] for _, findings in found),
        kind="measured",
        command="sets audit",
    )


def _counts(findings: list[Finding]) -> dict[str, int]:
    return {severity: sum(finding.severity == severity for finding in findings) for severity in _SEVERITIES}


def _parts(parameter_set: ParameterSet, findings: list[Finding], changed: frozenset[str] | None) -> list[Part]:
    """Return the errors and what concerns a ``changed`` value, all findings for None, then how many there are."""
    shown = [
        one
        for one in findings
        if changed is None
        or one.severity == "error"
        or not one.values
        or any(value.path in changed for value in one.values)
    ]
    summary = ", ".join(f"{n} {severity}{'' if n == 1 else 's'}" for severity, n in _counts(findings).items())
    left = len(findings) - len(shown)
    rest = f"; {left} of them concern{'s' if left == 1 else ''} no changed value: --all" if left else ""
    return [*(Part(said=_lines(one)) for one in shown), Part(said=[f"{parameter_set.name}: {summary}{rest}"])]


def _lines(finding: Finding) -> list[str]:
    lines = [f"{finding.severity}: {finding.title} [{finding.id}]"]
    lines += [
        f"{_INDENT}{value.path} = {value.value if isinstance(value.value, str) else f'{value.value:.6g}'} {value.unit} "
        f"({value.origin})"
        for value in finding.values
    ]
    lines += textwrap.wrap(finding.paragraph, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
    if finding.accepted:
        accepted = f"Accepted by the set: {finding.accepted}"
        lines += textwrap.wrap(accepted, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)
    return lines
