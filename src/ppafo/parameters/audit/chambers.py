"""Checks of the chambers against torque, angle range and measured gas use. Equations (2) to (5)."""

import math
from collections.abc import Iterator
from pathlib import Path

from ppafo.model.actuators.cylinder import pins_at
from ppafo.parameters.audit.evidence import AuditFinding, ComparedNumber, Evidence, density_change

# Does the torque constant equal the displacement per radian, as virtual work demands: T dtheta = (P1 - P2) dV?

_TORQUE_CONSTANT = "actuator.torque_constant"
_DISPLACEMENT_PER_RADIAN = "actuator.displacement_per_radian"
_EFFICIENCY = "reported.torque_efficiency"
_SUPPLY = "supply.pressure"
_ID = "virtual-work"
# Below 10 % two reported numbers of two digits rarely differ for certain.
_TOLERANCE = 0.1
_SLOPE = "actuator.displacement_per_radian"
_STOPS = ("actuator.angle_min", "actuator.angle_max")
_DEAD = ("actuator.dead_volume_1", "actuator.dead_volume_2")
_RATED = "reported.rated_rotation"

# 1 % of room for rounding of reported angles.
_SAME_TURN = 1.01
_LEVER = ("actuator.lever_length", "actuator.base_distance", "actuator.lever_offset")
_VOLUME = ("actuator.displacement_per_radian", "actuator.dead_volume_1")
_LEAST, _MOST = 0.6, 1.1
"""Accepted ratio of the gas of one filling to the measured gas use [-]; the remainder leaks during the task."""
_FELT_TORQUE = 0.01
"""Standard deviation of the torque, relative to the largest one [-], from which a rounded table is a warning."""


def check_virtual_work(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a warning if torque constant and displacement differ by over 10 %, a note if the efficiency explains it."""
    numbers, efficiency = evidence.numbers(_TORQUE_CONSTANT, _DISPLACEMENT_PER_RADIAN), evidence.number(_EFFICIENCY)
    if numbers is None or min(numbers) <= 0.0:
        return
    if efficiency is not None and abs(numbers[1] * efficiency / numbers[0] - 1.0) <= _TOLERANCE:
        # The shaft's work is the gas's less the stated loss.
        ratio = numbers[0] / numbers[1]
        yield AuditFinding(
            id=_ID,
            severity="note",
            title="torque constant and displacement per radian agree with the stated efficiency",
            values=evidence.values_of(_TORQUE_CONSTANT, _DISPLACEMENT_PER_RADIAN, _EFFICIENCY),
            sides=(ComparedNumber("torque constant over displacement per radian", ratio, ""),),
            why="The rest is the stated loss; where the shaft compresses the gas, the model has its opposite.",
        )
    elif abs(numbers[1] / numbers[0] - 1.0) > _TOLERANCE:
        torque_constant, displacement_per_radian = numbers
        gas_paths, gas_sides, gas_text = _gas_use(evidence, torque_constant, displacement_per_radian)
        yield AuditFinding(
            id=_ID,
            severity="warning",
            title="torque constant and displacement per radian differ, which contradicts virtual work",
            values=evidence.values_of(_TORQUE_CONSTANT, _DISPLACEMENT_PER_RADIAN, _EFFICIENCY, *gas_paths),
            sides=(
                ComparedNumber("torque constant", torque_constant, "m^3"),
                ComparedNumber("displacement per radian", displacement_per_radian, "m^3/rad"),
                *gas_sides,
            ),
            why=(
                "By virtual work, T dtheta = (P1 - P2) dV, both are equal. In the model the shaft gets "
                f"{100.0 * torque_constant / displacement_per_radian:.3g} % of the work p dV of the gas; the rest is "
                f"lost without a cause; energy and gas use are uncertain by the same factor.{gas_text}"
            ),
        )


def _gas_use(
    evidence: Evidence, torque_constant: float, displacement_per_radian: float
) -> tuple[tuple[str, ...], tuple[ComparedNumber, ...], str]:
    """Return paths, numbers and a sentence on the volume that holds the gas of one filling."""
    gas, supply, angles = evidence.gas(), evidence.number(_SUPPLY), evidence.angle_range()
    path = evidence.single_fill_gas()
    if gas is None or supply is None or supply <= evidence.atmosphere() or angles is None or path is None:
        return (), (), ""
    density = density_change(gas, supply - evidence.atmosphere())
    used, turn = evidence.number(path) or 0.0, abs(angles[3] - angles[1])
    needed, by_torque, by_volume = used / density, torque_constant * turn, displacement_per_radian * turn
    sides = (
        ComparedNumber("gas that fills a volume from atmosphere to supply", density, "kg/m^3"),
        ComparedNumber("volume that the gas use needs", needed, "m^3"),
        ComparedNumber("volume swept by the torque constant", by_torque, "m^3"),
        ComparedNumber("volume swept by the displacement per radian", by_volume, "m^3"),
    )
    text = " Lines and clearance contain a part of the gas of one filling."
    return (path, _SUPPLY, angles[0], angles[2]), sides, text


# Are both chamber volumes positive over the angles in use? Equations (4) and (5).


def check_volumes(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each chamber whose volume is not positive at one end of the angle range."""
    numbers, angles = evidence.numbers(_SLOPE, *_STOPS), evidence.angle_range()
    if numbers is None or angles is None or numbers[0] <= 0.0:
        return
    _, stop_low, stop_high = numbers
    low_path, low, high_path, high = angles
    yield from _chamber(evidence, 1, low - stop_low, high - low, low_path)
    yield from _chamber(evidence, 2, stop_high - high, high - low, high_path)


def _chamber(evidence: Evidence, chamber: int, travel: float, turn: float, end_path: str) -> Iterator[AuditFinding]:
    """Yield an error if a chamber volume is not positive at ``travel`` [rad] from its zero swept volume."""
    slope = evidence.number(_SLOPE) or math.inf
    dead_path, stop_path = _DEAD[chamber - 1], _STOPS[chamber - 1]
    dead = evidence.number(dead_path) or 0.0
    smallest = dead + slope * travel
    if smallest > 0.0:
        return
    empty = min(-travel - dead / slope, turn)
    end = evidence.in_set_unit(end_path, evidence.number(end_path) or 0.0)
    yield AuditFinding(
        id=f"volume-{chamber}",
        title=f"volume of chamber {chamber} is not positive over the range of angles",
        values=evidence.values_of(_SLOPE, stop_path, dead_path, end_path),
        sides=(
            ComparedNumber(f"V{chamber} at the end of the range", smallest, "m^3"),
            ComparedNumber("smallest sufficient dead volume", -slope * travel, "m^3"),
            ComparedNumber("part of the range with no volume", empty / turn if turn else 1.0, ""),
        ),
        why=f"The end of the range is {end_path} = {end}.",
    )


# Does the actuator turn as far as it is used?


def check_rotation(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a warning for a range of angles larger than the actuator's designation."""
    rated, angles = evidence.number(_RATED), evidence.angle_range()
    if rated is None or angles is None or angles[3] - angles[1] <= _SAME_TURN * rated:
        return
    turn = angles[3] - angles[1]
    yield AuditFinding(
        id="rotation",
        severity="warning",
        title="the range of angles exceeds the rated rotation of the actuator",
        values=evidence.values_of(_RATED, angles[0], angles[2]),
        sides=(
            ComparedNumber("range of angles", turn, "rad"),
            ComparedNumber("rotation by the designation", rated, "rad"),
        ),
        why="Another actuator or a gear was used, or the angle is not measured at the vane.",
    )


# Which stroke of a cylinder and which lever arms do the stops need?


def check_stroke(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a note on cylinder stroke and lever arm between the stops, for comparison with a data sheet."""
    lever, base, offset, *stops = (evidence.number(path) for path in (*_LEVER, *_STOPS))
    low, high = ((stop or 0.0) + (offset or 0.0) for stop in stops)
    if lever is None or base is None or None in stops or not 0.0 < low < high < math.pi:
        return
    (shortest, first_arm), (longest, last_arm) = pins_at(lever, base, low), pins_at(lever, base, high)
    yield AuditFinding(
        id="stroke",
        severity="note",
        title=f"the stroke of the cylinder between the stops is {1e3 * (longest - shortest):.4g} mm",
        values=evidence.values_of(*_LEVER, *_STOPS),
        sides=(
            ComparedNumber("distance of the pins at the lower stop", shortest, "m"),
            ComparedNumber("distance of the pins at the upper stop", longest, "m"),
            ComparedNumber("lever arm at the lower stop", first_arm, "m"),
            ComparedNumber("lever arm at the upper stop", last_arm, "m"),
        ),
    )


# Is the gas of one filling that was measured the gas that chamber 1 holds? Equations (3) and (4).


def check_filling(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield the gas of one filling at mid-range: a note if the measured gas use agrees, otherwise a warning.

    Yields nothing if the set reports no gas use of a single filling.
    """
    gas, supply, angles = evidence.gas(), evidence.number(_SUPPLY), evidence.angle_range()
    path = evidence.single_fill_gas()
    if gas is None or supply is None or supply <= evidence.atmosphere() or angles is None or path is None:
        return
    volume = evidence.chamber_1_volume(0.5 * (angles[1] + angles[3]))
    if volume is None or volume <= 0.0:
        return
    density, used = density_change(gas, supply - evidence.atmosphere()), evidence.number(path) or 0.0
    filled = density * volume
    agrees, least = _LEAST <= filled / used <= _MOST, f"a volume of {1e6 * _LEAST * used / density:.3g} cm^3 or more"
    yield AuditFinding(
        id="gas-of-one-filling",
        severity="note" if agrees else "warning",
        title=f"the measured gas of one filling {'fits' if agrees else 'does not fit'} the volume of chamber 1",
        values=evidence.values_of(*_VOLUME, path, _SUPPLY),
        sides=(
            ComparedNumber("gas that fills chamber 1", filled, "kg"),
            ComparedNumber("measured gas", used, "kg"),
            ComparedNumber("volume of chamber 1 in the middle of the range", volume, "m^3"),
        ),
        why="" if agrees else f"Consistent would be {least}, or a task with several fillings.",
    )


# Torque that the rounding of a measured table leaves unknown.


def check_rounded_table(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield what the rounding of a measured table leaves unknown of the torque, where volumes were moved for it."""
    parameter_set = evidence.parameter_set
    path = Path(parameter_set.file).parent / parameter_set.actuator_file
    if parameter_set.actuator_table is None or not path.is_file():
        return
    from ppafo.parameters.actuator_table import rounding_of_table

    rounding = rounding_of_table(path)
    if rounding.move > 0.0:
        share = 2.0 * rounding.torque_error
        yield AuditFinding(
            id="rounded-table",
            severity="note" if rounding.torque_error < _FELT_TORQUE else "warning",
            title=f"the measured volumes are rounded, which leaves the torque uncertain by {share:.1%} of its largest",
            sides=(
                ComparedNumber("largest move", rounding.move, "m^3"),
                ComparedNumber("last digit", rounding.resolution, "m^3"),
                ComparedNumber("standard deviation of the torque over its largest", rounding.torque_error, "1"),
            ),
            why="Half a digit leaves two of these unknown, more of the torque where it is small; volumes were moved.",
        )
