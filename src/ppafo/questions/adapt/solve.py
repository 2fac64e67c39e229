"""The search: an evolution strategy over gains of reflexes, each generation one ensemble, kept line by line.

What is kept are the costs alone: told them again, the strategy draws the same candidates, so that an interrupted search
goes on with the same bits.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo import interrupts
from ppafo.answers.writing import files_of
from ppafo.errors import DataError, StudyError
from ppafo.loading import scenario_or_load
from ppafo.model.wearer.reflexes import Gains
from ppafo.progress import Report
from ppafo.questions.adapt.answer import FALLS, Adaptation, Restart, Walked, answer_of
from ppafo.simulation.scenario import Scenario, scenario_document
from ppafo.storage.files import read_bytes
from ppafo.storage.result_folder import check_owned_folder, marked_folder, write_marked_folder
from ppafo.studies.draws import Model, Tally, scenario_model
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

METRICS = ("stays_up", "walked_time", "walking_speed", "muscle_power", "lowest_toes", "gas")
OF_SPEED = 10.0
"""Cost of being off the speed, over its square [s^2/m^2]: 0.1 m/s cost as much as the work of the muscles."""

STEP, LEAST_STEP = 0.1, 2.0e-3
"""First standard deviation of a gain, as a share of it, and the least one."""

MOST_GENERATIONS, LARGEST_POPULATION = 10_000, 1_000
JOURNAL = "search.jsonl"
_MAXIMUM_BYTES = 64_000_000


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
            "sha256": hashlib.sha256(_line(described)).hexdigest(),
            "gains": self.adapts,
            "speed": self.speed,
            "generations": self.generations,
            "population": self.population,
            "seed": self.seed,
        }


def adapt(
    walk: Scenario | str | Path | None = None,
    speed: float | None = None,
    adapts: str = "alike",
    restarts: int = 3,
    generations: int = 30,
    population: int = 16,
    seed: int = 1,
    overrides: Sequence[str] = (),
    threads: int | None = None,
    progress: Report | None = None,
) -> Adaptation:
    """Search the gains of reflexes with which the wearer of a walk walks on at a ``speed`` [m/s], with little work.

    Each of ``restarts`` searches is an evolution strategy (CMA-ES; Hansen, arXiv:1604.00772) from the gains that the
    wearer has, with a seed of its own. A candidate walks from two start speeds; a fall costs more than any walk, the
    later the less. A walk costs the work of its muscles over weight and way, and the square of the error of its speed.
    ``adapts`` says whose gains: of both legs ``alike``, of each leg ``apart``, of the ``left`` leg with the device.
    StudyError for bad input.
    """
    search = search_of(walk, speed, adapts, restarts, generations, population, seed, overrides)
    return _adapted(search, None, {}, threads, progress)


def adapt_into_folder(
    walk: Scenario | str | Path | None = None,
    out: str | Path | None = None,
    speed: float | None = None,
    adapts: str = "alike",
    restarts: int = 3,
    generations: int = 30,
    population: int = 16,
    seed: int = 1,
    overrides: Sequence[str] = (),
    threads: int | None = None,
    progress: Report | None = None,
) -> Adaptation:
    """Return the answer of ``adapt`` and write it to ``out``, ``out/adapt-NAME`` by default; goes on where it stopped.

    DataError for a folder of somebody else's, StudyError for one of another search.
    """
    search = search_of(walk, speed, adapts, restarts, generations, population, seed, overrides)
    folder = Path(out or Path("out") / f"adapt-{search.scenario.name}")
    journal, known = folder / JOURNAL, {}
    kind = marked_folder("adapt")
    if journal.is_file():
        content = read_bytes(journal, _MAXIMUM_BYTES)
        check_owned_folder(folder, kind, {JOURNAL: content})
        known = _known(journal, content, search)
        if not content.endswith(b"\n"):  # a line that was cut short
            with journal.open("r+b") as file:
                file.truncate(content.rindex(b"\n") + 1)
    else:
        check_owned_folder(folder, kind)
        write_marked_folder(folder, {JOURNAL: _line(search.document())}, "adapt")
    try:
        found = _adapted(search, journal, known, threads, progress)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; finished generations are kept, and the same command resumes") from None
    contents = files_of(answer_of(found))
    write_marked_folder(folder, {**contents, JOURNAL: read_bytes(journal, _MAXIMUM_BYTES)}, "adapt")
    return replace(found, folder=str(folder))


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
    for name, value, least, most in (
        ("restarts", restarts, 1, 100),
        ("generations", generations, 1, MOST_GENERATIONS),
        ("population", population, 4, LARGEST_POPULATION),
    ):
        if not least <= value <= most:
            raise StudyError(f"{name} = {value}: must be at least {least} and at most {most:,}")
    aim = float(motion.reacts.settings[START_SPEED.name]) if speed is None else speed
    low, high = START_SPEED.minimum / FRESH_STARTS[0], START_SPEED.maximum / FRESH_STARTS[-1]
    if not low <= aim <= high:
        raise StudyError(f"speed = {aim:g} m/s: must be at least {low:.2g} m/s and at most {high:.3g} m/s")
    before = np.array([float(motion.reacts.settings[paths[0].removeprefix("wearer.")]) for paths in groups[adapts]])
    return Search(scenario, motion.reacts, groups[adapts], before, aim, restarts, generations, population, seed, adapts)


def _line(document: Mapping[str, Any]) -> bytes:
    return f"{json.dumps(document, sort_keys=True)}\n".encode()


def _known(journal: Path, content: bytes, search: Search) -> dict[tuple[int, int], tuple[str, list[float]]]:
    """What a journal holds by restart and generation: hash of the candidates, and costs."""
    lines = content.split(b"\n")[:-1]
    try:
        documents = [json.loads(line.decode()) for line in lines]
        head = documents[0]
        found = {
            (int(item["restart"]), int(item["generation"])): (
                str(item["drawn"]),
                [float(cost) for cost in item["costs"]],
            )
            for item in documents[1:]
        }
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise DataError(f"{journal}: is damaged: delete its folder and search anew") from error
    requested = search.document()
    changed = [name for name, value in requested.items() if not isinstance(head, dict) or head.get(name) != value]
    if changed:
        raise StudyError(
            f"{journal.parent}: holds another search ({', '.join(changed)}); choose another folder with --out"
        )
    return found


def _adapted(
    search: Search,
    journal: Path | None,
    known: Mapping[tuple[int, int], tuple[str, list[float]]],
    threads: int | None,
    progress: Report | None,
) -> Adaptation:
    missing = search.restarts * search.generations - len(known)
    judged = (search.restarts + 1) * len(FRESH_STARTS)
    tally = Tally(missing * search.population * len(STARTS) + judged, progress)
    model = scenario_model(search.scenario, METRICS, threads, tally.add)
    restarts = []
    for number in range(search.restarts):
        gains, course = search.before, list[float]()
        for drawn, costs in _generations(search, number, model, journal, known):
            best = int(np.argmin(costs))
            gains = drawn[best] if not course or costs[best] < course[-1] else gains
            course.append(min([float(costs[best]), *course[-1:]]))
        restarts.append(Restart(number + 1, gains, tuple(course), walked(search, model, gains)))
    before = walked(search, model, search.before)
    return Adaptation(
        search.scenario,
        search.wearer,
        search.adapts,
        search.groups,
        search.speed,
        search.before,
        before,
        tuple(restarts),
        search.generations,
        search.population,
        search.seed,
    )


def _generations(
    search: Search,
    restart: int,
    model: Model,
    journal: Path | None,
    known: Mapping[tuple[int, int], tuple[str, list[float]]],
) -> Iterator[tuple[Floats, Floats]]:
    """The candidates (population, gains) and costs (population,) of one search, generation by generation."""
    from cmaes import CMA

    quantities = {f"wearer.{item.name}": item for item in GAINS}
    bounds = np.array([(quantities[paths[0]].minimum, quantities[paths[0]].maximum) for paths in search.groups])
    seed = int(np.random.SeedSequence([search.seed, restart]).generate_state(1)[0])
    strategy = CMA(
        mean=np.zeros(search.before.size),
        sigma=1.0,
        bounds=(bounds - search.before[:, None]) / search.scale[:, None],
        seed=seed,
        population_size=search.population,
    )
    for generation in range(search.generations):
        interrupts.check()
        asked = [strategy.ask() for _ in range(search.population)]
        drawn = search.before + search.scale * np.array(asked)
        mark = hashlib.sha256(np.ascontiguousarray(drawn).tobytes()).hexdigest()[:16]
        kept = known.get((restart, generation))
        if kept is not None:
            if kept[0] != mark or len(kept[1]) != search.population:
                raise StudyError(
                    f"restart {restart + 1}, generation {generation + 1}: candidates are not those with which the "
                    "search was begun, perhaps on another computer; choose another folder with --out"
                )
            costs = np.array(kept[1])
        else:
            costs = costs_of(search, model, drawn)
            if journal is not None:
                item = {"restart": restart, "generation": generation, "drawn": mark, "costs": costs.tolist()}
                with journal.open("ab") as file:
                    file.write(_line(item))
        strategy.tell(list(zip(asked, costs.tolist(), strict=True)))
        yield drawn, costs


def costs_of(search: Search, model: Model, gains: Floats) -> Floats:
    """The cost of candidates (candidates, gains), each the mean over its start speeds (candidates,)."""
    metrics, weight = _run(search, model, gains, STARTS), search.wearer.body.weight
    share = np.nan_to_num(metrics["walked_time"]) / search.scenario.duration
    speed, power = metrics["walking_speed"], metrics["muscle_power"]
    walks = power / (weight * speed) + OF_SPEED * (speed - search.speed) ** 2
    falls = FALLS * (2.0 - np.minimum(share, 1.0))
    is_walk = (metrics["stays_up"] > 0.5) & np.isfinite(walks)
    return np.asarray(np.mean(np.where(is_walk, np.minimum(walks, FALLS), falls), axis=1))


def walked(search: Search, model: Model, gains: Floats) -> Walked:
    """How the wearer walks with gains (gains,) from fresh start speeds."""
    metrics = {name: values[0] for name, values in _run(search, model, gains[None, :], FRESH_STARTS).items()}
    return Walked(tuple(search.speed * share for share in FRESH_STARTS), metrics)


def _run(search: Search, model: Model, gains: Floats, starts: Sequence[float]) -> dict[str, Floats]:
    """The metrics of candidates (candidates, gains) from start speeds, each (candidates, starts)."""
    columns = {path: np.repeat(values, len(starts)) for path, values in search.columns(gains).items()}
    columns[START_PATH] = np.tile(search.speed * np.array(starts), len(gains))
    outcomes = model(columns)
    return {name: values.reshape(len(gains), len(starts)) for name, values in outcomes.metrics.items()}
