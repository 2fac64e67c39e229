"""Every controller of walking by name. To add one: a module of this folder with a KIND, listed here."""

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import event_on_off, event_proportional, off

WALKING_CONTROLLERS: dict[str, ControllerKind] = {
    kind.name: kind for kind in (event_on_off.KIND, event_proportional.KIND, off.KIND)
}
