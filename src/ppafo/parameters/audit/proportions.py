"""Proportions of a device: ratios of its numbers that tell a slip by powers of ten from an unusual design.

Each number of a set may be in its own range while the device that they make is none: a friction above every torque, a
leak above the valve. A usual range covers devices from a finger joint to a hip, driven by compressed gas or vacuum. Its
source is literature where the proportion has one, and otherwise a judgement that says of which devices.
"""

import contextlib
import math
from collections.abc import Iterator
from typing import NamedTuple

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ParameterError
from ppafo.model.catalog import ACTUATORS
from ppafo.model.plant import chamber_mass, viscous_torque
from ppafo.parameters.audit.evidence import AuditFinding, Evidence, identifier_of
from ppafo.parameters.building import build_device
from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import static_torque, torque_reach
from ppafo.units.shown import shown_in, shown_text

_ANGLES = 8
"""Number of angle intervals between the stops in which the largest torque is searched."""
_SLOW = math.radians(100.0)
"""Angular velocity [rad/s] of a slow joint: a third of that of an ankle in push-off."""
_CHOSEN = "valve"
"""Section of the chosen valve."""
_OF_SUPPLY = (
    "Cylinders of ISO 15552 are rated to 1 MPa; judgement of the rest: valves to 1.6 MPa, soft actuators from 1 kPa."
)
_OF_CHAMBER = "Judgement: from a cylinder that carries its valve to a bladder behind metres of hose."
_OF_VALVE_TIME = "Judgement: the quickest pneumatic valves need some 0.2 ms."


class UsualRange(NamedTuple):
    """Usual range of a proportion in ``unit``, and its source."""

    words: str
    unit: str
    low: float
    high: float
    source: str


USUAL = {
    ATMOSPHERE_PATH: UsualRange(
        "atmosphere over the standard one",
        "",
        0.5,
        1.1,
        "ICAO standard atmosphere from the shore of the Dead Sea to the highest towns, 5,100 m.",
    ),
    PRESSURE_PATH: UsualRange("gauge supply over atmosphere", "", 0.01, 16.0, _OF_SUPPLY),
    SECOND_PRESSURE_PATH: UsualRange("second gauge supply over atmosphere", "", 0.01, 16.0, _OF_SUPPLY),
    "actuator.dead_volume_1": UsualRange("smallest over swept volume of chamber 1", "", 1.0e-3, 20.0, _OF_CHAMBER),
    "actuator.dead_volume_2": UsualRange("smallest over swept volume of chamber 2", "", 1.0e-3, 20.0, _OF_CHAMBER),
    "actuator.torque_constant": UsualRange(
        "torque ceiling",
        "N m",
        5.0e-3,
        500.0,
        "Judgement: from a finger tip to twice the strongest moments of hips and knees (Anderson et al. 2007).",
    ),
    "actuator.displacement_per_radian": UsualRange(
        "displacement over torque constant",
        "",
        0.2,
        10.0,
        "1 by virtual work, 3.5 as printed of the paper's vane; judgement: beyond ten another unit was meant.",
    ),
    "friction.static_torque": UsualRange(
        "static friction over torque ceiling",
        "",
        0.0,
        0.5,
        "Judgement: seals of vanes and cylinders take below a half.",
    ),
    "friction.viscous_damping": UsualRange(
        "viscous torque at 100 deg/s over torque ceiling",
        "",
        0.0,
        1.0,
        "Judgement: a device for a joint moves at a third of the rate of an ankle in push-off.",
    ),
    "foot_plate.inertia": UsualRange(
        "time to cross the range at the torque ceiling",
        "s",
        5.0e-3,
        1.0,
        "Throws turn a shoulder at 7,200 deg/s (Fleisig et al. 1999); judgement: a bare device is at most three times "
        "as quick, and one that moves a limb needs below 1 s.",
    ),
    "foot_plate.gravity_torque": UsualRange(
        "weight over torque ceiling", "", 0.0, 3.0, "Judgement: an assisting device lifts a third of a limb and more."
    ),
    "actuator.leak": UsualRange(
        "leak over valve", "", 0.0, 0.5, "Judgement: with a leak half as wide as the valve no chamber keeps a pressure."
    ),
    _CHOSEN: UsualRange(
        "time to fill chamber 1 through the open valve",
        "s",
        1.0e-3,
        30.0,
        "Sound takes 1 ms for 0.34 m of line and chamber; judgement: no joint waits half a minute for its gas.",
    ),
    **{
        f"{_CHOSEN}.{name}": UsualRange(f"{name.replace('_', ' ')} of the valve", "s", 1.0e-4, 1.0, _OF_VALVE_TIME)
        for name in ("delay", "opening_delay", "closing_delay", "switching_interval", "response_time")
    },
}
"""Usual range of each proportion by the path of its main number, or of the section with it."""


def unusual_text(device: Device) -> str:
    """Remark on the proportions of a device that are outside their usual range; "" without any."""
    texts = [text for _, text in _unusual(device)]
    return f"unusual device (ppafo sets audit has the sources): {'; '.join(texts)}" if texts else ""


def unusual(evidence: Evidence) -> Iterator[AuditFinding]:
    """Warn of each proportion of a device outside its usual range, with any valve of the set."""
    findings = {}
    for valve in evidence.parameter_set.valve_kinds:
        with contextlib.suppress(ParameterError), shown_in(evidence.parameter_set.shown):
            for path, text in _unusual(build_device(evidence.parameter_set, valve)):
                section = path.replace(_CHOSEN, f"valves.{valve}")
                paths = [name for name in evidence.parameter_set.numbers if name.startswith(section)]
                why = f"Usual range: {USUAL[path].source}"
                name = f"proportion-of-{identifier_of(section)}"
                findings[name] = evidence.finding(name, text, paths, why=why, severity="warning")
    yield from findings.values()


def _unusual(device: Device) -> Iterator[tuple[str, str]]:
    """Yield path of each proportion outside its usual range, and its value and range in words."""
    for path, value in proportions(device):
        words, unit, low, high, _ = USUAL[path]
        if not low <= value <= high:
            number, least, most = (shown_text(each, unit, ".3g") for each in (value, low, high))
            yield path, f"{words} {number} (usual {least} to {most})"


def proportions(device: Device) -> Iterator[tuple[str, float]]:
    """Yield path and value of the proportions of a device that it has, for a single run."""
    plant = plant_parameters(device)
    torque = static_torque(device)
    room = plant.atmospheric_pressure
    turn = plant.angle_max - plant.angle_min
    yield ATMOSPHERE_PATH, room / STANDARD_ATMOSPHERE
    for path, pressure in ((PRESSURE_PATH, plant.supply_pressure), (SECOND_PRESSURE_PATH, plant.dorsiflexion_pressure)):
        # A vented chamber has no supply.
        if gauge := round(abs(pressure - room) / room, 4):
            yield path, gauge
    chambers = ACTUATORS[device.actuator.kind].model.chambers
    first, last = (chambers(plant, angle, room, room) for angle in (plant.angle_min, plant.angle_max))
    for number, ends in enumerate(((first.volume_1, last.volume_1), (first.volume_2, last.volume_2)), 1):
        if ends[0] != ends[1]:
            yield f"actuator.dead_volume_{number}", min(ends) / abs(ends[1] - ends[0])
    if conductance := plant.valve_conductance:
        # Choked, the valve passes C p, and the chamber holds V p / (R T).
        yield _CHOSEN, chamber_mass(1.0, 0.5 * (first.volume_1 + last.volume_1), plant.gas_product) / conductance
        yield "actuator.leak", plant.leak_conductance / conductance
    yield "actuator.displacement_per_radian", plant.displacement_per_radian / plant.torque_constant
    for name, setting in device.valve.settings.items():
        if setting and f"{_CHOSEN}.{name}" in USUAL:
            yield f"{_CHOSEN}.{name}", setting
    angles = (plant.angle_min + turn * number / _ANGLES for number in range(_ANGLES + 1))
    ceiling = max(abs(each) for angle in angles for each in torque_reach(device, angle, torque))
    yield "actuator.torque_constant", ceiling
    if ceiling > 0.0:
        yield "friction.static_torque", plant.static_torque / ceiling
        yield "friction.viscous_damping", viscous_torque(plant.viscous_damping, _SLOW) / ceiling
        yield "foot_plate.gravity_torque", abs(plant.gravity_torque) / ceiling
        yield "foot_plate.inertia", math.sqrt(2.0 * turn * plant.inertia / ceiling)
