"""Commercial parts for a device: data-sheet figures with their origins."""

from ppafo.parameters.parts.catalogue import Catalogue, Part, load_catalogue, rated_pressure

__all__ = ["Catalogue", "Part", "load_catalogue", "rated_pressure"]
