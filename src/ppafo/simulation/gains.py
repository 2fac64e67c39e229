"""Controller gains in use in a run, and their origin."""

import logging
from collections.abc import Collection
from dataclasses import dataclass
from functools import partial

from ppafo.control.angle_loop import LIGHT, lightness
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import TorqueLoop
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.ports import load_torque
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import Asked, acting
from ppafo.parameters.overrides import other_forms
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.default_gains import SLOPE_GAINS, is_gain, loop_parts
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import PrescribedMotion, Scenario
from ppafo.units.shown import in_units, shown_text, written_text
from ppafo.wording import override_text, subject_text

logger = logging.getLogger("ppafo")


@dataclass(frozen=True, slots=True)
class _Gain:
    """Controller gain in use: name, unit and value [SI]; ``computed`` if derived from the device, otherwise given."""

    name: str
    unit: str
    value: float
    computed: bool


@dataclass(frozen=True, slots=True)
class Gains:
    """Controller gains in use, with the loop parameters from which they are computed.

    ``torque_rate`` is the rate of the controlled quantity at full valve opening [``unit``/s]; ``dead_time`` is the dead
    time of the loop [s].
    """

    gains: tuple[_Gain, ...]
    torque_rate: float
    dead_time: float
    unit: str = "N m"
    unknown_loads: tuple[str, ...] = ()
    """Effects that load a movable joint and are not included in the computed gains."""
    lightness: float = 0.0
    """Dead time times the frequency of the joint on its gas [-]; 0 for a law without a torque loop inside."""

    @property
    def sentence(self) -> str:
        """Gains in use and their origin."""
        loop = f"{self.torque_rate:.3g} {self.unit}/s at full opening, dead time {1.0e3 * self.dead_time:.3g} ms"
        parts = []
        for computed, origin in ((False, "(given)"), (True, f"(computed from the device: {loop})")):
            gains = [gain for gain in self.gains if gain.computed == computed]
            texts = [f"{gain.name} {shown_text(gain.value, gain.unit, '.3g')}" for gain in gains]
            parts += [f"{', '.join(texts)} {origin}"] if texts else []
        without = f"; the load of {', '.join(self.unknown_loads)} is not included" if self.unknown_loads else ""
        light = f"; friction alone keeps the joint still: theta sqrt(S/I) = {self.lightness:.2g}, above {LIGHT:g}"
        return f"gains: {'; '.join(parts)}{without}{light if self.lightness > LIGHT else ''}"


def loop_of(scenario: Scenario, law: ControllerKind) -> TorqueLoop:
    """Return the loop that a law closes in a scenario, from which its default gains are computed."""
    loop: TorqueLoop = loop_parts(scenario, law).group("loop", Asked(partial(number_at, scenario)), {})
    return loop


def gains_of(scenario: Scenario) -> Gains | None:
    """Return the gains in use of a scenario's torque controller; None for a controller without such gains."""
    law = scenario.law
    if law is None or scenario.controller.is_outside:
        return None
    settings = scenario.controller.settings
    items = [
        quantity
        for quantity in law_settings(law, scenario.controlled)
        if is_gain(quantity) or (quantity.name in SLOPE_GAINS and settings[quantity.name])
    ]
    if not items:
        return None
    parts = loop_parts(scenario, law)
    asked = Asked(partial(number_at, scenario))
    loop: TorqueLoop = parts.group("loop", asked, {})
    light = 0.0 if parts.controls_torque else lightness(loop, parts.group("joint", asked, {}))
    gains = tuple(
        _Gain(item.name, item.unit, float(settings[item.name]), f"controller.{item.name}" in scenario.links)
        for item in items
    )
    controlled = scenario.controlled if TORQUE in law.controls else TORQUE
    # A load moves the chambers of a joint that nothing leads, also of one whose torque is controlled.
    of_joint = any(gain.computed for gain in gains) and not isinstance(scenario.motion, PrescribedMotion)
    loads = [effect.section for effect in effects_of(scenario.device) if load_torque in effect.laws]
    return Gains(
        gains,
        loop.rate,
        loop.dead_time,
        CONTROLLED[controlled].plain_unit,
        unknown_loads=tuple(loads) if of_joint else (),
        lightness=light,
    )


@in_units(lambda scenario, _varied: scenario.device.shown)
def remark_on_following_gains(scenario: Scenario, varied: Collection[str]) -> str:
    """Return a remark on controller settings computed anew for each value of the varied paths; "" if none follows."""
    law = scenario.law
    if law is None or scenario.controller.is_outside:
        return ""
    paths = {form for path in varied for form in (path, *other_forms(path))}
    moved = acting(scenario.graph, paths)
    # Beside the gains what a controller knows of valve and friction, such as the dead band.
    following = [item for item in law_settings(law, scenario.controlled) if f"controller.{item.name}" in moved]
    if not following:
        return ""
    settings = scenario.controller.settings
    options = override_text(
        f"controller.{item.name}={written_text(float(settings[item.name]), item.unit)}" for item in following
    )
    names = ", ".join(item.name for item in following)
    return (
        f"{subject_text(scenario.name)}: {names} {'is' if len(following) == 1 else 'are'} recomputed from the "
        f"varied values, as if the controller knew them in every run; for the nominal gains give {options}"
    )


def warn_of_gains(scenario: Scenario, varied: Collection[str]) -> None:
    """Log the remarks on gains that follow varied values, and on numbers kept from another kind or set, if any."""
    kept = scenario.origin.replaced and f"{subject_text(scenario.name)}: {scenario.origin.replaced}"
    for remark in filter(None, (remark_on_following_gains(scenario, varied), kept)):
        logger.warning("ppafo: %s", remark)
