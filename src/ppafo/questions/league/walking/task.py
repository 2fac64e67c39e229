"""The walking task: one wearer, gait and device, a desired torque in push-off, and toes that must clear the ground."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ppafo.control.walking.assistance import PUSH_OFF_QUANTITIES, TorqueProfile
from ppafo.control.walking.catalog import WALKING_CONTROLLERS, keeps_time
from ppafo.control.walking.phases import PHASE_QUANTITIES
from ppafo.control.walking.signs import SAFETY_QUANTITIES
from ppafo.errors import ScenarioError, nearest_name, one_line
from ppafo.parameters.overrides import over, split_override
from ppafo.simulation.declaration import PERIOD, RATE
from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import check_led, walk_of
from ppafo.walking.walk import lasting

CONFIGURATION = "proportional"
MINUTES = 0.2
SHORTEST, LONGEST = 0.1, 1.0
"""Minutes: enough strides to learn from, and few enough to record every sample of."""
PROFILE_KIND, PROFILE_VALVE = "event_proportional", "proportional"
"""The controller whose settings say what is desired, on the valve that suits it; every other gets the same."""
SWING_ANGLE = "swing_angle"
DESIRED = "desired"
"""Section of the overrides that change what is desired; ``controller`` only changes what the controllers are told."""
COMMON = (*PUSH_OFF_QUANTITIES, *PHASE_QUANTITIES, *SAFETY_QUANTITIES, RATE, PERIOD)
SHORTEST_PUSH_OFF = 0.1
"""Fraction of the stride that there must be between the first torque and toe-off, also of a gait that is drawn."""
_PUSH_OFF = tuple(f"controller.{item.name}" for item in PUSH_OFF_QUANTITIES)
_OWN = ("controller.kind", "device.valve")


@dataclass(frozen=True, slots=True)
class WalkingTask:
    """What every entrant has to do: a walk file by name or path with overrides, another gait or None, the profile.

    ``profile`` is judged at the true events of the gait and no controller moves it; ``told`` is what they are told,
    the same unless an override of ``controller`` says otherwise. ``seconds`` of walking; the second half of the
    strides counts.
    """

    file: str
    gait: str | None
    overrides: tuple[str, ...]
    profile: TorqueProfile
    seconds: float
    told: TorqueProfile

    def overrides_for(self, kind: str, valve: str, own: Sequence[str] = ()) -> tuple[str, ...]:
        """Overrides of the walk file that put a controller and a valve in, with what it is told and its ``own``."""
        known = {item.name for item in (*WALKING_CONTROLLERS[kind].quantities, RATE, PERIOD)}
        wanted = [
            _override_text(item.name, item.unit, value)
            for item, value in zip(PUSH_OFF_QUANTITIES, self.told, strict=True)
        ]
        every = over(wanted, self.overrides, ScenarioError)
        paths = [split_override(text).typed.partition(".") for text in every]
        has_time = keeps_time(WALKING_CONTROLLERS[kind])
        kept = [
            text
            for text, (section, _, name) in zip(every, paths, strict=True)
            if (section != "controller" or name in known) and (section != "timing" or has_time)
        ]
        return over((f"controller.kind={kind}", f"device.valve={valve}", *kept), own, ScenarioError)

    def configuration(self, kind: str, valve: str, own: Sequence[str] = ()) -> Scenario:
        """The walk of one controller on one valve; ScenarioError or ParameterError where it cannot be."""
        return load_walk(self.file, self.overrides_for(kind, valve, own), self.gait)


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
    own = [override for override in overrides if not _is_desired(override)]
    desired = [override.replace(DESIRED, "controller", 1) for override in overrides if _is_desired(override)]
    for_all = [override for override in own if split_override(override).typed not in _PUSH_OFF]
    judged = _with_profile(file, [*for_all, *desired], gait)
    told = _with_profile(file, over(desired, own, ScenarioError), gait)
    check_led(judged, "a league")
    if walk_of(judged).course is not None:
        raise ScenarioError(f"{file}: course: a league compares equal strides; leave the course away")
    if walk_of(judged).bottle is not None:
        raise ScenarioError(f"{file}: bottle: a league compares strides at one supply pressure; leave the bottle away")
    profile, told_profile = (
        TorqueProfile(**{name: walk.control.settings[name] for name in TorqueProfile._fields})
        for walk in (judged, told)
    )
    if profile.peak_torque <= 0.0:
        raise ScenarioError("desired.peak_torque: a league needs a desired torque; give one above 0 N m")
    latest = walk_of(judged).gait.stance_share - SHORTEST_PUSH_OFF
    if profile.peak_time - profile.rise_time > latest:
        raise ScenarioError(
            f"desired.peak_time: the torque begins at {profile.peak_time - profile.rise_time:g} of the stride, "
            f"too late for a push-off that ends at {walk_of(judged).gait.stance_share:g}; at most {latest:g}"
        )
    seconds = lasting(judged, minutes).duration
    return WalkingTask(str(file), None if gait is None else str(gait), tuple(own), profile, seconds, told_profile)


def _with_profile(file: str | Path, overrides: Sequence[str], gait: str | Path | None) -> Scenario:
    """Return the walk of the controller whose settings say what torque is wanted."""
    return load_walk(file, [f"controller.kind={PROFILE_KIND}", f"device.valve={PROFILE_VALVE}", *overrides], gait)


def _is_desired(override: str) -> bool:
    return split_override(override, ScenarioError).typed.startswith(f"{DESIRED}.")


def _check(override: str) -> None:
    path, _ = split_override(override, ScenarioError)
    section, _, name = path.partition(".")
    wanted = [item.name for item in PUSH_OFF_QUANTITIES]
    if section == DESIRED and name not in wanted:
        hint = nearest_name(name, wanted)
        raise ScenarioError(f"override '{one_line(override)}': no '{name}' is desired{hint}; {', '.join(wanted)} are")
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
