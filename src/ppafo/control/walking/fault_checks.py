"""Plausibility checks of the sensor readings of a walk, their state, and the fault flags that they raise.

A reading raises a flag if it is out of range, lost, frozen while others change, or delayed. Delayed forces are detected
at the ankle: a foot that lands on its heel turns down until it is flat, and up from then on. A foot that turns up
before the heel is detected, and continues to do so until the toes are, was already on the ground.

Conditions are combined by ``&`` and ``|``: ``and`` and ``or`` are branches, which prevent vector code over runs.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import PRESSURE_LAG, VALVE_LAG
from ppafo.control.walking.fault_flags import (
    ANGLE_RANGE,
    FORCE_GONE,
    FORCE_RANGE,
    FROZEN_ANGLE,
    FROZEN_HEEL,
    FROZEN_TOE,
    PRESSURE_RANGE,
    STILL_ANGLE,
    STILL_HEEL,
    STILL_TOE,
    raised,
)
from ppafo.control.walking.nominal_device import LINE_QUANTITIES, NominalDevice
from ppafo.control.walking.phases import PhaseState, lifts
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.helping import LANDING, MID_STANCE, PUSH_OFF, SWING
from ppafo.model.sensors import GaitMeasurement


class SafetyRules(NamedTuple):
    """Plausible ranges of sensor readings, and the longest duration of a contradiction.

    Force [N], angles [rad], times in stride times (``longest_phase``, ``flat_from``, ``flat_to``, ``shortest_swing``)
    or [s], strides, and absolute pressures [Pa]. ``fill_time`` applies to a fully open valve; a half open valve takes
    twice as long. ``nominal`` is the nominal device of the chamber observer.
    """

    lowest_force: Annotated[float, Number("N", "lowest valid reading of a force sensor", -40.0, -1.0e5, 0.0)]
    largest_force: Annotated[float, Number("N", "highest valid reading of a force sensor", 3.0e3, 100.0, 1.0e5)]
    lowest_angle: Annotated[float, Number("rad", "lowest valid reading of the angle sensor", 0.3, -10.0, 10.0)]
    highest_angle: Annotated[float, Number("rad", "highest valid reading of the angle sensor", 2.4, -10.0, 10.0)]
    longest_phase: Annotated[float, Number("1", "longest stance or swing, in stride times", 1.2, 0.3, 20.0)]
    frozen_time: Annotated[
        float, Number("s", "longest time for which the reading of a loaded sensor may stay unchanged", 0.24, 0.01, 5.0)
    ]
    most_toe_strides: Annotated[
        float, Number("1", "largest number of consecutive strides on the toes alone", 1.0, 0.0, 1.0e6)
    ]
    flat_from: Annotated[
        float,
        Number(
            "1",
            "start of foot-flat, when heel and toes are both loaded, as a fraction of a steady stride",
            0.16,
            0.05,
            0.6,
        ),
    ]
    flat_to: Annotated[float, Number("1", "end of foot-flat, as a fraction of a steady stride", 0.24, 0.05, 0.6)]
    lowest_pressure: Annotated[
        float, Number("Pa_a", "lowest valid reading of a chamber pressure sensor", 3.0e4, 0.0, 1.0e5)
    ]
    highest_pressure: Annotated[
        float, Number("Pa_a", "highest valid reading of a chamber pressure sensor", 2.0e6, 1.1e5, 1.0e8)
    ]
    filled_pressure: Annotated[
        float,
        Number("Pa_a", "pressure above which a chamber counts as filled, below which as vented", 1.25e5, 1.0e4, 1.0e8),
    ]
    fill_time: Annotated[float, Number("s", "time for which a fully open valve fills a chamber", 0.05, 1.0e-3, 10.0)]
    vent_time: Annotated[float, Number("s", "time for which an open valve vents both chambers", 0.25, 1.0e-3, 10.0)]
    shortest_swing: Annotated[
        float, Number("1", "shortest valid swing, as a fraction of a steady stride", 0.25, 0.0, 0.6)
    ]
    resume_strides: Annotated[
        float, Number("1", "number of consecutive valid strides that ends a pause", 2.0, 1.0, 1.0e3)
    ]
    largest_drop: Annotated[float, Number("N", "largest force that may vanish within one sample", 300.0, 10.0, 1.0e5)]
    lowest_flat_angle: Annotated[float, Number("rad", "smallest plausible ankle angle at foot-flat", 1.22, -10.0, 10.0)]
    highest_flat_angle: Annotated[float, Number("rad", "largest plausible ankle angle at foot-flat", 1.92, -10.0, 10.0)]
    follow_time: Annotated[
        float,
        Number(
            "s",
            "time within which a pressure follows the valve, in addition to the lags of valve and sensor",
            8.0e-3,
            0.0,
            1.0,
            follows=(VALVE_LAG, PRESSURE_LAG),
        ),
    ]
    highest_toe_off_angle: Annotated[
        float, Number("rad", "largest plausible ankle angle while the toes are loaded", 2.06, -10.0, 10.0)
    ]
    nominal: NominalDevice


SAFETY_QUANTITIES = (*quantities_of(SafetyRules), *LINE_QUANTITIES)
"""Settings of the checks in a walk file, with the nominal device of the observer."""


class LastReadings(NamedTuple):
    """Last readings of heel and toe force [N], angle [rad] and both pressures [Pa].

    ``heel_unchanged``, ``toe_unchanged`` and ``angle_unchanged`` are the times [s] for which a reading has been
    constant; ``slow_heel``, ``slow_toe`` and ``slow_angle`` are the filtered readings.

    A time counts only while another sensor changes or the wearer steps. The angle is counted from the previous strike
    only, because a hanging or sitting foot may have a constant angle for long.
    """

    heel_force: float = 0.0
    toe_force: float = 0.0
    angle: float = 0.0
    pressure_1: float = 0.0
    pressure_2: float = 0.0
    heel_unchanged: float = 0.0
    toe_unchanged: float = 0.0
    angle_unchanged: float = 0.0
    slow_heel: float = 0.0
    slow_toe: float = 0.0
    slow_angle: float = 0.0


class LandingCheck(NamedTuple):
    """State of the landing check, which detects delayed force readings.

    ``lowest`` is the lowest ankle angle of this swing, or since the strike [rad]; ``highest`` is the highest angle
    after that, which decays with time [rad]. ``in_doubt`` is the angle at a doubtful strike [rad], 0 for a timely one;
    ``late`` is the number of consecutive late strikes. ``late_toes`` is the number of consecutive push-offs at whose
    end the foot had turned down as only a foot in the air does.
    """

    lowest: float = 0.0
    highest: float = 0.0
    in_doubt: float = 0.0
    late: float = 0.0
    late_toes: float = 0.0


class Emptying(NamedTuple):
    """Lowest pressure of chamber 2 while vented [Pa], ankle angle at this pressure [rad], duration of a rise [s]."""

    lowest: float = 0.0
    angle: float = 0.0
    rising: float = 0.0


SLOW_TIME = 0.08
"""Time constant [s] of the filtered readings: a step has decayed in them when a sensor counts as frozen."""

MOVES, TURNS = 40.0, 0.04
"""Deviations of a force [N] and an angle [rad] from their filtered readings that count as motion, beyond standing."""

IN_TIME = 0.06
"""Angle [rad], 3.4 deg, below ``highest_toe_off_angle`` up to which a detected toe-off is timely; between both the
check is undecided. A dropped foot without push-off also turns down in the air, but more slowly."""

GONE = 0.1
"""Largest force that counts as a lost signal, as a fraction of ``largest_drop`` [-]."""

QUICK_PERIOD = 0.005
"""Sample period [s] above which a force may vanish within one sample: toes leave the ground in about 0.1 s."""

SQUEEZING_ANGLE = 2.09
"""Ankle angle [rad] above which a foot may compress a full chamber 2 to any pressure: 30 deg in plantarflexion."""

TURNED_UP = 0.05
"""Angle [rad], 2.9 deg, by which a foot has turned up at a doubtful strike, after decay of the highest angle.

The largest value in two consecutive strides of 480 wearers with good sensors is 2.4 deg.
"""

FADES = 0.35
"""Decay rate [rad/s] of the highest angle of a swing, 20 deg/s: a foot that lands nearly flat turns up at that rate
in the air before, and several times as fast once it is flat."""

TURNS_DOWN, IS_FLAT = 0.01, 0.026
"""Angles [rad]: a foot that turns down by more than the first is landing now; one that turns up by more than the second
until the toes are loaded is flat.

A foot that is still being lifted at the strike turns up first, and then down: if by more than the second angle, it is
landing now too.
"""

LATE_STRIDES = 1.5
"""Largest number of consecutive doubtful strides without a fault: the last step of a walk may be flat too."""

RISES, LASTS = 1.2e4, 2.5e-3
"""Pressure rise [Pa], larger than one converter step of 1 psi, and duration [s], beyond noise."""

SHOWN = 0.1
"""Time [s] after ``follow_time`` in which a vented chamber is checked: a foot that moves later displaces gas."""

COMPRESSES = 0.02
"""Change of angle in plantarflexion [rad] above which the ankle compresses chamber 2 enough to raise its pressure."""

THIN, THIN_TIME = 6.0e4, 0.12
"""Pressure [Pa] below which no chamber stays longer than the time [s]; a moving foot may lower it for less."""

FALL_TIME = 0.1
"""Time constant [s] of the filtered pressures that detect a falling reading."""

FALLS = 0.03
"""Smallest relative excess of the filtered value over a falling reading. The excess is 0.3 for a venting chamber at
140 kPa, and 0.04 for a hose with a tenth of its conductance, which is no fault of the sensor."""

DWELLS, TURNS_BACK = 0.235, 0.35
"""Largest fractions of the stride in which a force and an ankle angle may stay within one converter step: in a usual
stride the first is ``frozen_time``; slow strides have slow reversals."""

LANDS = 0.3
"""Fraction of the stride after heel strike in which the wearer steps; later the wearer may stand on the heel."""

MOST = 0.75
"""Fraction of a stride for which a constant angle counts as constant over all of it; some time counts less, as nothing
else moved then."""

HALF = 0.5
"""Smallest ratio of a good stride to the stride time; the inverse is the largest ratio."""


def time_unchanged(last: float, reading: float, since: float, moves: bool, period: float) -> float:
    """Time for which a reading has been bitwise constant [s], counted while another quantity ``moves``."""
    # Equal to the last bit: the reading of a live sensor has noise, or changes by a converter step.
    unchanged = since + period if moves else since
    return unchanged if reading == last else 0.0


def slow_reading(last: float, reading: float, is_first: bool, period: float) -> float:
    """Reading filtered with ``SLOW_TIME``, in the unit of the reading; the first reading initialises the filter."""
    filtered = last + (reading - last) * period / (period + SLOW_TIME)
    return reading if is_first else filtered


def next_readings(
    last: LastReadings, measurement: GaitMeasurement, before: PhaseState, phase: PhaseState, period: float
) -> LastReadings:
    """Last readings after a sample of ``period`` [s]; ``before`` and ``phase`` are the phases around the sample.

    A sensor counts as frozen only while another sensor changes: in standing with heel and toes on the ground no sensor
    changes, and the resolution of a converter keeps a reading constant for long. Nobody stands still on the toes alone,
    or lands for long; a wearer whose toes are lifted by the device may stand on the heel alone.
    """
    # An angle of 0 marks that there was no reading yet: the angle of an ankle is never exactly 0 rad.
    is_first = last.angle == 0.0
    # The time before the last strike belongs to the previous stride.
    unchanged_angle = min(last.angle_unchanged, before.since_strike)
    slow_heel = slow_reading(last.slow_heel, measurement.heel_force, is_first, period)
    slow_toe = slow_reading(last.slow_toe, measurement.toe_force, is_first, period)
    slow_angle = slow_reading(last.slow_angle, measurement.angle, is_first, period)
    lands = (phase.phase == LANDING) & (phase.in_phase < LANDS * phase.stride_time)
    steps = (phase.heel.loaded < 0.5) | lands
    heel_moves = abs(measurement.heel_force - slow_heel) > MOVES
    toe_moves = abs(measurement.toe_force - slow_toe) > MOVES
    turns = abs(measurement.angle - slow_angle) > TURNS
    return LastReadings(
        heel_force=measurement.heel_force,
        toe_force=measurement.toe_force,
        angle=measurement.angle,
        pressure_1=measurement.pressure_1,
        pressure_2=measurement.pressure_2,
        heel_unchanged=time_unchanged(
            last.heel_force, measurement.heel_force, last.heel_unchanged, toe_moves | turns | steps, period
        ),
        toe_unchanged=time_unchanged(
            last.toe_force, measurement.toe_force, last.toe_unchanged, heel_moves | turns | steps, period
        ),
        angle_unchanged=time_unchanged(
            last.angle, measurement.angle, unchanged_angle, heel_moves | toe_moves | steps, period
        ),
        slow_heel=slow_heel,
        slow_toe=slow_toe,
        slow_angle=slow_angle,
    )


def range_flag(rules: SafetyRules, measurement: GaitMeasurement, thin: float) -> float:
    """Fault flag of a reading outside of its physical range; a pressure has been too low for the time ``thin`` [s]."""
    force = max(measurement.heel_force, measurement.toe_force) > rules.largest_force
    force = force | (min(measurement.heel_force, measurement.toe_force) < rules.lowest_force)
    angle = (measurement.angle < rules.lowest_angle) | (measurement.angle > rules.highest_angle)
    # A foot far in plantarflexion compresses a full chamber 2 to any pressure: no fault of the sensor.
    is_compressed = measurement.angle > SQUEEZING_ANGLE
    pressure = min(measurement.pressure_1, measurement.pressure_2) < rules.lowest_pressure
    pressure = pressure | (thin > THIN_TIME) | (measurement.pressure_1 > rules.highest_pressure)
    pressure = pressure | ((measurement.pressure_2 > rules.highest_pressure) & (not is_compressed))
    return min(raised(FORCE_RANGE, force), raised(ANGLE_RANGE, angle), raised(PRESSURE_RANGE, pressure))


def is_gone(rules: SafetyRules, last: float, force: float) -> bool:
    """Return whether a force [N] was large at the previous sample and is nearly zero now."""
    return (last > rules.largest_drop) & (force < GONE * rules.largest_drop)


def gone_flag(rules: SafetyRules, last: LastReadings, measurement: GaitMeasurement, period: float) -> float:
    """Fault flag of a loose contact: a foot takes many samples of ``period`` [s] to leave the ground."""
    gone = is_gone(rules, last.heel_force, measurement.heel_force)
    gone = gone | is_gone(rules, last.toe_force, measurement.toe_force)
    return raised(FORCE_GONE, gone & (period < QUICK_PERIOD))


def still_flag(rules: SafetyRules, readings: LastReadings, before: PhaseState, phase: PhaseState) -> float:
    """Fault flag of a reading that is constant while another sensor changes, or while the others show a step (frozen).

    An unloaded force sensor is constant for long, as is the angle of a lifted foot.
    """
    longest = max(rules.frozen_time, DWELLS * phase.stride_time)
    heel = (readings.heel_unchanged > longest) & (phase.heel.loaded > 0.5)
    toe = (readings.toe_unchanged > longest) & (phase.toe.loaded > 0.5)
    # Only the time since the strike: an angle may be constant in all of a slow swing.
    angle = min(readings.angle_unchanged, phase.since_strike) > max(rules.frozen_time, TURNS_BACK * phase.stride_time)
    ends = (before.phase == SWING) & (phase.phase != SWING)
    ends = ends & (before.since_strike > HALF * phase.stride_time) & (before.since_strike < phase.stride_time / HALF)
    return min(
        raised(FROZEN_HEEL, heel & (phase.toe.loaded != before.toe.loaded)),
        raised(FROZEN_TOE, toe & (phase.heel.loaded != before.heel.loaded)),
        raised(FROZEN_ANGLE, ends & (readings.angle_unchanged > MOST * before.since_strike)),
        raised(STILL_HEEL, heel),
        raised(STILL_TOE, toe),
        raised(STILL_ANGLE, angle & (not lifts(phase.phase))),
    )


def next_landing(
    rules: SafetyRules,
    last: LandingCheck,
    readings: LastReadings,
    before: PhaseState,
    phase: PhaseState,
    steady: float,
    period: float,
) -> LandingCheck:
    """Landing check after a sample of ``period`` [s].

    In a ``steady`` walk (1) a strike is doubtful if the foot has already turned up at the strike. A lifted foot also
    turns up in the air, but turns down again on its heel.
    """
    angle, is_swing = readings.angle, phase.phase == SWING
    # Each swing and each stance has its own lowest and highest angle.
    is_lowest = (is_swing != (before.phase == SWING)) | (angle < last.lowest)
    highest = max(last.highest - FADES * period, angle) if is_swing else last.highest
    strikes = (before.phase == SWING) & (phase.phase == LANDING)
    # The filtered angle still shows a recent high angle when the highest angle of the swing has decayed.
    turned_up = max(last.highest, readings.slow_angle) - angle > TURNED_UP
    in_doubt = (angle if turned_up & (steady > 0.5) else 0.0) if strikes else last.in_doubt
    # Turning down after the strike clears the doubt, and so does turning up from a lower angle.
    lands = (angle > in_doubt + TURNS_DOWN) | (
        (phase.phase == LANDING) & (not is_lowest) & (angle > last.lowest + IS_FLAT)
    )
    is_late = (before.phase == LANDING) & (last.in_doubt - angle > IS_FLAT)
    flat = lifts(before.phase) & (phase.phase == MID_STANCE)
    # Loaded toes hold the foot; in the air a pushed foot turns down to its stop within 60 ms.
    leaves = (before.phase == PUSH_OFF) & (phase.phase == SWING)
    # A late toe-off is counted, a timely one resets the count, and one between both limits changes nothing.
    counted = last.late_toes + 1.0 if angle > rules.highest_toe_off_angle else last.late_toes
    counted = 0.0 if angle < rules.highest_toe_off_angle - IN_TIME else counted
    return LandingCheck(
        lowest=angle if is_lowest else last.lowest,
        highest=angle if is_lowest else highest,
        in_doubt=0.0 if lands else in_doubt,
        late=(last.late + 1.0 if is_late else 0.0) if flat else last.late,
        late_toes=counted if leaves else last.late_toes,
    )


def next_slow_pressure(last: float, pressure: float, period: float) -> float:
    """Filtered pressure [Pa] after a sample taken every ``period`` [s]."""
    return last + (pressure - last) * period / (period + FALL_TIME)


def holds_pressure(rules: SafetyRules, pressure: float, expected: float, slow: float) -> bool:
    """Return whether a vented chamber shows a pressure [Pa] that does not fall and exceeds the expected pressure.

    The ankle compresses the gas of a vented chamber, which keeps that pressure until the gas has flowed out.
    """
    # The ankle may compress the remaining gas: only pressure above the expected gauge pressure counts.
    expected_gauge = max(expected - rules.nominal.nominal_atmospheric_pressure, 0.0)
    excess = pressure - (expected_gauge if rules.nominal.nominal_flow > 0.0 else 0.0)
    return (excess > rules.filled_pressure) & (slow <= (1.0 + FALLS) * pressure)


def next_emptying(
    rules: SafetyRules, last: Emptying, vented: float, measurement: GaitMeasurement, period: float
) -> Emptying:
    """Check of chamber 2 after a sample of ``period`` [s], vented for the time ``vented`` [s].

    A vented chamber has no source, and only the ankle could compress it: a rising pressure is an old reading.
    """
    pressure, angle = measurement.pressure_2, measurement.angle
    is_lowest = (vented <= rules.follow_time) | (pressure < last.lowest)
    rises = (pressure > max(last.lowest + RISES, rules.filled_pressure)) & (vented < rules.follow_time + SHOWN)
    rises = rises & (angle < min(last.angle + COMPRESSES, SQUEEZING_ANGLE))
    return Emptying(
        lowest=pressure if is_lowest else last.lowest,
        angle=angle if is_lowest else last.angle,
        rising=last.rising + period if rises & (not is_lowest) else 0.0,
    )
