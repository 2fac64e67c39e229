"""Ways to know the gait phase by name, and a controller of walking with another way than its own."""

import functools
from dataclasses import replace

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance
from ppafo.control.walking.estimated_timing import ESTIMATED
from ppafo.control.walking.timing import FRACTIONAL, THRESHOLDS, TimingKind
from ppafo.errors import ScenarioError
from ppafo.kinds import Kinds
from ppafo.model.binding import bind
from ppafo.model.declaration import row_with

TIMINGS: Kinds[TimingKind] = Kinds(
    "ppafo.walking_timings",
    "timing of walking",
    TimingKind,
    {kind.name: kind for kind in (THRESHOLDS, FRACTIONAL, ESTIMATED)},
)
"""The ways to know the gait phase. Every controller has the first one unless another is chosen."""


def keeps_time(kind: ControllerKind) -> bool:
    """Return whether a walking controller uses a gait phase, so that its timing can be chosen."""
    return "clock" in getattr(kind.initial, "_fields", ())


@functools.cache
def with_timing(kind: ControllerKind, timing: TimingKind) -> ControllerKind:
    """Return a controller of walking that knows the gait phase in another way.

    Its law is composed anew: where it asked for the phase of ``THRESHOLDS`` it asks for that of ``timing``, whose
    settings and state its own then have. ScenarioError if it uses no gait phase.
    """
    if timing is THRESHOLDS:
        return kind
    if not keeps_time(kind):
        raise ScenarioError(f"controller '{kind.name}' uses no gait phase: timing.kind cannot be given")
    usual_state = type(kind.initial)
    # One class for each pair of controller and timing, named after both: exported C has structs of these names.
    title = timing.name.capitalize()
    state = row_with(f"{usual_state.__name__}{title}", usual_state, clock=type(timing.initial))
    parameters = row_with(f"{kind.parameters.__name__}{title}", kind.parameters, timing=timing.parameters)
    asked = {"follow_thresholds": timing.follow, "threshold_time": timing.gait_time}
    timed_phase = {"timed_phase": bind(assistance.timed_phase, f"timed_phase_{timing.name}", asked)}
    assess = {"assess": bind(assistance.assess, f"assess_{timing.name}", timed_phase)}
    # Where the frame makes its state, it must make the class with the other clock.
    states = {name: state for name, value in kind.update.__globals__.items() if value is usual_state}
    return replace(
        kind,
        quantities=(*kind.quantities, *timing.quantities),
        parameters=parameters,
        initial=state(**kind.initial._asdict() | {"clock": timing.initial}),
        update=bind(kind.update, f"update_{kind.name}_{timing.name}", timed_phase | assess | states),
    )
