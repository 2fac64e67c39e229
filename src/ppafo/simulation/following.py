"""Default settings of a controller that follow numbers of the device and its sensors."""

from collections.abc import Mapping
from dataclasses import replace

from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import value_at
from ppafo.parameters.device import Device
from ppafo.parameters.effects import number_under
from ppafo.parameters.graph import Graph, LinkedDefault, LinkFunction
from ppafo.simulation.document import DocumentReader


def read_followers(
    reading: DocumentReader,
    sections: Mapping[str, tuple[Quantity, ...]],
    terms: Mapping[str, LinkFunction],
    device: Device,
    present: Mapping[str, float],
) -> tuple[dict[str, float], Graph]:
    """Return the settings of sections [SI] by path, and links for the defaults that depend on the device.

    ``terms`` are the quantities that a default may follow, by name; ``present`` are numbers by path in addition to
    those on the device.
    """
    settings: dict[str, float] = {}
    links: dict[str, tuple[LinkedDefault, ...]] = {}

    def number(path: str) -> float:
        known = settings if path in settings else present
        return known[path] if path in known else float(number_under(device, path.split(".")))

    for section, items in sections.items():
        for quantity in items:
            path, read = f"{section}.{quantity.name}", quantity
            # A setting of this list may follow one before it; what no number of the device decides is to be given.
            is_decided = quantity.follows and terms.keys() >= set(quantity.follows)
            if is_decided and value_at(reading.document, path) is None:
                link = LinkedDefault(tuple(terms[name] for name in quantity.follows), quantity.default or 0.0)
                links[path] = (link,)
                read = replace(quantity, default=float(link.number(number)))
            settings[path] = reading.number(path, read)
    return settings, links
