"""What torque can the supply hold at most, and is it enough? Equation (2)."""

from collections.abc import Iterator

from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Severity, Side
from ppafo.units import to_si

_TORQUE_CONSTANT = "actuator.torque_constant"
_DEMAND = "reported.demanded_torque"
_STATIC = "friction.static_torque"
_SUPPLIES = ("supply.pressure", "supply.dorsiflexion_pressure", "reported.other_supply_pressure")


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield the ceiling for each supply: a note, a warning below the demand, an error below static friction."""
    constant = evidence.number(_TORQUE_CONSTANT)
    supplies = {path: value for path in _SUPPLIES if (value := evidence.number(path)) is not None}
    if constant is None or constant <= 0.0 or not supplies:
        return
    ceilings = {path: constant * (value - evidence.atmosphere()) for path, value in supplies.items()}
    severity, verdict = _verdict(evidence, max(ceilings.values()), constant)
    per_psi = constant * to_si(1.0, "psi", "Pa")
    pressures = {path: evidence.in_set_unit(path, value) for path, value in supplies.items()}
    held = (f"{ceilings[path]:#.3g} N m at {pressures[path]} ({path})" for path in supplies)
    yield Finding(
        id="torque-ceiling",
        severity=severity,
        title=f"the supply holds at most {max(ceilings.values()):#.3g} N m",
        values=evidence.values_of(_TORQUE_CONSTANT, *supplies, _DEMAND, _STATIC),
        sides=tuple(Side(f"ceiling at {path}", value, "N m") for path, value in ceilings.items()),
        paragraph=(
            f"The torque constant is {per_psi:#.3g} N m/psi. With one chamber at supply and the other at atmosphere "
            f"the vane holds {', '.join(held)}, before friction.{verdict}"
        ),
    )


def _verdict(evidence: Evidence, ceiling: float, constant: float) -> tuple[Severity, str]:
    static, demand = evidence.number(_STATIC), evidence.number(_DEMAND)
    if static is not None and static >= ceiling:
        needed = static / constant / 1e3
        return "error", f" Static friction of {static:.3g} N m is more: the vane cannot move below {needed:.4g} kPa_d."
    if demand is not None and demand > ceiling:
        needed = demand / constant / 1e3
        return "warning", (
            f" The requested {demand:.3g} N m lie above it, so that every valve and controller keeps an error of "
            f"{demand - ceiling:.3g} N m; reconciled by {needed:.4g} kPa_g of supply, or by requesting less."
        )
    return "note", " A reference above that cannot be followed by any valve or controller."
