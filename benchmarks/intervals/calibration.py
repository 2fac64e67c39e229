"""Do the intervals of a fit hold, whatever the noise? Many synthetic recordings of each kind, at planted truths.

Truths stay the same (coverage), or are drawn from the prior that the fit is given (simulation-based calibration: the
share of the posterior below the truth is then evenly distributed). Each repetition has a seed of its own and is one
line of a file, so that a study resumes where it was stopped, on any number of processes.
"""

import json
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.intervals.made_by import check_code, code_now, whole_lines
from benchmarks.intervals.noise_kinds import NOISE_KINDS, noise_kind
from benchmarks.intervals.planted import Planted, exact_recording, planted_problem, two_step_responses
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import FreeParameter, Prior, Search, TrajectoryFit, fit
from ppafo.identification.trajectory.fitting import residuals_of
from ppafo.identification.trajectory.information import directions_for, inverse_with_root
from ppafo.identification.trajectory.problem import full_path, with_numbers
from ppafo.identification.trajectory.residuals import Floats, Residuals, prior_coordinates
from ppafo.identification.trajectory.search import is_at_bound
from ppafo.signals.recording import Channel, Recording

FIVE_PARAMETERS = (
    "valve.discharge_coefficient",
    "actuator.leak.area",
    "friction.static_torque",
    "friction.viscous_damping",
    "foot_plate.inertia",
)
DURATION = 0.4
"""Seconds of each of the two step responses: breakaway, motion, impact, filling."""

PRIOR = 0.1
"""Standard deviation of the prior over its mean, where truths are drawn."""

_CODE = "code"
_AWAY = 0.01
_STEP = 1.0e-3
_SINGLE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


@dataclass(frozen=True, slots=True)
class Task:
    """One repetition: kind of noise, its number, seed of the study, and whether the truth is drawn from the prior."""

    kind: str
    number: int
    seed: int
    is_drawn: bool


@dataclass(frozen=True, slots=True)
class Line:
    """What one repetition gave, by parameter in the order of ``FIVE_PARAMETERS``.

    ``below`` is the share of the posterior below the truth [-], ``exact`` the same of a fit that knows the noise, with
    the slopes of this one (empty where errors are not normal); ``width`` is the standard deviation over the best
    possible one [-]; ``alarm`` says that the test of misfit called the (right) model wrong, ``chance`` is the least of
    its comparisons.
    """

    kind: str
    number: int
    below: tuple[float, ...]
    width: tuple[float, ...]
    verdicts: tuple[str, ...]
    alarm: bool
    chance: float
    noise: str
    seconds: float
    exact: tuple[float, ...] = ()


def tasks_of(kinds: Sequence[str], repetitions: int, seed: int, is_drawn: bool) -> list[Task]:
    """Return all repetitions, one of each kind in turn, so that a study that is stopped has some of every kind."""
    if repetitions < 1:
        raise IdentificationError(f"a study of intervals needs at least one repetition, not {repetitions}")
    for kind in kinds:
        noise_kind(kind)
    return [Task(kind, number, seed, is_drawn) for number in range(repetitions) for kind in kinds]


def _nobody(_text: str) -> None:
    """Nobody listens."""


def run_tasks(
    tasks: Sequence[Task],
    file: Path | None,
    processes: int,
    tell: Callable[[str], None] = _nobody,
    warn: Callable[[str], None] = _nobody,
) -> list[Line]:
    """Return the lines of all tasks; those that ``file`` already has are not run again, the others are added to it.

    IdentificationError where others would be added to lines that other code made; ``warn`` hears of lines that do not
    say what made them, which count.
    """
    known = {} if file is None else _read(file)
    wanted = {(task.kind, task.number) for task in tasks}
    lines = {key: line for key, (line, _) in known.items() if key in wanted}
    missing = [task for task in tasks if (task.kind, task.number) not in lines]
    if file is not None:
        check_code(file, [code for _, code in known.values()], len(missing), warn)
    for count, line in enumerate(_results(missing, processes), start=1):
        lines[line.kind, line.number] = line
        if file is not None:
            with file.open("a", encoding="utf-8") as stream:
                stream.write(f"{json.dumps(_plain(line) | {_CODE: code_now()})}\n")
        if count % 20 == 0:
            tell(f"{count} of {len(missing)} fits")
    return [lines[task.kind, task.number] for task in tasks]


def repetition(task: Task) -> Line:
    """Return what one repetition gives: truth, recordings, noise and fit."""
    began = time.perf_counter()
    # The kind of noise is part of the seed, so that no two kinds share their errors.
    random = np.random.default_rng([task.seed, list(NOISE_KINDS).index(task.kind), task.number, int(task.is_drawn)])
    middle = _planted()
    truth = {full_path(path, middle.scenarios[0]): middle.truth(path) for path in FIVE_PARAMETERS}
    priors: dict[str, Prior | None] = dict.fromkeys(truth)
    planted = middle
    if task.is_drawn:
        priors = {path: Prior(mean, PRIOR * mean) for path, mean in truth.items()}
        truth = {path: _drawn(path, mean, random) for path, mean in truth.items()}
        planted = replace(middle, scenarios=tuple(with_numbers(one, truth) for one in middle.scenarios))
    recordings = _recordings(planted, task.kind, random)
    starts = {path: (middle if task.is_drawn else planted).truth(path) for path in truth}
    parameters = tuple(
        FreeParameter(path, start=start * math.exp(random.uniform(-_AWAY, _AWAY)), prior=priors[path])
        for path, start in starts.items()
    )
    # With one seed for all, what chains of few draws are off by would be off the same way in every repetition.
    search = Search(seed=int(random.integers(2**31)))
    found = fit(planted_problem(middle, parameters, recordings, search))
    return _line(task, found, list(truth.values()), time.perf_counter() - began)


def _line(task: Task, found: TrajectoryFit, truth: Sequence[float], seconds: float) -> Line:
    uncertainty, ranges = found.uncertainty, found.optimum.residuals.ranges
    away = [item.coordinate(true) - at for item, true, at in zip(ranges, truth, found.optimum.point, strict=True)]
    below = [float(uncertainty.mixture.below(index, np.array([one]))[0]) for index, one in enumerate(away)]
    widths = np.sqrt(np.diag(uncertainty.covariance)) / _ideal(task.kind, task.is_drawn)
    return Line(
        kind=task.kind,
        number=task.number,
        below=tuple(below),
        width=tuple(float(one) for one in widths),
        verdicts=tuple(estimate.verdict for estimate in found.estimates),
        alarm=bool(found.misfit),
        chance=min(one.chance for one in uncertainty.misfit.comparisons),
        noise="; ".join(f"{one.channel} {one.in_words}" for one in uncertainty.sensors),
        seconds=seconds,
        exact=() if noise_kind(task.kind).is_heavy else _below_with_known_noise(task.kind, found, away),
    )


def _below_with_known_noise(kind: str, found: TrajectoryFit, away: Sequence[float]) -> tuple[float, ...]:
    """Return the share of the posterior below a truth this far ``away`` [-], were the covariance of the noise known."""
    from scipy.special import ndtr

    whole, point = found.optimum.residuals, found.optimum.point
    residuals = replace(whole, whitening=None)
    directions = directions_for(found.uncertainty.curvature, is_at_bound(point, residuals.ranges))
    near = residuals.around(point, directions)
    products = _whitened_products(kind, residuals, np.column_stack([near.jacobian_of_data(), near.of_data]))
    mean, deviation, has = prior_coordinates(residuals.ranges)
    pull = np.where(has, (point - mean) / np.square(deviation), 0.0)
    matrix, _ = inverse_with_root(products[:-1, :-1] + np.diag(1.0 / np.square(deviation)))
    step = -matrix @ (products[:-1, -1] + pull)
    return tuple(float(one) for one in ndtr((np.array(away) - step) / np.sqrt(np.diag(matrix))))


def _whitened_products(kind: str, residuals: Residuals, columns: Floats) -> Floats:
    """Return the products of columns (samples, columns) with each other, whitened by the covariance of the noise."""
    noise, white, sizes = noise_kind(kind), noise_kind("white"), _planted().noise
    products = np.zeros((columns.shape[1], columns.shape[1]))
    places = iter(residuals.channel_slices())
    for number, prepared in enumerate(residuals.experiments):
        for channel in prepared.channels:
            rows = columns[next(places)] * channel.noise / sizes[channel.name]
            chosen = noise if channel.name in noise.channels else white
            products += rows.T @ np.linalg.solve(chosen.covariance(len(rows), number), rows)
    return products


@lru_cache(maxsize=1)
def _planted() -> Planted:
    return two_step_responses(DURATION)


@lru_cache(maxsize=1)
def _clean() -> tuple[Recording, ...]:
    return tuple(exact_recording(scenario) for scenario in _planted().scenarios)


def _drawn(path: str, mean: float, random: np.random.Generator) -> float:
    """Return a truth drawn from the prior, as the fit understands it: normal in the coordinate of the parameter."""
    size = PRIOR * random.standard_normal()
    return mean * (1.0 + size) if path.startswith("friction.") else mean * math.exp(size)


def _recordings(planted: Planted, kind: str, random: np.random.Generator) -> tuple[Recording, ...]:
    clean = _clean() if planted is _planted() else tuple(map(exact_recording, planted.scenarios))
    noise, white = noise_kind(kind), noise_kind("white")
    made = []
    for number, recording in enumerate(clean):
        channels = {
            name: Channel(
                recording[name]
                + size * (noise if name in noise.channels else white).draw(len(recording), number, random),
                recording.unit(name),
            )
            for name, size in planted.noise.items()
        }
        made.append(Recording(f"synthetic {recording.label}", recording.time, channels, kind="synthetic"))
    return tuple(made)


@lru_cache(maxsize=32)
def _ideal(kind: str, is_drawn: bool) -> Floats:
    """Return the standard deviations of coordinates of a fit that knows the noise exactly, at the middle truth."""
    planted = _planted()
    parameters = tuple(FreeParameter(path) for path in FIVE_PARAMETERS)
    residuals = residuals_of(
        planted_problem(planted, parameters, _recordings(planted, "white", np.random.default_rng(1)))
    )
    point = np.array([item.coordinate(item.start) for item in residuals.ranges])
    jacobian = residuals.around(point, _STEP * np.eye(len(point))).jacobian_of_data()
    information = np.eye(len(point)) / PRIOR**2 if is_drawn else np.zeros((len(point), len(point)))
    return np.asarray(
        np.sqrt(np.diag(inverse_with_root(information + _whitened_products(kind, residuals, jacobian))[0]))
    )


def _results(tasks: Sequence[Task], processes: int) -> Iterator[Line]:
    if processes == 1 or len(tasks) < 2:
        yield from map(repetition, tasks)
        return
    # Small matrices are slower on many threads; the processes that are started read this when they load NumPy.
    before = {name: os.environ.get(name) for name in _SINGLE}
    os.environ.update(_SINGLE)
    try:
        with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
            yield from pool.map(repetition, tasks, chunksize=2)
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _plain(line: Line) -> dict[str, Any]:
    return {name: getattr(line, name) for name in Line.__slots__}


def _read(file: Path) -> dict[tuple[str, int], tuple[Line, str]]:
    """Return the lines of a file, each with the code that made it; an unfinished last one is left out.

    Lines of before this was kept do not say which code that was: an empty text.
    """
    found: dict[tuple[str, int], tuple[Line, str]] = {}
    for one in whole_lines(file):
        document: Mapping[str, Any] = json.loads(one)
        parts: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in document.items()
        }
        code = parts.pop(_CODE, "")
        found[parts["kind"], parts["number"]] = Line(**parts), code
    return found
