"""Checks of damping and dynamic friction against inertia and reported decay ratios. Equations (1) and (10)."""

from collections.abc import Iterator

from ppafo.errors import UnitError
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, ReportedRange
from ppafo.units import to_si

_INERTIA = "foot_plate.inertia"
_DAMPING = "friction.viscous_damping"
_FRICTION = "friction.dynamic_torque"
_DECAY = "reported.acceleration_over_velocity"
_DECAY_INVERSE = "reported.velocity_over_acceleration"
_DECELERATION = "reported.stopping_deceleration"
_SHIFTS = (-3, -2, -1, 1, 2, 3)
"""Powers of ten of a misplaced decimal point or a wrong prefix."""


def check_inertia(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield errors for damping or friction contradicting inertia times decay rate, and a note on a fitting inertia."""
    inertia = evidence.magnitude(_INERTIA)
    decay_path, decay = _decay_rate(evidence)
    if inertia is None:
        return
    inertias = []
    for product, rate_path, rate, name in (
        (_DAMPING, decay_path, decay, "damping"),
        (_FRICTION, _DECELERATION, evidence.magnitude(_DECELERATION), "dynamic friction"),
    ):
        reported = evidence.magnitude(product)
        if reported is None or rate is None or inertia.times(rate).meets(reported):
            continue
        inertias.append(reported.over(rate))
        stated, number = evidence.number(_INERTIA) or 0.0, evidence.number(product) or 0.0
        expected, needed = stated * _middle(rate), number / _middle(rate)
        unit = evidence.declared[product].unit
        yield AuditFinding(
            id=f"{name.replace(' ', '-')}-against-inertia",
            title=f"{name} is not the product of inertia and the reported ratio",
            values=evidence.values_of(product, _INERTIA, rate_path),
            sides=(
                ComparedNumber(f"reported {name}", number, unit),
                ComparedNumber("inertia times ratio", expected, unit),
                ComparedNumber("inertia that would agree", needed, "kg m^2"),
            ),
        )
    # Only if both products disagree with the reported inertia.
    if len(inertias) > 1:
        yield from _one_inertia(evidence, inertias[0], inertias[1], decay_path)


def _decay_rate(evidence: Evidence) -> tuple[str, ReportedRange | None]:
    """Return beta/I [1/s] and its path, from the ratio or its inverse; an inverse given in 1/s is the ratio."""
    direct = evidence.magnitude(_DECAY)
    inverse = evidence.magnitude(_DECAY_INVERSE)
    if direct is not None or inverse is None:
        return _DECAY, direct
    try:
        to_si(1.0, evidence.parameter_set.numbers[_DECAY_INVERSE].unit, "s")
    except UnitError:
        return _DECAY_INVERSE, inverse
    return _DECAY_INVERSE, ReportedRange(1.0, 1.0).over(inverse)


def _middle(interval: ReportedRange) -> float:
    return 0.5 * (interval.low + interval.high)


def _one_inertia(
    evidence: Evidence, damping: ReportedRange, friction: ReportedRange, decay_path: str
) -> Iterator[AuditFinding]:
    """Yield a note on an inertia that fits both products, preferably the reported one with its decimal point moved."""
    if not damping.meets(friction):
        return
    common = ReportedRange(max(damping.low, friction.low), min(damping.high, friction.high))
    reported = evidence.number(_INERTIA) or 0.0
    shifted = [reported * 10.0**shift for shift in _SHIFTS if common.low <= reported * 10.0**shift <= common.high]
    # A moved decimal point is the most likely error; otherwise the middle of the common range.
    reconciling = shifted[0] if shifted else _middle(common)
    yield AuditFinding(
        id="one-inertia-for-both",
        severity="note",
        title=f"damping and friction both agree with an inertia of {evidence.in_set_unit(_INERTIA, reconciling)}",
        values=evidence.values_of(_INERTIA, _DAMPING, _FRICTION, decay_path, _DECELERATION),
        sides=(
            ComparedNumber("reported inertia", reported, "kg m^2"),
            ComparedNumber("reconciling inertia", reconciling, "kg m^2"),
            ComparedNumber("lowest that agrees", common.low, "kg m^2"),
            ComparedNumber("highest that agrees", common.high, "kg m^2"),
        ),
        why="The reported inertia with a shifted decimal point reconciles both." if shifted else "",
    )
