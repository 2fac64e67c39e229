"""Do damping and dynamic friction agree with the inertia and the printed ratios they were computed from?"""

from collections.abc import Iterator

from ppafo.errors import UnitError
from ppafo.parameters.audit.evidence import Evidence, Interval
from ppafo.parameters.audit.finding import Finding, Side
from ppafo.units import to_si

_INERTIA = "foot_plate.inertia"
_DAMPING = "friction.viscous_damping"
_FRICTION = "friction.dynamic_torque"
_DECAY = "reported.acceleration_over_velocity"
_DECAY_INVERSE = "reported.velocity_over_acceleration"
_DECELERATION = "reported.stopping_deceleration"
_SHIFTS = (-3, -2, -1, 1, 2, 3)


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for each product that does not hold, and a note on one inertia that would make both hold."""
    inertia = evidence.magnitude(_INERTIA)
    decay_path, decay = _decay_rate(evidence)
    if inertia is None:
        return
    implied = []
    for product, rate_path, rate, name in (
        (_DAMPING, decay_path, decay, "damping"),
        (_FRICTION, _DECELERATION, evidence.magnitude(_DECELERATION), "dynamic friction"),
    ):
        printed = evidence.magnitude(product)
        if printed is None or rate is None or inertia.times(rate).meets(printed):
            continue
        implied.append(printed.over(rate))
        yield _product(evidence, product, rate_path, name, _middle(rate))
    if len(implied) > 1:
        yield from _one_inertia(evidence, implied[0], implied[1], decay_path)


def _decay_rate(evidence: Evidence) -> tuple[str, Interval | None]:
    """Return beta/I [1/s] and its path, from the ratio or its inverse; an inverse in 1/s is the ratio itself."""
    direct = evidence.magnitude(_DECAY)
    inverse = evidence.magnitude(_DECAY_INVERSE)
    if direct is not None or inverse is None:
        return _DECAY, direct
    try:
        to_si(1.0, evidence.parameter_set.numbers[_DECAY_INVERSE].unit, "s")
    except UnitError:
        return _DECAY_INVERSE, inverse
    return _DECAY_INVERSE, Interval(1.0, 1.0).over(inverse)


def _middle(interval: Interval) -> float:
    return 0.5 * (interval.low + interval.high)


def _product(evidence: Evidence, product: str, rate_path: str, name: str, rate: float) -> Finding:
    inertia, printed = evidence.number(_INERTIA) or 0.0, evidence.number(product) or 0.0
    expected, implied = inertia * rate, printed / rate
    unit = evidence.declared[product].unit
    ratio = evidence.values_of(rate_path)[0]
    return Finding(
        id=f"{name.replace(' ', '-')}-against-inertia",
        severity="error",
        title=f"{name} is not the product of inertia and the printed ratio",
        values=evidence.values_of(product, _INERTIA, rate_path),
        sides=(
            Side(f"printed {name}", printed, unit),
            Side("inertia times ratio", expected, unit),
            Side("inertia that would agree", implied, "kg m^2"),
        ),
        paragraph=(
            f"Inertia {evidence.in_set_unit(_INERTIA, inertia)} times {abs(float(ratio.value)):g} {ratio.unit} is "
            f"{evidence.in_set_unit(product, expected)}, printed is {evidence.in_set_unit(product, printed)}: a factor "
            f"{printed / expected:.3g}. Reconciled by an inertia of {evidence.in_set_unit(_INERTIA, implied)}, or by "
            f"{evidence.in_set_unit(product, expected)} as the {name}."
        ),
    )


def _one_inertia(evidence: Evidence, damping: Interval, friction: Interval, decay_path: str) -> Iterator[Finding]:
    """Look for one inertia within the printed digits of both products, first the printed one with a moved point."""
    if not damping.meets(friction):
        return
    common = damping.common(friction)
    printed = evidence.number(_INERTIA) or 0.0
    shifted = [printed * 10.0**shift for shift in _SHIFTS if common.low <= printed * 10.0**shift <= common.high]
    best = shifted[0] if shifted else _middle(common)
    written = evidence.in_set_unit(_INERTIA, best)
    slip = (
        f" {written} is the printed {evidence.in_set_unit(_INERTIA, printed)} with the decimal point moved: either the "
        f"inertia or both products carry the slip, and only a weighing can tell which."
        if shifted
        else ""
    )
    yield Finding(
        id="one-inertia-for-both",
        severity="note",
        title=f"damping and dynamic friction both agree with an inertia of {written}",
        values=evidence.values_of(_INERTIA, _DAMPING, _FRICTION, decay_path, _DECELERATION),
        sides=(
            Side("printed inertia", printed, "kg m^2"),
            Side("reconciling inertia", best, "kg m^2"),
            Side("lowest that agrees", common.low, "kg m^2"),
            Side("highest that agrees", common.high, "kg m^2"),
        ),
        paragraph=(
            f"Within the printed digits both products hold for any inertia from "
            f"{evidence.in_set_unit(_INERTIA, common.low)} to {evidence.in_set_unit(_INERTIA, common.high)}.{slip}"
        ),
    )
