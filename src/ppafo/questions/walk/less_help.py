"""What the answer of a walk says of less help: what is fitted for safety, pauses and stops, and the walk over time."""

from ppafo.answers import Figure, Section
from ppafo.simulation.scenario import Scenario
from ppafo.walking.events import event_lines
from ppafo.walking.figures.over_time import failures, over_time_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult

_OVER_TIME = (
    "Gas, toes and phases over the whole walk. The strip at the bottom shows where the controller helps, only lifts "
    "the foot, pauses or has stopped. A red line is where there is less help, a dashed one where something fails."
)
_OF_LEGS = (
    " Gas is that of both devices, and so are the lines on it; each leg has a strip. Toes and phases are those of the "
    "left leg."
)


def safety_remarks(worn: WalkResult) -> list[str]:
    """Return what is fitted for safety, the pauses, the stop and the returns of help, and how many strides had help."""
    fitted = _shut_off_line(worn.scenario)
    if not worn.events:
        return fitted
    helped, strides = int(worn.helped.sum()), worn.helped.size
    counted = (
        [f"help in {helped} of {strides} strides{'' if worn.is_helped else ': fewer than half'}"] if strides else []
    )
    return [*fitted, *event_lines(worn.events), *counted]


def _shut_off_line(scenario: Scenario) -> list[str]:
    """Return what a fitted shut-off valve weighs and takes."""
    given = walk_of(scenario).shut_off
    if not given:
        return []
    mass, power = 1.0e3 * float(given["mass"]), float(given["power"])
    where = "on each leg a shut-off valve" if walk_of(scenario).devices > 1 else "shut-off valve"
    return [f"{where}: {mass:.0f} g, {power:.2g} W as long as the device helps ({60.0 * power:.0f} J a minute)"]


def over_time_sections(worn: WalkResult) -> tuple[Section, ...]:
    """Return the walk over time, where something happened in it."""
    if not worn.events and not failures(worn.scenario):
        return ()
    caption = _OVER_TIME + (_OF_LEGS if walk_of(worn.scenario).devices > 1 else "")
    figure = Figure("over-time", caption, lambda: over_time_figure(worn))
    return (Section("The walk over time", figure=figure, is_detail=True),)
