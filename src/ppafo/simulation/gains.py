"""Controller gains in use in a run, and their origin."""

import logging
from collections.abc import Collection
from dataclasses import dataclass

from ppafo.control import angle_loop, torque_loop
from ppafo.control.kind import ControllerKind
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.model.ports import load_torque
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import LinkFunction, acting
from ppafo.parameters.overrides import other_forms
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.default_gains import DEAD_TIME, RATE, loop_terms
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import PrescribedMotion, Scenario

logger = logging.getLogger("ppafo")

_OF_LOOP = frozenset(
    (
        torque_loop.PROPORTIONAL_GAIN,
        torque_loop.INTEGRAL_GAIN,
        torque_loop.INTEGRAL_RATE,
        torque_loop.BOUNDARY,
        torque_loop.CONVERGENCE,
        torque_loop.DEAD_ZONE,
        torque_loop.RELEASE,
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
        angle_loop.STATIC_FRICTION,
        angle_loop.LOAD_TIME,
        angle_loop.TORQUE_LAG,
        angle_loop.TOLERANCE,
        angle_loop.REST_DISTANCE,
    )
)


@dataclass(frozen=True, slots=True)
class Gain:
    """Controller gain in use: name, unit and value [SI]; ``computed`` if derived from the device, otherwise given."""

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
    """Controller gains in use, with the loop parameters from which they are computed.

    ``torque_rate`` is the rate of the controlled quantity at full valve opening [``unit``/s]; ``dead_time`` is the dead
    time of the loop [s].
    """

    gains: tuple[Gain, ...]
    torque_rate: float
    dead_time: float
    unit: str = "N m"
    unknown_loads: tuple[str, ...] = ()
    """Effects that load a movable joint and are not included in the computed gains."""

    @property
    def sentence(self) -> str:
        """Gains in use and their origin."""
        loop = f"{self.torque_rate:.3g} {self.unit}/s at full opening, {1.0e3 * self.dead_time:.3g} ms late"
        parts = [
            f"{', '.join(gain.text for gain in self.gains if gain.computed == computed)} {origin}"
            for computed, origin in ((False, "(given)"), (True, f"(computed from the device: {loop})"))
            if any(gain.computed == computed for gain in self.gains)
        ]
        without = f"; without the load of {', '.join(self.unknown_loads)}" if self.unknown_loads else ""
        return f"gains: {'; '.join(parts)}{without}"


def settings_of(scenario: Scenario, law: ControllerKind) -> tuple[Quantity, ...]:
    """Return the settings of a scenario's controller, in units of the controlled quantity."""
    return law_settings(law, scenario.controlled)


def terms_of(scenario: Scenario, law: ControllerKind) -> dict[str, LinkFunction]:
    """Return the functions of the device that determine the default gains of a scenario's controller, by name."""
    return loop_terms(scenario.device, law, scenario.motion.motion_kind.sees(scenario), scenario.controlled)


def gains_of(scenario: Scenario, law: ControllerKind) -> Gains | None:
    """Return the gains in use of a scenario's torque controller; None for a controller without such gains."""
    if scenario.controller.is_outside:
        return None
    items = [quantity for quantity in settings_of(scenario, law) if _OF_LOOP.intersection(quantity.follows)]
    if not items:
        return None
    links, terms = scenario.links, terms_of(scenario, law)
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
    # A load moves the chambers of a joint that nothing leads, also of one whose torque is controlled.
    of_joint = any(gain.computed for gain in gains) and not isinstance(scenario.motion, PrescribedMotion)
    loads = [effect.section for effect in effects_of(scenario.device) if load_torque in effect.laws]
    return Gains(gains, rate, late, CONTROLLED[controlled].plain_unit, tuple(loads) if of_joint else ())


def remark_on_following_gains(scenario: Scenario, varied: Collection[str]) -> str:
    """Return a remark on gains computed anew for each value of the varied paths; empty if no gain follows them."""
    gains = None if scenario.law is None else gains_of(scenario, scenario.law)
    if gains is None:
        return ""
    paths = {form for path in varied for form in (path, *other_forms(path))}
    moved = acting(scenario.graph, paths)
    following = [gain for gain in gains.gains if f"controller.{gain.name}" in moved]
    if not following:
        return ""
    options = " ".join(
        f"--set 'controller.{gain.name}={f'{gain.value:.6g} {gain.unit}'.removesuffix(' -').rstrip()}'"
        for gain in following
    )
    names = ", ".join(gain.name for gain in following)
    return (
        f"{scenario.name}: {names} {'is' if len(following) == 1 else 'are'} computed anew from the varied values, as "
        f"if the controller knew them in every run; for the gains of the nominal device: {options}"
    )


def warn_of_following_gains(scenario: Scenario, varied: Collection[str]) -> None:
    """Log the remark on gains that follow varied values, if there is one."""
    if remark := remark_on_following_gains(scenario, varied):
        logger.warning("ppafo: %s", remark)
