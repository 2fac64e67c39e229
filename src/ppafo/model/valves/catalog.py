"""The valves that a parameter set can name. To add one: a module beside this file and one line here."""

from ppafo.kinds import Kinds
from ppafo.model.valves import proportional, solenoid, solenoid_recycling
from ppafo.model.valves.kind import ValveKind

VALVES: Kinds[ValveKind] = Kinds(
    "ppafo.valves", "valve", ValveKind, (proportional.KIND, solenoid.KIND, solenoid_recycling.KIND)
)
