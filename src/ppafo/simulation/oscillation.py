"""What a run says of its loop: the gains in force and where they come from, and whether the loop oscillates.

A loop oscillates where its command turns too often from more than half open one way to the other within one task: in a
walk above 12 times a stride, else above 10 times a second. A law that only switches does so by design.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ppafo.control import angle_loop, torque_loop
from ppafo.control.kind import ControllerKind
from ppafo.metrics.command import asked_samples
from ppafo.metrics.metric import Floats, followed, has_reference
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.parameters.graph import Term
from ppafo.report.display_units import metric_change
from ppafo.signals import Recording
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import DEAD_TIME, RATE, loop_terms
from ppafo.units.shown import in_units, units_in_force

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import Recorded

MOST_PER_STRIDE, MOST_PER_SECOND = 12.0, 10.0
"""Reversals of the command above which a loop oscillates."""

REVERSALS = "command_reversals"
"""The metric that counts them."""

_OF_LOOP = frozenset(
    (
        torque_loop.PROPORTIONAL_GAIN,
        torque_loop.INTEGRAL_GAIN,
        torque_loop.INTEGRAL_RATE,
        torque_loop.BOUNDARY,
        torque_loop.CONVERGENCE,
        torque_loop.OPENING,
        torque_loop.LEARNING_GAIN,
        torque_loop.LEAD,
        angle_loop.ANGLE_STIFFNESS,
        angle_loop.ANGLE_DAMPING,
        angle_loop.RATE_FILTER,
        angle_loop.INNER_GAIN,
        angle_loop.GRAVITY,
        angle_loop.INERTIA,
        angle_loop.FRICTION,
    )
)
_FIRST = (
    torque_loop.PROPORTIONAL_GAIN,
    torque_loop.BOUNDARY,
    torque_loop.CONVERGENCE,
    angle_loop.INNER_GAIN,
    angle_loop.ANGLE_STIFFNESS,
)
"""What sets how fast a loop is; of a cascade the inner one first, on which the outer one relies."""
_ON_STOP = 1.0e-6
"""How near to a stop a joint lies on it [rad]."""
_SLOPES = ("derivative_gain", "damping")
_NEAR = 0.02
"""Fraction by which a gain may differ from another one that is called the same."""


@dataclass(frozen=True, slots=True)
class Gain:
    """A gain in force [SI]: its name, unit and value, and whether it was computed from the device or given."""

    name: str
    unit: str
    value: float
    computed: bool

    @property
    def text(self) -> str:
        """Name, value and unit."""
        return f"{self.name} {self.value:.3g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Gains:
    """The gains of a law, with the rate of what it controls at full opening, per ``unit``, and what comes late [s]."""

    gains: tuple[Gain, ...]
    torque_rate: float
    dead_time: float
    unit: str = "N m"

    @property
    def sentence(self) -> str:
        """The gains in force and where they come from."""
        loop = f"{self.torque_rate:.3g} {self.unit}/s at full opening, {1.0e3 * self.dead_time:.3g} ms late"
        parts = [
            f"{', '.join(gain.text for gain in self.gains if gain.computed == computed)} {origin}"
            for computed, origin in ((False, "(given)"), (True, f"(computed from the device: {loop})"))
            if any(gain.computed == computed for gain in self.gains)
        ]
        return f"gains: {'; '.join(parts)}"


@dataclass(frozen=True, slots=True)
class Oscillation:
    """A loop that oscillates: reversals ``per`` stride or second, RMS error and RMS of what is wanted.

    Both are in SI, of what is ``controlled``; an angle or a pressure is wanted as far as it is from where the run
    begins. ``remedy`` says which gain would mend it.
    """

    reversals: float
    per: str
    error: float
    wanted: float
    remedy: str
    controlled: str = TORQUE
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    @in_units(lambda oscillation: oscillation.units)
    def sentence(self) -> str:
        """The verdict in one line."""
        followed = CONTROLLED[self.controlled]
        # Differences of levels both, so that no gauge pressure is meant.
        (error, unit), (wanted, _) = (
            metric_change(number, followed.difference) for number in (self.error, self.wanted)
        )
        return (
            f"the {followed.words} loop oscillates: {self.reversals:.3g} reversals a {self.per}, RMS {error:.2g} of "
            f"{wanted:.2g} {unit} wanted; {self.remedy}"
        )


def settings_of(scenario: Scenario, law: ControllerKind) -> tuple[Quantity, ...]:
    """Return the settings of a law of a scenario, in units of what it controls."""
    return law_settings(law, scenario.controlled)


def _terms(scenario: Scenario, law: ControllerKind) -> dict[str, Term]:
    return loop_terms(scenario.device, law, scenario.motion.motion_kind.sees(scenario), scenario.controlled)


def gains_of(scenario: Scenario, law: ControllerKind) -> Gains | None:
    """Return the gains of a scenario's torque law in force; None for a law that has none."""
    if scenario.controller.is_outside:
        return None
    items = [quantity for quantity in settings_of(scenario, law) if _OF_LOOP.intersection(quantity.follows)]
    if not items:
        return None
    links, terms = scenario.links, _terms(scenario, law)
    gains = tuple(
        Gain(
            quantity.name,
            quantity.unit,
            float(scenario.controller.settings[quantity.name]),
            f"controller.{quantity.name}" in links,
        )
        for quantity in items
    )
    rate, late = (float(terms[name].number(lambda path: number_at(scenario, path))) for name in (RATE, DEAD_TIME))
    controlled = scenario.controlled if TORQUE in law.controls else TORQUE
    return Gains(gains, rate, late, CONTROLLED[controlled].plain_unit)


def most_reversals(scenario: Scenario, law: ControllerKind, duration: float, stride_time: float = 0.0) -> float:
    """Return the reversals of the command in a time [s] above which a loop oscillates; infinite for one that may.

    ``stride_time`` [s] is how long a stride of a walk lasts.
    """
    # A law that asks for openings between shut and open should not turn.
    if scenario.controller.is_outside or not scenario.motion.motion_kind.asks_gradually(law):
        return math.inf
    return duration * (MOST_PER_STRIDE / stride_time if stride_time > 0.0 else MOST_PER_SECOND)


def oscillation_in(result: "Recorded") -> Oscillation | None:
    """Return the verdict on a result, of a walk per stride; None where its loop does not oscillate, or is of yours."""
    scenario, law = result.scenario, result.scenario.law
    if law is None:
        return None
    metrics, time = {name: metric.value for name, metric in result.metrics.items()}, result.recording.time
    strides = metrics.get("strides", 0.0)
    stride_time = float(time[-1] - time[0]) / strides if strides > 0.0 else 0.0
    return oscillation_of(scenario, law, result.recording, metrics, stride_time)


@in_units(lambda scenario, *_, **__: scenario.device.shown)
def oscillation_of(
    scenario: Scenario,
    law: ControllerKind,
    recording: Recording,
    metrics: Mapping[str, float],
    stride_time: float = 0.0,
) -> Oscillation | None:
    """Return the verdict on a run with these metrics [SI]; None where its loop does not oscillate."""
    reversals, duration = metrics.get(REVERSALS, 0.0), float(np.ptp(recording.time[[0, -1]]))
    if not has_reference(recording) or reversals <= most_reversals(scenario, law, duration, stride_time):
        return None
    asked = asked_samples(recording)
    reference, value = (series[asked] for series in followed(recording))
    unlike = _unlike(scenario, law)
    # With the device's gains a command that turns there comes from what presses the joint, and no gain would help.
    if scenario.controlled == ANGLE and not unlike and _lies_on_stop(scenario, value):
        return None
    origin = 0.0 if scenario.controlled == TORQUE else value[0]
    scale, per = (stride_time, "stride") if stride_time > 0.0 else (1.0, "second")
    return Oscillation(
        reversals=reversals * scale / duration,
        per=per,
        error=float(np.sqrt(np.mean((reference - value) ** 2))),
        wanted=float(np.sqrt(np.mean((reference - origin) ** 2))),
        remedy=_remedy(scenario, law, unlike),
        controlled=scenario.controlled,
    )


def _lies_on_stop(scenario: Scenario, angle: Floats) -> bool:
    """Tell whether a joint lies on a stop for most of a run."""
    actuator = scenario.device.actuator
    away = np.minimum(np.abs(angle - actuator.angle_min), np.abs(angle - actuator.angle_max))
    return bool(np.mean(away <= _ON_STOP) > 0.5)


def _first(scenario: Scenario, law: ControllerKind) -> dict[str, Quantity]:
    """Return the settings of a law that say how fast its loops are, by what they follow, the innermost first."""
    items = {name: quantity for quantity in settings_of(scenario, law) for name in _FIRST if name in quantity.follows}
    return {name: items[name] for name in _FIRST if name in items}


def _unlike(scenario: Scenario, law: ControllerKind) -> list[tuple[Quantity, float]]:
    """Return those of them that are not the device's, each with the number [SI] that would be."""
    terms, settings = _terms(scenario, law), scenario.controller.settings
    rights = {
        name: (quantity, float(terms[name].number(lambda path: number_at(scenario, path))))
        for name, quantity in _first(scenario, law).items()
    }
    return [
        (quantity, right)
        for quantity, right in rights.values()
        if abs(float(settings[quantity.name]) - right) > _NEAR * right
    ]


def _remedy(scenario: Scenario, law: ControllerKind, unlike: list[tuple[Quantity, float]]) -> str:
    """Return which gain the device asks for, or what else to look at where it has all of them."""
    items = _first(scenario, law)
    if not items:
        return "give its law smaller gains, or a slower one"
    if not unlike:
        first = next(iter(items.values()))
        return f"{first.name} is this device's: look for what delays it (sensors, lines), or give half of it"
    quantity, right = unlike[0]
    # The rules leave the slope of the error alone.
    slopes = [name for name in _SLOPES if scenario.controller.settings.get(name, 0.0) > 0.0]
    rest = "".join(f" and `{name} = 0`" for name in slopes)
    return f"for this device `{quantity.name} = {right:.3g} {quantity.unit}`{rest}"
