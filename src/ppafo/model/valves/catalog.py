"""The valves that a parameter set can name. To add one: a module beside this file and one line here."""

from ppafo.model.valves import proportional, solenoid
from ppafo.model.valves.kind import ValveKind

VALVES: dict[str, ValveKind] = {kind.name: kind for kind in (proportional.KIND, solenoid.KIND)}
