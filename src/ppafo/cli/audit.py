"""``ppafo audit SET``: what in a parameter set contradicts itself, and what would reconcile it."""

import argparse
import textwrap
from typing import TYPE_CHECKING, Any

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_output,
    deliver,
)

if TYPE_CHECKING:
    from ppafo.parameters import ParameterSet
    from ppafo.parameters.audit import Finding

_WIDTH = 100
_INDENT = "    "
_SEVERITIES = ("error", "warning", "note")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("name", metavar="SET", help="name of a set, or a .toml file")
    add_override_argument(parser)
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print the findings; 1 where one of them is an error, else 0."""
    from ppafo.parameters import apply_overrides, load_parameter_set
    from ppafo.parameters.audit import audit

    check_output(parsed)
    parameter_set = apply_overrides(load_parameter_set(parsed.name), parsed.overrides)
    findings = audit(parameter_set)
    counts = {severity: sum(finding.severity == severity for finding in findings) for severity in _SEVERITIES}
    document = {
        "set": parameter_set.name,
        "overrides": parsed.overrides,
        "counts": counts,
        "findings": [finding.document() for finding in findings],
    }
    deliver(f"audit-{parameter_set.name}", _text(parameter_set, findings, counts), document, parsed)
    return EXIT_CHECK_FAILED if counts["error"] else EXIT_GOOD


def _text(parameter_set: "ParameterSet", findings: "list[Finding]", counts: dict[str, int]) -> str:
    blocks = ["\n".join(_lines(finding)) for finding in findings]
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
