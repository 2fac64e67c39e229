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

Every parameter is a setting whose default follows the device; ``nominal_flow`` 0 switches the observer off.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.control.kind import PRESSURE_LAG, nominal_term
from ppafo.control.walking.fault_flags import (
    LEAK,
    NOT_RAISED,
    SUPPLY_HIGH,
    SUPPLY_LOST,
    SUPPLY_LOW,
    VALVE_OPEN,
    VALVE_SHUT,
)
from ppafo.model.declaration import Quantity
from ppafo.model.regulator import LineState, SupplyLines, step_lines
from ppafo.model.valves.kind import VENTS_ABOVE

_CHAMBERS = {
    "displacement_per_radian": "chamber_growth",
    "dead_volume_1": "chamber_rest_1",
    "dead_volume_2": "chamber_rest_2",
}
"""Settings of both chambers for the observer; a torque law uses one mean chamber only."""


def _nominal(name: str, unit: str, summary: str, maximum: float, lowest: float = 0.0) -> Quantity:
    follows = (PRESSURE_LAG,) if name == "sensor_lag" else (nominal_term(_CHAMBERS.get(name, name)),)
    return Quantity(
        f"nominal_{name}", unit, f"{summary}; the device's unless given", 0.0, lowest, maximum, follows=follows
    )


_FLOW = "R T times the conductance of the valve, which the observer of the chambers believes; 0 switches it off"
_PAIR = "1 for a pair of on/off valves, 0 for a spool with a vent valve"
_INTERVAL = "shortest time between two switchings of a coil"
_JOINING = "time for which the chambers are joined after chamber 1 was fed"


class NominalDevice(NamedTuple):
    """Nominal device of the observer, SI units; absolute pressures.

    ``nominal_flow`` is R T times the valve's conductance [m^3/s]: gas content per second of a choked flow, divided by
    the upstream pressure. ``nominal_pair`` is 1 for on/off valves that vent while not energised, else 0: a spool with a
    vent valve. Both follow their command after ``nominal_delay``, the spool with ``nominal_lag`` and beyond
    ``nominal_dead_band``. ``nominal_joining_time`` is the time for which both chambers are joined after chamber 1 was
    fed. ``nominal_lines`` count gas by its content p V [J]; a volume of 0 stands for a supply without lines.
    """

    nominal_flow: Annotated[float, _nominal("flow", "m^3/s", _FLOW, 1.0)]
    nominal_critical_ratio: Annotated[
        float, _nominal("critical_ratio", "", "critical pressure ratio of the valve", 0.95)
    ]
    nominal_supply_pressure: Annotated[float, _nominal("supply_pressure", "Pa_a", "pressure to chamber 1", 1.0e8)]
    nominal_dorsiflexion_pressure: Annotated[
        float, _nominal("dorsiflexion_pressure", "Pa_a", "pressure to chamber 2", 1.0e8)
    ]
    nominal_atmospheric_pressure: Annotated[
        float, _nominal("atmospheric_pressure", "Pa_a", "pressure of the atmosphere", 1.0e8)
    ]
    nominal_relieving: Annotated[float, _nominal("relieving", "", "1 where the supplies take gas back", 1.0)]
    nominal_displacement_per_radian: Annotated[
        float, _nominal("displacement_per_radian", "m^3/rad", "mean growth of chamber 1 with the angle", 1.0)
    ]
    nominal_dead_volume_1: Annotated[float, _nominal("dead_volume_1", "m^3", "dead volume of chamber 1", 1.0)]
    nominal_dead_volume_2: Annotated[float, _nominal("dead_volume_2", "m^3", "dead volume of chamber 2", 1.0)]
    nominal_angle_min: Annotated[float, _nominal("angle_min", "rad", "lower stop", 10.0, -10.0)]
    nominal_angle_max: Annotated[float, _nominal("angle_max", "rad", "upper stop", 10.0, -10.0)]
    nominal_pair: Annotated[float, _nominal("pair", "", _PAIR, 1.0)]
    nominal_opening_delay: Annotated[float, _nominal("opening_delay", "s", "time from energising a coil to flow", 1.0)]
    nominal_closing_delay: Annotated[
        float, _nominal("closing_delay", "s", "time from de-energising it to venting", 1.0)
    ]
    nominal_switching_interval: Annotated[float, _nominal("switching_interval", "s", _INTERVAL, 1.0)]
    nominal_delay: Annotated[float, _nominal("delay", "s", "dead time of a spool", 1.0)]
    nominal_lag: Annotated[float, _nominal("lag", "s", "time after which a spool has followed", 1.0)]
    nominal_dead_band: Annotated[float, _nominal("dead_band", "", "smallest command that opens a spool", 0.99)]
    nominal_joining_time: Annotated[float, _nominal("joining_time", "s", _JOINING, 10.0)]
    nominal_sensor_lag: Annotated[float, _nominal("sensor_lag", "s", "lag of the pressure sensors", 1.0e3)]
    nominal_lines: SupplyLines


LINE_QUANTITIES = (
    *(
        _nominal(f"line_{name}_{line}", unit, f"{what} of line {line}", most)
        for line in (1, 2)
        for name, unit, what, most in (
            ("droop", "Pa s/J", "droop per gas content (p V) that flows", 1.0e10),
            ("largest_flow", "W", "largest flow of gas content (p V)", 1.0e10),
            ("volume", "m^3", "volume, 0 without lines,", 1.0),
        )
    ),
    _nominal("line_relieving", "", "1 where gas flows back through the regulators", 1.0),
)
"""Settings for the fields of ``nominal_lines``, in order."""


LONG_AGO = 1.0e9
"""Time [s] since the command of a coil that was switched off before the start."""


class ObservedValve(NamedTuple):
    """On/off valve: present flow (0 or 1), commanded flow, time since the command, and switching time [s]."""

    position: float = 0.0
    target: float = 0.0
    since: float = LONG_AGO
    waits: float = 0.0


class CommandInTransit(NamedTuple):
    """Command on its way to a spool or a vent valve [-], after one, two and three thirds of the dead time."""

    first: float = 0.0
    second: float = 0.0
    third: float = 0.0


class ObservedChamber(NamedTuple):
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

    chamber_1: ObservedChamber = ObservedChamber()
    chamber_2: ObservedChamber = ObservedChamber()
    command: float = 2.0
    coil_1: ObservedValve = ObservedValve()
    coil_2: ObservedValve = ObservedValve()
    on_the_way: CommandInTransit = CommandInTransit()
    venting: CommandInTransit = CommandInTransit(1.0, 1.0, 1.0)
    spool: float = 0.0
    joined: float = 0.0
    lines: LineState = LineState(0.0, 0.0, 0.0)


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
    # Nearly equal pressures take the straight line, as the model's own flow does.
    place = (min(max(ratio, critical), LINEAR_RATIO) - critical) / (1.0 - critical)
    share = math.sqrt(1.0 - place * place) * min((1.0 - ratio) / (1.0 - LINEAR_RATIO), 1.0)
    return nominal.nominal_flow * upstream * share * (1.0 if node >= pressure else -is_relieving)


def next_coil(nominal: NominalDevice, coil: ObservedValve, wanted: float, period: float) -> tuple[ObservedValve, float]:
    """Coil after a sample [s] with the commanded position ``wanted``, and its mean position [-] in the sample."""
    accepts = (wanted != coil.target) & (coil.since >= nominal.nominal_switching_interval - SAME)
    delay = nominal.nominal_opening_delay if wanted > 0.5 else nominal.nominal_closing_delay
    target = wanted if accepts else coil.target
    waits = delay if accepts else coil.waits
    # Share of the sample before the change: the mean position is that far between both.
    before = min(waits, period) / period
    return ObservedValve(
        position=target if waits <= period + SAME else coil.position,
        target=target,
        since=(0.0 if accepts else coil.since) + period,
        waits=max(waits - period, 0.0),
    ), before * coil.position + (1.0 - before) * target


def next_on_the_way(
    nominal: NominalDevice, on_the_way: CommandInTransit, target: float, period: float
) -> CommandInTransit:
    """Command in transit after a sample [s] with a ``target`` [-]: three first-order lags that add up to the dead time.

    The mean flow is then correct, without a buffer for all samples of the dead time.
    """
    share = period / (period + nominal.nominal_delay / 3.0)
    first = on_the_way.first + (target - on_the_way.first) * share
    second = on_the_way.second + (first - on_the_way.second) * share
    return CommandInTransit(first=first, second=second, third=on_the_way.third + (second - on_the_way.third) * share)


def contradiction(
    nominal: NominalDevice,
    passed: float,
    volume: float,
    mean_volume: float,
    measured: float,
    expected: float,
    fed: bool,
    supply: float,
) -> float:
    """Residual of a chamber divided by its tolerance [-]: above 1 there is too much gas, below -1 too little.

    ``passed`` is the gas passed lately [J]; ``volume`` and ``mean_volume`` [m^3] are the present and the mean volume.
    The pressures [Pa] are measured, expected, and of the ``supply``, which matters only while the chamber is ``fed``.
    """
    at_rest = mean_volume * (OFFSET + OF_PRESSURE * abs(measured))
    at_rest = at_rest + OF_ANGLE * nominal.nominal_displacement_per_radian * abs(measured)
    of_passed = OF_PASSED if fed | (measured < expected) else KEPT
    share = (measured - expected) * volume / (of_passed * passed + at_rest)
    # However wide the valve and small the chamber are, a supply fills it to its own pressure only.
    overfull = (measured - max(expected, supply)) * volume / at_rest
    return max(share, overfull) if fed & (measured > expected) else share


def next_chamber(
    nominal: NominalDevice,
    chamber: ObservedChamber,
    source: float,
    vent: float,
    was_fed: bool,
    supply: float,
    set_pressure: float,
    last_volume: float,
    last_measured: float,
    volume: float,
    mean_volume: float,
    measured: float,
    blind: bool,
    period: float,
) -> tuple[ObservedChamber, float]:
    """Chamber after a sample [s], updated by the flow and then by a reading [Pa]; and gas taken from the supply [J].

    ``source`` and ``vent`` [-] are the openings to the supply and to the atmosphere. ``supply`` is the supply pressure
    and ``set_pressure`` the set pressure of its regulator [Pa]; ``was_fed`` is True if the supply was connected before.
    Volumes [m^3] belong to the previous reading [Pa], to this reading, and to mid-range. ``blind`` is True where the
    content is taken from the sensor: at the start, and while the chambers are joined.
    """
    room = nominal.nominal_atmospheric_pressure
    before = chamber.content / last_volume
    # At the expected pressure, not the measured one: an offset of the sensor would add up in the flow.
    entered = source * flow_into(nominal, before, supply, nominal.nominal_relieving) + vent * flow_into(
        nominal, before, room, 1.0
    )
    # In one sample no flow leads beyond the pressures between which it runs.
    low, high = min(before, room if vent > 0.0 else supply), max(before, supply if source > 0.0 else room)
    added = max((low - before) * last_volume, min((high - before) * last_volume, WARM * period * entered))
    share = period / FORGETS
    passed = chamber.passed + abs(added) - share * chamber.passed
    # What was before a change of the connection belongs to another cause.
    turns = (source > vent) != was_fed
    lowest = chamber.least if was_fed else min(chamber.least, last_measured * last_volume)
    least = last_measured * last_volume if turns else lowest

    content = measured * volume if blind else chamber.content + added
    lag = nominal.nominal_sensor_lag
    followed = chamber.pressure + (content / volume - chamber.pressure) * period / (period + lag)
    expected = measured if blind else followed
    # As gas content: what no movement of the ankle changes.
    residual = (measured - expected) * volume
    excess = contradiction(nominal, passed, volume, mean_volume, measured, expected, was_fed, set_pressure)
    return ObservedChamber(
        content=max(content + residual * min(share, 1.0), 0.0),
        pressure=expected,
        passed=0.0 if blind else passed,
        contrary=chamber.contrary + period if abs(excess) > 1.0 else 0.0,
        least=measured * volume if blind else least,
    ), added if source > vent else 0.0


def volumes(nominal: NominalDevice, angle: float) -> tuple[float, float]:
    """Volumes of both chambers [m^3] at a measured angle [rad], not below the dead volumes. Equations (4), (5)."""
    growth = nominal.nominal_displacement_per_radian
    return (
        nominal.nominal_dead_volume_1 + max(growth * (angle - nominal.nominal_angle_min), 0.0),
        nominal.nominal_dead_volume_2 + max(growth * (nominal.nominal_angle_max - angle), 0.0),
    )


def believed_volumes(nominal: NominalDevice, angle: float, pressure_1: float, pressure_2: float) -> tuple[float, float]:
    """Nominal volumes of both chambers [m^3] at a measured angle [rad]; for a vane independent of the pressures [Pa].

    A program with an actuator of another kind calls the chamber function of that kind instead.
    """
    return volumes(nominal, angle)


def mean_volumes(nominal: NominalDevice, pressure_1: float, pressure_2: float) -> tuple[float, float]:
    """Derivative of gas content with respect to pressure [m^3] in mid-range, for both chambers at two readings [Pa].

    For a vane the derivative is the volume. For another kind, as in ``believed_volumes``, it includes the compliance.
    """
    return volumes(nominal, 0.5 * (nominal.nominal_angle_min + nominal.nominal_angle_max))


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
    command, begins = state.command, state.chamber_1.content <= 0.0
    vents, is_pair = command > VENTS_ABOVE, nominal.nominal_pair > 0.5
    coil_1, on_1 = next_coil(nominal, state.coil_1, 1.0 if (command > 0.0) & (not vents) else 0.0, period)
    coil_2, on_2 = next_coil(nominal, state.coil_2, 1.0 if command < 0.0 else 0.0, period)
    # A spool opens beyond its dead band, and rests in the middle while all vents.
    size = max(min(abs(command), 1.0) - nominal.nominal_dead_band, 0.0) / (1.0 - nominal.nominal_dead_band)
    target = 0.0 if vents else (size if command >= 0.0 else -size)
    on_the_way = next_on_the_way(nominal, state.on_the_way, target, period)
    venting = next_on_the_way(nominal, state.venting, 1.0 if vents else 0.0, period)
    spool = state.spool + (on_the_way.third - state.spool) * period / (period + nominal.nominal_lag)
    towards_1, towards_2 = max(spool, 0.0), max(-spool, 0.0)
    # A pair feeds by its coils' mean positions, a spool by its opening to either side.
    source_1, source_2 = on_1 if is_pair else towards_1, on_2 if is_pair else towards_2
    vent_1 = 1.0 - on_1 if is_pair else max(venting.third, towards_2)
    vent_2 = 1.0 - on_2 if is_pair else max(venting.third, towards_1)
    fed_1, fed_2 = is_fed(nominal, state.coil_1, state.spool), is_fed(nominal, state.coil_2, -state.spool)
    # The joining time counts from when the coil of chamber 1 lets go.
    joined = nominal.nominal_joining_time if coil_1.position > 0.5 else max(state.joined - period, 0.0)
    # While the chambers are joined, gas passes that no nominal flow describes.
    blind = begins | ((joined > 0.0) & (coil_1.position < 0.5))
    # The flow is reckoned in the volume before the sample, the reading in the volume after it.
    was_1, was_2 = believed_volumes(nominal, last_angle, last_1, last_2)
    now_1, now_2 = believed_volumes(nominal, angle, pressure_1, pressure_2)
    mean_1, mean_2 = mean_volumes(nominal, pressure_1, pressure_2)
    # No line has more than its regulator gives, whatever it has lost on the way; at the start it has that.
    set_1, set_2 = nominal.nominal_supply_pressure, nominal.nominal_dorsiflexion_pressure
    given = nominal.nominal_lines
    full = LineState(mass_1=set_1 * given.volume_1, mass_2=set_2 * given.volume_2, regulated_mass=0.0)
    lines = full if begins else state.lines
    to_1, to_2 = supplied(nominal, lines)
    chamber_1, taken_1 = next_chamber(
        nominal,
        state.chamber_1,
        source_1,
        vent_1,
        fed_1,
        to_1,
        set_1,
        was_1,
        last_1,
        now_1,
        mean_1,
        pressure_1,
        blind,
        period,
    )
    chamber_2, taken_2 = next_chamber(
        nominal,
        state.chamber_2,
        source_2,
        vent_2,
        fed_2,
        to_2,
        set_2,
        was_2,
        last_2,
        now_2,
        mean_2,
        pressure_2,
        blind,
        period,
    )
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
    """Return whether both lines have a volume and their regulators a droop; other lines cannot be predicted."""
    given = nominal.nominal_lines
    return min(given.volume_1, given.volume_2, given.droop_1, given.droop_2) > 0.0


def supplied(nominal: NominalDevice, lines: LineState) -> tuple[float, float]:
    """Absolute pressures [Pa] upstream of the valve: of both lines, or of the supplies if there are no lines."""
    first, second = max(nominal.nominal_lines.volume_1, TINY), max(nominal.nominal_lines.volume_2, TINY)
    has_lines = is_behind_lines(nominal)
    return (
        lines.mass_1 / first if has_lines else nominal.nominal_supply_pressure,
        lines.mass_2 / second if has_lines else nominal.nominal_dorsiflexion_pressure,
    )


def next_lines(nominal: NominalDevice, lines: LineState, taken_1: float, taken_2: float, period: float) -> LineState:
    """Lines after a sample [s] in which the chambers took two gas contents [J]; zero if there are no lines."""
    has_lines = is_behind_lines(nominal)
    given = nominal.nominal_lines
    real = SupplyLines(
        droop_1=max(given.droop_1, TINY),
        largest_flow_1=given.largest_flow_1,
        volume_1=max(given.volume_1, TINY),
        droop_2=max(given.droop_2, TINY),
        largest_flow_2=given.largest_flow_2,
        volume_2=max(given.volume_2, TINY),
        relieving=given.relieving,
    )
    set_1, set_2 = nominal.nominal_supply_pressure, nominal.nominal_dorsiflexion_pressure
    after = step_lines(real, set_1, set_2, 1.0, lines, taken_1, taken_2, 0.0, period).after
    return LineState(
        mass_1=max(after.mass_1, 0.0) if has_lines else 0.0,
        mass_2=max(after.mass_2, 0.0) if has_lines else 0.0,
        regulated_mass=0.0,
    )


def is_fed(nominal: NominalDevice, coil: ObservedValve, spool: float) -> bool:
    """Return whether the valve is estimated to feed its chamber; ``spool`` [-] is positive towards the chamber."""
    return (coil.position > 0.5) if nominal.nominal_pair > 0.5 else (spool > 0.0)


SHOWS_GAS = 0.05
"""Fraction of the passed gas by which a content must grow to prove an inflow: half the growth at a tenth of the flow,
and several times the growth with a hose that is open to the atmosphere."""

NEARLY_FULL = 0.8
"""Fraction of the supply pressure above which a vented chamber is still connected to the supply."""


def has_gas(chamber: ObservedChamber, volume: float, measured: float) -> bool:
    """Return whether a chamber with a reading [Pa] in its volume [m^3] has received gas since it was connected."""
    # Against the content when the feeding began: an offset of the sensor is in both.
    return measured * volume - chamber.least > SHOWS_GAS * chamber.passed


def cause_of(
    nominal: NominalDevice,
    chamber: ObservedChamber,
    volume: float,
    measured: float,
    supply: float,
    coil: ObservedValve,
    spool: float,
    venting: float,
    lost_beside: float,
    period: float,
) -> float:
    """Fault flag of a chamber for a reading [Pa] in its volume [m^3] and a supply pressure [Pa]; else ``NOT_RAISED``.

    ``coil``, ``spool`` [-], positive towards the chamber, and ``venting`` [-] are the estimated valve states.
    ``lost_beside`` [J] is the missing gas content of the other chamber, 0 if that chamber received no gas.
    """
    fed = is_fed(nominal, coil, spool)
    vented = (coil.position < 0.5) if nominal.nominal_pair > 0.5 else ((venting > 0.5) | (spool < 0.0))
    # In samples too: at a slow rate 5 ms would be a single noisy reading.
    alarm = chamber.contrary > max(ALARM_TIME, ALARM_SAMPLES * period) - SAME
    gained = (measured - chamber.pressure) * volume
    gains = gained > 0.0
    # Gas that comes to a vented chamber is a valve stuck open where the supply shows, else one stuck shut under a foot.
    into_vent = (measured > NEARLY_FULL * supply) | (measured * volume > chamber.least + 0.5 * OFFSET * volume)
    # Fed: too much, too little, or nothing at all comes.
    in_fill = SUPPLY_HIGH if gains else (SUPPLY_LOW if has_gas(chamber, volume, measured) else SUPPLY_LOST)
    in_vent = (VALVE_OPEN if into_vent else VALVE_SHUT) if gains else LEAK
    # Neither fed nor vented: what comes in passes a valve, what goes passes a leak.
    closed = VALVE_OPEN if gains else LEAK
    found = in_fill if fed else (in_vent if vented else closed)
    # What a chamber without a source gains has come across the vane where the other one lost as much of what came.
    across = gains & (not fed) & (lost_beside > gained)
    return (LEAK if across else found) if alarm else NOT_RAISED


def found_cause(
    nominal: NominalDevice, state: Observer, angle: float, pressure_1: float, pressure_2: float, period: float
) -> float:
    """Fault flag of a sample [s] with an angle [rad] and absolute pressures [Pa]; chamber 1 is checked first.

    ``NOT_RAISED`` if no fault is found.
    """
    if nominal.nominal_flow <= 0.0:
        return NOT_RAISED
    now_1, now_2 = believed_volumes(nominal, angle, pressure_1, pressure_2)
    to_1, to_2 = supplied(nominal, state.lines)
    lost_1 = (state.chamber_1.pressure - pressure_1) * now_1 if has_gas(state.chamber_1, now_1, pressure_1) else 0.0
    lost_2 = (state.chamber_2.pressure - pressure_2) * now_2 if has_gas(state.chamber_2, now_2, pressure_2) else 0.0
    spool, venting = state.spool, state.venting.third
    first = cause_of(nominal, state.chamber_1, now_1, pressure_1, to_1, state.coil_1, spool, venting, lost_2, period)
    second = cause_of(nominal, state.chamber_2, now_2, pressure_2, to_2, state.coil_2, -spool, venting, lost_1, period)
    return first if first < NOT_RAISED else second
