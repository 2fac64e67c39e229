"""What a run says of a loop that does not move at all: what holds it, and which setting would set it going."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ppafo.control.angle_loop import ANGLE_STIFFNESS
from ppafo.control.kind import ControllerKind
from ppafo.metrics.metric import extent, followed
from ppafo.model.controlled import ANGLE, CONTROLLED
from ppafo.report.display_units import metric_change
from ppafo.signals import Recording
from ppafo.simulation.oscillation import settings_of
from ppafo.simulation.scenario import Scenario
from ppafo.units.shown import in_units, units_in_force

LEAST_SHARE = 0.01
"""Share of the way that is wanted below which a loop does not move."""
LEAST_WAY = 0.01
"""Way below which nothing is wanted, in sizes of what is controlled (``CONTROLLED``)."""
MARGIN = 1.5
"""Torque that a law should be able to ask for, over the friction that holds the joint."""


@dataclass(frozen=True, slots=True)
class Standstill:
    """A loop that does not move: how far it went and was to go [SI] of what is ``controlled``, and what would help."""

    moved: float
    wanted: float
    remedy: str
    controlled: str
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    @in_units(lambda standstill: standstill.units)
    def sentence(self) -> str:
        """The verdict in one line."""
        kind = CONTROLLED[self.controlled]
        (moved, unit), (wanted, _) = (metric_change(way, kind.difference) for way in (self.moved, self.wanted))
        return f"the {kind.words} loop does not move: {moved:.2g} of {wanted:.3g} {unit} wanted; {self.remedy}"


@in_units(lambda scenario, *_: scenario.device.shown)
def standstill_of(scenario: Scenario, law: ControllerKind, recording: Recording) -> Standstill | None:
    """Return the verdict on a run; None where its loop moves, or where it wants nothing else than it has."""
    if not scenario.follows_reference:
        return None
    wanted, moved = extent(recording), float(np.ptp(followed(recording)[1]))
    if wanted <= LEAST_WAY * CONTROLLED[scenario.controlled].size or moved > LEAST_SHARE * wanted:
        return None
    return Standstill(moved, wanted, _remedy(scenario, law, recording), scenario.controlled)


def _remedy(scenario: Scenario, law: ControllerKind, recording: Recording) -> str:
    """Return what holds the loop, and the setting that would set it going."""
    asked, settings = float(np.max(np.abs(recording["command"]))), scenario.controller.settings
    dead_band = float(scenario.device.valve.settings.get("dead_band", 0.0))
    if asked == 0.0:
        return "its law asks for nothing: its gains are 0, or its dead zone is wider than the error"
    if asked <= dead_band:
        return (
            f"its command of {asked:.2g} at most stays within `valve.dead_band = {dead_band:.2g}`: give a larger gain"
        )
    if scenario.controlled != ANGLE:
        return "its supplies have no other pressure than the chambers: look at `supply.pressure` and `initial`"
    holding = float(scenario.device.friction.static_torque)
    torque, unit = metric_change(holding, "N m")
    held = f"static friction holds the joint with {torque:.3g} {unit}"
    by = {name: quantity for quantity in settings_of(scenario, law) for name in quantity.follows}
    if ANGLE_STIFFNESS not in by:
        return f"{held}, or a stop: look at `supply.pressure`"
    limit, own = float(settings["error_limit"]), float(settings["angle_stiffness"])
    most, _ = metric_change(own * limit, "N m")
    if own * limit > holding:
        return f"{held}, and the law asks for up to {most:.3g}: look at `supply.pressure`"
    enough = MARGIN * holding / limit
    return (
        f"{held}, and the law asks for {most:.3g} at most, `angle_stiffness` times `error_limit`: with "
        f"`angle_stiffness = {enough:.3g} N m/rad` or some `angle_integral` it moves"
    )
