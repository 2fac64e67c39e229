"""The search for a front: an even sample of all designs, then generations of differential evolution.

Kukkonen and Lampinen, GDE3: the third evolution step of generalized differential evolution, 2005; variation of the
choice of parts as in a genetic algorithm. Why so: docs/decisions/0006.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.design.front import (
    Candidates,
    Floats,
    Worth,
    evenly_spread,
    hypervolume,
    non_dominated,
    survivors,
)

SCALES = (0.1, 0.6)
"""Smallest and largest fraction of a difference of two designs that is added to a third."""
CROSSED = 0.3
"""Fraction of the variables that a child has from the changed design, the others from its parent."""
OTHER_PARTS = 0.1
"""Fraction of the children that try parts at random; half of the others take those of the changed design."""
PATIENCE = 10
"""Generations over which the hypervolume has to grow."""


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """Designs of the initial even sample and of each generation, the most generations, relative tolerance, seed."""

    screening: int
    population: int
    generations: int
    tolerance: float
    seed: int


@dataclass(frozen=True, slots=True, eq=False)
class Front:
    """Candidates that no other one found dominates, their worth, and how the search went.

    ``growth`` has pairs of candidates evaluated so far and hypervolume [-], as a fraction of the box from the best to
    the worst values of the initial even sample. ``settled`` tells whether the tolerance stopped the search.
    """

    candidates: Candidates
    worth: Worth
    growth: tuple[tuple[int, float], ...]
    settled: bool


Evaluate = Callable[[Candidates], Worth]


def search_front(
    evaluate: Evaluate, choices: int, variables: int, settings: SearchSettings, progress: Report = report_nothing
) -> Front:
    """Return the front of a problem with ``choices`` combinations of parts and ``variables`` numbers.

    The same settings give the same front.
    """
    begun = time.monotonic()
    random = np.random.default_rng(settings.seed)
    found = evenly_spread(settings.screening, choices, variables, settings.seed)
    worth = evaluate(found)
    best = survivors_of_many(worth, settings.population)
    population, standing = found.at(best), worth.at(best)
    box = _box(worth)
    keep = non_dominated(worth) & worth.is_feasible
    found, worth = found.at(keep), worth.at(keep)
    growth = [(settings.screening, _dominated_fraction(worth, box))]
    while len(growth) <= settings.generations and not _has_settled(growth, settings.tolerance):
        children = vary(population, choices, random)
        value = evaluate(children)
        population, standing = population.with_more(children), standing.with_more(value)
        best = survivors(standing, settings.population)
        population, standing = population.at(best), standing.at(best)
        found, worth = _add_children(found, worth, children, value)
        if box is None:
            box = _box(worth)
        growth.append((growth[-1][0] + len(children), _dominated_fraction(worth, box)))
        progress(_progress(growth, settings, time.monotonic() - begun))
    return Front(found, worth, tuple(growth), _has_settled(growth, settings.tolerance))


def _progress(growth: list[tuple[int, float]], settings: SearchSettings, elapsed: float) -> Progress:
    designs, fraction = growth[-1]
    most = settings.screening + settings.generations * settings.population
    return Progress(f"hypervolume {fraction:.2f}", designs, most, elapsed=elapsed, noun="designs")


def survivors_of_many(worth: Worth, count: int) -> NDArray[np.intp]:
    """Return the places of the ``count`` best points of very many, front by front, without comparing all with all."""
    left = np.arange(worth.violation.size)
    chosen = np.empty(0, dtype=np.intp)
    while chosen.size < count and left.size:
        front = non_dominated(worth.at(left))
        chosen = np.concatenate([chosen, left[front]])
        left = left[~front]
    return chosen[survivors(worth.at(chosen), count)]


def vary(population: Candidates, choices: int, random: np.random.Generator) -> Candidates:
    """Return a child for each candidate: part of it, part of a third one moved along a difference of two others."""
    count, variables = population.places.shape
    first, second, third = (random.permutation(count) for _ in range(3))
    scale = random.uniform(*SCALES, size=(count, 1))
    moved = population.places[first] + scale * (population.places[second] - population.places[third])
    crossed = random.random((count, variables)) < CROSSED
    if variables:
        crossed[np.arange(count), random.integers(variables, size=count)] = True
    places = np.where(crossed, reflect(moved), population.places)
    draw, other = random.random(count), random.integers(choices, size=count)
    mixed = np.where(draw < 0.5 + 0.5 * OTHER_PARTS, population.choice[first], population.choice)
    return Candidates(np.where(draw < OTHER_PARTS, other, mixed), places)


def reflect(places: Floats) -> Floats:
    """Return places thrown back into 0 to 1 at its ends."""
    turned = np.mod(places, 2.0)
    return np.where(turned > 1.0, 2.0 - turned, turned)


def _add_children(found: Candidates, worth: Worth, children: Candidates, value: Worth) -> tuple[Candidates, Worth]:
    """Return all that no other dominates so far, each point once."""
    good = value.is_feasible
    found, worth = found.with_more(children.at(good)), worth.with_more(value.at(good))
    _, once = np.unique(worth.objectives, axis=0, return_index=True)
    once.sort()
    found, worth = found.at(once), worth.at(once)
    keep = non_dominated(worth)
    return found.at(keep), worth.at(keep)


def _box(worth: Worth) -> tuple[Floats, Floats] | None:
    """Return the best values and the worst ones of all designs that satisfy the constraints; None where none does."""
    good = worth.objectives[worth.is_feasible]
    if good.shape[0] == 0:
        return None
    lowest, highest = good.min(axis=0), good.max(axis=0)
    span = np.where(highest > lowest, highest - lowest, np.maximum(np.abs(highest), 1.0))
    return lowest, lowest + 1.01 * span


def _dominated_fraction(worth: Worth, box: tuple[Floats, Floats] | None) -> float:
    if box is None:
        return 0.0
    lowest, highest = box
    return hypervolume((worth.objectives - lowest) / (highest - lowest), np.ones(lowest.size))


def _has_settled(growth: list[tuple[int, float]], tolerance: float) -> bool:
    if len(growth) <= PATIENCE or growth[-1][1] == 0.0:
        return False
    return growth[-1][1] - growth[-1 - PATIENCE][1] < tolerance * growth[-1][1]
