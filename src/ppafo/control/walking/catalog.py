"""Every controller of walking by name. To add one: a module of this folder with a KIND, listed here.

Its ``update`` watches the sensors with ``safety.watched`` and passes its command through ``safety.carried_out``.
"""

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import event_on_off, event_proportional, off

WALKING_CONTROLLERS: dict[str, ControllerKind] = {
    kind.name: kind for kind in (event_on_off.KIND, event_proportional.KIND, off.KIND)
}

FITS_ON_OFF_VALVES = frozenset({event_on_off.KIND.name, off.KIND.name})
"""Controllers that ask for fully open, shut or vented; every other one needs a proportional valve."""
