"""Checks of actuator torques: largest torque at the supply, vacuum, published torques. Equation (2)."""

import math
from collections.abc import Iterator

from ppafo.errors import ParameterError
from ppafo.model.gas import choked_flow_constant
from ppafo.model.orifice import isentropic_flow_function
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, Severity
from ppafo.parameters.device import VANE, Gas
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.reach import torque_reach
from ppafo.units import from_si, to_si
from ppafo.units.shown import shown_in, shown_unit

_TORQUE_CONSTANT = "actuator.torque_constant"
_DEMAND = "reported.demanded_torque"
_STATIC = "friction.static_torque"
_SUPPLIES = ("supply.pressure", "supply.dorsiflexion_pressure", "reported.other_supply_pressure")
_TOLERANCE = 0.1
"""Relative tolerance [-] of a torque published with one or two digits."""
_REACHED = 0.9
"""Fraction of the final torque [-] that defines the filling time, since the approach is asymptotic."""
_PUSH_OFF = 0.2
"""Time [s] of push-off: from 42 to 61 % of the built-in gait's stride of 1.04 s."""
_TOE_OFF = math.radians(110.0)
"""Angle [rad] of the vane at toe-off: 20 deg of plantarflexion."""
_INTERVALS = 200
"""Number of pressure intervals in the integration of a filling time."""
_ANGLES = 40
"""Number of angle intervals between the stops for an actuator's torque."""
_LIMIT = "No valve or controller can follow a reference above this torque."


def check_torque_ceiling(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield the torque ceiling for each supply: a note, a warning below the demand, an error below static friction."""
    constant = evidence.number(_TORQUE_CONSTANT)
    supplies = {path: value for path in _SUPPLIES if (value := evidence.number(path)) is not None}
    if supplies and evidence.parameter_set.actuator_kind != VANE:
        yield from _ceiling_by_angle(evidence)
    if constant is None or constant <= 0.0 or not supplies:
        return
    ceilings = {path: constant * abs(value - evidence.atmosphere()) for path, value in supplies.items()}
    severity, verdict = _verdict(evidence, max(ceilings.values()), constant)
    # Torque constants are quoted per psi in the field, or per bar where the set has bar.
    with shown_in(evidence.parameter_set.shown):
        unit = shown_unit("Pa_d")
    per_unit = evidence.torque(constant * to_si(1.0, unit, "Pa_d"), "#.3g")
    pressures = {path: evidence.in_set_unit(path, value) for path, value in supplies.items()}
    torques = (f"{evidence.torque(ceilings[path], '#.3g')} at {pressures[path]} ({path})" for path in supplies)
    yield AuditFinding(
        id="torque-ceiling",
        severity=severity,
        title=f"the supply allows at most {evidence.torque(max(ceilings.values()), '#.3g')}",
        values=evidence.values_of(_TORQUE_CONSTANT, *supplies, _DEMAND, _STATIC),
        sides=tuple(ComparedNumber(f"ceiling at {path}", value, "N m") for path, value in ceilings.items()),
        paragraph=(
            f"The torque constant is {per_unit}/{unit.removesuffix('_d')}. With one chamber at supply and "
            f"the other at atmosphere the vane gives {', '.join(torques)}, before friction.{verdict}"
        ),
    )


def check_vacuum(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a note on each supply below the atmosphere with the depth of the vacuum; a warning for an absolute unit."""
    for path in _SUPPLIES[:2]:
        entry, pressure = evidence.parameter_set.numbers.get(path), evidence.number(path)
        if entry is None or pressure is None or not 0.0 < pressure < evidence.atmosphere():
            continue
        depth, chamber = evidence.atmosphere() - pressure, 1 if path == _SUPPLIES[0] else 2
        effect = "lowers" if chamber == 1 else "raises"
        doubt = f" If {entry.value:g} {entry.unit} was read from a gauge, write '_g' instead of '_a'."
        yield AuditFinding(
            id=f"vacuum-{chamber}",
            severity="warning" if entry.unit.endswith("_a") else "note",
            title=f"{path} is a vacuum, {depth / 1e3:.3g} kPa below the atmosphere",
            values=evidence.values_of(path, ATMOSPHERE_PATH),
            sides=(ComparedNumber("depth of the vacuum", depth, "Pa"),),
            paragraph=(
                f"A valve that connects chamber {chamber} to this supply evacuates the chamber, and ambient air "
                f"refills the chamber: evacuation {effect} the torque.{doubt if entry.unit.endswith('_a') else ''}"
            ),
        )


def _ceiling_by_angle(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield the torque ceiling of an actuator with angle-dependent torque: maximum and minimum between the stops."""
    from ppafo.parameters.building import build_device

    try:
        device = build_device(evidence.parameter_set)
    except ParameterError:
        return
    chambers = "the chamber at supply or" if device.actuator.has_one_chamber else "one chamber at supply and the other"
    lowest, highest = float(device.actuator.angle_min), float(device.actuator.angle_max)
    angles = [lowest + (highest - lowest) * number / _ANGLES for number in range(_ANGLES + 1)]
    downward, upward = zip(*(torque_reach(device, angle) for angle in angles), strict=True)
    texts, sides = [], []
    for direction, torques in (("up", list(upward)), ("down", [-torque for torque in downward])):
        largest = max(torques)
        angle = math.degrees(angles[torques.index(largest)])
        texts.append(
            f"{evidence.torque(largest, '#.3g')} {direction} at {angle:.3g} deg (at other angles less, down to "
            f"{evidence.torque(min(torques), '#.3g')})"
        )
        sides.append(ComparedNumber(f"most {direction}", largest, "N m"))
    ceiling = max(side.value for side in sides)
    static = evidence.number(_STATIC)
    sticks = static is not None and static >= ceiling
    yield AuditFinding(
        id="torque-ceiling",
        severity="error" if sticks else "note",
        title="the actuator gives at most "
        + " and ".join(f"{evidence.torque(side.value, '#.3g')} {side.label.removeprefix('most ')}" for side in sides),
        values=evidence.values_of(*_SUPPLIES, _STATIC),
        sides=tuple(sides),
        paragraph=(
            f"With {chambers} at atmosphere the actuator gives {' and '.join(texts)}, before friction. "
            f"{'Static friction is larger: the joint cannot move.' if sticks else _LIMIT}"
        ),
    )


def _verdict(evidence: Evidence, ceiling: float, constant: float) -> tuple[Severity, str]:
    """Return severity and sentence on a torque ceiling [N m] of a vane with a torque constant [N m/Pa]."""
    static, demand = evidence.number(_STATIC), evidence.number(_DEMAND)
    with shown_in(evidence.parameter_set.shown):
        unit = shown_unit("Pa_d")
    if static is not None and static >= ceiling:
        needed = f"{from_si(static / constant, unit, 'Pa_d'):.4g} {unit}"
        return "error", f" Static friction of {evidence.torque(static)} is larger: the vane cannot move below {needed}."
    if demand is not None and demand > ceiling:
        needed = f"{from_si(demand / constant, unit, 'Pa_d'):.4g} {unit.removesuffix('_d')}_g"
        return "warning", (
            f" The required {evidence.torque(demand)} exceed this ceiling, so every valve and controller leaves an "
            f"error of {evidence.torque(demand - ceiling)}; raise the supply to {needed}, or require less torque."
        )
    return "note", f" {_LIMIT}"


def check_published_torque(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield findings on published torques: comparison with the torque at supply pressure, filling time in walking.

    Agreement gives a note, disagreement a warning.
    """
    for name in ("rated", "walking"):
        paths = f"reported.{name}_torque", f"reported.{name}_torque_pressure"
        numbers = evidence.numbers(_TORQUE_CONSTANT, *paths)
        if numbers is None or min(numbers) <= 0.0 or numbers[2] <= evidence.atmosphere():
            continue
        constant, torque, pressure = numbers
        note = evidence.parameter_set.numbers[paths[0]].note
        at_rest = constant * (pressure - evidence.atmosphere())
        agrees = abs(at_rest / torque - 1.0) <= _TOLERANCE
        yield AuditFinding(
            id=f"{name}-torque",
            severity="note" if agrees else "warning",
            title=f"the published {name} torque {'agrees' if agrees else 'does not agree'} with the torque constant",
            values=evidence.values_of(_TORQUE_CONSTANT, *paths),
            sides=(
                ComparedNumber("torque constant times pressure", at_rest, "N m"),
                ComparedNumber("published", torque, "N m"),
            ),
            paragraph=(
                f"At {evidence.in_set_unit(paths[1], pressure)} the vane gives {evidence.torque(at_rest)}; the "
                f"published torque is {evidence.torque(torque)}. This checks only the torque constant, since the "
                f"volume has no influence at rest. {note}"
            ).rstrip(),
        )
        if name == "walking":
            yield from _while_walking(evidence, numbers[1], numbers[2])


def _while_walking(evidence: Evidence, torque: float, pressure: float) -> Iterator[AuditFinding]:
    """Yield, for each valve, the time that chamber 1 with its volume at toe-off takes to reach the torque."""
    gas, volume = evidence.gas(), evidence.chamber_1_volume(_TOE_OFF)
    constant, atmosphere = evidence.number(_TORQUE_CONSTANT) or 0.0, evidence.atmosphere()
    target = atmosphere + _REACHED * min(torque / constant, pressure - atmosphere)
    for valve in evidence.parameter_set.valve_kinds:
        sizes = f"valves.{valve}.area", f"valves.{valve}.discharge_coefficient"
        numbers = evidence.numbers(*sizes)
        if gas is None or volume is None or volume <= 0.0 or numbers is None or min(numbers) <= 0.0:
            continue
        time = _filling_time(gas, volume, numbers[0] * numbers[1], (atmosphere, target, pressure))
        severity: Severity = "note" if time <= _PUSH_OFF else "warning"
        yield AuditFinding(
            id=f"walking-torque-in-time-{valve}",
            severity=severity,
            title=f"valve '{valve}' fills chamber 1 {'within' if time <= _PUSH_OFF else 'too slowly for'} a push-off",
            values=evidence.values_of(
                "actuator.displacement_per_radian", "actuator.dead_volume_1", *sizes, "reported.walking_torque_pressure"
            ),
            sides=(ComparedNumber("time to fill", time, "s"), ComparedNumber("time of push-off", _PUSH_OFF, "s")),
            paragraph=(
                f"At toe-off chamber 1 has {1e6 * volume:.3g} cm^3. Through the open valve '{valve}', "
                f"{100.0 * _REACHED:.0f} % of the published walking torque of {evidence.torque(torque)} is reached in "
                f"{1e3 * time:.0f} ms; push-off lasts about {1e3 * _PUSH_OFF:.0f} ms. The published walks may have "
                "used other valves."
            ),
        )


def _filling_time(gas: Gas, volume: float, area: float, pressures: tuple[float, float, float]) -> float:
    """Return the time [s] to fill a fixed volume [m^3] through Cd A [m^2]; pressures [Pa]: from, to, supply."""
    initial, final, supply = pressures
    choked = area * choked_flow_constant(gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature) * supply
    interval = (final - initial) / _INTERVALS
    middles = (initial + (number + 0.5) * interval for number in range(_INTERVALS))
    slowings = (1.0 / isentropic_flow_function(middle / supply, gas.heat_capacity_ratio) for middle in middles)
    return volume * interval * sum(slowings) / (gas.specific_gas_constant * gas.temperature * choked)
