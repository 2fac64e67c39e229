"""Consistency checks of a parameter set.

All checks run, in the order of the report. A reason given by the author of the set accepts a finding. To add a check,
write a function in the module of its subject and list it here.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

from ppafo.parameters.audit.chambers import (
    check_filling,
    check_rotation,
    check_rounded_table,
    check_stroke,
    check_virtual_work,
    check_volumes,
)
from ppafo.parameters.audit.changes import changes
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, NamedValue, Severity
from ppafo.parameters.audit.inertia import check_inertia
from ppafo.parameters.audit.orifices import check_bores, check_flow, check_orifices
from ppafo.parameters.audit.torque import (
    check_published_torque,
    check_set_pressures,
    check_torque_ceiling,
    check_vacuum,
)
from ppafo.parameters.audit.values import (
    check_choked_flow,
    check_contradictions,
    check_dimensions,
    check_gas_data,
    check_ideal_gas,
    check_missing,
    check_ranges,
    check_statements,
)
from ppafo.parameters.loading import set_or_load
from ppafo.parameters.parameter_set import ParameterSet, overridden_paths, with_followers

__all__ = ["AuditFinding", "ComparedNumber", "NamedValue", "Severity", "changed_paths", "findings_of"]

CHECKS: dict[str, Callable[[Evidence], Iterator[AuditFinding]]] = {
    "missing": check_missing,
    "contradictions": check_contradictions,
    "statements": check_statements,
    "dimensions": check_dimensions,
    "ranges": check_ranges,
    "gas data": check_gas_data,
    "orifices": check_orifices,
    "bores": check_bores,
    "choked flow": check_choked_flow,
    "flow": check_flow,
    "inertia": check_inertia,
    "virtual work": check_virtual_work,
    "volumes": check_volumes,
    "rounded table": check_rounded_table,
    "rotation": check_rotation,
    "stroke": check_stroke,
    "filling": check_filling,
    "vacuum": check_vacuum,
    "set pressures": check_set_pressures,
    "torque ceiling": check_torque_ceiling,
    "published torque": check_published_torque,
    "ideal gas": check_ideal_gas,
}
_ORDER = {"error": 0, "warning": 1, "note": 2}


def findings_of(audited: ParameterSet, parent: ParameterSet | None = None) -> list[AuditFinding]:
    """Return the contradictions and remarkable values of a set, errors first; see ``ppafo.audit``.

    ``parent`` is the set from which this one was made, by default the one that its file names. An accepting reason that
    the parent states too lapses if the set changes a value of the finding.
    """
    of_parent = set_or_load(parent or audited.parent or None)
    evidence = Evidence(with_followers(audited), audited.declarations())
    findings = [finding for check in CHECKS.values() for finding in check(evidence)]
    changed, ids = overridden_paths(audited), {finding.id for finding in findings}
    judged = []
    for finding in findings:
        reason = audited.accepted.get(finding.id, "")
        is_copied = of_parent is not None and of_parent.accepted.get(finding.id) == reason
        # An override, or a change in a copy, of a value of the finding makes the author's reason lapse.
        others = changed_paths(audited, of_parent) if is_copied else changed
        if reason and not any(value.path in others for value in finding.values):
            severity = "warning" if finding.severity == "error" else finding.severity
            judged.append(replace(finding, severity=severity, accepted=reason))
        else:
            judged.append(finding)
    # With overrides a finding may be gone for that reason alone: its acceptance is not idle.
    idle = {} if changed else {name: why for name, why in audited.accepted.items() if name not in ids}
    judged += [
        AuditFinding(
            id="idle-acceptance",
            severity="warning",
            title=f"the set accepts '{name}', which does not exist",
            why=f"Its reason is: {why}",
        )
        for name, why in idle.items()
    ]
    return sorted(judged, key=lambda finding: _ORDER[finding.severity])


def changed_paths(parameter_set: ParameterSet, parent: ParameterSet | None) -> frozenset[str]:
    """Return the paths of values set by overrides or different from the parent set."""
    of_file = frozenset[str]() if parent is None else {change.path for change in changes(parameter_set, parent)}
    return overridden_paths(parameter_set) | of_file
