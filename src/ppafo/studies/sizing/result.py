"""What a sizing study finds: for each valve the lowest pressure and the bottle, with margins and what limits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.parts import Part
from ppafo.signals import Recording
from ppafo.studies.sizing.problem import SizingProblem

Floats = NDArray[np.float64]

Limit = Literal["torque", "flow", "control", "pressure"]
LIMITS: dict[Limit, str] = {
    "torque": "the torque ceiling: torque constant times pressure",
    "flow": "the flow: with a larger opening it would do",
    "control": "the control: neither more pressure nor a larger opening would do",
    "pressure": "nothing: the lowest pressure that was asked for is enough",
}
"""What keeps a valve from working at a lower pressure, or from working at all."""


@dataclass(frozen=True, slots=True)
class Margins:
    """How far a sized valve is from its limits, as shares [-].

    ``error``: how much smaller the RMS error is than its limit. ``torque``: how much more torque the pressure can hold
    than the profile asks for; below 0 where the error limit lets its crest be cut. ``flow``: how much smaller the
    opening might be if the gauge pressure were a tenth higher. ``gas``: how much more gas the bottle has than is used;
    None without a bottle.
    """

    error: float
    torque: float
    flow: float
    gas: float | None


@dataclass(frozen=True, slots=True, eq=False)
class SizedValve:
    """A valve at a supply pressure [Pa absolute] that keeps the error limit: the one with the lightest bottle.

    ``works`` False: it keeps the limit at no pressure; then ``pressure`` is the one with the smallest error.
    ``lowest_pressure`` [Pa absolute] is the lowest that works, and ``limit`` what keeps it from being lower. ``gains``
    are those of the controller, by path, in SI. Error [N m], gas per repetition [kg], gas in all with the reserve [kg];
    ``bottle`` None where none is large enough; ``mass`` [kg] of valve, bottle, regulators, and actuator where one was
    named. ``curve`` has pressures [Pa absolute], errors [N m] and gas per repetition [kg] with the best gains of each.
    """

    valve: Part
    works: bool
    pressure: float
    lowest_pressure: float | None
    gains: Mapping[str, float]
    error: float
    gas: float
    gas_in_all: float
    bottle: Part | None
    mass: float | None
    margins: Margins | None
    limit: Limit
    remark: str
    curve: tuple[Floats, Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Sizing:
    """The result of a sizing study: every valve, and the place of the lightest that works with a bottle, if any.

    ``recording`` is the suggestion on the profile, None without one. ``failures`` maps reasons of failed runs to how
    many had them.
    """

    problem: SizingProblem
    valves: tuple[SizedValve, ...]
    suggested: int | None
    recording: Recording | None
    runs: int
    failures: Mapping[str, int]
    seconds: float

    @property
    def choice(self) -> SizedValve | None:
        """The suggestion."""
        return None if self.suggested is None else self.valves[self.suggested]

    @property
    def doubtful(self) -> tuple[tuple[Part, str], ...]:
        """Figures that are quoted or assumed, of the parts that the result rests on."""
        problem = self.problem
        parts = [item.valve for item in self.valves] + [item.bottle for item in self.valves if item.bottle is not None]
        parts += [*problem.regulators, *([] if problem.actuator is None else [problem.actuator])]
        once = {(part.group, part.name): part for part in parts}.values()
        return tuple((part, name) for part in once for name in part.doubtful)
