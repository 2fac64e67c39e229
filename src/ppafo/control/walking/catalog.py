"""Every controller of walking by name.

A torque law of ``control.catalog`` walks by its own name, with no line here; a line gives it gains for walking. A law
with ideas of its own of the phases is a module of this folder with a KIND, listed here: its ``update`` watches the
sensors with ``safety.monitor`` and passes its command through ``safety.safe_command``.
"""

import functools
from dataclasses import dataclass, replace

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers import feedback, model_based, switching
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, event_on_off, learning, torque_law
from ppafo.control.walking.estimated_timing import ESTIMATED
from ppafo.control.walking.timing import FRACTIONAL, THRESHOLDS, TimingKind
from ppafo.control.walking.torque_law import bind, row_with, shared_settings, walking_law
from ppafo.errors import ScenarioError
from ppafo.kinds import Kinds


@dataclass(frozen=True, slots=True)
class Walking:
    """A torque law with gains for walking, in SI units, and what follows the torque profiles, in words."""

    law: ControllerKind
    following: str
    gains: tuple[tuple[str, float], ...] = ()


LAWS = (
    Walking(
        switching.ON_OFF_DEAD_ZONE,
        "on/off switching with a dead zone",
        (("dead_zone", 0.21), ("release", 0.031), ("opening", 0.77)),
    ),
    Walking(torque_law.PROPORTIONAL, "proportional and integral action"),
    Walking(
        feedback.PID,
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
        model_based.PID_FEEDFORWARD,
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
        feedback.SLIDING_MODE,
        "a sliding mode law with a boundary layer",
        (("surface_slope", 71.0), ("boundary_layer", 0.35), ("reaching_command", 0.78)),
    ),
    Walking(
        model_based.FEEDBACK_LINEARISATION,
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
    event_on_off.EVENT_ON_OFF,
    *(_EVENT_BASED[name] for name in ("on_off_dead_zone", "proportional", "pid", "pid_feedforward", "sliding_mode")),
    learning.KIND,
    _EVENT_BASED["feedback_linearisation"],
    event_on_off.OFF,
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
    laws = {
        name: law for name, law in CONTROLLERS.items() if law is not switching.CONSTANT and not shared_settings(law)
    }
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


TIMINGS: Kinds[TimingKind] = Kinds(
    "ppafo.walking_timings",
    "timing of walking",
    TimingKind,
    (THRESHOLDS, FRACTIONAL, ESTIMATED),
)
"""The ways to know the time in the stride. The first one is that of every controller unless another is chosen."""


def keeps_time(kind: ControllerKind) -> bool:
    """Tell whether a controller of walking goes by a time in the stride that can be known in several ways."""
    return "clock" in getattr(kind.initial, "_fields", ())


@functools.cache
def with_timing(kind: ControllerKind, timing: TimingKind) -> ControllerKind:
    """Return a controller of walking that knows the time in the stride in another way; ScenarioError if it has none."""
    if timing is THRESHOLDS:
        return kind
    if not keeps_time(kind):
        raise ScenarioError(f"controller '{kind.name}' goes by no time in the stride: timing.kind cannot be given")
    name, before = f"{kind.name}_{timing.name}", type(kind.initial)
    title = timing.name.capitalize()
    state = row_with(f"{before.__name__}{title}", before, clock=type(timing.initial))
    parameters = row_with(f"{kind.parameters.__name__}{title}", kind.parameters, timing=timing.parameters)
    own = {"follow_thresholds": timing.follow, "threshold_time": timing.gait_time}
    timed = {"timed_phase": bind(assistance.timed_phase, f"timed_phase_{timing.name}", own)}
    pieces = timed | {"assess": bind(assistance.assess, f"assess_{timing.name}", timed)}
    made = {word: state for word, value in kind.update.__globals__.items() if value is before}
    return replace(
        kind,
        quantities=(*kind.quantities, *timing.quantities),
        parameters=parameters,
        initial=state(**kind.initial._asdict() | {"clock": timing.initial}),
        update=bind(kind.update, f"update_{name}", pieces | made),
    )
