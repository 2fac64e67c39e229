"""Real parts that a device can be built from: figures of data sheets, each with its origin, and what is not known."""

from ppafo.parameters.parts.catalogue import Catalogue, Part, load_catalogue, rated_pressure

__all__ = ["Catalogue", "Part", "load_catalogue", "rated_pressure"]
