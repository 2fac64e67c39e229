"""Real parts that a device can be built from: figures of data sheets, each with its origin, and what is not known."""

from ppafo.parameters.parts.catalogue import Catalogue, load_catalogue
from ppafo.parameters.parts.part import Part

__all__ = ["Catalogue", "Part", "load_catalogue"]
