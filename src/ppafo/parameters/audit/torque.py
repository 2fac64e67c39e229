"""Checks of actuator torques: largest torque at the supply, vacuum, published torques. Equation (2)."""

import math
from collections.abc import Iterator
from typing import cast

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


def check_torque_ceiling(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield the torque ceiling for each supply: a note, a warning below the demand, an error below static friction."""
    constant, atmosphere = evidence.number(_TORQUE_CONSTANT), evidence.atmosphere()
    supplies = {path: value for path in _SUPPLIES if (value := evidence.number(path)) is not None}
    if supplies and evidence.parameter_set.actuator_kind != VANE:
        sides, why = _ceilings_by_angle(evidence)
    elif constant is not None and constant > 0.0:
        ceilings = {path: constant * abs(value - atmosphere) for path, value in supplies.items()}
        sides, why = tuple(ComparedNumber(f"ceiling at {path}", value, "N m") for path, value in ceilings.items()), []
    else:
        return
    if not sides:
        return
    ceiling, needed = max(side.value for side in sides), 0.0
    severity: Severity = "note"
    for path, verdict in ((_DEMAND, "warning"), (_STATIC, "error")):
        torque = evidence.number(path)
        if torque is not None and (torque >= ceiling if path == _STATIC else torque > ceiling):
            severity, needed = cast("Severity", verdict), torque
    if constant:
        # Torque constants are quoted per psi in the field, or per bar where the set has bar.
        with shown_in(evidence.parameter_set.shown):
            unit = shown_unit("Pa_d").removesuffix("_d")
        why.append(
            f"The torque constant is {evidence.torque(constant * to_si(1.0, f'{unit}_d', 'Pa_d'), '#.3g')}/{unit}."
        )
        if needed:
            why.append(
                f"{evidence.torque(needed)} need {from_si(needed / constant, f'{unit}_d', 'Pa_d'):.4g} {unit}_g."
            )
    yield AuditFinding(
        id="torque-ceiling",
        severity=severity,
        title=f"the supply allows at most {evidence.torque(ceiling, '#.3g')}",
        values=evidence.values_of(_TORQUE_CONSTANT, *supplies, _DEMAND, _STATIC),
        sides=sides,
        why=" ".join(why),
    )


def _ceilings_by_angle(evidence: Evidence) -> tuple[tuple[ComparedNumber, ...], list[str]]:
    """Return the largest and least torques up and down between the stops, and the angles of the largest."""
    from ppafo.parameters.building import build_device

    try:
        device = build_device(evidence.parameter_set)
    except ParameterError:
        return (), []
    lowest, highest = float(device.actuator.angle_min), float(device.actuator.angle_max)
    angles = [lowest + (highest - lowest) * number / _ANGLES for number in range(_ANGLES + 1)]
    downward, upward = zip(*(torque_reach(device, angle) for angle in angles), strict=True)
    torques = {"up": [*upward], "down": [-torque for torque in downward]}
    sides = tuple(
        ComparedNumber(f"{word} {direction}", torque, "N m")
        for direction, found in torques.items()
        for word, torque in (("most", max(found)), ("least", min(found)))
    )
    at = (f"{way} at {math.degrees(angles[found.index(max(found))]):.3g} deg" for way, found in torques.items())
    return sides, [f"Most {' and '.join(at)}."]


def check_vacuum(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a note on each supply below the atmosphere with the depth of the vacuum; a warning for an absolute unit."""
    for path in _SUPPLIES[:2]:
        entry, pressure = evidence.parameter_set.numbers.get(path), evidence.number(path)
        if entry is None or pressure is None or not 0.0 < pressure < evidence.atmosphere():
            continue
        depth, chamber = evidence.atmosphere() - pressure, 1 if path == _SUPPLIES[0] else 2
        yield AuditFinding(
            id=f"vacuum-{chamber}",
            severity="warning" if entry.unit.endswith("_a") else "note",
            title=f"{path} is a vacuum, {depth / 1e3:.3g} kPa below the atmosphere",
            values=evidence.values_of(path, ATMOSPHERE_PATH),
            sides=(ComparedNumber("depth of the vacuum", depth, "Pa"),),
            why="Read from a gauge, it would have '_g' instead of '_a'." if entry.unit.endswith("_a") else "",
        )


def check_set_pressures(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a note on each pressure regulator that can be set above its supply, with the command from which it is."""
    for name in evidence.parameter_set.valve_kinds:
        paths = (f"valves.{name}.lowest_pressure", f"valves.{name}.highest_pressure", _SUPPLIES[0])
        numbers = evidence.numbers(*paths)
        if numbers is None or not numbers[0] < numbers[2] < numbers[1]:
            continue
        share = (numbers[2] - numbers[0]) / (numbers[1] - numbers[0])
        yield AuditFinding(
            id=f"set-pressure-of-{name}",
            severity="note",
            title=f"valve '{name}' can be set above its supply: beyond a command of {share:.2g} it gives no more",
            values=evidence.values_of(*paths),
            sides=(ComparedNumber("command that sets the supply pressure", share, "1"),),
        )


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
            why=note,
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
            why=f"{100.0 * _REACHED:.0f} % of the published walking torque are reached, with the volume at toe-off.",
        )


def _filling_time(gas: Gas, volume: float, area: float, pressures: tuple[float, float, float]) -> float:
    """Return the time [s] to fill a fixed volume [m^3] through Cd A [m^2]; pressures [Pa]: from, to, supply."""
    initial, final, supply = pressures
    choked = area * choked_flow_constant(gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature) * supply
    interval = (final - initial) / _INTERVALS
    middles = (initial + (number + 0.5) * interval for number in range(_INTERVALS))
    slowings = (1.0 / isentropic_flow_function(middle / supply, gas.heat_capacity_ratio) for middle in middles)
    return volume * interval * sum(slowings) / (gas.specific_gas_constant * gas.temperature * choked)
