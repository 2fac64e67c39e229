"""Questions on the actuator: inertia against damping and friction, torque against volumes, angles and pressures."""

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path

from ppafo.errors import ParameterError, UnitError
from ppafo.model.actuators.cylinder import pins_at
from ppafo.model.orifice import area_conductance, isentropic_flow_function
from ppafo.model.plant import pressure_for_torque
from ppafo.parameters.audit.evidence import AuditFinding, Evidence, ReportedRange, Severity, of_each_valve
from ppafo.parameters.building import build_device
from ppafo.parameters.device import VANE
from ppafo.parameters.graph import ATMOSPHERE_PATH, DISPLACEMENT_PATH, PRESSURE_PATH, TORQUE_CONSTANT_PATH
from ppafo.parameters.reach import torque_reach
from ppafo.units import from_si, to_si
from ppafo.units.shown import shown_in, shown_unit, shown_value

_INERTIA = "foot_plate.inertia"
_DAMPING = "friction.viscous_damping"
_FRICTION = "friction.dynamic_torque"
_DECAY = "reported.acceleration_over_velocity"
_DECAY_INVERSE = "reported.velocity_over_acceleration"
_DECELERATION = "reported.stopping_deceleration"
_SHIFTS = (-3, -2, -1, 1, 2, 3)
"""Powers of ten of a misplaced decimal point or a wrong prefix."""
_STOPS = ("actuator.angle_min", "actuator.angle_max")
_DEAD = ("actuator.dead_volume_1", "actuator.dead_volume_2")
_LEVER = ("actuator.lever_length", "actuator.base_distance", "actuator.lever_offset")
_SUPPLIES = ("supply.pressure", "supply.dorsiflexion_pressure", "reported.other_supply_pressure")
_DEMAND = "reported.demanded_torque"
_STATIC = "friction.static_torque"
_TOLERANCE = 0.1
"""Relative difference [-] from which two reported numbers of one or two digits differ for certain."""
_SAME_TURN = 1.01
"""Ratio of two turns that the rounding of reported angles leaves open [-]."""
# Accepted ratio of the gas of one filling to the measured gas use [-]; the remainder leaks during the task.
_LEAST = 0.6
_MOST = 1.1
_FELT_TORQUE = 0.01
"""Standard deviation of the torque, relative to the largest one [-], from which a rounded table is a warning."""
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


def inertia(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name a damping or friction that is not inertia times the reported decay, and an inertia that fits both.

    Equations (1) and (10). The decay is reported as a ratio or as its inverse; an inverse in 1/s is the ratio itself.
    """
    of_inertia = evidence.magnitude(_INERTIA)
    decay_path = _DECAY
    decay = evidence.magnitude(_DECAY)
    if decay is None and (inverse := evidence.magnitude(_DECAY_INVERSE)) is not None:
        decay_path = _DECAY_INVERSE
        decay = inverse
        with contextlib.suppress(UnitError):
            to_si(1.0, evidence.parameter_set.numbers[_DECAY_INVERSE].unit, "s")
            decay = ReportedRange(1.0, 1.0).over(inverse)
    agreeing = []
    for product, rate_path, rate, name in (
        (_DAMPING, decay_path, decay, "damping"),
        (_FRICTION, _DECELERATION, evidence.magnitude(_DECELERATION), "dynamic friction"),
    ):
        reported = evidence.magnitude(product)
        if of_inertia is None or reported is None or rate is None or of_inertia.times(rate).meets(reported):
            continue
        agreeing.append(reported.over(rate))
        stated, number = evidence.numbers(_INERTIA, product)
        unit = evidence.declared[product].unit
        yield evidence.finding(
            f"{name.replace(' ', '-')}-against-inertia",
            f"{name} is not the product of inertia and the reported ratio",
            [product, _INERTIA, rate_path],
            {
                f"reported {name}": (number, unit),
                "inertia times ratio": (stated * _middle(rate), unit),
                "inertia that would agree": (number / _middle(rate), "kg m^2"),
            },
        )
    # Only if both products disagree with the reported inertia.
    if len(agreeing) > 1 and agreeing[0].meets(agreeing[1]):
        lows, highs = zip(*agreeing, strict=True)
        common = ReportedRange(max(lows), min(highs))
        (stated,) = evidence.numbers(_INERTIA)
        # A moved decimal point is the most likely error; otherwise the middle of the common range.
        moved = [number for shift in _SHIFTS if common.low <= (number := stated * 10.0**shift) <= common.high]
        reconciling = moved[0] if moved else _middle(common)
        sides = {
            "reported inertia": stated,
            "reconciling inertia": reconciling,
            "lowest that agrees": common.low,
            "highest that agrees": common.high,
        }
        yield evidence.finding(
            "one-inertia-for-both",
            f"damping and friction both agree with an inertia of {evidence.in_set_unit(_INERTIA, reconciling)}",
            [_INERTIA, _DAMPING, _FRICTION, decay_path, _DECELERATION],
            {label: (number, "kg m^2") for label, number in sides.items()},
            "The reported inertia with a shifted decimal point reconciles both." if moved else "",
            "note",
        )


def _middle(interval: ReportedRange) -> float:
    return 0.5 * (interval.low + interval.high)


def _one_filling(evidence: Evidence) -> tuple[str, float, float]:
    """Return path and gas [kg] of a reported single filling, and the density [kg/m^3] that it adds; equation (3).

    Raises ParameterError if the set reports no such gas, or a supply that fills nothing.
    """
    gas = evidence.gas()
    (supply,) = evidence.numbers(PRESSURE_PATH)
    paths = (f"reported.valves.{name}.single_fill_gas" for name in evidence.parameter_set.valve_kinds)
    path = next((path for path in paths if evidence.number(path)), "")
    if supply <= evidence.atmosphere() or not path:
        raise ParameterError("no gas of a single filling is reported")
    density = (supply - evidence.atmosphere()) / (gas.specific_gas_constant * gas.temperature)
    return path, evidence.numbers(path)[0], density


def virtual_work(evidence: Evidence) -> Iterator[AuditFinding]:
    """Warn of a torque constant and a displacement that differ by over 10 %, a note if the efficiency explains it.

    Equations (2) to (5): by virtual work, T dtheta = (P1 - P2) dV, both are equal.
    """
    paths = [TORQUE_CONSTANT_PATH, DISPLACEMENT_PATH, "reported.torque_efficiency"]
    constant, displacement = evidence.positive(*paths[:2])
    efficiency = evidence.number(paths[2])
    if efficiency is not None and abs(displacement * efficiency / constant - 1.0) <= _TOLERANCE:
        yield evidence.finding(
            "virtual-work",
            "torque constant and displacement per radian agree with the stated efficiency",
            paths,
            {"torque constant over displacement per radian": (constant / displacement, "")},
            "The rest is the stated loss; where the shaft compresses the gas, the model has its opposite.",
            "note",
        )
    elif abs(displacement / constant - 1.0) > _TOLERANCE:
        sides = {"torque constant": (constant, "m^3"), "displacement per radian": (displacement, "m^3/rad")}
        remark = ""
        with contextlib.suppress(ParameterError):
            path, used, density = _one_filling(evidence)
            low_path, low, high_path, high = evidence.angle_range()
            paths += [path, PRESSURE_PATH, low_path, high_path]
            sides |= {
                "gas that fills a volume from atmosphere to supply": (density, "kg/m^3"),
                "volume that the gas use needs": (used / density, "m^3"),
                "volume swept by the torque constant": (constant * abs(high - low), "m^3"),
                "volume swept by the displacement per radian": (displacement * abs(high - low), "m^3"),
            }
            remark = " Lines and clearance contain a part of the gas of one filling."
        yield evidence.finding(
            "virtual-work",
            "torque constant and displacement per radian differ, which contradicts virtual work",
            paths,
            sides,
            "By virtual work, T dtheta = (P1 - P2) dV, both are equal. In the model the shaft gets "
            f"{100.0 * constant / displacement:.3g} % of the work p dV of the gas; the rest is lost without a cause; "
            f"energy and gas use are uncertain by the same factor.{remark}",
            "warning",
        )


def volumes(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each chamber whose volume is not positive at one end of the angles in use; equations (4) and (5)."""
    (slope,) = evidence.positive(DISPLACEMENT_PATH)
    stop_low, stop_high = evidence.numbers(*_STOPS)
    low_path, low, high_path, high = evidence.angle_range()
    turn = high - low
    for index, (travel, path, end) in enumerate(((low - stop_low, low_path, low), (stop_high - high, high_path, high))):
        dead = evidence.number(_DEAD[index]) or 0.0
        if dead + slope * travel <= 0.0:
            empty = min(-travel - dead / slope, turn)
            yield evidence.finding(
                f"volume-{index + 1}",
                f"volume of chamber {index + 1} is not positive over the range of angles",
                [DISPLACEMENT_PATH, _STOPS[index], _DEAD[index], path],
                {
                    f"V{index + 1} at the end of the range": (dead + slope * travel, "m^3"),
                    "smallest sufficient dead volume": (-slope * travel, "m^3"),
                    "part of the range with no volume": (empty / turn if turn else 1.0, ""),
                },
                f"The end of the range is {path} = {evidence.in_set_unit(path, end)}.",
            )


def rounded_table(evidence: Evidence) -> Iterator[AuditFinding]:
    """Tell what the rounding of a measured table leaves unknown of the torque, where volumes were moved for it."""
    parameter_set = evidence.parameter_set
    path = Path(parameter_set.file).parent / parameter_set.actuator_file
    if parameter_set.actuator_table is None or not path.is_file():
        return
    from ppafo.parameters.actuator_table import fitted_chambers, read_measured_volumes

    # Of the chamber in which rounding matters most to the torque.
    rounding = max(fitted_chambers(read_measured_volumes(path)), key=lambda each: (each.torque_error, each.move))
    if rounding.move > 0.0:
        share = 2.0 * rounding.torque_error
        yield evidence.finding(
            "rounded-table",
            f"the measured volumes are rounded, which leaves the torque uncertain by {share:.1%} of its largest",
            (),
            {
                "largest move": (rounding.move, "m^3"),
                "last digit": (rounding.resolution, "m^3"),
                "standard deviation of the torque over its largest": (rounding.torque_error, "1"),
            },
            "Half a digit leaves two of these unknown, more of the torque where it is small; volumes were moved.",
            "note" if rounding.torque_error < _FELT_TORQUE else "warning",
        )


def rotation(evidence: Evidence) -> Iterator[AuditFinding]:
    """Warn of a range of angles larger than the actuator's designation."""
    (rated,) = evidence.numbers("reported.rated_rotation")
    low_path, low, high_path, high = evidence.angle_range()
    if high - low > _SAME_TURN * rated:
        yield evidence.finding(
            "rotation",
            "the range of angles exceeds the rated rotation of the actuator",
            ["reported.rated_rotation", low_path, high_path],
            {"range of angles": (high - low, "rad"), "rotation by the designation": (rated, "rad")},
            "Another actuator or a gear was used, or the angle is not measured at the vane.",
            "warning",
        )


def stroke(evidence: Evidence) -> Iterator[AuditFinding]:
    """Note cylinder stroke and lever arm between the stops, for comparison with a data sheet."""
    lever, base, *stops = evidence.numbers(*_LEVER[:2], *_STOPS)
    low, high = (stop + (evidence.number(_LEVER[2]) or 0.0) for stop in stops)
    if 0.0 < low < high < math.pi:
        shortest, first_arm = pins_at(lever, base, low)
        longest, last_arm = pins_at(lever, base, high)
        sides = {
            "distance of the pins at the lower stop": shortest,
            "distance of the pins at the upper stop": longest,
            "lever arm at the lower stop": first_arm,
            "lever arm at the upper stop": last_arm,
        }
        yield evidence.finding(
            "stroke",
            f"the stroke of the cylinder between the stops is {1e3 * (longest - shortest):.4g} mm",
            [*_LEVER, *_STOPS],
            {label: (number, "m") for label, number in sides.items()},
            severity="note",
        )


def filling(evidence: Evidence) -> Iterator[AuditFinding]:
    """Compare the gas that fills chamber 1 at mid-range with the reported gas of one filling; equations (3) and (4)."""
    path, used, density = _one_filling(evidence)
    _, low, _, high = evidence.angle_range()
    volume = evidence.chamber_1_volume(0.5 * (low + high))
    agrees = _LEAST <= density * volume / used <= _MOST
    least = f"a volume of {1e6 * _LEAST * used / density:.3g} cm^3 or more"
    yield evidence.finding(
        "gas-of-one-filling",
        f"the measured gas of one filling {'fits' if agrees else 'does not fit'} the volume of chamber 1",
        [DISPLACEMENT_PATH, _DEAD[0], path, PRESSURE_PATH],
        {
            "gas that fills chamber 1": (density * volume, "kg"),
            "measured gas": (used, "kg"),
            "volume of chamber 1 in the middle of the range": (volume, "m^3"),
        },
        "" if agrees else f"Consistent would be {least}, or a task with several fillings.",
        "note" if agrees else "warning",
    )


def vacuum(evidence: Evidence) -> Iterator[AuditFinding]:
    """Note each supply below the atmosphere with the depth of the vacuum; a warning for an absolute unit."""
    for chamber, path in enumerate(_SUPPLIES[:2], 1):
        pressure = evidence.number(path)
        atmosphere = evidence.atmosphere()
        if pressure is not None and 0.0 < pressure < atmosphere:
            depth = atmosphere - pressure
            is_absolute = evidence.parameter_set.numbers[path].unit.endswith("_a")
            yield evidence.finding(
                f"vacuum-{chamber}",
                f"{path} is a vacuum, {depth / 1e3:.3g} kPa below the atmosphere",
                [path, ATMOSPHERE_PATH],
                {"depth of the vacuum": (depth, "Pa")},
                "Read from a gauge, it would have '_g' instead of '_a'." if is_absolute else "",
                "warning" if is_absolute else "note",
            )


@of_each_valve
def set_pressures(evidence: Evidence, valve: str) -> Iterator[AuditFinding]:
    """Note a pressure regulator that can be set above its supply, with the command from which it is."""
    paths = [f"valves.{valve}.lowest_pressure", f"valves.{valve}.highest_pressure", PRESSURE_PATH]
    lowest, highest, supply = evidence.numbers(*paths)
    if lowest < supply < highest:
        share = (supply - lowest) / (highest - lowest)
        yield evidence.finding(
            f"set-pressure-of-{valve}",
            f"valve '{valve}' can be set above its supply: beyond a command of {share:.2g} it gives no more",
            paths,
            {"command that sets the supply pressure": (share, "1")},
            severity="note",
        )


def torque_ceiling(evidence: Evidence) -> Iterator[AuditFinding]:
    """Note the largest torque of each supply: a warning below the demand, an error below static friction.

    Equation (2). Of an actuator other than a vane it is the most and the least up and down between the stops.
    """
    shown = evidence.parameter_set.shown
    constant = evidence.number(TORQUE_CONSTANT_PATH)
    supplies = {path: value for path in _SUPPLIES if (value := evidence.number(path)) is not None}
    ceilings = dict[str, float]()
    why = []
    if supplies and evidence.parameter_set.actuator_kind != VANE:
        device = build_device(evidence.parameter_set)
        lowest = float(device.actuator.angle_min)
        highest = float(device.actuator.angle_max)
        angles = [lowest + (highest - lowest) * number / _ANGLES for number in range(_ANGLES + 1)]
        downward, upward = zip(*(torque_reach(device, angle) for angle in angles), strict=True)
        at = []
        for way, torques in (("up", [*upward]), ("down", [-torque for torque in downward])):
            ceilings |= {f"most {way}": max(torques), f"least {way}": min(torques)}
            at.append(f"{way} at {math.degrees(angles[torques.index(max(torques))]):.3g} deg")
        why.append(f"Most {' and '.join(at)}.")
    elif constant is not None and constant > 0.0:
        ceilings = {f"ceiling at {path}": constant * abs(p - evidence.atmosphere()) for path, p in supplies.items()}
    if not ceilings:
        return
    severity: Severity = "note"
    needed = 0.0
    ceiling = max(ceilings.values())
    demand = evidence.number(_DEMAND)
    static = evidence.number(_STATIC)
    if demand is not None and demand > ceiling:
        severity = "warning"
        needed = demand
    if static is not None and static >= ceiling:
        severity = "error"
        needed = static
    with shown_in(shown):
        torque_unit = shown_unit("N m")
        unit = shown_unit("Pa_d").removesuffix("_d")
        # A form that keeps zeros makes "550." of 550.
        most = f"{shown_value(ceiling, 'N m'):#.3g}".removesuffix(".")
        if constant:
            # Torque constants are quoted per psi in the field, or per bar where the set has bar.
            per_unit = f"{shown_value(constant * to_si(1.0, f'{unit}_d', 'Pa_d'), 'N m'):#.3g}".removesuffix(".")
            why.append(f"The torque constant is {per_unit} {torque_unit}/{unit}.")
            if needed:
                pressure = from_si(needed / constant, f"{unit}_d", "Pa_d")
                why.append(f"{shown_value(needed, 'N m'):.3g} {torque_unit} need {pressure:.4g} {unit}_g.")
    yield evidence.finding(
        "torque-ceiling",
        f"the supply allows at most {most} {torque_unit}",
        [TORQUE_CONSTANT_PATH, *supplies, _DEMAND, _STATIC],
        {label: (torque, "N m") for label, torque in ceilings.items()},
        " ".join(why),
        severity,
    )


def published_torque(evidence: Evidence) -> Iterator[AuditFinding]:
    """Compare each published torque with the torque constant, and the one of walking with the time of a push-off."""
    for name in ("rated", "walking"):
        paths = [TORQUE_CONSTANT_PATH, f"reported.{name}_torque", f"reported.{name}_torque_pressure"]
        with contextlib.suppress(ParameterError):
            constant, torque, pressure = evidence.positive(*paths)
            if pressure <= evidence.atmosphere():
                continue
            at_rest = constant * (pressure - evidence.atmosphere())
            agrees = abs(at_rest / torque - 1.0) <= _TOLERANCE
            yield evidence.finding(
                f"{name}-torque",
                f"the published {name} torque {'agrees' if agrees else 'does not agree'} with the torque constant",
                paths,
                {"torque constant times pressure": (at_rest, "N m"), "published": (torque, "N m")},
                evidence.parameter_set.numbers[paths[1]].note,
                "note" if agrees else "warning",
            )
            if name == "walking":
                yield from while_walking(evidence)


@of_each_valve
def while_walking(evidence: Evidence, valve: str) -> Iterator[AuditFinding]:
    """Compare the time in which a valve fills chamber 1 at toe-off for the torque of walking with a push-off."""
    paths = [f"valves.{valve}.area", f"valves.{valve}.discharge_coefficient", "reported.walking_torque_pressure"]
    gas = evidence.gas()
    volume = evidence.chamber_1_volume(_TOE_OFF)
    atmosphere = evidence.atmosphere()
    area, coefficient, supply, torque, constant = evidence.positive(
        *paths, "reported.walking_torque", TORQUE_CONSTANT_PATH
    )
    k = gas.heat_capacity_ratio
    product = gas.specific_gas_constant * gas.temperature
    choked = area_conductance(area, coefficient, k, gas.specific_gas_constant, gas.temperature) * supply
    target = atmosphere + _REACHED * min(pressure_for_torque(torque, constant), supply - atmosphere)
    interval = (target - atmosphere) / _INTERVALS
    middles = (atmosphere + (number + 0.5) * interval for number in range(_INTERVALS))
    slowings = (1.0 / isentropic_flow_function(middle / supply, k) for middle in middles)
    time = volume * interval * sum(slowings) / (product * choked)
    yield evidence.finding(
        f"walking-torque-in-time-{valve}",
        f"valve '{valve}' fills chamber 1 {'within' if time <= _PUSH_OFF else 'too slowly for'} a push-off",
        [DISPLACEMENT_PATH, _DEAD[0], *paths],
        {"time to fill": (time, "s"), "time of push-off": (_PUSH_OFF, "s")},
        f"{100.0 * _REACHED:.0f} % of the published walking torque are reached, with the volume at toe-off.",
        "note" if time <= _PUSH_OFF else "warning",
    )
