"""What a search of reflexes is about: the walk, whose gains, the speed to aim at, and how long it goes on."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import StudyError
from ppafo.loading import scenario_or_load
from ppafo.model.wearer.reflexes import Gains
from ppafo.simulation.scenario import Scenario, scenario_document
from ppafo.studies.study import with_overrides
from ppafo.version import __version__
from ppafo.walking.motion import WalkMotion
from ppafo.walking.reacting_wearer import GAINS, START_SPEED, ReactingWearer

Floats = NDArray[np.float64]

WALK = "reacting"
"""The walk that is taken where none is named."""

START_PATH = f"wearer.{START_SPEED.name}"
STARTS = (0.9, 1.1)
"""Start speeds of each candidate over the speed to aim at: who walks from one of them only is no walker."""

FRESH_STARTS = tuple(np.linspace(0.85, 1.15, 8).tolist())
"""Start speeds from which what was found is judged, none of them one of the search."""

STEP, LEAST_STEP = 0.1, 2.0e-3
"""First standard deviation of a gain, as a share of it, and the least one."""

MOST_GENERATIONS, LARGEST_POPULATION = 10_000, 1_000


@dataclass(frozen=True, slots=True)
class Search:
    """What is searched: the walk, its wearer, the gains by group of paths, the speed to aim at [m/s], and how long."""

    scenario: Scenario
    wearer: ReactingWearer
    groups: tuple[tuple[str, ...], ...]
    before: Floats
    speed: float
    restarts: int
    generations: int
    population: int
    seed: int
    adapts: str

    @property
    def scale(self) -> Floats:
        """First standard deviations (gains,)."""
        return np.maximum(STEP * np.abs(self.before), LEAST_STEP)

    def columns(self, gains: Floats) -> dict[str, Floats]:
        """The values by path (candidates,) of candidates (candidates, gains)."""
        return {path: gains[:, number] for number, paths in enumerate(self.groups) for path in paths}

    def document(self) -> dict[str, Any]:
        """What must be the same for a search to go on, as plain data."""
        described = scenario_document(self.scenario)
        del described["origin"]
        return {
            "format": "ppafo adaptation",
            "schema_version": 1,
            "version": __version__,
            "walk": self.scenario.name,
            "sha256": hashlib.sha256(line_of(described)).hexdigest(),
            "gains": self.adapts,
            "speed": self.speed,
            "generations": self.generations,
            "population": self.population,
            "seed": self.seed,
        }


def line_of(document: Mapping[str, Any]) -> bytes:
    """Return plain data as a line of JSON."""
    return f"{json.dumps(document, sort_keys=True)}\n".encode()


def search_of(
    walk: Scenario | str | Path | None,
    speed: float | None,
    adapts: str,
    restarts: int,
    generations: int,
    population: int,
    seed: int,
    overrides: Sequence[str],
) -> Search:
    """Return the search that arguments of ``adapt`` describe; StudyError where they cannot be."""
    scenario = with_overrides(scenario_or_load(WALK if walk is None else walk), overrides)
    motion = scenario.motion
    if not isinstance(motion, WalkMotion) or motion.reacts is None:
        raise StudyError(
            f"'{scenario.name}': is no walk of a wearer who reacts, so that no reflexes can adapt; 'reacting' is one"
        )
    names = Gains._fields
    groups: Mapping[str, tuple[tuple[str, ...], ...]] = {
        "alike": tuple((f"wearer.left_{name}", f"wearer.right_{name}") for name in names),
        "left": tuple((f"wearer.left_{name}",) for name in names),
        "apart": tuple((f"wearer.{item.name}",) for item in GAINS),
    }
    if adapts not in groups:
        raise StudyError(f"gains = {adapts!r}: must be one of {', '.join(groups)}")
    own = motion.reacts.settings
    unlike = [name for name in names if own[f"left_{name}"] != own[f"right_{name}"]]
    if adapts == "alike" and unlike:
        raise StudyError(
            f"gains = 'alike': the legs of '{motion.reacts.name}' differ in {', '.join(unlike)}; take 'apart' or 'left'"
        )
    for name, value, least, most in (
        ("restarts", restarts, 1, 100),
        ("generations", generations, 1, MOST_GENERATIONS),
        ("population", population, 4, LARGEST_POPULATION),
    ):
        if not least <= value <= most:
            raise StudyError(f"{name} = {value}: must be at least {least} and at most {most:,}")
    aim = float(own[START_SPEED.name]) if speed is None else speed
    low, high = START_SPEED.minimum / FRESH_STARTS[0], START_SPEED.maximum / FRESH_STARTS[-1]
    if not low <= aim <= high:
        raise StudyError(f"speed = {aim:g} m/s: must be at least {low:.2g} m/s and at most {high:.3g} m/s")
    before = np.array([float(own[paths[0].removeprefix("wearer.")]) for paths in groups[adapts]])
    return Search(scenario, motion.reacts, groups[adapts], before, aim, restarts, generations, population, seed, adapts)
