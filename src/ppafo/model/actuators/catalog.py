"""The actuators that a parameter set can name. To add one: a module beside this file and one line here."""

from ppafo.kinds import Kinds
from ppafo.model.actuators import bladder, cylinder, muscle_pair, table, vane
from ppafo.model.actuators.kind import ActuatorKind

ACTUATORS: Kinds[ActuatorKind] = Kinds(
    "ppafo.actuators", "actuator", ActuatorKind, (vane.KIND, cylinder.KIND, muscle_pair.KIND, bladder.KIND, table.KIND)
)
