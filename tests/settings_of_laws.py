"""Settings of a controller of walking [SI] for tests of its function alone: its defaults, and gains of a device."""

from ppafo.control.kind import ControllerKind
from ppafo.walking import load_walk


def settings_of_law(kind: ControllerKind) -> dict[str, float]:
    """Defaults by name; what has none is computed from the paper's device, and the observer is off."""
    of_device = load_walk("proportional", [f"controller.kind={kind.name}"]).controller.settings
    return {
        item.name: float(of_device.get(item.name, 0.0)) if item.default is None else float(item.default)
        for item in kind.quantities
    }
