"""Does the torque constant equal the volume per angle, as virtual work wants: T dtheta = (P1 - P2) dV?"""

from collections.abc import Iterator

from ppafo.parameters.audit.evidence import Evidence, density_change
from ppafo.parameters.audit.finding import Finding, Side

_TORQUE_CONSTANT = "actuator.torque_constant"
_VOLUME_PER_ANGLE = "actuator.volume_per_angle"
_EFFICIENCY = "reported.torque_efficiency"
_SUPPLY = "supply.pressure"
_ID = "virtual-work"
_TOLERANCE = 0.1


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield a warning where the two differ by more than 10 %, a note where a stated efficiency explains it."""
    found, efficiency = evidence.numbers(_TORQUE_CONSTANT, _VOLUME_PER_ANGLE), evidence.number(_EFFICIENCY)
    if found is None or min(found) <= 0.0:
        return
    if efficiency is not None and abs(found[1] * efficiency / found[0] - 1.0) <= _TOLERANCE:
        yield _closure(evidence, found[0] / found[1])
    elif abs(found[1] / found[0] - 1.0) > _TOLERANCE:
        yield _contradiction(evidence, *found)


def _closure(evidence: Evidence, ratio: float) -> Finding:
    """Return the note that the shaft's work is that of the gas less the stated loss."""
    return Finding(
        id=_ID,
        severity="note",
        title="torque constant and volume per angle agree, with the stated efficiency",
        values=evidence.values_of(_TORQUE_CONSTANT, _VOLUME_PER_ANGLE, _EFFICIENCY),
        sides=(Side("torque constant over volume per angle", ratio, ""),),
        paragraph=(
            f"Energy closes: the shaft gets {100.0 * ratio:.3g} % of the work p dV of the gas, and the other "
            f"{100.0 * (1.0 - ratio):.3g} % are the stated loss. The model takes the same ratio where the shaft drives "
            "the vane and compresses gas, where a real loss has the other sign."
        ),
    )


def _contradiction(evidence: Evidence, torque_constant: float, volume_per_angle: float) -> Finding:
    gas_paths, gas_sides, gas_text = _gas_use(evidence, torque_constant, volume_per_angle)
    return Finding(
        id=_ID,
        severity="warning",
        title="torque constant and volume per angle differ, against virtual work",
        values=evidence.values_of(_TORQUE_CONSTANT, _VOLUME_PER_ANGLE, _EFFICIENCY, *gas_paths),
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
    path = evidence.single_fill_gas()
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
