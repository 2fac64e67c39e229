"""Rows of the integer walking controller as the lanes keep them, whole numbers in floats, and as the law takes them."""

from typing import Any

from ppafo.control.fixed.walking.event_on_off import WalkCounts, WalkNumbers
from ppafo.control.fixed.walking.phases import PhaseCounts, PhaseNumbers, SwitchCounts
from ppafo.control.fixed.walking.signs import (
    PressureCounts,
    RangeNumbers,
    SafetyCounts,
    SafetyNumbers,
    StillNumbers,
    StrideNumbers,
    ValveNumbers,
)
from ppafo.control.fixed.walking.traces import (
    EmptyingCounts,
    EmptyingNumbers,
    LandingCounts,
    SensorCounts,
    TraceCounts,
    TraceNumbers,
)


def kept(count: int) -> Any:
    """A whole number as the lanes keep it."""
    return float(count)


def whole_phase_numbers(row: PhaseNumbers) -> PhaseNumbers:
    """Whole numbers of the phases."""
    return PhaseNumbers(
        load=int(row.load),
        unload=int(row.unload),
        debounce=int(row.debounce),
        first_stride=int(row.first_stride),
        stride_weight=int(row.stride_weight),
        push_off_start=int(row.push_off_start),
    )


def whole_range_numbers(row: RangeNumbers) -> RangeNumbers:
    """Whole ranges of the readings."""
    return RangeNumbers(
        lowest_force=int(row.lowest_force),
        largest_force=int(row.largest_force),
        lowest_angle=int(row.lowest_angle),
        highest_angle=int(row.highest_angle),
        lowest_pressure=int(row.lowest_pressure),
        highest_pressure=int(row.highest_pressure),
        thin=int(row.thin),
        thin_time=int(row.thin_time),
    )


def whole_stride_numbers(row: StrideNumbers) -> StrideNumbers:
    """Whole numbers of a stride."""
    return StrideNumbers(
        longest_phase=int(row.longest_phase),
        flat_from=int(row.flat_from),
        flat_to=int(row.flat_to),
        shortest_swing=int(row.shortest_swing),
        steady=int(row.steady),
        most_toe_strides=int(row.most_toe_strides),
        resume_strides=int(row.resume_strides),
        lowest_flat_angle=int(row.lowest_flat_angle),
        highest_flat_angle=int(row.highest_flat_angle),
    )


def whole_still_numbers(row: StillNumbers) -> StillNumbers:
    """Whole numbers of readings that rest or drop."""
    return StillNumbers(
        frozen=int(row.frozen),
        dwells=int(row.dwells),
        turns_back=int(row.turns_back),
        largest_drop=int(row.largest_drop),
        gone=int(row.gone),
    )


def whole_valve_numbers(row: ValveNumbers) -> ValveNumbers:
    """Whole numbers of the valve."""
    return ValveNumbers(
        fill=int(row.fill),
        vent=int(row.vent),
        late_vent=int(row.late_vent),
        lasts=int(row.lasts),
    )


def whole_trace_numbers(row: TraceNumbers) -> TraceNumbers:
    """Whole numbers of slow readings and landing."""
    return TraceNumbers(
        slow_share=int(row.slow_share),
        fall_share=int(row.fall_share),
        lands=int(row.lands),
        moves=int(row.moves),
        turns=int(row.turns),
        fades=int(row.fades),
        turned_up=int(row.turned_up),
        turns_down=int(row.turns_down),
        is_flat=int(row.is_flat),
        toes_late=int(row.toes_late),
        toes_in_time=int(row.toes_in_time),
    )


def whole_emptying_numbers(row: EmptyingNumbers) -> EmptyingNumbers:
    """Whole numbers of a vented chamber."""
    return EmptyingNumbers(
        follow=int(row.follow),
        shown=int(row.shown),
        rises=int(row.rises),
        filled=int(row.filled),
        compresses=int(row.compresses),
        squeezes=int(row.squeezes),
    )


def whole_safety_numbers(row: SafetyNumbers) -> SafetyNumbers:
    """Whole numbers of the signs."""
    return SafetyNumbers(
        ranges=whole_range_numbers(row.ranges),
        stride=whole_stride_numbers(row.stride),
        still=whole_still_numbers(row.still),
        valve=whole_valve_numbers(row.valve),
        stands_up=int(row.stands_up),
        trace=whole_trace_numbers(row.trace),
        emptying=whole_emptying_numbers(row.emptying),
    )


def whole_walk_numbers(row: WalkNumbers) -> WalkNumbers:
    """Whole numbers of the law."""
    return WalkNumbers(
        lifts_above=int(row.lifts_above),
        lets_go_below=int(row.lets_go_below),
        push_off_end=int(row.push_off_end),
        phase=whole_phase_numbers(row.phase),
        safety=whole_safety_numbers(row.safety),
    )


def whole_switch_counts(row: SwitchCounts) -> SwitchCounts:
    """Whole: a force sensor."""
    return SwitchCounts(
        loaded=int(row.loaded),
        against=int(row.against),
    )


def whole_phase_counts(row: PhaseCounts) -> PhaseCounts:
    """Whole: the phase."""
    return PhaseCounts(
        phase=int(row.phase),
        heel=whole_switch_counts(row.heel),
        toe=whole_switch_counts(row.toe),
        spell=int(row.spell),
        since_strike=int(row.since_strike),
        stride=int(row.stride),
        strikes=int(row.strikes),
    )


def whole_trace_counts(row: TraceCounts) -> TraceCounts:
    """Whole: the readings of a sensor."""
    return TraceCounts(
        last=int(row.last),
        still=int(row.still),
        slow=int(row.slow),
    )


def whole_sensor_counts(row: SensorCounts) -> SensorCounts:
    """Whole: forces and angle."""
    return SensorCounts(
        heel=whole_trace_counts(row.heel),
        toe=whole_trace_counts(row.toe),
        angle=whole_trace_counts(row.angle),
    )


def whole_landing_counts(row: LandingCounts) -> LandingCounts:
    """Whole: the landing."""
    return LandingCounts(
        lowest=int(row.lowest),
        mark=int(row.mark),
        late=int(row.late),
        late_toes=int(row.late_toes),
    )


def whole_emptying_counts(row: EmptyingCounts) -> EmptyingCounts:
    """Whole: a vented chamber."""
    return EmptyingCounts(
        lowest=int(row.lowest),
        angle=int(row.angle),
        rising=int(row.rising),
    )


def whole_pressure_counts(row: PressureCounts) -> PressureCounts:
    """Whole: slow pressures."""
    return PressureCounts(
        first=int(row.first),
        second=int(row.second),
    )


def whole_safety_counts(row: SafetyCounts) -> SafetyCounts:
    """Whole: the safety."""
    return SafetyCounts(
        level=int(row.level),
        sign=int(row.sign),
        good_strides=int(row.good_strides),
        heel_seen=int(row.heel_seen),
        toe_seen=int(row.toe_seen),
        toe_strides=int(row.toe_strides),
        steady=int(row.steady),
        side=int(row.side),
        held=int(row.held),
        seen=whole_sensor_counts(row.seen),
        landing=whole_landing_counts(row.landing),
        emptying=whole_emptying_counts(row.emptying),
        slow=whole_pressure_counts(row.slow),
        thin=int(row.thin),
    )


def whole_walk_counts(row: WalkCounts) -> WalkCounts:
    """Whole: the state of the law."""
    return WalkCounts(
        phase=whole_phase_counts(row.phase),
        safety=whole_safety_counts(row.safety),
        lifting=int(row.lifting),
    )


def kept_switch_counts(row: SwitchCounts) -> SwitchCounts:
    """As the lanes keep it: a force sensor."""
    return SwitchCounts(
        loaded=kept(row.loaded),
        against=kept(row.against),
    )


def kept_phase_counts(row: PhaseCounts) -> PhaseCounts:
    """As the lanes keep it: the phase."""
    return PhaseCounts(
        phase=kept(row.phase),
        heel=kept_switch_counts(row.heel),
        toe=kept_switch_counts(row.toe),
        spell=kept(row.spell),
        since_strike=kept(row.since_strike),
        stride=kept(row.stride),
        strikes=kept(row.strikes),
    )


def kept_trace_counts(row: TraceCounts) -> TraceCounts:
    """As the lanes keep it: the readings of a sensor."""
    return TraceCounts(
        last=kept(row.last),
        still=kept(row.still),
        slow=kept(row.slow),
    )


def kept_sensor_counts(row: SensorCounts) -> SensorCounts:
    """As the lanes keep it: forces and angle."""
    return SensorCounts(
        heel=kept_trace_counts(row.heel),
        toe=kept_trace_counts(row.toe),
        angle=kept_trace_counts(row.angle),
    )


def kept_landing_counts(row: LandingCounts) -> LandingCounts:
    """As the lanes keep it: the landing."""
    return LandingCounts(
        lowest=kept(row.lowest),
        mark=kept(row.mark),
        late=kept(row.late),
        late_toes=kept(row.late_toes),
    )


def kept_emptying_counts(row: EmptyingCounts) -> EmptyingCounts:
    """As the lanes keep it: a vented chamber."""
    return EmptyingCounts(
        lowest=kept(row.lowest),
        angle=kept(row.angle),
        rising=kept(row.rising),
    )


def kept_pressure_counts(row: PressureCounts) -> PressureCounts:
    """As the lanes keep it: slow pressures."""
    return PressureCounts(
        first=kept(row.first),
        second=kept(row.second),
    )


def kept_safety_counts(row: SafetyCounts) -> SafetyCounts:
    """As the lanes keep it: the safety."""
    return SafetyCounts(
        level=kept(row.level),
        sign=kept(row.sign),
        good_strides=kept(row.good_strides),
        heel_seen=kept(row.heel_seen),
        toe_seen=kept(row.toe_seen),
        toe_strides=kept(row.toe_strides),
        steady=kept(row.steady),
        side=kept(row.side),
        held=kept(row.held),
        seen=kept_sensor_counts(row.seen),
        landing=kept_landing_counts(row.landing),
        emptying=kept_emptying_counts(row.emptying),
        slow=kept_pressure_counts(row.slow),
        thin=kept(row.thin),
    )


def kept_walk_counts(row: WalkCounts) -> WalkCounts:
    """As the lanes keep it: the state of the law."""
    return WalkCounts(
        phase=kept_phase_counts(row.phase),
        safety=kept_safety_counts(row.safety),
        lifting=kept(row.lifting),
    )
