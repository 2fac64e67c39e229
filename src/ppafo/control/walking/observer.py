"""Observer of the chamber contents from command, measured angle and nominal device, and the contradictions it finds.

The gas content of a chamber is p V, its mass times R T, which no movement of the ankle changes. The residual is formed
in gas content: a residual in pressure would grow without bounds where a foot compresses a chamber at its stop. From
sample to sample

    content += residual h / ``FORGETS`` + flow h,    residual = (measured pressure - expected pressure) V

and the flow is the flow of the nominal valve at the *expected* pressure, because the offset of a sensor would
accumulate in it. An alarm is a residual larger than devices, sensors and heat explain: a fraction of the gas that has
passed lately, and an error of pressure and angle in a mean volume. The sign of the residual and the state of the valve
indicate the likely cause. A fault of a valve and a fault of a pressure sensor cannot be distinguished at that moment,
and both stop the device.

``nominal_flow`` 0 switches the observer off.
"""

import math
from typing import NamedTuple

from ppafo.control.walking.fault_flags import (
    LEAK,
    NOT_RAISED,
    SUPPLY_HIGH,
    SUPPLY_LOST,
    SUPPLY_LOW,
    VALVE_OPEN,
    VALVE_SHUT,
)
from ppafo.control.walking.nominal_device import NominalDevice, believed_volumes, mean_volumes
from ppafo.model.regulator import LineState, SupplyLines, step_lines
from ppafo.model.valves.kind import VENTS_ABOVE

LONG_AGO = 1.0e9
"""Time [s] since the command of a coil that was switched off before the start."""


class _ObservedValve(NamedTuple):
    """On/off valve: present flow (0 or 1), commanded flow, time since the command, and switching time [s]."""

    position: float = 0.0
    target: float = 0.0
    since: float = LONG_AGO
    waits: float = 0.0


class _CommandInTransit(NamedTuple):
    """Command on its way to a spool or a vent valve [-], after one, two and three thirds of the dead time."""

    first: float = 0.0
    second: float = 0.0
    third: float = 0.0


class _ObservedChamber(NamedTuple):
    """Estimated gas of a chamber.

    ``content`` p V [J], expected sensor ``pressure`` [Pa], gas ``passed`` lately [J], and duration ``contrary`` of an
    alarm [s]. ``least`` [J] is the measured content when the chamber was connected to its supply, or the lowest
    measured content since the supply was disconnected. While fed the minimum is not used: with noise it would indicate
    gas that never came.
    """

    content: float = 0.0
    pressure: float = 0.0
    passed: float = 0.0
    contrary: float = 0.0
    least: float = 0.0


class Observer(NamedTuple):
    """Estimated state of both chambers, the valve and the lines.

    ``command`` [-] is the present command. ``coil_1`` and ``coil_2`` are the on/off valves, ``on_the_way`` and
    ``venting`` the commands to the spool and the vent valve in transit, and ``spool`` is the estimated opening [-].
    ``joined`` [s] is the remaining time for which the chambers are joined. ``lines`` are the gas contents [J] of the
    lines downstream of the regulators.
    """

    chamber_1: _ObservedChamber = _ObservedChamber()
    chamber_2: _ObservedChamber = _ObservedChamber()
    command: float = 2.0
    coil_1: _ObservedValve = _ObservedValve()
    coil_2: _ObservedValve = _ObservedValve()
    on_the_way: _CommandInTransit = _CommandInTransit()
    venting: _CommandInTransit = _CommandInTransit(1.0, 1.0, 1.0)
    spool: float = 0.0
    joined: float = 0.0
    lines: LineState = LineState(0.0, 0.0, 0.0)


class Supplying(NamedTuple):
    """Connection of a chamber to supply and atmosphere during a sample.

    ``source`` and ``vent`` [-] are the mean openings to the supply and to the atmosphere. ``was_fed`` is 1 if the
    supply was connected before the sample. ``pressure`` is of the supply and ``set_pressure`` of its regulator [Pa].
    """

    source: float
    vent: float
    was_fed: float
    pressure: float
    set_pressure: float


class ChamberReading(NamedTuple):
    """Measured pressures before and after a sample [Pa], volumes at both angles, and volume in mid-range [m^3]."""

    last_pressure: float
    pressure: float
    last_volume: float
    volume: float
    mean_volume: float


START = Observer()

FORGETS = 0.128
"""Time constant [s] with which the contents follow the measurement and passed gas is forgotten."""

WARM = 1.1
"""Flow divided by isothermal flow: between isothermal and adiabatic gas."""

OF_PASSED, KEPT = 0.5, 0.375
"""Fractions of the gas passed lately that errors of area, dead volume, supply and heat explain, and that a chamber may
have kept while not fed.

A tenth of area and a twentieth each of supply and heat add up to a quarter. A dead volume twice the nominal one halves
the pressure that gas gives, and half the nominal one raises it by half, in vanes whose dead volume is three quarters of
the mean volume. A chamber that does not vent at all keeps 0.6 of the gas passed lately, because the estimate follows
the sensor.
"""

OFFSET, OF_PRESSURE, OF_ANGLE = 1.2e4, 0.05, 0.035
"""Tolerances: pressure offset and noise [Pa], relative regulator error [-], angle error for the volume [rad], 2 deg."""

ALARM_TIME, ALARM_SAMPLES = 5.0e-3, 5.0
"""Smallest duration of an alarm, in time [s] and in samples, before it counts."""

LINEAR_RATIO = 0.95
"""Pressure ratio above which the flow function is a straight line to zero."""

TINY = 1.0e-12
"""Replacement for a volume [m^3] and a droop of 0, which avoids a division by 0."""

SAME = 1.0e-6
"""Times [s] that differ by less than this are equal."""


def flow_into(nominal: NominalDevice, pressure: float, node: float, is_relieving: float) -> float:
    """Flow of gas content [J/s] into a chamber at ``pressure`` from a node [Pa] through the open valve.

    A flow out of the chamber is negative. No gas flows back into a node with ``is_relieving`` 0. Equations (6), (7),
    with the flow function of ISO 6358-1:2013 at a pressure ratio r and the critical ratio b:
    psi(r) = sqrt(1 - ((r - b) / (1 - b))^2), 1 below b, and a straight line to 0 at r = 1 above ``LINEAR_RATIO``.
    """
    upstream = max(pressure, node)
    ratio, critical = min(pressure, node) / upstream, nominal.nominal_critical_ratio
    # The straight line for nearly equal pressures is the one of the model's orifice.
    subsonic = (min(max(ratio, critical), LINEAR_RATIO) - critical) / (1.0 - critical)
    share = math.sqrt(1.0 - subsonic * subsonic) * min((1.0 - ratio) / (1.0 - LINEAR_RATIO), 1.0)
    return nominal.nominal_flow * upstream * share * (1.0 if node >= pressure else -is_relieving)


def next_coil(
    nominal: NominalDevice, coil: _ObservedValve, requested: float, period: float
) -> tuple[_ObservedValve, float]:
    """Coil after a sample [s] with the ``requested`` position, and its mean position [-] in the sample."""
    switches = (requested != coil.target) & (coil.since >= nominal.nominal_switching_interval - SAME)
    delay = nominal.nominal_opening_delay if requested > 0.5 else nominal.nominal_closing_delay
    target = requested if switches else coil.target
    waits = delay if switches else coil.waits
    # Fraction of the sample before the change: the weight of the present position in the mean.
    before = min(waits, period) / period
    return _ObservedValve(
        position=target if waits <= period + SAME else coil.position,
        target=target,
        since=(0.0 if switches else coil.since) + period,
        waits=max(waits - period, 0.0),
    ), before * coil.position + (1.0 - before) * target


def next_on_the_way(
    nominal: NominalDevice, on_the_way: _CommandInTransit, target: float, period: float
) -> _CommandInTransit:
    """Command in transit after a sample [s] with a ``target`` [-]: three first-order lags that add up to the dead time.

    The mean flow is then correct, without a buffer for all samples of the dead time.
    """
    share = period / (period + nominal.nominal_delay / 3.0)
    first = on_the_way.first + (target - on_the_way.first) * share
    second = on_the_way.second + (first - on_the_way.second) * share
    return _CommandInTransit(first=first, second=second, third=on_the_way.third + (second - on_the_way.third) * share)


def contradiction(
    nominal: NominalDevice, passed: float, supplying: Supplying, reading: ChamberReading, expected: float
) -> float:
    """Residual of a chamber divided by its tolerance [-]: above 1 there is too much gas, below -1 too little.

    ``passed`` is the gas passed lately [J], ``expected`` the expected pressure [Pa].
    """
    measured, is_fed = reading.pressure, supplying.was_fed > 0.5
    at_rest = reading.mean_volume * (OFFSET + OF_PRESSURE * abs(measured))
    at_rest = at_rest + OF_ANGLE * nominal.nominal_displacement_per_radian * abs(measured)
    of_passed = OF_PASSED if is_fed | (measured < expected) else KEPT
    share = (measured - expected) * reading.volume / (of_passed * passed + at_rest)
    # However wide the valve and small the chamber are, a supply fills it to its own pressure only.
    overfull = (measured - max(expected, supplying.set_pressure)) * reading.volume / at_rest
    return max(share, overfull) if is_fed & (measured > expected) else share


def next_chamber(
    nominal: NominalDevice,
    chamber: _ObservedChamber,
    supplying: Supplying,
    reading: ChamberReading,
    is_blind: bool,
    period: float,
) -> tuple[_ObservedChamber, float]:
    """Chamber after a sample [s], updated by the flow and then by its reading; and gas taken from the supply [J].

    The content is taken from the sensor while the observer ``is_blind``: at the start, and while the chambers are
    joined.
    """
    atmosphere, supply = nominal.nominal_atmospheric_pressure, supplying.pressure
    source, vent, was_fed = supplying.source, supplying.vent, supplying.was_fed > 0.5
    last_volume, volume, measured = reading.last_volume, reading.volume, reading.pressure
    before = chamber.content / last_volume
    # At the expected pressure, not the measured one: an offset of the sensor would add up in the flow.
    entered = source * flow_into(nominal, before, supply, nominal.nominal_relieving) + vent * flow_into(
        nominal, before, atmosphere, 1.0
    )
    # In one sample no flow leads beyond the pressures between which it runs.
    low, high = min(before, atmosphere if vent > 0.0 else supply), max(before, supply if source > 0.0 else atmosphere)
    added = max((low - before) * last_volume, min((high - before) * last_volume, WARM * period * entered))
    share = period / FORGETS
    passed = chamber.passed + abs(added) - share * chamber.passed
    # A content measured before the connection changed belongs to another cause.
    is_switched = (source > vent) != was_fed
    last_content = reading.last_pressure * last_volume
    lowest = chamber.least if was_fed else min(chamber.least, last_content)
    least = last_content if is_switched else lowest

    content = measured * volume if is_blind else chamber.content + added
    lag = nominal.nominal_sensor_lag
    filtered = chamber.pressure + (content / volume - chamber.pressure) * period / (period + lag)
    expected = measured if is_blind else filtered
    # In gas content, which no movement of the ankle changes.
    residual = (measured - expected) * volume
    excess = contradiction(nominal, passed, supplying, reading, expected)
    return _ObservedChamber(
        content=max(content + residual * min(share, 1.0), 0.0),
        pressure=expected,
        passed=0.0 if is_blind else passed,
        contrary=chamber.contrary + period if abs(excess) > 1.0 else 0.0,
        least=measured * volume if is_blind else least,
    ), added if source > vent else 0.0


def next_observer(
    nominal: NominalDevice,
    state: Observer,
    last_angle: float,
    last_1: float,
    last_2: float,
    angle: float,
    pressure_1: float,
    pressure_2: float,
    period: float,
) -> Observer:
    """Observer after a sample [s] with the present command; ``last_`` readings are before the sample.

    Angles [rad], absolute pressures [Pa].
    """
    if nominal.nominal_flow <= 0.0:
        return state
    command, is_start = state.command, state.chamber_1.content <= 0.0
    vents, is_pair = command > VENTS_ABOVE, nominal.nominal_pair > 0.5

    # A pair feeds by its coils' mean positions, a spool by its opening to either side.
    coil_1, on_1 = next_coil(nominal, state.coil_1, 1.0 if (command > 0.0) & (not vents) else 0.0, period)
    coil_2, on_2 = next_coil(nominal, state.coil_2, 1.0 if command < 0.0 else 0.0, period)
    # A spool opens beyond its dead band, and rests in the middle while all vents.
    size = max(min(abs(command), 1.0) - nominal.nominal_dead_band, 0.0) / (1.0 - nominal.nominal_dead_band)
    target = 0.0 if vents else (size if command >= 0.0 else -size)
    on_the_way = next_on_the_way(nominal, state.on_the_way, target, period)
    venting = next_on_the_way(nominal, state.venting, 1.0 if vents else 0.0, period)
    spool = state.spool + (on_the_way.third - state.spool) * period / (period + nominal.nominal_lag)
    towards_1, towards_2 = max(spool, 0.0), max(-spool, 0.0)

    # No line has more than its regulator gives, whatever it has lost on the way; at the start it has that.
    set_1, set_2 = nominal.nominal_supply_pressure, nominal.nominal_dorsiflexion_pressure
    nominal_lines = nominal.nominal_lines
    full = LineState(mass_1=set_1 * nominal_lines.volume_1, mass_2=set_2 * nominal_lines.volume_2, regulated_mass=0.0)
    lines = full if is_start else state.lines
    supply_1, supply_2 = supplied(nominal, lines)
    supplying_1 = Supplying(
        source=on_1 if is_pair else towards_1,
        vent=1.0 - on_1 if is_pair else max(venting.third, towards_2),
        was_fed=1.0 if is_fed(nominal, state.coil_1, state.spool) else 0.0,
        pressure=supply_1,
        set_pressure=set_1,
    )
    supplying_2 = Supplying(
        source=on_2 if is_pair else towards_2,
        vent=1.0 - on_2 if is_pair else max(venting.third, towards_1),
        was_fed=1.0 if is_fed(nominal, state.coil_2, -state.spool) else 0.0,
        pressure=supply_2,
        set_pressure=set_2,
    )

    # The flow is calculated in the volume before the sample, the reading in the volume after it.
    last_volume_1, last_volume_2 = believed_volumes(nominal, last_angle, last_1, last_2)
    volume_1, volume_2 = believed_volumes(nominal, angle, pressure_1, pressure_2)
    mean_1, mean_2 = mean_volumes(nominal, pressure_1, pressure_2)
    # The joining time counts from the release of the coil of chamber 1.
    joined = nominal.nominal_joining_time if coil_1.position > 0.5 else max(state.joined - period, 0.0)
    # While the chambers are joined, gas passes that no nominal flow describes.
    is_blind = is_start | ((joined > 0.0) & (coil_1.position < 0.5))
    reading_1 = ChamberReading(
        last_pressure=last_1, pressure=pressure_1, last_volume=last_volume_1, volume=volume_1, mean_volume=mean_1
    )
    reading_2 = ChamberReading(
        last_pressure=last_2, pressure=pressure_2, last_volume=last_volume_2, volume=volume_2, mean_volume=mean_2
    )
    chamber_1, taken_1 = next_chamber(nominal, state.chamber_1, supplying_1, reading_1, is_blind, period)
    chamber_2, taken_2 = next_chamber(nominal, state.chamber_2, supplying_2, reading_2, is_blind, period)
    return Observer(
        chamber_1=chamber_1,
        chamber_2=chamber_2,
        command=command,
        coil_1=coil_1,
        coil_2=coil_2,
        on_the_way=on_the_way,
        venting=venting,
        spool=spool,
        joined=joined,
        lines=next_lines(nominal, lines, taken_1, taken_2, period),
    )


def is_behind_lines(nominal: NominalDevice) -> bool:
    """Tell whether the observer models supply lines: both have a volume, and their regulators a droop."""
    lines = nominal.nominal_lines
    return min(lines.volume_1, lines.volume_2, lines.droop_1, lines.droop_2) > 0.0


def supplied(nominal: NominalDevice, lines: LineState) -> tuple[float, float]:
    """Absolute pressures [Pa] upstream of the valve: of both lines, or of the supplies if there are no lines."""
    volume_1, volume_2 = max(nominal.nominal_lines.volume_1, TINY), max(nominal.nominal_lines.volume_2, TINY)
    has_lines = is_behind_lines(nominal)
    return (
        lines.mass_1 / volume_1 if has_lines else nominal.nominal_supply_pressure,
        lines.mass_2 / volume_2 if has_lines else nominal.nominal_dorsiflexion_pressure,
    )


def next_lines(nominal: NominalDevice, lines: LineState, taken_1: float, taken_2: float, period: float) -> LineState:
    """Lines after a sample [s] in which the chambers took two gas contents [J]; zero if there are no lines."""
    has_lines = is_behind_lines(nominal)
    nominal_lines = nominal.nominal_lines
    divisible = SupplyLines(
        droop_1=max(nominal_lines.droop_1, TINY),
        largest_flow_1=nominal_lines.largest_flow_1,
        volume_1=max(nominal_lines.volume_1, TINY),
        droop_2=max(nominal_lines.droop_2, TINY),
        largest_flow_2=nominal_lines.largest_flow_2,
        volume_2=max(nominal_lines.volume_2, TINY),
        relieving=nominal_lines.relieving,
    )
    set_1, set_2 = nominal.nominal_supply_pressure, nominal.nominal_dorsiflexion_pressure
    after = step_lines(divisible, set_1, set_2, 1.0, lines, taken_1, taken_2, 0.0, period).after
    return LineState(
        mass_1=max(after.mass_1, 0.0) if has_lines else 0.0,
        mass_2=max(after.mass_2, 0.0) if has_lines else 0.0,
        regulated_mass=0.0,
    )


def is_fed(nominal: NominalDevice, coil: _ObservedValve, spool: float) -> bool:
    """Return whether the valve is estimated to feed its chamber; ``spool`` [-] is positive towards the chamber."""
    return (coil.position > 0.5) if nominal.nominal_pair > 0.5 else (spool > 0.0)


SHOWS_GAS = 0.05
"""Fraction of the passed gas by which a content must grow to prove an inflow: half the growth at a tenth of the flow,
and several times the growth with a hose that is open to the atmosphere."""

NEARLY_FULL = 0.8
"""Fraction of the supply pressure above which a vented chamber is still connected to the supply."""


def has_gas(chamber: _ObservedChamber, volume: float, measured: float) -> bool:
    """Return whether a chamber with a reading [Pa] in its volume [m^3] has received gas since it was connected."""
    # Against the content when the feeding began: an offset of the sensor is in both.
    return measured * volume - chamber.least > SHOWS_GAS * chamber.passed


def cause_of(
    nominal: NominalDevice,
    chamber: _ObservedChamber,
    volume: float,
    measured: float,
    supply: float,
    coil: _ObservedValve,
    spool: float,
    venting: float,
    lost_beside: float,
    period: float,
) -> float:
    """Fault flag of a chamber for a reading [Pa] in its volume [m^3] and a supply pressure [Pa]; else ``NOT_RAISED``.

    ``coil``, ``spool`` [-], positive towards the chamber, and ``venting`` [-] are the estimated valve states.
    ``lost_beside`` [J] is the missing gas content of the other chamber, 0 if that chamber received no gas.
    """
    is_supplied = is_fed(nominal, coil, spool)
    is_vented = (coil.position < 0.5) if nominal.nominal_pair > 0.5 else ((venting > 0.5) | (spool < 0.0))
    # In samples too: at a slow rate 5 ms would be a single noisy reading.
    is_alarm = chamber.contrary > max(ALARM_TIME, ALARM_SAMPLES * period) - SAME
    gained = (measured - chamber.pressure) * volume
    gains = gained > 0.0
    # Gas in a vented chamber: the valve is stuck open if the supply is visible, else stuck shut under a foot.
    into_vent = (measured > NEARLY_FULL * supply) | (measured * volume > chamber.least + 0.5 * OFFSET * volume)
    # Fed: too much, too little, or nothing at all comes.
    in_fill = SUPPLY_HIGH if gains else (SUPPLY_LOW if has_gas(chamber, volume, measured) else SUPPLY_LOST)
    in_vent = (VALVE_OPEN if into_vent else VALVE_SHUT) if gains else LEAK
    # Neither fed nor vented: what comes in passes a valve, what goes passes a leak.
    closed = VALVE_OPEN if gains else LEAK
    flag = in_fill if is_supplied else (in_vent if is_vented else closed)
    # What a chamber without a source gains has come across the vane where the other one lost as much of what came.
    across = gains & (not is_supplied) & (lost_beside > gained)
    return (LEAK if across else flag) if is_alarm else NOT_RAISED


def found_cause(
    nominal: NominalDevice, state: Observer, angle: float, pressure_1: float, pressure_2: float, period: float
) -> float:
    """Fault flag of a sample [s] with an angle [rad] and absolute pressures [Pa]; chamber 1 is checked first.

    ``NOT_RAISED`` if no fault is found.
    """
    if nominal.nominal_flow <= 0.0:
        return NOT_RAISED
    chamber_1, chamber_2 = state.chamber_1, state.chamber_2
    volume_1, volume_2 = believed_volumes(nominal, angle, pressure_1, pressure_2)
    supply_1, supply_2 = supplied(nominal, state.lines)
    lost_1 = (chamber_1.pressure - pressure_1) * volume_1 if has_gas(chamber_1, volume_1, pressure_1) else 0.0
    lost_2 = (chamber_2.pressure - pressure_2) * volume_2 if has_gas(chamber_2, volume_2, pressure_2) else 0.0
    spool, venting = state.spool, state.venting.third
    flag_1 = cause_of(nominal, chamber_1, volume_1, pressure_1, supply_1, state.coil_1, spool, venting, lost_2, period)
    flag_2 = cause_of(nominal, chamber_2, volume_2, pressure_2, supply_2, state.coil_2, -spool, venting, lost_1, period)
    return flag_1 if flag_1 < NOT_RAISED else flag_2
