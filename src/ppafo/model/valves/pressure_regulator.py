"""Electronic pressure regulators, one for each chamber: the command is a set pressure, and gas flows until it is there.

A command above 0 sets chamber 1 above the lowest pressure, one below 0 chamber 2; the other chamber is set to the
lowest, as both are at 0 and ``VENT``. The command passes hysteresis and resolution, the set pressure follows it with a
lag of first order. A regulator opens to the supply below its set pressure and to the atmosphere above it, in proportion
to the deviation and fully beyond its band.
"""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import PlantParameters, PortFlow, PortSlopes, SinglePort, single_port_flow
from ppafo.model.ports import exhaust_path, supply_path
from ppafo.model.sensors import decay_factors, quantise
from ppafo.model.valves.kind import VENTS_ABOVE, ValveKind, ValveModel

TIMES_OF_CONSTANT = 2.1972245773362196
"""Time from 10 to 90 % of a first-order lag, divided by its time constant: ln 9 [-]."""
STAGE = 0.41421356237309503
"""Half the difference of the set pressures at both stages of a step, divided by how far the end is from the mean [-].

By the weights of the method that fills the chambers (``engine.scheme.pneumatics``), sqrt(2) - 1 lets a chamber that
follows closely arrive with its set pressure, and gives one that follows slowly the mean over the step.
"""
FOREVER = 1.0e9
"""Time of an event that never comes [s]."""
SMALLEST_RATE = 1.0e-300
"""Smallest rate of a set pressure that is divided by [Pa/s]."""
SMALLEST_RANGE = 1.0
"""Smallest range of set pressures [Pa] that is divided by."""


class RegulatorSettings(NamedTuple):
    """Settings of a regulator: range, dead time, response time, band, and flaws of the set pressure."""

    lowest_pressure: Annotated[float, Number("Pa_a", "set pressure at a command of 0", None, 1.0e3, 1.0e7)]
    highest_pressure: Annotated[float, Number("Pa_a", "set pressure at full command", None, 1.0e3, 1.0e7)]
    response_time: Annotated[float, Number("s", "time from 10 to 90 % of a step, 0 for none", 0.0, 0.0, 10.0)]
    delay: Annotated[float, Number("s", "dead time between command and set pressure", 0.0, 0.0, 0.2)]
    band: Annotated[
        float, Number("", "deviation at which it is fully open, as a fraction of the range", 0.01, 1.0e-4, 1.0)
    ]
    hysteresis: Annotated[float, Number("", "hysteresis, as a fraction of the range", 0.0, 0.0, 0.5)]
    resolution: Annotated[float, Number("", "step of the set pressure, as a fraction of the range", 0.0, 0.0, 0.5)]


class RegulatorParameters(NamedTuple):
    """Lowest set pressure, range and band [Pa], rate of the lag [1/s] (0 for none), hysteresis and resolution [-]."""

    lowest: float
    range: float
    band: float
    rate: float
    hysteresis: float
    resolution: float


class RegulatorState(NamedTuple):
    """Commands behind the hysteresis [-], and set pressures behind the lag above the lowest ones [Pa]."""

    command_1: float = 0.0
    command_2: float = 0.0
    set_1: float = 0.0
    set_2: float = 0.0


class SetPressures(NamedTuple):
    """Set pressures [Pa absolute] of both chambers at both stages of a step, and the band [Pa]."""

    first_1: float
    first_2: float
    second_1: float
    second_2: float
    band: float


class RegulatedPort(NamedTuple):
    """Conductances [kg/(s Pa)] of the fully open paths to source and atmosphere, their pressures [Pa absolute].

    ``is_relieving`` is 1 where gas may flow back into the source, else 0; set pressure and band in Pa.
    """

    source_conductance: float
    source_pressure: float
    vent_conductance: float
    vent_pressure: float
    is_relieving: float
    set_pressure: float
    band: float


def behind_hysteresis(before: float, command: float, hysteresis: float) -> float:
    """Command [-] behind a hysteresis [-], a play of that width, given the one before."""
    half = 0.5 * hysteresis
    return max(command - half, min(command + half, before))


def settle(valve: RegulatorParameters, state: RegulatorState, command: float, time: float) -> RegulatorState:
    """State with the commands behind the hysteresis; without a lag the set pressures follow them."""
    asked = 0.0 if command > VENTS_ABOVE else max(-1.0, min(1.0, command))
    command_1 = behind_hysteresis(state.command_1, max(asked, 0.0), valve.hysteresis)
    command_2 = behind_hysteresis(state.command_2, max(-asked, 0.0), valve.hysteresis)
    follows = valve.rate > 0.0
    return RegulatorState(
        command_1=command_1,
        command_2=command_2,
        set_1=state.set_1 if follows else target_of(valve, command_1),
        set_2=state.set_2 if follows else target_of(valve, command_2),
    )


def target_of(valve: RegulatorParameters, command: float) -> float:
    """Set pressure above the lowest one [Pa] at which a command behind the hysteresis [-] ends."""
    return valve.range * quantise(command, valve.resolution)


def next_event(valve: RegulatorParameters, state: RegulatorState, command: float, time: float) -> float:
    """Time [s] before which no set pressure moves by more than a band.

    Within a longer part a regulator would pass from shut to fully open, unseen by the error of the part.
    """
    distance_1 = abs(target_of(valve, state.command_1) - state.set_1)
    distance_2 = abs(target_of(valve, state.command_2) - state.set_2)
    distance = max(distance_1, distance_2)
    wait = valve.band / max(valve.rate * distance, SMALLEST_RATE)
    return time + wait if distance > valve.band else FOREVER


def advance(
    valve: RegulatorParameters, state: RegulatorState, command: float, time: float, step: float
) -> tuple[SetPressures, RegulatorState]:
    """Set pressures [Pa] during a step [s] with a constant command [-], and the state at its end."""
    begun = settle(valve, state, command, time)
    target_1 = target_of(valve, begun.command_1)
    target_2 = target_of(valve, begun.command_2)
    kept, mean = decay_factors(valve.rate, step)
    end_1 = target_1 + kept * (begun.set_1 - target_1)
    end_2 = target_2 + kept * (begun.set_2 - target_2)
    mean_1 = target_1 + mean * (begun.set_1 - target_1)
    mean_2 = target_2 + mean * (begun.set_2 - target_2)
    shown = SetPressures(
        first_1=valve.lowest + mean_1 - STAGE * (end_1 - mean_1),
        first_2=valve.lowest + mean_2 - STAGE * (end_2 - mean_2),
        second_1=valve.lowest + mean_1 + STAGE * (end_1 - mean_1),
        second_2=valve.lowest + mean_2 + STAGE * (end_2 - mean_2),
        band=valve.band,
    )
    return shown, RegulatorState(begun.command_1, begun.command_2, end_1, end_2)


def regulated_ports(
    plant: PlantParameters, set_1: float, set_2: float, band: float
) -> tuple[RegulatedPort, RegulatedPort]:
    """Ports of both chambers for their set pressures and a band [Pa]."""
    # Lines narrow the open path; a part of it has the same share of what they leave.
    supply = supply_path(plant.valve_conductance)
    exhaust = exhaust_path(plant.valve_conductance)
    room = plant.atmospheric_pressure
    back = plant.relieving
    return (
        RegulatedPort(supply, plant.supply_pressure, exhaust, room, back, set_1, band),
        RegulatedPort(supply, plant.dorsiflexion_pressure, exhaust, room, back, set_2, band),
    )


def connect(plant: PlantParameters, shown: SetPressures) -> tuple[RegulatedPort, RegulatedPort]:
    """Ports of both chambers at the first stage of a step."""
    return regulated_ports(plant, shown.first_1, shown.first_2, shown.band)


def connect_ahead(plant: PlantParameters, shown: SetPressures) -> tuple[RegulatedPort, RegulatedPort]:
    """Ports of both chambers at the second stage of a step."""
    return regulated_ports(plant, shown.second_1, shown.second_2, shown.band)


def regulated_port_flow(pressure: float, port: RegulatedPort, curve: FlowCurve) -> tuple[PortFlow, PortSlopes]:
    """Flow into a chamber at ``pressure`` [Pa absolute] through its regulator, and its derivatives. Eqs (6) to (8)."""
    opening = (port.set_pressure - pressure) / port.band
    fed = max(min(opening, 1.0), 0.0)
    vented = max(min(-opening, 1.0), 0.0)
    # The flows of open paths: the derivative has that of the opening, too.
    open_source = SinglePort(port.source_conductance, port.source_pressure, 1.0, port.is_relieving)
    open_vent = SinglePort(port.vent_conductance, port.vent_pressure, 0.0, 1.0)
    source, by_source = single_port_flow(pressure, open_source, curve)
    vent, by_vent = single_port_flow(pressure, open_vent, curve)
    narrowing = source.total / port.band if fed > 0.0 and fed < 1.0 else 0.0
    widening = vent.total / port.band if vented > 0.0 and vented < 1.0 else 0.0
    from_source = fed * source.total
    slope = fed * by_source.total - narrowing
    return PortFlow(from_source + vented * vent.total, from_source), PortSlopes(
        slope + vented * by_vent.total + widening, slope
    )


def command_for(valve: RegulatorParameters, opening: float, pressure_1: float, pressure_2: float) -> float:
    """Command [-] for a law that wants an opening [-], by which a spool would change the pressures [Pa absolute].

    A set pressure beyond the present one by the opening changes the pressure at a rate in proportion to it; an opening
    of 0 keeps it. ``VENT`` is passed on.
    """
    present = (pressure_1 - pressure_2) / valve.range
    return opening if opening > VENTS_ABOVE else max(-1.0, min(1.0, present + opening))


def holding(valve: RegulatorParameters, command: float, pressure_1: float, pressure_2: float) -> RegulatorState:
    """State under a command [-] with the set pressures at those in the chambers [Pa absolute], within their range."""
    set_1 = max(0.0, min(valve.range, pressure_1 - valve.lowest))
    set_2 = max(0.0, min(valve.range, pressure_2 - valve.lowest))
    return settle(valve, RegulatorState(set_1 / valve.range, set_2 / valve.range, set_1, set_2), command, 0.0)


def prepare(settings: RegulatorSettings) -> RegulatorParameters:
    """Parameters of the regulators from ``settings`` [SI]."""
    width = max(settings.highest_pressure - settings.lowest_pressure, SMALLEST_RANGE)
    time = settings.response_time
    return RegulatorParameters(
        lowest=settings.lowest_pressure,
        range=width,
        band=settings.band * width,
        rate=TIMES_OF_CONSTANT / time if time > 0.0 else 0.0,
        hysteresis=settings.hysteresis,
        resolution=settings.resolution,
    )


def dead_time(settings: RegulatorSettings) -> float:
    """Time from a command to the first change of the set pressure [s]."""
    return settings.delay


def regulation(settings: RegulatorSettings) -> tuple[float, float, float]:
    """Change of the pressure per command and band [Pa], and time constant of the lag [s]."""
    width = settings.highest_pressure - settings.lowest_pressure
    return width, settings.band * width, settings.response_time / TIMES_OF_CONSTANT


MODEL = ValveModel(
    parameters=RegulatorParameters,
    state=RegulatorState,
    prepare=prepare,
    advance=advance,
    connect=connect,
    port_flow=regulated_port_flow,
    jumps=True,
    shift=None,
    command_delay=dead_time,
    instant=None,
    rates=None,
    next_event=next_event,
    settle=settle,
    connect_ahead=connect_ahead,
    command_for=command_for,
    holding=holding,
)


def choose(settings: RegulatorSettings) -> ValveModel:
    """Model of the regulators, whatever the settings."""
    return MODEL


KIND = ValveKind(
    name="pressure_regulator",
    summary="Electronic pressure regulators, one for each chamber: the command is a set pressure.",
    settings=RegulatorSettings,
    choose=choose,
    regulation=regulation,
)
