"""What a direction is: one effect that a fitted model may lack, and the change of the channels that a little makes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario

_OF_A_BENCH = 0.1
"""Fraction of the largest fault of a record that can be believed up to which a bench has it and no model is wrong."""
TRACE = 1.0e-12
"""A setting with which an effect acts and is not felt [SI]."""


@dataclass(frozen=True, slots=True)
class Form:
    """A number of an effect that says how it acts rather than how much of it there is, above 0.

    Its logarithm is fitted with a normal prior around ``usual`` whose standard deviation is the logarithm of ``factor``
    [-], and stays between ``low`` and ``high``.
    """

    path: str
    usual: float
    factor: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Direction:
    """One effect of the device that a fitted model may lack.

    ``title`` is what it is called in a sentence, ``seems`` says that it shows, ``unless`` what must not be, each with
    the size as ``size_in_words`` writes it. ``sizes`` grow to the largest that can be believed. ``settings`` gives the
    numbers [SI] of a size by path, on the device of a scenario; ``neutral`` those with which the effect acts, and
    changes nothing. ``suits`` says which scenarios can have it. What it changes grows with the size to the power of
    ``growth``. ``forms`` are what a fit with the effect finds beside its size.
    """

    name: str
    title: str
    seems: str
    unless: str
    size_in_words: Callable[[float], str]
    sizes: tuple[float, ...]
    settings: Callable[[float, Scenario], dict[str, float]]
    neutral: Mapping[str, float] = field(default_factory=dict)
    suits: Callable[[Scenario], bool] = lambda _: True
    growth: float = 1.0
    forms: tuple[Form, ...] = ()

    @property
    def largest(self) -> float:
        """The largest size that can be believed."""
        return self.sizes[-1]


@dataclass(frozen=True, slots=True)
class Column:
    """A direction as a change of the residuals [-] per size [SI of the size], and between what its size may be."""

    name: str
    seems: str
    unless: str
    size_in_words: Callable[[float], str]
    low: float
    high: float
    change: Floats

    @property
    def tolerance(self) -> float:
        """Size up to which it is no news: none for an effect of the device, which is never negative."""
        return _OF_A_BENCH * self.high if self.low < 0.0 else 0.0
