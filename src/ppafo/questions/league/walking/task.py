"""The walking task: one wearer, gait and device, a desired torque in push-off, and toes that must clear the ground."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.control.walking.declaration import PHASE_QUANTITIES, PUSH_OFF_QUANTITIES, SAFETY_QUANTITIES
from ppafo.control.walking.torque_profile import TorqueProfile
from ppafo.errors import ScenarioError, nearest_name, one_line
from ppafo.simulation.declaration import PERIOD, RATE
from ppafo.simulation.overriding import split_override
from ppafo.walking.configuration import Configuration
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import walk_duration

CONFIGURATION = "proportional"
MINUTES = 0.2
SHORTEST, LONGEST = 0.1, 1.0
"""Minutes: enough strides to learn from, and few enough to record every sample of."""

PROFILE_KIND, PROFILE_VALVE = "event_proportional", "proportional"
"""The controller whose settings say what is desired, on the valve that suits it; every other gets the same."""
SWING_ANGLE = "swing_angle"
COMMON = (*PUSH_OFF_QUANTITIES, *PHASE_QUANTITIES, *SAFETY_QUANTITIES, RATE, PERIOD)
SHORTEST_PUSH_OFF = 0.1
"""Fraction of the stride that there must be between the first torque and toe-off, also of a gait that is drawn."""
_OWN = ("controller.kind", "device.valve")


@dataclass(frozen=True, slots=True)
class WalkingTask:
    """What every entrant has to do: a walk file by name or path with overrides, another gait or None, the profile.

    ``seconds`` of walking; the second half of the strides counts.
    """

    file: str
    gait: str | None
    overrides: tuple[str, ...]
    profile: TorqueProfile
    seconds: float

    def overrides_for(self, kind: str, valve: str) -> tuple[str, ...]:
        """Overrides of the walk file that put a controller and a valve in, with what is desired."""
        known = {item.name for item in (*WALKING_CONTROLLERS[kind].quantities, RATE, PERIOD)}
        wanted = [
            _override_text(item.name, item.unit, value)
            for item, value in zip(PUSH_OFF_QUANTITIES, self.profile, strict=True)
        ]
        paths = [split_override(text)[0].partition(".") for text in (*wanted, *self.overrides)]
        kept = [
            text
            for text, (section, _, name) in zip((*wanted, *self.overrides), paths, strict=True)
            if section != "controller" or name in known
        ]
        return (f"controller.kind={kind}", f"device.valve={valve}", *kept)

    def configuration(self, kind: str, valve: str) -> Configuration:
        """The walk of one controller on one valve; ScenarioError or ParameterError where it cannot be."""
        return load_walk(self.file, self.overrides_for(kind, valve), self.gait)


def walking_task(
    file: str | Path = CONFIGURATION,
    overrides: Sequence[str] = (),
    gait: str | Path | None = None,
    minutes: float = MINUTES,
) -> WalkingTask:
    """The task of a walk file; overrides of the controller may be those that all of them know.

    ScenarioError or ParameterError for bad input.
    """
    if not SHORTEST <= minutes <= LONGEST:
        raise ScenarioError(f"{minutes:g} minutes: a league can walk for {SHORTEST:g} to {LONGEST:g} minutes")
    for override in overrides:
        _check(override)
    judged = load_walk(file, [f"controller.kind={PROFILE_KIND}", f"device.valve={PROFILE_VALVE}", *overrides], gait)
    profile = TorqueProfile(**{name: judged.settings[name] for name in TorqueProfile._fields})
    if profile.peak_torque <= 0.0:
        raise ScenarioError("controller.peak_torque: a league needs a desired torque; give one above 0 N m")
    latest = judged.gait.stance_share - SHORTEST_PUSH_OFF
    if profile.peak_time - profile.rise_time > latest:
        raise ScenarioError(
            f"controller.peak_time: the torque begins at {profile.peak_time - profile.rise_time:g} of the stride, "
            f"too late for a push-off that ends at {judged.gait.stance_share:g}; at most {latest:g}"
        )
    seconds = walk_duration(judged, minutes)
    return WalkingTask(str(file), None if gait is None else str(gait), tuple(overrides), profile, seconds)


def _check(override: str) -> None:
    path, _ = split_override(override)
    section, _, name = path.partition(".")
    if path in _OWN:
        raise ScenarioError(f"override '{one_line(override)}': every controller of the league has its own")
    common = [item.name for item in COMMON] + [SWING_ANGLE]
    if section == "controller" and name not in common:
        hint = nearest_name(name, common)
        raise ScenarioError(
            f"override '{one_line(override)}': not all controllers have '{name}'{hint}; all have {', '.join(common)}"
        )


def _override_text(name: str, unit: str, value: float) -> str:
    return f"controller.{name}={value!r}{'' if unit == '1' else f' {unit}'}"
