"""Samples for meters and traces, with the channels of a recording, in programs that record nothing.

Sample ``index`` of a run, counted from 0, lies ``index * interval`` steps after the start, with ``interval`` the number
of steps between samples. ``elapsed`` is the same time [steps] as the loop has reached it, a step and a fraction.

The loop over steps calls, before the first sample, ``begin_reference_summary`` and, unless the reference is monotone,
``update_largest_reference`` for each sample and ``search_final_hold`` for each from the last one backwards. It then
calls ``start_meters`` at the first sample, ``update_meters`` at the others, after ``update_course`` and, where a part
of the reference ends, ``end_parts``; and ``store_trace`` at traced samples.
"""

from ppafo.engine.program import Program
from ppafo.engine.step.lane import Lane
from ppafo.engine.step.phases import present_pressures
from ppafo.engine.step.sample import reference_at
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.gas import energy_per_content
from ppafo.model.plant import ThermalParameters
from ppafo.signals.meter import (
    NO_ENERGY,
    SAME_LEVEL,
    EnergySample,
    FootSample,
    GasSample,
    ReferenceSummary,
    Sample,
    StrideSample,
    advance_course,
    advance_part,
    deciding_sample,
    is_away,
    start_up_of,
)

NO_FOOT = FootSample(**dict.fromkeys(FootSample._fields, 0.0))
NO_STRIDE = StrideSample(**dict.fromkeys(StrideSample._fields, 0.0))
"""Stride data of a sample without a walk, or of a foot on a shank without a gait."""


def make_sample(parts: Program, lane: Lane, elapsed: float, index: int, interval: float) -> None:
    """Store the present values of a run as its sample."""
    pressure_1, pressure_2 = present_pressures(parts, lane)
    torque = parts.actuator.torque(lane.plant, lane.state.angle, pressure_1, pressure_2)
    time = elapsed * lane.timing.step
    # Extremes over the chambers are of chamber 1 where it is the only one.
    lane.sample = Sample(
        number=float(index),
        angle=lane.state.angle,
        angular_velocity=lane.state.angular_velocity,
        pressure_1=pressure_1,
        pressure_2=pressure_1 if parts.has_one_chamber else pressure_2,
        torque=torque,
        command=lane.result.command,
        value=parts.controlled_value(lane.state.angle, pressure_1, pressure_2, torque),
        # The course has evaluated a reference with parts already.
        reference=lane.course.previous if parts.cuts_reference else set_point_at(parts, lane, time),
        temperature_1=temperature(lane.thermal, lane.state.mass_1, lane.masses.mass_1) if parts.is_thermal else 0.0,
        temperature_2=temperature_of_chamber_2(parts, lane) if parts.is_thermal else 0.0,
        gas=gas_sample(parts, lane),
        energy=energy_sample(parts, lane),
        foot=parts.foot.sample(parts, lane, time) if parts.foot is not None and parts.is_on_gait else NO_FOOT,
        stride=stride_sample(parts, lane),
    )


def temperature(thermal: ThermalParameters, content: float, mass: float) -> float:
    """Gas temperature in a chamber [K]: reference temperature times content per mass.

    The content [kg] is the mass that would have the same pressure at the reference temperature.
    """
    return thermal.temperature * (content / mass)


def temperature_of_chamber_2(parts: Program, lane: Lane) -> float:
    """Temperature of the gas in chamber 2, or in the only chamber [K]."""
    if parts.has_one_chamber:
        return temperature(lane.thermal, lane.state.mass_1, lane.masses.mass_1)
    return temperature(lane.thermal, lane.state.mass_2, lane.masses.mass_2)


def gas_sample(parts: Program, lane: Lane) -> GasSample:
    """Gas masses in the chambers and totals [kg]; true masses for gas with an energy balance."""
    return GasSample(
        supplied_mass=lane.state.supplied_mass,
        vented_mass=lane.state.vented_mass,
        leaked_mass=lane.state.leaked_mass,
        mass_1=lane.masses.mass_1 if parts.is_thermal else lane.state.mass_1,
        mass_2=lane.masses.mass_2 if parts.is_thermal else lane.state.mass_2,
    )


def energy_sample(parts: Program, lane: Lane) -> EnergySample:
    """Energies of the gas and energy totals [J]; zeros for gas without an energy balance."""
    if not parts.is_thermal:
        return NO_ENERGY
    per_content = energy_per_content(lane.plant.gas_product, lane.thermal.heat_capacity_ratio)
    return EnergySample(
        gas_energy=per_content * (lane.state.mass_1 + lane.state.mass_2),
        supplied_enthalpy=per_content * lane.masses.supplied_content,
        vented_enthalpy=per_content * lane.masses.vented_content,
        wall_heat=per_content * lane.masses.heat_content,
        gas_work=lane.masses.gas_work,
    )


def set_point_at(parts: Program, lane: Lane, time: float) -> float:
    """Reference at a time [s]; in a walk, the torque requested by the controller [N m]; 0 without a reference."""
    if parts.leg is not None:
        return float(lane.controller_state.request.torque) if parts.requests_torque else 0.0
    return reference_at(parts, lane, time) if parts.has_reference else 0.0


def stride_sample(parts: Program, lane: Lane) -> StrideSample:
    """Stride data of a walk at a sample; zeros without a walk."""
    if parts.leg is None:
        return NO_STRIDE
    return StrideSample(
        supplied_mass=lane.state.supplied_mass,
        strides=lane.walk.strides,
        positive_push_off_work=lane.walk.positive_push_off_work,
        net_push_off_work=lane.walk.net_push_off_work,
        clearances=lane.walk.clearances,
        toe_landings=lane.walk.toe_landings,
        phase=lane.controller_state.phase.phase if parts.has_phase else 0.0,
    )


# The whole reference, before the first sample.


def reference_of_sample(parts: Program, lane: Lane, index: int, interval: float) -> float:
    """Reference at the nominal time of a sample, in the unit of the controlled quantity."""
    return reference_at(parts, lane, index * interval * lane.timing.step)


def reference_origin(parts: Program, lane: Lane) -> float:
    """Origin for the magnitude of the reference: zero for torque, else the initial value of the controlled quantity."""
    if parts.controlled == TORQUE:
        return 0.0
    pressure_1, pressure_2 = present_pressures(parts, lane)
    torque = parts.actuator.torque(lane.plant, lane.state.angle, pressure_1, pressure_2)
    return float(parts.controlled_value(lane.state.angle, pressure_1, pressure_2, torque))


def begin_reference_summary(parts: Program, lane: Lane, interval: float, last_index: int) -> None:
    """Set the last value of the reference and the larger distance of its ends from the origin, without a hold."""
    first = reference_of_sample(parts, lane, 0, interval)
    last = reference_of_sample(parts, lane, last_index, interval)
    origin = reference_origin(parts, lane)
    largest = max(abs(first - origin), abs(last - origin))
    start_up = 0.0
    duration = last_index * interval * lane.timing.step
    if parts.reference.period is not None:
        start_up = start_up_of(parts.reference.period(lane.reference), duration, parts.reference.is_wave)
    lane.course = ReferenceSummary(
        last=last,
        largest=largest,
        tolerance=SAME_LEVEL * largest,
        hold_start=0.0,
        samples=last_index + 1.0,
        start_up=start_up / (interval * lane.timing.step),
        interval=interval * lane.timing.step,
        of_joint=0.0 if parts.controlled == ANGLE else 1.0,
        previous=first,
    )


def update_largest_reference(parts: Program, lane: Lane, interval: float, index: int) -> None:
    """Update the largest distance of the reference from its origin with a sample."""
    value = reference_of_sample(parts, lane, index, interval)
    largest = max(lane.course.largest, abs(value - reference_origin(parts, lane)))
    lane.course = lane.course._replace(largest=largest, tolerance=SAME_LEVEL * largest)


def search_final_hold(parts: Program, lane: Lane, interval: float, index: int) -> None:
    """Set the start of the final hold after this sample, if it is the last that differs from the final value."""
    value = reference_of_sample(parts, lane, index, interval)
    is_last_away = lane.course.hold_start == 0.0 and is_away(value, lane.course.last, lane.course.tolerance)
    lane.course = lane.course._replace(hold_start=index + 1.0 if is_last_away else lane.course.hold_start)


# Meters and traces, at each sample.


def sample_with_summary(parts: Program, lane: Lane, elapsed: float, index: int, interval: float) -> None:
    """Store the sample, and extend the summary of a monotone reference, whose hold is found during the run."""
    make_sample(parts, lane, elapsed, index, interval)
    if parts.follows_reference and parts.reference.is_monotone:
        lane.course = advance_course(lane.course, lane.sample)


def start_meters(parts: Program, lane: Lane, elapsed: float, index: int, interval: float) -> None:
    """Set every meter to its state at the first sample."""
    sample_with_summary(parts, lane, elapsed, index, interval)
    for group, kind in parts.meter_groups.items():
        lane[group] = kind.start(lane.course, lane.sample)


def update_course(parts: Program, lane: Lane, elapsed: float, index: int, interval: float) -> None:
    """Update the present part of the reference with one more sample."""
    step = lane.timing.step
    number = float(index)
    reference = reference_at(parts, lane, elapsed * step)
    later = deciding_sample(lane.course, number, reference)
    reference_later = reference_at(parts, lane, later * interval * step)
    lane.course = advance_part(lane.course, number, reference, later, reference_later)


def end_parts(parts: Program, lane: Lane) -> None:
    """Update the meters that note the end of a part of the reference."""
    for group, kind in parts.meter_groups.items():
        if kind.end_part is not None:
            lane[group] = kind.end_part(lane[group], lane.course)


def update_meters(parts: Program, lane: Lane, elapsed: float, index: int, interval: float) -> None:
    """Update every meter with one more sample; meters of motion keep their first state for a locked vane."""
    sample_with_summary(parts, lane, elapsed, index, interval)
    for group, kind in parts.meter_groups.items():
        if not (parts.is_locked and kind.of_motion):
            lane[group] = kind.update(lane[group], lane.course, lane.sample)


def store_trace(parts: Program, lane: Lane, elapsed: float, index: int, interval: float, slot: int) -> None:
    """Write the traced channels of the present sample to ``slot`` of the ring buffer of traces."""
    make_sample(parts, lane, elapsed, index, interval)
    for row, name in enumerate(parts.traced):
        lane.trace[slot, row] = lane[parts.traces.get(name, name)]
