"""Checks a parameter set for contradictions: any set, with whatever values it has.

All checks run, in the order of the report, and what the author of the set accepts is taken account of. To add one: a
function in the module of its subject and one line here.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

from ppafo.parameters.audit.chambers import check_filling, check_rotation, check_virtual_work, check_volumes
from ppafo.parameters.audit.evidence import Evidence, Finding, NamedValue, Severity, Side
from ppafo.parameters.audit.flow import check_bores, check_choked_flow, check_flow, check_orifices, check_sonic_flow
from ppafo.parameters.audit.torque import check_inertia, check_published_torque, check_torque_ceiling
from ppafo.parameters.audit.values import (
    check_dimensions,
    check_gas_data,
    check_ideal_gas,
    check_ranges,
    check_statements,
)
from ppafo.parameters.parameter_set import ParameterSet, overridden_paths

__all__ = ["Finding", "NamedValue", "Severity", "Side", "audit"]

CHECKS: dict[str, Callable[[Evidence], Iterator[Finding]]] = {
    "statements": check_statements,
    "dimensions": check_dimensions,
    "ranges": check_ranges,
    "gas data": check_gas_data,
    "orifices": check_orifices,
    "bores": check_bores,
    "choked flow": check_choked_flow,
    "flow": check_flow,
    "sonic flow": check_sonic_flow,
    "inertia": check_inertia,
    "virtual work": check_virtual_work,
    "volumes": check_volumes,
    "rotation": check_rotation,
    "filling": check_filling,
    "torque ceiling": check_torque_ceiling,
    "published torque": check_published_torque,
    "ideal gas": check_ideal_gas,
}
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
