"""Faults of the plant in a walk, and the shut-off valve of the safe state: what they do to the ports of both chambers.

A fault is one entry of ``PLANT_FAULTS``: the part, the kind, its numbers, and the fields of ``PlantFaults`` they fill.
All act at the ports between valve and chamber, at the command, or at the controller's sample, from a time on; without
one the numbers of ``SOUND`` change nothing, and a walk that has neither fault nor shut-off is composed without them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.orifice import conductance_in_series
from ppafo.model.plant import BlendedPort, PlantParameters, SinglePort
from ppafo.model.sensors import unit_noise

NEVER = 1.0e9
"""Time [s] of what does not happen."""


class ChamberFaults(NamedTuple):
    """Faults of one chamber: when each begins [s], and how large it is: absolute pressures [Pa], shares, openings."""

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
    """Faults of both chambers and of their common parts: when each begins [s], and how large it is."""

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


class ShutOff(NamedTuple):
    """Shut-off valve, normally closed 3/2: conductance [kg/(s Pa)], 0 where none is fitted, and delay [s].

    Its watchdog cuts the power of all valves where the controller is silent for longer than
    ``silence`` [s]; ``NEVER`` where there is none.
    """

    conductance: float
    delay: float
    silence: float


NOT_FITTED = ShutOff(0.0, 0.0, NEVER)


class Unpowered(NamedTuple):
    """For how long [s] the shut-off valve has had no power, and for how long the controller has been silent.

    It has none since the controller stopped, was in a brown-out, or was silent for longer than the watchdog allows.
    """

    since: float
    silent: float


POWERED = Unpowered(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class PlantFault:
    """A fault as ``[faults]`` of a walk knows it: what it is, its numbers, and which field each of them is."""

    part: str
    kind: str
    summary: str
    quantities: tuple[Quantity, ...]
    fields: Mapping[str, str]


TIME = Quantity("time", "s", "when it fails", None, 0.0, 1.0e6)


def _of_chambers(part: str, kind: str, summary: str, own: Mapping[str, Quantity], time: str) -> list[PlantFault]:
    """The fault of the part of either chamber: its own quantities by field, and the field of its ``time``."""
    return [
        PlantFault(
            f"{part}_{chamber}",
            kind,
            f"{summary} {chamber}",
            (TIME, *own.values()),
            {item.name: f"chamber_{chamber}.{name}" for name, item in {time: TIME, **own}.items()},
        )
        for chamber in (1, 2)
    ]


_CATALOGUE = [
    *_of_chambers(
        "valve",
        "stuck",
        "stays at one opening, whatever it is commanded: the valve of chamber",
        {"opening": Quantity("opening", "1", "1 open to the supply, -1 to the atmosphere, 0 shut", 1.0, -1.0, 1.0)},
        "stuck_time",
    ),
    PlantFault("valve", "swapped", "feeds the other chamber", (TIME,), {"time": "swapped_time"}),
    PlantFault(
        "valve",
        "slow",
        "follows late: it takes a command only once in each such time",
        (TIME, Quantity("delay", "s", "that time", 0.1, 0.0, 10.0)),
        {"time": "slow_time", "delay": "slow_delay"},
    ),
    *_of_chambers("hose", "off", "is open to the atmosphere: the hose of chamber", {}, "off_time"),
    *_of_chambers(
        "hose",
        "kinked",
        "is narrow: the hose of chamber",
        {"kinked_share": Quantity("share", "1", "what is left of its conductance", 0.1, 0.0, 1.0)},
        "kinked_time",
    ),
    *_of_chambers(
        "regulator",
        "high",
        "gives another pressure: the regulator of chamber",
        {"pressure": Quantity("pressure", "Pa_a", "that pressure", 9.286959e5, 1.0e4, 1.0e8)},
        "high_time",
    ),
    *_of_chambers(
        "regulator",
        "creeping",
        "gives more and more: the regulator of chamber",
        {"rate": Quantity("rate", "Pa/s", "what it gives more in each second", 6.894757e4, -1.0e7, 1.0e7)},
        "creep_time",
    ),
    *_of_chambers(
        "regulator",
        "frozen",
        "lets little through: the regulator of chamber",
        {"frozen_share": Quantity("share", "1", "what is left of its flow", 0.1, 0.0, 1.0)},
        "frozen_time",
    ),
    PlantFault(
        "bottle",
        "empty",
        "its pressure falls to atmospheric",
        (TIME, Quantity("lag", "s", "time in which most of it is gone", 0.2, 1.0e-3, 1.0e3)),
        {"time": "empty_time", "lag": "empty_lag"},
    ),
    PlantFault(
        "vane",
        "leaking",
        "leaks more between the chambers",
        (TIME, Quantity("factor", "1", "its leak over a sound one's", 50.0, 0.0, 1.0e4)),
        {"time": "leak_time", "factor": "leak_factor"},
    ),
    PlantFault(
        "controller",
        "late",
        "runs only once in each such time",
        (TIME, Quantity("delay", "s", "that time", 0.02, 0.0, 10.0)),
        {"time": "late_time", "delay": "late_delay"},
    ),
    PlantFault(
        "controller",
        "jittering",
        "misses samples at random",
        (TIME, Quantity("share", "1", "share of samples that it misses", 0.3, 0.0, 1.0)),
        {"time": "jitter_time", "share": "jitter_share"},
    ),
    PlantFault(
        "controller",
        "brown_out",
        "is without power for a time, with all valves, and starts anew",
        (TIME, Quantity("duration", "s", "for how long", 0.3, 0.0, 1.0e6)),
        {"time": "brown_out_time", "duration": "brown_out_duration"},
    ),
]
PLANT_FAULTS: dict[str, dict[str, PlantFault]] = {}
for _fault in _CATALOGUE:
    PLANT_FAULTS.setdefault(_fault.part, {})[_fault.kind] = _fault
"""Every fault of the plant, by part and by kind."""

SHUT_OFF = (
    Quantity("area", "m^2", "area of the shut-off valve, 0 where none is fitted", 0.0, 0.0, 1.0e-3),
    Quantity("discharge_coefficient", "1", "its discharge coefficient", 0.7, 0.01, 1.0),
    Quantity("delay", "s", "time from the alarm to a vented line", 0.02, 0.0, 1.0),
    Quantity(
        "silence",
        "s",
        "its watchdog lets it shut, for good, where the controller is silent for longer",
        0.01,
        0.0,
        1.0e9,
    ),
    Quantity("mass", "kg", "its mass", 0.06, 0.0, 1.0),
    Quantity("power", "W", "what holds it open, as long as the device helps", 0.5, 0.0, 100.0),
)
"""What a walk says of a shut-off valve; mass and power of a miniature 3/2 solenoid with a holding circuit, assumed."""


def set_pressure(faults: PlantFaults, own: ChamberFaults, pressure: float, room: float, time: float) -> float:
    """Pressure of a faulty regulator at a time [s], never below the atmosphere ``room``; all [Pa]."""
    # First the regulator's own faults, then the bottle before it: an empty one takes any of them down with it.
    given = (own.pressure if time >= own.high_time else pressure) + own.rate * max(time - own.creep_time, 0.0)
    gone = max(time - faults.empty_time, 0.0) / faults.empty_lag
    # 1 / (1 + x + x^2/2) stands for exp(-x), without a call, so in vector code.
    left = 1.0 / (1.0 + gone + 0.5 * gone * gone)
    return max(room + (given - room) * left, room)


def feed_conductance(shut_off: ShutOff, own: ChamberFaults, conductance: float, time: float) -> float:
    """Conductance [kg/(s Pa)] from a supply to a chamber at a time [s], through regulator, shut-off, valve and hose."""
    # A frozen regulator and a kinked hose are in series; shares of both stand for their joint loss.
    share = (own.frozen_share if time >= own.frozen_time else 1.0) * hose_share(own, time)
    fitted = shut_off.conductance > 0.0
    # Both sides of a select are computed in vector code: without the valve the divisor is 1.
    second = shut_off.conductance if fitted else 1.0
    passed = conductance_in_series(conductance, 1.0 / (second * second)) if fitted else conductance
    return share * passed


def hose_share(own: ChamberFaults, time: float) -> float:
    """Fraction of its conductance [-] that a hose still has at a time [s]."""
    return own.kinked_share if time >= own.kinked_time else 1.0


def failed_single_port(
    plant: PlantParameters,
    faults: PlantFaults,
    own: ChamberFaults,
    shut_off: ShutOff,
    closed: Unpowered,
    port: SinglePort,
    supply: float,
    time: float,
) -> SinglePort:
    """A port with one open path as faults leave it at a time [s]; ``supply`` [Pa] feeds a stuck valve."""
    room, stuck = plant.atmospheric_pressure, time >= own.stuck_time
    # A stuck valve feeds or vents by its own opening, whatever the command would do.
    fed = (own.opening > 0.0) if stuck else (port.source_fraction > 0.5)
    conductance = abs(own.opening) * plant.valve_conductance if stuck else port.conductance
    node = supply if stuck else port.node_pressure
    back = plant.relieving if stuck else port.is_relieving
    is_off, vents = time >= own.off_time, (closed.since > shut_off.delay) & (shut_off.conductance > 0.0)
    through = feed_conductance(shut_off, own, conductance, time) if fed else hose_share(own, time) * conductance
    from_supply = fed & (not vents) & (not is_off)
    return SinglePort(
        conductance=plant.valve_conductance if is_off else through,
        node_pressure=set_pressure(faults, own, node, room, time) if from_supply else room,
        source_fraction=1.0 if from_supply else 0.0,
        is_relieving=back if from_supply else 1.0,
    )


def failed_blended_port(
    plant: PlantParameters,
    faults: PlantFaults,
    own: ChamberFaults,
    shut_off: ShutOff,
    closed: Unpowered,
    port: BlendedPort,
    time: float,
) -> BlendedPort:
    """A port with two open paths as faults leave it at a time [s]."""
    room, stuck, full = plant.atmospheric_pressure, time >= own.stuck_time, plant.valve_conductance
    source = max(own.opening, 0.0) * full if stuck else port.source_conductance
    vent = max(-own.opening, 0.0) * full if stuck else port.vent_conductance
    is_off, vents = time >= own.off_time, (closed.since > shut_off.delay) & (shut_off.conductance > 0.0)
    lost = is_off | vents
    through = feed_conductance(shut_off, own, source, time)
    return BlendedPort(
        source_conductance=0.0 if is_off else through,
        source_pressure=room if lost else set_pressure(faults, own, port.source_pressure, room, time),
        vent_conductance=full if is_off else hose_share(own, time) * vent,
        vent_pressure=port.vent_pressure,
        is_relieving=1.0 if lost else port.is_relieving,
    )


def failed_single_ports(
    plant: PlantParameters,
    faults: PlantFaults,
    shut_off: ShutOff,
    closed: Unpowered,
    port_1: SinglePort,
    port_2: SinglePort,
    time: float,
) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers with one open path each, as faults leave them at a time [s]."""
    swapped = time >= faults.swapped_time
    first, second = swapped_single(port_1, port_2, swapped), swapped_single(port_2, port_1, swapped)
    to_1, to_2 = plant.supply_pressure, plant.dorsiflexion_pressure
    return (
        failed_single_port(plant, faults, faults.chamber_1, shut_off, closed, first, to_1, time),
        failed_single_port(plant, faults, faults.chamber_2, shut_off, closed, second, to_2, time),
    )


def swapped_single(port: SinglePort, other: SinglePort, swapped: bool) -> SinglePort:
    """A port with one open path, or the other one."""
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
    closed: Unpowered,
    port_1: BlendedPort,
    port_2: BlendedPort,
    time: float,
) -> tuple[BlendedPort, BlendedPort]:
    """Ports of both chambers with two open paths each, as faults leave them at a time [s]."""
    swapped = time >= faults.swapped_time
    first, second = swapped_blended(port_1, port_2, swapped), swapped_blended(port_2, port_1, swapped)
    return (
        failed_blended_port(plant, faults, faults.chamber_1, shut_off, closed, first, time),
        failed_blended_port(plant, faults, faults.chamber_2, shut_off, closed, second, time),
    )


def swapped_blended(port: BlendedPort, other: BlendedPort, swapped: bool) -> BlendedPort:
    """A port with two open paths, or the other one."""
    return BlendedPort(
        source_conductance=other.source_conductance if swapped else port.source_conductance,
        source_pressure=other.source_pressure if swapped else port.source_pressure,
        vent_conductance=other.vent_conductance if swapped else port.vent_conductance,
        vent_pressure=other.vent_pressure if swapped else port.vent_pressure,
        is_relieving=other.is_relieving if swapped else port.is_relieving,
    )


def failed_plant(plant: PlantParameters, faults: PlantFaults, time: float) -> PlantParameters:
    """The plant with the vane leak that it has at a time [s]."""
    factor = faults.leak_factor if time >= faults.leak_time else 1.0
    return plant._replace(leak_conductance=factor * plant.leak_conductance)


def is_in_brown_out(faults: PlantFaults, time: float) -> bool:
    """True where controller and valves have no power at a time [s]."""
    return (time >= faults.brown_out_time) & (time < faults.brown_out_time + faults.brown_out_duration)


def is_due(began: float, delay: float, time: float, period: float) -> bool:
    """True where something that happens once in each ``delay`` since it began does so in this sample; all [s]."""
    length = max(delay, period)
    # A sample within half a period of its time is due, and one that misses it by rounding (1e-9 of a delay) is not
    # early.
    place = max(time - began, 0.0) / length
    return (time < began) | ((place - float(int(place + 1.0e-9))) * length < 0.5 * period)


def runs_at(faults: PlantFaults, time: float, period: float, seed: int, sample: int) -> bool:
    """True where the controller runs at a sample, at its time [s]."""
    missed = (time >= faults.jitter_time) & (unit_noise(seed, sample, 11) < faults.jitter_share)
    return is_due(faults.late_time, faults.late_delay, time, period) & (not missed)


def is_silenced(shut_off: ShutOff, closed: Unpowered) -> bool:
    """True where the watchdog has taken the power of all valves away."""
    return closed.silent > shut_off.silence


def next_unpowered(
    shut_off: ShutOff, closed: Unpowered, runs: bool, stopped: bool, brown_out: bool, period: float
) -> Unpowered:
    """The shut-off valve after a sample [s] at which the controller runs or not; without power it shuts at once.

    A watchdog that has acted stays: what the controller would do when it comes back is not known.
    """
    silenced = is_silenced(shut_off, closed)
    silent = closed.silent if silenced else (0.0 if runs | brown_out else closed.silent + period)
    # The same test with the new silence: the sample that exceeds the limit already takes the power.
    since = closed.since + period if stopped | (silent > shut_off.silence) else 0.0
    return Unpowered(NEVER if brown_out else since, silent)
