"""Pair of solenoid valves."""

from ppafo.model.declaration import Quantity
from ppafo.model.valves.kind import ValveKind

KIND = ValveKind(
    name="solenoid",
    summary="Two on/off valves, one for each chamber; both off vents both chambers.",
    quantities=(
        Quantity("opening_delay", "s", "time from energising to flow from the source", 0.0, 0.0, 0.2),
        Quantity("closing_delay", "s", "time from de-energising to venting", 0.0, 0.0, 0.2),
        Quantity("switching_interval", "s", "shortest time between two switchings of one valve", 0.0, 0.0, 1.0),
    ),
)
