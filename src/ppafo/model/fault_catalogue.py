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


TIME = Quantity("time", "s", "when it fails", None, 0.0, 1.0e6)
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
)

PLANT_FAULTS = {
    part: {fault.kind: fault for fault in _FAULTS if fault.part == part}
    for part in dict.fromkeys(fault.part for fault in _FAULTS)
}
"""Faults of the plant by part and by kind."""
