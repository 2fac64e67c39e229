"""A proportional valve with a vent valve behind it, which vents both chambers when the command says so.

A spool valve alone cannot let the foot move: in its middle it locks the gas in both chambers. The vent valve has the
area of the proportional one and follows at once.
"""

from dataclasses import replace
from typing import NamedTuple

from ppafo.model.plant import Openings, PlantParameters, SinglePort, single_ports
from ppafo.model.valves import proportional
from ppafo.model.valves.kind import VENTS_ABOVE, ValveModel
from ppafo.model.valves.proportional import IdealProportional, MovingProportional, NoValveState, SpoolState


class VentedOpening(NamedTuple):
    """Opening of the proportional valve from -1 to 1, and 1 where the vent valve vents."""

    opening: float
    vents: float


def vent_chambers(openings: Openings, command: float) -> Openings:
    """Openings [-] with both chambers vented where the command says so."""
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
    opening, after = proportional.advance_ideal(valve, state, command, time, step)
    return VentedOpening(opening, 1.0 if command > VENTS_ABOVE else 0.0), after


def connect_ideal(plant: PlantParameters, shown: VentedOpening) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers, by equation (8), with the vent valve open or shut."""
    port_1, port_2 = single_ports(plant, shown.opening)
    vents = shown.vents > 0.5
    full, room = plant.valve_conductance, plant.atmospheric_pressure
    return (
        SinglePort(
            conductance=full if vents else port_1.conductance,
            node_pressure=room if vents else port_1.node_pressure,
            source_fraction=0.0 if vents else port_1.source_fraction,
            is_relieving=1.0 if vents else port_1.is_relieving,
        ),
        SinglePort(
            conductance=full if vents else port_2.conductance,
            node_pressure=room if vents else port_2.node_pressure,
            source_fraction=0.0 if vents else port_2.source_fraction,
            is_relieving=1.0 if vents else port_2.is_relieving,
        ),
    )


def instant_ideal(valve: IdealProportional, state: NoValveState, command: float) -> Openings:
    """Openings [-] at an instant."""
    return vent_chambers(proportional.instant_ideal(valve, state, command), command)


def advance_moving(
    valve: MovingProportional, state: SpoolState, command: float, time: float, step: float
) -> tuple[Openings, SpoolState]:
    """Mean openings [-] during the step [s] and the spool at its end."""
    openings, after = proportional.advance_moving(valve, state, command, time, step)
    return vent_chambers(openings, command), after


def instant_moving(valve: MovingProportional, state: SpoolState, command: float) -> Openings:
    """Openings [-] at an instant."""
    return vent_chambers(proportional.instant_moving(valve, state, command), command)


IDEAL = replace(
    proportional.IDEAL,
    shown=VentedOpening,
    advance=advance_ideal,
    connect=connect_ideal,
    instant=instant_ideal,
)

MOVING = replace(proportional.MOVING, advance=advance_moving, instant=instant_moving)


def choose(settings: proportional.ProportionalSettings) -> ValveModel:
    """The ideal model where nothing moves, else the moving one, from ``settings`` [SI]."""
    return IDEAL if proportional.choose(settings) is proportional.IDEAL else MOVING
