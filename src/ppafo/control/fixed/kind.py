"""What an integer controller declares of itself."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from ppafo.control.fixed.converter import OF_CONVERTER, Readings
from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity

FLOAT, FIXED = "float", "fixed"
"""The two arithmetics of a controller."""
TARGETS = ("msp430f2013", "cortex-m0", "cortex-m4")
"""Processors that an integer controller can be written for."""
PLANT_TARGETS = ("cortex-m4",)
"""Those that the plant can be written for too."""
WALK_TARGETS = ("msp430g2553",)
"""And those that an integer controller of walking can be written for: the smallest has no room for it."""


class WholeLaw(Protocol):
    """A law on whole numbers as the proof and the translation take it: of a torque task, or of a walk."""

    @property
    def name(self) -> str:
        """That of the controller whose form it is."""

    @property
    def sample(self) -> Callable[..., Any]:
        """The law: command in steps and next state, from numbers, state and readings."""

    @property
    def numbers(self) -> type:
        """The NamedTuple class of what it is given."""

    @property
    def readings(self) -> type:
        """That of what the converter shows."""

    @property
    def state_ranges(self) -> Mapping[str, tuple[int, int]]:
        """Lowest and highest of every number of the state, by its own name."""

    @property
    def number_quantities(self) -> tuple[Quantity, ...]:
        """Declarations of the whole numbers that the law is given, in order."""


@dataclass(frozen=True, slots=True)
class FixedLaw:
    """The integer form of a controller of the catalogue.

    ``kind`` runs it in the lanes: its update reads the converter, calls ``sample`` and gives the command back as a
    number from -1 to 1. ``sample(numbers, state, readings)`` is the law itself, on whole numbers only: the command in
    steps and the next state. ``numbers`` is the NamedTuple class of what it is given, whose ranges are those of the
    quantities of ``kind`` after the ones of the converter. ``state_ranges`` has those of each field of the state.

    ``prepare(settings, period, torque_step)`` makes the parameters of ``kind`` without the converter, and
    ``largest(settings, period, torque_step)`` is the largest part of their range that any of them takes, above 1
    where the settings cannot be held.
    """

    kind: ControllerKind
    sample: Callable[..., Any]
    numbers: type
    state_ranges: Mapping[str, tuple[int, int]]
    prepare: Callable[[Mapping[str, float], float, float], Any]
    largest: Callable[[Mapping[str, float], float, float], float]

    @property
    def name(self) -> str:
        """That of the controller whose form it is."""
        return self.kind.name

    @property
    def readings(self) -> type:
        """What the converter shows."""
        return Readings

    @property
    def number_quantities(self) -> tuple[Quantity, ...]:
        """Declarations of the whole numbers that the law is given, in order."""
        return self.kind.quantities[len(OF_CONVERTER) - 2 :]
