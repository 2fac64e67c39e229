"""The search: an evolution strategy over gains of reflexes, each generation one ensemble, kept line by line.

Only the costs are stored. Given them again, the strategy draws the same candidates, so that an interrupted search
resumes with the same bits.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ppafo import interrupts
from ppafo.answers.writing import files_of
from ppafo.errors import DataError, StudyError
from ppafo.progress import Report
from ppafo.questions.adapt.answer import EFFORT, FALLS, Adaptation, Restart, Walked, answer_of
from ppafo.questions.adapt.problem import FRESH_STARTS, START_PATH, STARTS, Search, line_of, search_of
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import read_bytes
from ppafo.storage.result_folder import check_owned_folder, marked_folder, write_marked_folder
from ppafo.studies.draws import Model, Tally, scenario_model
from ppafo.walking.reacting_wearer import GAINS

Floats = NDArray[np.float64]

METRICS = ("stays_up", "walked_time", "walking_speed", *(name for name, _ in EFFORT), "lowest_toes", "gas")
OF_SPEED = 10.0
"""Cost of being off the speed, over its square [s^2/m^2]: 0.1 m/s cost as much as the work of the muscles."""

JOURNAL = "search.jsonl"
_MAXIMUM_BYTES = 64_000_000


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
    try:
        found = _adapted(search, journal, known, threads, progress)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; finished generations are kept, and the same command resumes") from None
    contents = files_of(answer_of(found))
    write_marked_folder(folder, {**contents, JOURNAL: read_bytes(journal, _MAXIMUM_BYTES)}, "adapt")
    return replace(found, folder=str(folder))


def _known(journal: Path, content: bytes, search: Search) -> dict[tuple[int, int], tuple[str, list[float]]]:
    """What a journal holds by restart and generation: hash of the candidates, and costs."""
    lines = content.split(b"\n")[:-1]
    try:
        documents = [json.loads(line.decode()) for line in lines]
        head = dict(documents[0])
        found = {
            (int(item["restart"]), int(item["generation"])): (str(item["drawn"]), _finite(item["costs"]))
            for item in documents[1:]
        }
    except (ValueError, LookupError, TypeError, OverflowError, RecursionError) as error:
        raise DataError(f"{journal}: is damaged: delete its folder and search anew") from error
    requested = search.document()
    changed = [name for name, value in requested.items() if head.get(name) != value]
    if changed:
        raise StudyError(
            f"{journal.parent}: holds another search ({', '.join(changed)}); choose another folder with --out"
        )
    return found


def _finite(costs: Sequence[float]) -> list[float]:
    """Costs of a journal as floats; ValueError for one that no search has."""
    found = [float(cost) for cost in costs]
    if not np.isfinite(found).all():
        raise ValueError("costs are finite")
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
    return Adaptation(search, before, tuple(restarts))


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
                # Nothing is written for a search that cannot be begun.
                if not journal.exists():
                    write_marked_folder(journal.parent, {JOURNAL: line_of(search.document())}, "adapt")
                with journal.open("ab") as file:
                    file.write(line_of(item))
        strategy.tell(list(zip(asked, costs.tolist(), strict=True)))
        yield drawn, costs


def costs_of(search: Search, model: Model, gains: Floats) -> Floats:
    """The cost of candidates (candidates, gains), each the mean over its start speeds (candidates,)."""
    metrics, weight = _run(search, model, gains, STARTS), search.wearer.weight
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
