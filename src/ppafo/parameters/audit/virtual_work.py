"""Does the torque constant equal the volume per angle, as virtual work wants: T dtheta = (P1 - P2) dV?"""

from collections.abc import Iterator

from ppafo.parameters.audit.evidence import Evidence, density_change
from ppafo.parameters.audit.finding import Finding, Side

_TORQUE_CONSTANT = "actuator.torque_constant"
_VOLUME_PER_ANGLE = "actuator.volume_per_angle"
_SUPPLY = "supply.pressure"
_TOLERANCE = 0.1


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield a warning where the two differ by more than 10 %, with what a measured gas use says about the volume."""
    found = evidence.numbers(_TORQUE_CONSTANT, _VOLUME_PER_ANGLE)
    if found is None or min(found) <= 0.0 or abs(found[1] / found[0] - 1.0) <= _TOLERANCE:
        return
    torque_constant, volume_per_angle = found
    gas_paths, gas_sides, gas_text = _gas_use(evidence, torque_constant, volume_per_angle)
    yield Finding(
        id="virtual-work",
        severity="warning",
        title="torque constant and volume per angle differ, against virtual work",
        values=evidence.values_of(_TORQUE_CONSTANT, _VOLUME_PER_ANGLE, *gas_paths),
        sides=(
            Side("torque constant", torque_constant, "m^3"),
            Side("volume per angle", volume_per_angle, "m^3/rad"),
            *gas_sides,
        ),
        paragraph=(
            f"A frictionless vane that turns by dtheta does the work T dtheta = (P1 - P2) dV, so that the torque "
            f"constant {1e6 * torque_constant:.4g} cm^3 and the volume per angle {1e6 * volume_per_angle:.4g} cm^3/rad "
            f"should be one number; the volume is {volume_per_angle / torque_constant:.2g} times the torque constant."
            f"{gas_text} Reconciled by measuring the volume of gas that a full turn displaces; until then energy and "
            f"efficiency figures are uncertain by the same factor."
        ),
    )


def _gas_use(
    evidence: Evidence, torque_constant: float, volume_per_angle: float
) -> tuple[tuple[str, ...], tuple[Side, ...], str]:
    """Return paths, numbers and a sentence on the volume that the gas for one filling needs."""
    gas, supply, angles = evidence.gas(), evidence.number(_SUPPLY), evidence.angle_range()
    path = _single_fill(evidence)
    if gas is None or supply is None or supply <= evidence.atmosphere() or angles is None or path is None:
        return (), (), ""
    density = density_change(gas, supply - evidence.atmosphere())
    used, turn = evidence.number(path) or 0.0, abs(angles[3] - angles[1])
    needed, by_torque, by_volume = used / density, torque_constant * turn, volume_per_angle * turn
    nearer = "volume per angle" if abs(needed - by_volume) < abs(needed - by_torque) else "torque constant"
    sides = (
        Side("volume that the gas use needs", needed, "m^3"),
        Side("volume swept by the torque constant", by_torque, "m^3"),
        Side("volume swept by the volume per angle", by_volume, "m^3"),
    )
    text = (
        f" Filling 1 cm^3 from atmosphere to supply takes {density:.3g} mg of gas, so the "
        f"{evidence.in_set_unit(path, used)} of one filling occupy {1e6 * needed:.3g} cm^3; over the whole "
        "range the vane "
        f"sweeps {1e6 * by_torque:.3g} cm^3 by the torque constant and {1e6 * by_volume:.3g} cm^3 by the volume per "
        f"angle. The gas use favours the {nearer}."
    )
    return (path, _SUPPLY, angles[0], angles[2]), sides, text


def _single_fill(evidence: Evidence) -> str | None:
    """Return the path of the first gas use of a single filling that the set reports."""
    paths = (f"reported.valves.{name}.single_fill_gas" for name in evidence.parameter_set.valve_kinds)
    return next((path for path in paths if evidence.number(path)), None)
