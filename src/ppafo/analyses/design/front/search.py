"""Search for designs that no other dominates: what dominates what, how a generation follows from the last.

Non-dominated sorting with constraints: Deb, Pratap, Agarwal and Meyarivan, A fast and elitist multiobjective genetic
algorithm: NSGA-II, 2002. All objectives are to be small.

Kukkonen and Lampinen, GDE3: the third evolution step of generalized differential evolution, 2005; variation of the
choice of parts as in a genetic algorithm. Why so: docs/decisions/0006.
"""

import time
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ppafo.documents.models import StrictTable
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import Floats

Choices = NDArray[np.int64]
MAXIMUM_SHOWN = 12
"""Points of a front that are shown one by one at most."""
_CHUNK = 512
"""Points compared with all others at once: the matrix of who dominates whom then stays in the cache."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """``choice`` (candidates,) counts from 0; ``places`` (candidates, variables) are from 0 to 1."""

    choice: Choices
    places: Floats

    def __len__(self) -> int:
        """Return the number of candidates."""
        return self.choice.size

    def at(self, members: NDArray[np.bool_] | NDArray[np.intp]) -> "Candidates":
        """Return some of the candidates."""
        return Candidates(self.choice[members], self.places[members])

    def with_more(self, more: "Candidates") -> "Candidates":
        """Return these candidates and then the others."""
        return Candidates(np.concatenate([self.choice, more.choice]), np.concatenate([self.places, more.places]))


@dataclass(frozen=True, slots=True, eq=False)
class Worth:
    """What candidates are worth.

    ``objectives`` (candidates, objectives) are to be small; nan where a candidate could not be evaluated. ``violation``
    (candidates,) is 0 where all constraints are kept, infinite where a run failed.
    """

    objectives: Floats
    violation: Floats

    @property
    def is_feasible(self) -> NDArray[np.bool_]:
        """Which candidates satisfy all constraints."""
        return np.asarray(self.violation == 0.0)

    def at(self, members: NDArray[np.bool_] | NDArray[np.intp]) -> "Worth":
        """Return the worth of some of the candidates."""
        return Worth(self.objectives[members], self.violation[members])

    def with_more(self, more: "Worth") -> "Worth":
        """Return this and then the other."""
        return Worth(
            np.concatenate([self.objectives, more.objectives]), np.concatenate([self.violation, more.violation])
        )


def evenly_spread(count: int, choices: int, variables: int, seed: int) -> Candidates:
    """Return candidates of a scrambled Sobol sequence; a choice is one more dimension, so that each is met as often."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(variables + 1, rng=np.random.default_rng(seed))
    points = sequence.random_base2(max(0, int(np.ceil(np.log2(count)))))[:count]
    return Candidates(np.minimum((points[:, 0] * choices).astype(np.int64), choices - 1), points[:, 1:])


def dominance(first: Worth, second: Worth) -> NDArray[np.bool_]:
    """Return (first, second): True where a point of the first dominates one of the second.

    Of two points of which not both satisfy the constraints, the one that violates them less dominates.
    """
    a, b = first.objectives[:, None, :], second.objectives[None, :, :]
    is_better = np.all(a <= b, axis=2) & np.any(a < b, axis=2)
    both = first.is_feasible[:, None] & second.is_feasible[None, :]
    violates_less = first.violation[:, None] < second.violation[None, :]
    return np.where(both, is_better, violates_less)


def non_dominated(worth: Worth) -> NDArray[np.bool_]:
    """Return which points (points,) no other dominates; equal points all stay."""
    kept = np.ones(worth.violation.size, dtype=bool)
    for start in range(0, kept.size, _CHUNK):
        # What is dominated cannot be needed to dominate others: its dominator dominates them too.
        members = np.flatnonzero(kept)
        part = np.arange(start, min(start + _CHUNK, kept.size))
        kept[part] &= ~dominance(worth.at(members), worth.at(part)).any(axis=0)
    return kept


def crowding(objectives: Floats) -> Floats:
    """Return the crowding distance (points,) [-]: how far apart a point's neighbours are; infinite at the ends."""
    count = objectives.shape[0]
    distance = np.zeros(count)
    for column in objectives.T:
        order = np.argsort(column, kind="stable")
        span = column[order[-1]] - column[order[0]]
        distance[order[[0, -1]]] = np.inf
        if span > 0.0 and count > 2:
            distance[order[1:-1]] += (column[order[2:]] - column[order[:-2]]) / span
    return distance


def survivors(worth: Worth, count: int) -> NDArray[np.intp]:
    """Return the places of the ``count`` best points: front by front, then the less crowded of the last front.

    Fronts are taken away one after the other, so that of very many points all are never compared with all.
    """
    left = np.arange(worth.violation.size)
    chosen = np.empty(0, dtype=np.intp)
    while chosen.size < count and left.size:
        is_front = non_dominated(worth.at(left))
        front = left[is_front]
        if chosen.size + front.size > count:
            apart = crowding(np.nan_to_num(worth.objectives[front]))
            front = front[np.argsort(-apart, kind="stable")]
        chosen = np.concatenate([chosen, front])[:count]
        left = left[~is_front]
    return chosen


def hypervolume(points: Floats, reference: Floats) -> float:
    """Return the volume that points (points, 3) dominate up to a reference point (3,); all objectives to be small.

    The points are taken in order of the third objective; between two of them the dominated area in the plane of the
    other two, bounded by a staircase, stays the same.
    """
    inside = points[(points < reference).all(axis=1)]
    if inside.size == 0:
        return 0.0
    ordered = inside[inside[:, 2].argsort(kind="stable")]
    right, top, last = reference.tolist()
    # The staircase: points of the plane of which none dominates another, so that x grows and y falls.
    xs: list[float] = []
    ys: list[float] = []
    volume = area = 0.0
    for (x, y, height), above in zip(ordered.tolist(), [*ordered[1:, 2].tolist(), last], strict=True):
        step = bisect_left(xs, x)
        level = ys[step - 1] if step else top
        if level > y and not (step < len(xs) and xs[step] == x and ys[step] <= y):
            # What it dominates and no point before it did; the points that it dominates leave the staircase.
            gained, start, end = 0.0, x, step
            while end < len(xs) and ys[end] >= y:
                gained += (xs[end] - start) * (level - y)
                start, level, end = xs[end], ys[end], end + 1
            area += gained + ((xs[end] if end < len(xs) else right) - start) * (level - y)
            xs[step:end], ys[step:end] = [x], [y]
        volume += area * (above - height)
    return volume


def fractions(objectives: Floats) -> Floats:
    """Return objectives (points, objectives) as fractions: 0 the best value on the front, 1 the worst."""
    lowest, highest = objectives.min(axis=0), objectives.max(axis=0)
    span = np.where(highest > lowest, highest - lowest, 1.0)
    return np.asarray((objectives - lowest) / span)


def knee(objectives: Floats) -> int:
    """Return the place of the design with the smallest sum of fractions.

    What any other design gains in some objectives it loses at least as much of in the rest, counted in fractions.
    """
    return int(np.argmin(fractions(objectives).sum(axis=1)))


def representatives(objectives: Floats, most: int = MAXIMUM_SHOWN) -> tuple[int, ...]:
    """Return places of designs that stand for the front, in its order.

    The best of each objective and the knee first, then always the one farthest from all that are there.
    """
    scaled = fractions(objectives)
    chosen = list(dict.fromkeys([*np.argmin(objectives, axis=0).tolist(), knee(objectives)]))[:most]
    distance = np.min([np.linalg.norm(scaled - scaled[point], axis=1) for point in chosen], axis=0)
    while len(chosen) < min(most, objectives.shape[0]) and distance.max() > 0.0:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return tuple(sorted(chosen))


SCALES = (0.1, 0.6)
"""Smallest and largest fraction of a difference of two designs that is added to a third."""
CROSSED = 0.3
"""Fraction of the variables that a child has from the changed design, the others from its parent."""
OTHER_PARTS = 0.1
"""Fraction of the children that try parts at random; half of the others take the changed design's."""
PATIENCE = 10
"""Generations over which the hypervolume has to grow."""
LARGEST_SEED = 2**32 - 1


class SearchTable(StrictTable):
    """Section of a design file: how long to search, and when to stop."""

    screening: Annotated[
        int, Field(ge=16, le=100_000, description="number of evenly spread designs in the first generation")
    ] = 4096
    population: Annotated[int, Field(ge=16, le=4096, description="number of designs in each later generation")] = 256
    generations: Annotated[int, Field(ge=0, le=10_000, description="maximum number of generations")] = 80
    tolerance: Annotated[
        float,
        Field(ge=0.0, lt=1.0, description="stop when the hypervolume grows by less than this over 10 generations"),
    ] = 1.0e-3
    seed: Annotated[
        int, Field(ge=0, le=LARGEST_SEED, description="random seed; the same seed gives the same designs")
    ] = 1


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
    evaluate: Evaluate, choices: int, variables: int, settings: SearchTable, progress: Report = report_nothing
) -> Front:
    """Return the front of a problem with ``choices`` combinations of parts and ``variables`` numbers.

    The same settings give the same front.
    """
    begun = time.monotonic()
    random = np.random.default_rng(settings.seed)
    evaluated = evenly_spread(settings.screening, choices, variables, settings.seed)
    worth = evaluate(evaluated)
    best = survivors(worth, settings.population)
    population, standing = evaluated.at(best), worth.at(best)
    box = _box(worth)
    keep = non_dominated(worth) & worth.is_feasible
    evaluated, worth = evaluated.at(keep), worth.at(keep)
    growth = [(settings.screening, _dominated_fraction(worth, box))]
    while len(growth) <= settings.generations and not _has_settled(growth, settings.tolerance):
        children = vary(population, choices, random)
        value = evaluate(children)
        population, standing = population.with_more(children), standing.with_more(value)
        best = survivors(standing, settings.population)
        population, standing = population.at(best), standing.at(best)
        good = value.is_feasible
        evaluated, worth = evaluated.with_more(children.at(good)), worth.with_more(value.at(good))
        # Equal points do not dominate each other: without this one design would fill the front with its copies.
        _, once = np.unique(worth.objectives, axis=0, return_index=True)
        once.sort()
        evaluated, worth = evaluated.at(once), worth.at(once)
        keep = non_dominated(worth)
        evaluated, worth = evaluated.at(keep), worth.at(keep)
        # No design of the first sample kept the constraints: the first that do give the box.
        if box is None:
            box = _box(worth)
        growth.append((growth[-1][0] + len(children), _dominated_fraction(worth, box)))
        elapsed = time.monotonic() - begun
        designs, fraction = growth[-1]
        most = settings.screening + settings.generations * settings.population
        progress(Progress(f"hypervolume {fraction:.2f}", designs, most, elapsed=elapsed, noun="designs"))
    return Front(evaluated, worth, tuple(growth), _has_settled(growth, settings.tolerance))


def vary(population: Candidates, choices: int, random: np.random.Generator) -> Candidates:
    """Return a child for each candidate: part of it, part of a third one moved along a difference of two others."""
    count, variables = population.places.shape
    first, second, third = (random.permutation(count) for _ in range(3))
    scale = random.uniform(*SCALES, size=(count, 1))
    moved = population.places[first] + scale * (population.places[second] - population.places[third])
    crossed = random.random((count, variables)) < CROSSED
    # At least one variable of every child is a changed one, else it might be its parent again.
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


def _box(worth: Worth) -> tuple[Floats, Floats] | None:
    """Return the best values and the worst ones of all designs that satisfy the constraints; None where none does."""
    good = worth.objectives[worth.is_feasible]
    if good.shape[0] == 0:
        return None
    lowest, highest = good.min(axis=0), good.max(axis=0)
    span = np.where(highest > lowest, highest - lowest, np.maximum(np.abs(highest), 1.0))
    # A hundredth beyond the worst values, so that a design at the edge of the box still counts.
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
