"""Walks of one wearer with and without the device, or of many wearers."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.endurance.solve import endurance_of_walk
from ppafo.questions.walk.answer import WalkPair, Wearers
from ppafo.questions.walk.volumes import walks_by_volume, wearers_by_volume
from ppafo.simulation.scenario import Scenario
from ppafo.walking import course as courses
from ppafo.walking.loading import FILE, load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import compare_walks

_LONG = 12.0
"""Minutes above which a walk reports how far it is."""


def walk_with_and_without(
    configuration: Scenario | str | Path,
    minutes: float | None = None,
    gait: str | Path | None = None,
    course: str | Path | None = None,
    bottle: str | Path | None = None,
    wearers: int | None = None,
    seed: int = 1,
    overrides: Sequence[str] = (),
    progress: Report | None = None,
) -> WalkPair | Wearers:
    """Walk with the device, with it switched off, and beside the healthy gait; or let many wearers walk with it.

    ``configuration`` is a walk file, its name or a loaded one; ``minutes`` the length of the walk [min], one or
    that of its course unless given; ``gait``, ``course`` and ``bottle`` stand in place of those of the configuration;
    ``wearers`` the number of different wearers, drawn with ``seed``. ScenarioError for bad input; a walk that diverges
    is an answer that has not passed.
    """
    chosen = configuration
    if not isinstance(chosen, Scenario):
        chosen = load_walk(chosen, overrides, gait, course, bottle)
    report = progress or report_nothing
    if wearers is not None:
        advance = _reporter(report, "walking", "wearers", 0.0)
        return Wearers(*wearers_by_volume(chosen, minutes, wearers, seed, advance))
    comparison = compare_walks(chosen, minutes, _reporter(report, "walking", "min", _LONG))
    life = endurance_of_walk(comparison.with_device) if walk_of(chosen).bottle is None else None
    return WalkPair(comparison, life, walks_by_volume(comparison.with_device, life, minutes))


def list_files() -> list[dict[str, Any]]:
    """Return the walks and the courses that come with the package: name, what it is, description."""
    found = []
    for library in (FILE, courses.FILE):
        files = {name: library.parse(library.read(name), name) for name in library.names()}
        found += [
            {"name": name, "kind": library.noun, "description": str(file.get("description", ""))}
            for name, file in files.items()
        ]
    return found


def default_folder(values: Mapping[str, Any]) -> Path:
    """Return where the command writes by default: by the name of the configuration."""
    configuration = load_walk(
        values["configuration"], values["overrides"], values["gait"], values["course"], values["bottle"]
    )
    walked, bottled = walk_of(configuration).course, walk_of(configuration).bottle
    along = ("" if walked is None else f"-{walked.name}") + ("" if bottled is None else f"-{bottled.bottle.name}")
    return Path("out") / f"{'walk' if values['wearers'] is None else 'wearers'}-{configuration.name}{along}"


def _reporter(report: Report, activity: str, noun: str, above: float) -> "Any":
    def forward(done: float, total: float) -> None:
        if total > above:
            report(Progress(activity, round(done), round(total), noun=noun))

    return forward
