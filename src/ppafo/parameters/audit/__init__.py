"""Consistency checks of a parameter set.

All questions are asked, in the order of the report; one whose numbers the set lacks has no answer. A reason given by
the author of the set accepts a finding. To add a question, write a function in the module of its subject and list it
here.
"""

import contextlib
from dataclasses import replace

from ppafo.errors import ParameterError
from ppafo.parameters.audit import actuator, orifices, proportions, values
from ppafo.parameters.audit.changes import changes
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, NamedValue, Question, Severity
from ppafo.parameters.loading import set_or_load
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, overridden_paths, with_followers
from ppafo.wording import count_of

__all__ = ["AuditFinding", "ComparedNumber", "NamedValue", "Severity", "changed_paths", "findings_of"]

QUESTIONS: tuple[Question, ...] = (
    values.missing,
    values.contradictions,
    values.statements,
    values.dimensions,
    values.ranges,
    values.gas_data,
    orifices.forms,
    orifices.open_flow,
    orifices.bores,
    values.flow_constants,
    orifices.flow,
    actuator.inertia,
    actuator.virtual_work,
    actuator.volumes,
    actuator.rounded_table,
    actuator.rotation,
    actuator.stroke,
    actuator.filling,
    actuator.vacuum,
    actuator.set_pressures,
    actuator.torque_ceiling,
    actuator.published_torque,
    values.ideal_gas,
    proportions.unusual,
)
_ORDER = {"error": 0, "warning": 1, "note": 2}


def findings_of(audited: ParameterSet, parent: ParameterSet | None = None) -> list[AuditFinding]:
    """Return the contradictions and remarkable values of a set, errors first; see ``ppafo.audit``.

    ``parent`` is the set from which this one was made, by default the one that its file names. An accepting reason that
    the parent states too lapses if the set changes a value of the finding.
    """
    of_parent = set_or_load(parent or audited.parent or None)
    # Numbers cannot be compared without the zero of gauge pressures.
    atmospheric_pressure(audited)
    evidence = Evidence(with_followers(audited))
    findings = list[AuditFinding]()
    for question in QUESTIONS:
        with contextlib.suppress(ParameterError):
            findings.extend(question(evidence))
    if of_parent is not None:
        before = of_parent.entries()
        after = evidence.parameter_set.entries()
        copied = [
            change.path
            for change in changes(audited, of_parent)
            if (old := before.get(change.path)) is not None
            and (new := after.get(change.path)) is not None
            and (new.origin, new.source) == (old.origin, old.source)
            # A number that follows another has its source from there.
            and not new.note.startswith("follows")
        ]
        if copied:
            findings.append(
                evidence.finding(
                    "copied-sources",
                    f"{count_of(len(copied), 'value')} changed, with the source of the parent set",
                    copied,
                    why=f"State where they are from: {', '.join(copied)}.",
                    severity="warning",
                )
            )
    changed = overridden_paths(audited)
    ids = {finding.id for finding in findings}
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
