"""Runs all checks on a set and takes account of what its author accepts."""

from collections.abc import Iterator
from dataclasses import replace

from ppafo.parameters.audit.catalog import CHECKS
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding
from ppafo.parameters.overrides import overridden_paths
from ppafo.parameters.parameter_set import ParameterSet

_ORDER = {"error": 0, "warning": 1, "note": 2}


def audit(parameter_set: ParameterSet) -> list[Finding]:
    """Return what contradicts, or deserves attention in, any parameter set; errors first.

    An error that the set accepts with a reason becomes a warning that shows the reason. A reason for something that
    is not found is a warning too, so that it does not outlive what it excuses.
    """
    evidence = Evidence(parameter_set, parameter_set.declarations())
    found = [finding for check in CHECKS.values() for finding in check(evidence)]
    changed = overridden_paths(parameter_set)
    judged = [_judge(finding, parameter_set, changed) for finding in found]
    if not changed:
        judged += _idle_reasons(parameter_set, {finding.id for finding in found})
    return sorted(judged, key=lambda finding: _ORDER[finding.severity])


def _judge(finding: Finding, parameter_set: ParameterSet, changed: frozenset[str]) -> Finding:
    """Apply the set's reason, which speaks of the set's own values and not of overrides."""
    reason = parameter_set.accepted.get(finding.id, "")
    if not reason or any(value.path in changed for value in finding.values):
        return finding
    severity = "warning" if finding.severity == "error" else finding.severity
    return replace(finding, severity=severity, accepted=reason)


def _idle_reasons(parameter_set: ParameterSet, found: set[str]) -> Iterator[Finding]:
    for identifier, reason in parameter_set.accepted.items():
        if identifier not in found:
            yield Finding(
                id="idle-acceptance",
                severity="warning",
                title=f"the set accepts '{identifier}', which does not exist",
                values=(),
                sides=(),
                paragraph=f"There is no finding '{identifier}'. Remove the entry from the set; its reason is: {reason}",
            )
