"""Proportional valve."""

from ppafo.model.declaration import Quantity
from ppafo.model.valves.kind import ValveKind

KIND = ValveKind(
    name="proportional",
    summary="One spool valve: the opening follows the command from -1 to 1.",
    quantities=(
        Quantity("dead_band", "", "smallest command that opens the valve", 0.0, 0.0, 0.99),
        Quantity("delay", "s", "dead time between command and spool", 0.0, 0.0, 0.2),
        Quantity("spool_frequency", "Hz", "undamped natural frequency of the spool, 0 for none", 0.0, 0.0, 2000.0),
        Quantity("spool_damping_ratio", "", "damping ratio of the spool", 0.7, 0.05, 5.0),
        Quantity("slew_limit", "1/s", "largest rate of the opening, 0 for none", 0.0, 0.0, 1.0e5),
    ),
)
