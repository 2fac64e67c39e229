"""Every controller of walking by name. To add one: a module of this folder with a KIND, listed here.

Its ``update`` watches the sensors with ``safety.watched`` and passes its command through ``safety.carried_out``.
"""

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import (
    event_damped_learning,
    event_feedback_linearisation,
    event_on_off,
    event_on_off_dead_zone,
    event_pid,
    event_pid_feedforward,
    event_proportional,
    event_sliding_mode,
    off,
)

WALKING_CONTROLLERS: dict[str, ControllerKind] = {
    kind.name: kind
    for kind in (
        event_on_off.KIND,
        event_on_off_dead_zone.KIND,
        event_proportional.KIND,
        event_pid.KIND,
        event_pid_feedforward.KIND,
        event_sliding_mode.KIND,
        event_damped_learning.KIND,
        event_feedback_linearisation.KIND,
        off.KIND,
    )
}

FITS_ON_OFF_VALVES = frozenset({event_on_off.KIND.name, event_on_off_dead_zone.KIND.name, off.KIND.name})
"""Controllers that ask for fully open, shut or vented; every other one needs a proportional valve."""
