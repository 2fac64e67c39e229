"""Declaration of an integer controller, in addition to its entry in the catalogue of controllers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.processor.fixed_point import ConverterCounts

Sample = Callable[[Any, Any, ConverterCounts], tuple[int, Any]]
"""Command in steps, from -1000 to 1000, and next state, of numbers, state and readings: a pure function of integers."""


@dataclass(frozen=True, slots=True)
class FixedLaw:
    """The integer form of a controller of the catalogue.

    ``kind`` runs it in the lanes: its update reads the converter, calls ``sample``, which is the law itself, and gives
    the command back as a number from -1 to 1. ``numbers`` is the NamedTuple class of what ``sample`` is given beside
    state and readings; ``number_quantities`` declare the numbers, in order. The state ``begins`` so, and
    ``state_ranges`` has lowest and highest of every number of it, by its own name; its ``sound`` is what a processor
    reports.
    """

    kind: ControllerKind
    sample: Sample
    numbers: type
    number_quantities: tuple[Quantity, ...]
    begins: Any
    state_ranges: Mapping[str, tuple[int, int]]
