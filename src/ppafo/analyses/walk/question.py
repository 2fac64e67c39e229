"""Command ``walk``: walking with the device, without it, and healthy; default output folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Gait, Minutes, Overrides, Word, checked
from ppafo.progress import Progress, Report

if TYPE_CHECKING:
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario


@checked
def walk_with_and_without(
    scenario: Annotated[Scenario | str | Path, Word("WALK")] = "solenoid",
    *,
    gait: Gait | None = None,
    bottle: Annotated[str | Path, Word("BOTTLE")] | None = None,
    minutes: Minutes | None = None,
    check: bool = False,
    overrides: Overrides = (),
    progress: Report | None = None,
) -> Finding[Any]:
    """Simulate walking with the device, without it, and healthy.

    Raises ScenarioError for bad input. The finding has not passed if a walk diverges or, with ``check``, if the torque
    does not follow its request.

    scenario: name of a walk configuration, or a .toml file; default solenoid
    gait: name of a gait, or a gait file; default: the gait of the configuration
    bottle: supply the device from a bottle: a name ('ppafo bottle --list') or a .toml file; the walk ends with it
    minutes: time to walk; default 1, up to 10 on a bottle
    check: end with exit code 1 where the torque does not follow what is requested

    >>> print(walk_with_and_without("solenoid", minutes=0.1).said[0])
    solenoid: completed, 4 strides of falisse2019-subject1
    """
    from dataclasses import replace

    from ppafo.analyses.walk.answer import finding_of
    from ppafo.simulation.scenario import Scenario
    from ppafo.simulation.tracking.verdict import NOTHING_TO_FOLLOW
    from ppafo.walking.loading import check_duration_once, load_walk
    from ppafo.walking.walk import compare_walks

    chosen = scenario
    # The options of the command line belong to a file: a scenario that was built has all of it already.
    if not isinstance(chosen, Scenario):
        check_duration_once(overrides, minutes)
        chosen = load_walk(chosen, overrides, gait=gait, bottle=bottle)

    def report_minutes(done: float, total: float) -> None:
        # A shorter walk ends before a report of whole minutes says anything.
        if progress is not None and total > 12.0:
            progress(Progress("walking", round(done), round(total), noun="min"))

    comparison = compare_walks(chosen, minutes=minutes, progress=report_minutes)
    finding = finding_of(comparison)
    tracking = finding.found["tracking"]
    follows = tracking["follows"] or tracking["reason"] in NOTHING_TO_FOLLOW
    return replace(finding, passed=finding.passed and follows) if check else finding


def default_folder(values: Mapping[str, Any]) -> Path:
    """Return the default output folder of the command, named after the configuration."""
    from ppafo.walking.loading import load_walk
    from ppafo.walking.motion import walk_of

    configuration = load_walk(values["scenario"], values["overrides"], gait=values["gait"], bottle=values["bottle"])
    bottled = walk_of(configuration).bottle
    along = "" if bottled is None else f"-{bottled.bottle.name}"
    return Path("out") / f"walk-{configuration.name}{along}"
