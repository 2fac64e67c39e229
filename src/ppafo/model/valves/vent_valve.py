"""Proportional valve with a downstream vent valve, which vents both chambers on command.

A spool valve alone cannot release the foot: in mid-position it locks the gas in both chambers. The vent valve has the
area of the proportional one and no dynamics.
"""

from dataclasses import replace
from typing import NamedTuple

from ppafo.model.plant import Openings, PlantParameters, SinglePort, single_ports
from ppafo.model.valves import proportional
from ppafo.model.valves.kind import VENTS_ABOVE, ValveModel
from ppafo.model.valves.proportional import IdealProportional, MovingProportional, NoValveState, SpoolState


class VentedOpening(NamedTuple):
    """Opening of the proportional valve from -1 to 1, and 1 if the vent valve is open."""

    opening: float
    vents: float


def spool_command(command: float) -> float:
    """Command [-] of the proportional valve: 0 while both chambers vent."""
    return 0.0 if command > VENTS_ABOVE else command


def vent_chambers(openings: Openings, command: float) -> Openings:
    """Openings [-], with both chambers vented if the command requests it."""
    # The vent valve acts at once: it has neither delay nor spool.
    vents = command > VENTS_ABOVE
    return Openings(
        source_1=0.0 if vents else openings.source_1,
        vent_1=1.0 if vents else openings.vent_1,
        source_2=0.0 if vents else openings.source_2,
        vent_2=1.0 if vents else openings.vent_2,
    )


def advance_ideal(
    valve: IdealProportional, state: NoValveState, command: float, time: float, step: float
) -> tuple[VentedOpening, NoValveState]:
    """Opening [-] and venting during the step [s], and the state at its end."""
    # The spool returns to its middle meanwhile, so that it feeds no chamber when the vent valve shuts.
    opening, after = proportional.advance_ideal(valve, state, spool_command(command), time, step)
    return VentedOpening(opening, 1.0 if command > VENTS_ABOVE else 0.0), after


def vented_port(plant: PlantParameters, port: SinglePort, vents: bool) -> SinglePort:
    """Port of a chamber, or its open path to the atmosphere through the vent valve."""
    return SinglePort(
        conductance=plant.valve_conductance if vents else port.conductance,
        node_pressure=plant.atmospheric_pressure if vents else port.node_pressure,
        source_fraction=0.0 if vents else port.source_fraction,
        is_relieving=1.0 if vents else port.is_relieving,
    )


def connect_ideal(plant: PlantParameters, shown: VentedOpening) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers, by equation (8), with the vent valve open or closed."""
    port_1, port_2 = single_ports(plant, shown.opening)
    return vented_port(plant, port_1, shown.vents > 0.5), vented_port(plant, port_2, shown.vents > 0.5)


def instant_ideal(valve: IdealProportional, state: NoValveState, command: float) -> Openings:
    """Openings [-] of the ideal valve at an instant."""
    return vent_chambers(proportional.instant_ideal(valve, state, spool_command(command)), command)


def settle_ideal(valve: IdealProportional, state: NoValveState, command: float, time: float) -> NoValveState:
    """State with the opening [-] that the command requests."""
    return proportional.settle_ideal(valve, state, spool_command(command), time)


def advance_moving(
    valve: MovingProportional, state: SpoolState, command: float, time: float, step: float
) -> tuple[Openings, SpoolState]:
    """Mean openings [-] during the step [s] and the spool at its end."""
    openings, after = proportional.advance_moving(valve, state, spool_command(command), time, step)
    return vent_chambers(openings, command), after


def instant_moving(valve: MovingProportional, state: SpoolState, command: float) -> Openings:
    """Openings [-] of the moving valve at an instant."""
    return vent_chambers(proportional.instant_moving(valve, state, spool_command(command)), command)


def rates_moving(valve: MovingProportional, state: SpoolState, command: float) -> SpoolState:
    """Rates [1/s] of the spool; the vent valve has no state."""
    return proportional.rates_moving(valve, state, spool_command(command))


def next_moving_event(valve: MovingProportional, state: SpoolState, command: float, time: float) -> float:
    """Time [s] at which the requested opening reaches the command."""
    return proportional.next_moving_event(valve, state, spool_command(command), time)


def settle_moving(valve: MovingProportional, state: SpoolState, command: float, time: float) -> SpoolState:
    """State with the requested opening [-] at its target, if it has reached the target."""
    return proportional.settle_moving(valve, state, spool_command(command), time)


IDEAL = replace(
    proportional.IDEAL,
    advance=advance_ideal,
    connect=connect_ideal,
    instant=instant_ideal,
    settle=settle_ideal,
)

MOVING = replace(
    proportional.MOVING,
    advance=advance_moving,
    instant=instant_moving,
    rates=rates_moving,
    next_event=next_moving_event,
    settle=settle_moving,
)


def choose(settings: proportional.ProportionalSettings) -> ValveModel:
    """Ideal model without dynamics, else the moving model, from ``settings`` [SI]."""
    return IDEAL if proportional.choose(settings) is proportional.IDEAL else MOVING
