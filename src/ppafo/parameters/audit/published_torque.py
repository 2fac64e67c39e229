"""Does the set give the torques that other publications report of the device, at rest and within one push-off?"""

import math
from collections.abc import Iterator

from ppafo.model.gas import choked_flow_constant
from ppafo.model.orifice import isentropic_flow_function
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Severity, Side
from ppafo.parameters.device import Gas

_TORQUE_CONSTANT = "actuator.torque_constant"
_ROOM = 0.1
"""Relative room of a torque that is published with one or two digits."""
_REACHED = 0.9
"""Fraction of the torque whose time counts: the rest comes ever more slowly."""
_PUSH_OFF = 0.2
"""Time [s] of push-off: from 42 to 61 % of the built-in gait's stride of 1.04 s."""
_TOE_OFF = math.radians(110.0)
"""Angle [rad] that the vane has reached by then: 20 deg of plantarflexion."""
_PARTS = 200


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield for each published torque whether the pressure holds it, and for that of walking whether it comes in time.

    Notes where it does, warnings where not; silent without published torques.
    """
    for name in ("rated", "walking"):
        paths = f"reported.{name}_torque", f"reported.{name}_torque_pressure"
        found = evidence.numbers(_TORQUE_CONSTANT, *paths)
        if found is None or min(found) <= 0.0 or found[2] <= evidence.atmosphere():
            continue
        yield _at_rest(evidence, name, paths, found)
        if name == "walking":
            yield from _while_walking(evidence, found[1], found[2])


def _at_rest(evidence: Evidence, name: str, paths: tuple[str, str], found: tuple[float, ...]) -> Finding:
    constant, torque, pressure = found
    held = constant * (pressure - evidence.atmosphere())
    agrees = abs(held / torque - 1.0) <= _ROOM
    return Finding(
        id=f"{name}-torque",
        severity="note" if agrees else "warning",
        title=f"the published {name} torque {'agrees' if agrees else 'does not agree'} with the torque constant",
        values=evidence.values_of(_TORQUE_CONSTANT, *paths),
        sides=(Side("torque constant times pressure", held, "N m"), Side("published", torque, "N m")),
        paragraph=(
            f"At {evidence.in_set_unit(paths[1], pressure)} the vane holds {held:.3g} N m, published are {torque:.3g} "
            "N m. This speaks of the torque constant alone: a vane at rest has any volume."
        ),
    )


def _while_walking(evidence: Evidence, torque: float, pressure: float) -> Iterator[Finding]:
    """Yield for each valve how long chamber 1, as large as it is at toe-off, needs for the torque."""
    gas, volume = evidence.gas(), evidence.chamber_1_volume(_TOE_OFF)
    constant, atmosphere = evidence.number(_TORQUE_CONSTANT) or 0.0, evidence.atmosphere()
    target = atmosphere + _REACHED * min(torque / constant, pressure - atmosphere)
    for valve in evidence.parameter_set.valve_kinds:
        sizes = f"valves.{valve}.area", f"valves.{valve}.discharge_coefficient"
        found = evidence.numbers(*sizes)
        if gas is None or volume is None or volume <= 0.0 or found is None or min(found) <= 0.0:
            continue
        time = _filling_time(gas, volume, found[0] * found[1], (atmosphere, target, pressure))
        severity: Severity = "note" if time <= _PUSH_OFF else "warning"
        yield Finding(
            id=f"walking-torque-in-time-{valve}",
            severity=severity,
            title=f"valve '{valve}' fills chamber 1 {'within' if time <= _PUSH_OFF else 'too slowly for'} a push-off",
            values=evidence.values_of(
                "actuator.volume_per_angle", "actuator.dead_volume_1", *sizes, "reported.walking_torque_pressure"
            ),
            sides=(Side("time to fill", time, "s"), Side("time of push-off", _PUSH_OFF, "s")),
            paragraph=(
                f"At toe-off chamber 1 has {1e6 * volume:.3g} cm^3. Through the open valve '{valve}' "
                f"{100.0 * _REACHED:.0f} % of the {torque:.3g} N m that were published of walking take "
                f"{1e3 * time:.0f} ms; push-off lasts about {1e3 * _PUSH_OFF:.0f} ms. The valves of that publication "
                "may have been others."
            ),
        )


def _filling_time(gas: Gas, volume: float, area: float, pressures: tuple[float, float, float]) -> float:
    """Return the time [s] to fill a fixed volume [m^3] through Cd A [m^2]; pressures [Pa]: from, to, supply."""
    first, last, supply = pressures
    choked = area * choked_flow_constant(gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature) * supply
    part = (last - first) / _PARTS
    middles = (first + (number + 0.5) * part for number in range(_PARTS))
    paces = (1.0 / isentropic_flow_function(middle / supply, gas.heat_capacity_ratio) for middle in middles)
    return volume * part * sum(paces) / (gas.specific_gas_constant * gas.temperature * choked)
