"""Every controller of walking by name.

A torque law of ``control.catalog`` walks by its own name, with no line here; a line gives it gains for walking. A law
with ideas of its own of the phases is a module of this folder with a KIND, listed here: its ``update`` watches the
sensors with ``safety.monitor`` and passes its command through ``safety.safe_command``.
"""

from dataclasses import dataclass

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers import (
    constant,
    feedback_linearisation,
    on_off_dead_zone,
    pid,
    pid_feedforward,
    sliding_mode,
)
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import event_damped_learning, event_on_off, off, proportional
from ppafo.control.walking.torque_law import shared_settings, walking_law
from ppafo.kinds import Kinds


@dataclass(frozen=True, slots=True)
class Walking:
    """A torque law with gains for walking, in SI units, and what follows the torque profiles, in words."""

    law: ControllerKind
    following: str
    gains: tuple[tuple[str, float], ...] = ()


LAWS = (
    Walking(
        on_off_dead_zone.KIND,
        "on/off switching with a dead zone",
        (("dead_zone", 0.21), ("release", 0.031), ("opening", 0.77)),
    ),
    Walking(proportional.KIND, "proportional and integral action"),
    Walking(
        pid.KIND,
        "a PID with anti-windup",
        (
            ("proportional_gain", 1.5),
            ("integral_gain", 100.0),
            ("derivative_gain", 0.033),
            ("derivative_filter", 0.0023),
            ("anti_windup", 97.0),
        ),
    ),
    Walking(
        pid_feedforward.KIND,
        "a PID and the inverse of a valve model",
        (
            ("proportional_gain", 1.2),
            ("integral_gain", 53.0),
            ("derivative_gain", 0.02),
            ("derivative_filter", 0.0012),
            ("anti_windup", 34.0),
        ),
    ),
    Walking(
        sliding_mode.KIND,
        "a sliding mode law with a boundary layer",
        (("surface_slope", 71.0), ("boundary_layer", 0.35), ("reaching_command", 0.78)),
    ),
    Walking(
        feedback_linearisation.KIND,
        "inverting the chamber dynamics",
        (("convergence_rate", 91.0), ("rate_filter", 0.0018)),
    ),
)
"""Gains found with ``python scripts/walking_gains.py event_pid``, and so on for the others."""


def _event_based(item: Walking) -> ControllerKind:
    summary = f"Event-based torque profiles for each phase, tracked by {item.following}."
    return walking_law(item.law, f"event_{item.law.name}", summary, item.gains)


_EVENT_BASED = {item.law.name: _event_based(item) for item in LAWS}
_ORDER = (
    event_on_off.KIND,
    *(_EVENT_BASED[name] for name in ("on_off_dead_zone", "proportional", "pid", "pid_feedforward", "sliding_mode")),
    event_damped_learning.KIND,
    _EVENT_BASED["feedback_linearisation"],
    off.KIND,
)

WALKING_CONTROLLERS: Kinds[ControllerKind] = Kinds(
    "ppafo.walking_controllers", "controller of walking", ControllerKind, _ORDER
)
"""Those with gains for walking, which compete with each other."""


def walking_controllers() -> dict[str, ControllerKind]:
    """Return all that a walk file can name: those with gains for walking, and every torque law by its own name.

    A law that has gains for walking has them under its own name too: ``pid`` is ``event_pid``. A constant command
    follows no torque and does not walk, nor does a law whose settings have names that walking has taken.
    """
    laws = {name: law for name, law in CONTROLLERS.items() if law is not constant.KIND and not shared_settings(law)}
    return dict(WALKING_CONTROLLERS) | {name: law_that_walks(law) for name, law in laws.items()}


def load_walking_controller(name: str) -> None:
    """Load a controller of another package by its name, so that ``walking_controllers`` has it; KindError if broken."""
    if WALKING_CONTROLLERS.get(name) is None:
        CONTROLLERS.get(name)


def law_that_walks(law: ControllerKind) -> ControllerKind:
    """Return any torque law as a controller of walking, with its gains for walking where the catalogue has some."""
    if law.name in _EVENT_BASED and CONTROLLERS.get(law.name) is law:
        return _EVENT_BASED[law.name]
    summary = f"Torque profiles for each phase, tracked by the law {law.name} with its own gains."
    return walking_law(law, law.name, summary, ())
