"""Faults of the plant in a walk, and their action on the ports of both chambers.

All faults act from a start time on, at the ports between valve and chamber, at the command, or at the sampling of the
controller. The values of ``SOUND`` change nothing; a walk without faults and shut-off is composed without them.
``fault_catalogue.py`` has the names of the faults in files.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.model.orifice import conductance_in_series
from ppafo.model.plant import BlendedPort, PlantParameters, SinglePort
from ppafo.model.sensors import unit_noise
from ppafo.model.shut_off import NEVER, ShutOff, Unpowered, vents_line


class ChamberFaults(NamedTuple):
    """Faults of one chamber, each from its time [s] on, ``NEVER`` for none.

    The valve is stuck at an ``opening`` [-], 1 to the supply and -1 to the atmosphere; the hose is off, or kinked to
    ``kinked_share`` [-] of its conductance; the regulator has another ``pressure`` [Pa, absolute], creeps by ``rate``
    [Pa/s], or is frozen to ``frozen_share`` [-] of its flow.
    """

    stuck_time: float = NEVER
    opening: float = 0.0
    off_time: float = NEVER
    kinked_time: float = NEVER
    kinked_share: float = 1.0
    high_time: float = NEVER
    pressure: float = 0.0
    creep_time: float = NEVER
    rate: float = 0.0
    frozen_time: float = NEVER
    frozen_share: float = 1.0


class PlantFaults(NamedTuple):
    """Faults of both chambers and of their common parts, each from its time [s] on, ``NEVER`` for none.

    With swapped hoses the valve feeds the other chamber; the bottle empties with the time constant ``empty_lag`` [s];
    the vane leak is multiplied by ``leak_factor`` [-]. The valve takes a command only once per ``slow_delay`` [s]; the
    controller runs only once per ``late_delay`` [s], misses ``jitter_share`` [-] of its samples, or is without power
    for ``brown_out_duration`` [s].
    """

    chamber_1: ChamberFaults
    chamber_2: ChamberFaults
    swapped_time: float = NEVER
    empty_time: float = NEVER
    empty_lag: float = 1.0
    leak_time: float = NEVER
    leak_factor: float = 1.0
    slow_time: float = NEVER
    slow_delay: float = 0.0
    late_time: float = NEVER
    late_delay: float = 0.0
    jitter_time: float = NEVER
    jitter_share: float = 0.0
    brown_out_time: float = NEVER
    brown_out_duration: float = 0.0


SOUND = PlantFaults(ChamberFaults(), ChamberFaults())
_NOISE_OF_CONTROLLER = 11
"""Noise channel that decides which samples a controller misses; the sensors have channels 0 to 10."""


def set_pressure(faults: PlantFaults, chamber: ChamberFaults, pressure: float, room: float, time: float) -> float:
    """Pressure of a faulty regulator at a time [s], at least the atmospheric pressure ``room``; all [Pa]."""
    # First the regulator's own faults, then the bottle before it: an empty one takes any of them down with it.
    steady = chamber.pressure if time >= chamber.high_time else pressure
    regulated = steady + chamber.rate * max(time - chamber.creep_time, 0.0)
    lags = max(time - faults.empty_time, 0.0) / faults.empty_lag
    # 1 / (1 + x + x^2/2) stands for exp(-x), without a call, so in vector code.
    remaining = 1.0 / (1.0 + lags + 0.5 * lags * lags)
    return max(room + (regulated - room) * remaining, room)


def feed_conductance(shut_off: ShutOff, chamber: ChamberFaults, conductance: float, time: float) -> float:
    """Conductance [kg/(s Pa)] from a supply to a chamber at a time [s], through regulator, shut-off, valve and hose."""
    # A frozen regulator and a kinked hose are in series; shares of both stand for their joint loss.
    share = (chamber.frozen_share if time >= chamber.frozen_time else 1.0) * hose_share(chamber, time)
    is_fitted = shut_off.conductance > 0.0
    # Both sides of a select are computed in vector code: without the valve the divisor is 1.
    divisor = shut_off.conductance if is_fitted else 1.0
    in_series = conductance_in_series(conductance, 1.0 / (divisor * divisor)) if is_fitted else conductance
    return share * in_series


def hose_share(chamber: ChamberFaults, time: float) -> float:
    """Fraction of the conductance of a hose [-] that is left at a time [s]."""
    return chamber.kinked_share if time >= chamber.kinked_time else 1.0


def failed_single_port(
    plant: PlantParameters,
    faults: PlantFaults,
    chamber: ChamberFaults,
    shut_off: ShutOff,
    unpowered: Unpowered,
    port: SinglePort,
    supply: float,
    time: float,
) -> SinglePort:
    """Port with one open path after faults at a time [s]; a stuck valve is fed by ``supply`` [Pa]."""
    room, is_stuck = plant.atmospheric_pressure, time >= chamber.stuck_time
    # A stuck valve feeds or vents by its own opening, whatever the command would do.
    feeds = (chamber.opening > 0.0) if is_stuck else (port.source_fraction > 0.5)
    conductance = abs(chamber.opening) * plant.valve_conductance if is_stuck else port.conductance
    node_pressure = supply if is_stuck else port.node_pressure
    is_relieving = plant.relieving if is_stuck else port.is_relieving
    is_off, is_vented = time >= chamber.off_time, vents_line(shut_off, unpowered)
    vented = hose_share(chamber, time) * conductance
    through = feed_conductance(shut_off, chamber, conductance, time) if feeds else vented
    from_supply = feeds & (not is_vented) & (not is_off)
    return SinglePort(
        conductance=plant.valve_conductance if is_off else through,
        node_pressure=set_pressure(faults, chamber, node_pressure, room, time) if from_supply else room,
        source_fraction=1.0 if from_supply else 0.0,
        is_relieving=is_relieving if from_supply else 1.0,
    )


def failed_blended_port(
    plant: PlantParameters,
    faults: PlantFaults,
    chamber: ChamberFaults,
    shut_off: ShutOff,
    unpowered: Unpowered,
    port: BlendedPort,
    time: float,
) -> BlendedPort:
    """Port with two open paths after faults at a time [s]."""
    room, fully_open, is_stuck = plant.atmospheric_pressure, plant.valve_conductance, time >= chamber.stuck_time
    source = max(chamber.opening, 0.0) * fully_open if is_stuck else port.source_conductance
    vent = max(-chamber.opening, 0.0) * fully_open if is_stuck else port.vent_conductance
    is_off = time >= chamber.off_time
    lacks_supply = is_off | vents_line(shut_off, unpowered)
    fed = feed_conductance(shut_off, chamber, source, time)
    return BlendedPort(
        source_conductance=0.0 if is_off else fed,
        source_pressure=room if lacks_supply else set_pressure(faults, chamber, port.source_pressure, room, time),
        vent_conductance=fully_open if is_off else hose_share(chamber, time) * vent,
        vent_pressure=port.vent_pressure,
        is_relieving=1.0 if lacks_supply else port.is_relieving,
    )


def failed_single_ports(
    plant: PlantParameters,
    faults: PlantFaults,
    shut_off: ShutOff,
    unpowered: Unpowered,
    port_1: SinglePort,
    port_2: SinglePort,
    time: float,
) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers with one open path each, after faults at a time [s]."""
    swapped = time >= faults.swapped_time
    own_1, own_2 = swapped_single(port_1, port_2, swapped), swapped_single(port_2, port_1, swapped)
    supply_1, supply_2 = plant.supply_pressure, plant.dorsiflexion_pressure
    return (
        failed_single_port(plant, faults, faults.chamber_1, shut_off, unpowered, own_1, supply_1, time),
        failed_single_port(plant, faults, faults.chamber_2, shut_off, unpowered, own_2, supply_2, time),
    )


def swapped_single(port: SinglePort, other: SinglePort, swapped: bool) -> SinglePort:
    """Port with one open path of a chamber: its own, or the other chamber's if the hoses are swapped."""
    return SinglePort(
        conductance=other.conductance if swapped else port.conductance,
        node_pressure=other.node_pressure if swapped else port.node_pressure,
        source_fraction=other.source_fraction if swapped else port.source_fraction,
        is_relieving=other.is_relieving if swapped else port.is_relieving,
    )


def failed_blended_ports(
    plant: PlantParameters,
    faults: PlantFaults,
    shut_off: ShutOff,
    unpowered: Unpowered,
    port_1: BlendedPort,
    port_2: BlendedPort,
    time: float,
) -> tuple[BlendedPort, BlendedPort]:
    """Ports of both chambers with two open paths each, after faults at a time [s]."""
    swapped = time >= faults.swapped_time
    own_1, own_2 = swapped_blended(port_1, port_2, swapped), swapped_blended(port_2, port_1, swapped)
    return (
        failed_blended_port(plant, faults, faults.chamber_1, shut_off, unpowered, own_1, time),
        failed_blended_port(plant, faults, faults.chamber_2, shut_off, unpowered, own_2, time),
    )


def swapped_blended(port: BlendedPort, other: BlendedPort, swapped: bool) -> BlendedPort:
    """Port with two open paths of a chamber: its own, or the other chamber's if the hoses are swapped."""
    return BlendedPort(
        source_conductance=other.source_conductance if swapped else port.source_conductance,
        source_pressure=other.source_pressure if swapped else port.source_pressure,
        vent_conductance=other.vent_conductance if swapped else port.vent_conductance,
        vent_pressure=other.vent_pressure if swapped else port.vent_pressure,
        is_relieving=other.is_relieving if swapped else port.is_relieving,
    )


FAILED_PORTS: dict[type, Callable[..., tuple[Any, Any]]] = {
    SinglePort: failed_single_ports,
    BlendedPort: failed_blended_ports,
}
"""Function that applies faults to both ports, by the class of the ports."""


def failed_plant(plant: PlantParameters, faults: PlantFaults, time: float) -> PlantParameters:
    """Plant with the faulty vane leak at a time [s]."""
    factor = faults.leak_factor if time >= faults.leak_time else 1.0
    return plant._replace(leak_conductance=factor * plant.leak_conductance)


def is_in_brown_out(faults: PlantFaults, time: float) -> bool:
    """Return whether controller and valves are without power at a time [s]."""
    return (time >= faults.brown_out_time) & (time < faults.brown_out_time + faults.brown_out_duration)


def is_due(began: float, delay: float, time: float, period: float) -> bool:
    """Return whether an action that occurs once per ``delay`` is due in the sample at ``time``; all [s].

    Before ``began`` the action is due in each sample. A ``delay`` shorter than the sample ``period`` counts as one
    period.
    """
    length = max(delay, period)
    # A sample within half a period of its time is due, and one that misses it by rounding (1e-9 of a delay) is not
    # early.
    turns = max(time - began, 0.0) / length
    return (time < began) | ((turns - float(int(turns + 1.0e-9))) * length < 0.5 * period)


def runs_at(faults: PlantFaults, time: float, period: float, seed: int, sample: int) -> bool:
    """Return whether the controller runs at a ``sample`` at a time [s]; ``seed`` determines the missed samples."""
    missed = (time >= faults.jitter_time) & (unit_noise(seed, sample, _NOISE_OF_CONTROLLER) < faults.jitter_share)
    return is_due(faults.late_time, faults.late_delay, time, period) & (not missed)
