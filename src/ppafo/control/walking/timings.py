"""Gait phase estimators by name, and walking controllers with an exchanged estimator."""

import functools
from dataclasses import replace

from ppafo.control.kind import ControllerKind
from ppafo.control.walking.estimated_timing import ESTIMATED
from ppafo.control.walking.fractional_timing import FRACTIONAL
from ppafo.control.walking.timing import THRESHOLDS, TimingKind, TimingParts
from ppafo.errors import ScenarioError
from ppafo.kinds import Kinds
from ppafo.model.binding import frame_of, made_of, parts_of
from ppafo.model.declaration import row_with

TIMINGS: Kinds[TimingKind] = Kinds(
    "ppafo.walking_timings",
    "timing of walking",
    TimingKind,
    {kind.name: kind for kind in (THRESHOLDS, FRACTIONAL, ESTIMATED)},
)
"""Methods of estimating the gait phase. Every controller uses the first one by default."""


def keeps_time(kind: ControllerKind) -> bool:
    """Return whether a walking controller uses a gait phase, so that its timing can be chosen."""
    return "clock" in getattr(kind.initial, "_fields", ())


@functools.cache
def with_timing(kind: ControllerKind, timing: TimingKind) -> ControllerKind:
    """Return a walking controller with another estimation of the gait phase.

    The functions, settings and state of ``timing`` replace those of ``THRESHOLDS``. Raises ScenarioError if the
    controller uses no gait phase.
    """
    if timing is THRESHOLDS:
        return kind
    if not keeps_time(kind):
        raise ScenarioError(f"controller '{kind.name}' uses no gait phase; omit timing.kind")
    usual_state = type(kind.initial)
    # One class for each pair of controller and timing, named after both: exported C has structs of these names.
    title = timing.name.capitalize()
    state = row_with(f"{usual_state.__name__}{title}", usual_state, clock=type(timing.initial))
    parameters = row_with(f"{kind.parameters.__name__}{title}", kind.parameters, timing=timing.parameters)
    frame = frame_of(kind.update)
    parts = parts_of(kind.update)._replace(timing=TimingParts(timing.follow, timing.gait_time), state=state)
    return replace(
        kind,
        quantities=(*kind.quantities, *timing.quantities),
        parameters=parameters,
        initial=state(**kind.initial._asdict() | {"clock": timing.initial}),
        update=made_of(frame.function if frame else kind.update, f"update_{kind.name}_{timing.name}", parts),
    )
