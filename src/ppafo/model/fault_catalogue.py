"""Faults of the plant that a walk may have, with their names in files and their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass

from ppafo.model.declaration import Quantity


@dataclass(frozen=True, slots=True)
class PlantFault:
    """Fault in the ``[faults]`` section of a walk: failed part, kind of failure, summary, and parameters.

    ``fields`` maps the name of a parameter to the field of ``PlantFaults`` that it fills; a field of one chamber is
    written as ``chamber_1.opening``.
    """

    part: str
    kind: str
    summary: str
    quantities: tuple[Quantity, ...]
    fields: Mapping[str, str]


TIME = Quantity("time", "s", "start time of the fault", None, 0.0, 1.0e6)
"""Parameter of every fault: its start time."""


def _of_chambers(
    part: str, kind: str, summary: str, by_field: Mapping[str, Quantity], time_field: str
) -> list[PlantFault]:
    """Return the fault of the part of chamber 1 and of chamber 2, ``valve_1`` and ``valve_2``.

    ``by_field`` maps fields of ``ChamberFaults`` to the parameters other than the time.
    """
    quantities = {time_field: TIME, **by_field}
    return [
        PlantFault(
            part=f"{part}_{chamber}",
            kind=kind,
            summary=f"{summary} {chamber}",
            quantities=tuple(quantities.values()),
            fields={quantity.name: f"chamber_{chamber}.{field}" for field, quantity in quantities.items()},
        )
        for chamber in (1, 2)
    ]


_FAULTS = (
    *_of_chambers(
        "valve",
        "stuck",
        "valve stuck at a fixed opening, whatever the command: chamber",
        {
            "opening": Quantity(
                "opening", "1", "fixed opening: 1 open to the supply, -1 open to the atmosphere, 0 shut", 1.0, -1.0, 1.0
            )
        },
        "stuck_time",
    ),
    PlantFault(
        "valve",
        "swapped",
        "valve outputs swapped: each command feeds the other chamber",
        (TIME,),
        {"time": "swapped_time"},
    ),
    PlantFault(
        "valve",
        "slow",
        "slow valve: it accepts a new command only once per delay",
        (TIME, Quantity("delay", "s", "time between two accepted commands", 0.1, 0.0, 10.0)),
        {"time": "slow_time", "delay": "slow_delay"},
    ),
    *_of_chambers("hose", "off", "hose disconnected, open to the atmosphere: chamber", {}, "off_time"),
    *_of_chambers(
        "hose",
        "kinked",
        "hose kinked, flow restricted: chamber",
        {"kinked_share": Quantity("share", "1", "remaining fraction of the conductance of the hose", 0.1, 0.0, 1.0)},
        "kinked_time",
    ),
    *_of_chambers(
        "regulator",
        "high",
        "regulator at a wrong constant pressure: chamber",
        {"pressure": Quantity("pressure", "Pa_a", "outlet pressure of the faulty regulator", 9.286959e5, 1.0e4, 1.0e8)},
        "high_time",
    ),
    *_of_chambers(
        "regulator",
        "creeping",
        "regulator creep, outlet pressure that rises steadily: chamber",
        {"rate": Quantity("rate", "Pa/s", "rate of rise of the outlet pressure", 6.894757e4, -1.0e7, 1.0e7)},
        "creep_time",
    ),
    *_of_chambers(
        "regulator",
        "frozen",
        "regulator frozen, flow restricted: chamber",
        {"frozen_share": Quantity("share", "1", "remaining fraction of the flow of the regulator", 0.1, 0.0, 1.0)},
        "frozen_time",
    ),
    PlantFault(
        "bottle",
        "empty",
        "bottle empty: supply pressure falls to atmospheric",
        (TIME, Quantity("lag", "s", "time constant of the fall in pressure", 0.2, 1.0e-3, 1.0e3)),
        {"time": "empty_time", "lag": "empty_lag"},
    ),
    PlantFault(
        "vane",
        "leaking",
        "larger leak between the chambers",
        (TIME, Quantity("factor", "1", "leak relative to the leak of an intact vane", 50.0, 0.0, 1.0e4)),
        {"time": "leak_time", "factor": "leak_factor"},
    ),
    PlantFault(
        "controller",
        "late",
        "controller runs only once per delay",
        (TIME, Quantity("delay", "s", "time between two runs of the controller", 0.02, 0.0, 10.0)),
        {"time": "late_time", "delay": "late_delay"},
    ),
    PlantFault(
        "controller",
        "jittering",
        "controller misses samples at random",
        (TIME, Quantity("share", "1", "fraction of samples that the controller misses", 0.3, 0.0, 1.0)),
        {"time": "jitter_time", "share": "jitter_share"},
    ),
    PlantFault(
        "controller",
        "brown_out",
        "controller and all valves lose power for a time, then restart",
        (TIME, Quantity("duration", "s", "duration of the power loss", 0.3, 0.0, 1.0e6)),
        {"time": "brown_out_time", "duration": "brown_out_duration"},
    ),
)

PLANT_FAULTS = {
    part: {fault.kind: fault for fault in _FAULTS if fault.part == part}
    for part in dict.fromkeys(fault.part for fault in _FAULTS)
}
"""Faults of the plant by part and by kind."""
