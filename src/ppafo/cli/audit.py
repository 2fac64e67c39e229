"""``ppafo audit SET``: what in a parameter set contradicts itself, and what would reconcile it."""

import argparse
import textwrap
from typing import TYPE_CHECKING, Any

from ppafo.cli import output

if TYPE_CHECKING:
    from ppafo.parameters import ParameterSet
    from ppafo.parameters.audit import Finding

_WIDTH = 100
_INDENT = "    "
_SEVERITIES = ("error", "warning", "note")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "names", metavar="SET", nargs="+", help="name of a set, or a .toml file; several are shown side by side"
    )
    output.add_override_argument(parser)
    output.add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print the findings of one set, or a table of several; 1 where one of them is an error, else 0."""
    from ppafo.parameters import apply_overrides, load_parameter_set
    from ppafo.parameters.audit import audit

    output.check_output(parsed)
    sets = [apply_overrides(load_parameter_set(name), parsed.overrides) for name in parsed.names]
    found = [(parameter_set, audit(parameter_set)) for parameter_set in sets]
    documents = [_document(*one, parsed.overrides) for one in found]
    if len(found) == 1:
        output.deliver(f"audit-{sets[0].name}", _text(*found[0]), documents[0], parsed)
    else:
        output.deliver("audit", _table(found), {"sets": documents}, parsed)
    return output.EXIT_CHECK_FAILED if any(_counts(findings)["error"] for _, findings in found) else output.EXIT_GOOD


def _document(parameter_set: "ParameterSet", findings: "list[Finding]", overrides: list[str]) -> dict[str, Any]:
    return {
        "set": parameter_set.name,
        "overrides": overrides,
        "counts": _counts(findings),
        "findings": [finding.document() for finding in findings],
    }


def _counts(findings: "list[Finding]") -> dict[str, int]:
    return {severity: sum(finding.severity == severity for finding in findings) for severity in _SEVERITIES}


def _table(found: "list[tuple[ParameterSet, list[Finding]]]") -> str:
    """Return a row for each finding and a column for each set, with how serious it is there."""
    from ppafo.answers.writing import align_columns

    columns = [{finding.id: _verdict(finding) for finding in findings} for _, findings in found]
    names = dict.fromkeys(name for column in columns for name in column)
    head = ["finding", *(parameter_set.name for parameter_set, _ in found)]
    return "\n".join(align_columns([head, *([name, *(column.get(name, "-") for column in columns)] for name in names)]))


def _verdict(finding: "Finding") -> str:
    return "accepted" if finding.accepted else finding.severity


def _text(parameter_set: "ParameterSet", findings: "list[Finding]") -> str:
    blocks, counts = ["\n".join(_lines(finding)) for finding in findings], _counts(findings)
    summary = ", ".join(f"{count} {severity}{'' if count == 1 else 's'}" for severity, count in counts.items())
    return "\n\n".join([*blocks, f"{parameter_set.name}: {summary}"])


def _lines(finding: "Finding") -> list[str]:
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
