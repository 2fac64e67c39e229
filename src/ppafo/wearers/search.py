"""A search of numbers by an evolution strategy that adapts its covariance: candidates out, costs in.

N. Hansen, "The CMA evolution strategy: a tutorial", arXiv:1604.00772, equations 5 to 37 without negative weights. A
generation draws from its own number and the seed alone: a search that was interrupted goes on with the same bits.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import DataError

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Search:
    """State of a search between two generations.

    ``mean`` (n,), ``covariance`` (n, n) and both paths (n,) are in units of ``scale`` (n,) around ``origin`` (n,);
    ``deviation`` is the width of the draws; ``best`` (n,) is in the units of ``origin``, ``best_cost`` what it cost.
    """

    seed: int
    population: int
    origin: Numbers
    scale: Numbers
    generation: int
    mean: Numbers
    deviation: float
    covariance: Numbers
    path_of_deviation: Numbers
    path_of_covariance: Numbers
    best: Numbers
    best_cost: float


def begin(origin: Numbers, scale: Numbers, *, seed: int, deviation: float = 1.0, population: int = 16) -> Search:
    """Return a search that has not drawn yet, around ``origin`` (n,) by ``deviation`` times ``scale`` (n,)."""
    count = origin.size
    none = np.zeros(count)
    return Search(
        seed=seed,
        population=population,
        origin=origin,
        scale=scale,
        generation=0,
        mean=none,
        deviation=deviation,
        covariance=np.eye(count),
        path_of_deviation=none,
        path_of_covariance=none,
        best=origin,
        best_cost=math.inf,
    )


def _axes(search: Search) -> tuple[Numbers, Numbers]:
    """Square roots of the variances along the axes of the draws (n,), and these axes as columns (n, n)."""
    variances, axes = np.linalg.eigh(search.covariance)
    # The sign of an axis is the library's choice; the draws must not depend on it.
    axes = axes * np.where(axes[np.abs(axes).argmax(axis=0), np.arange(axes.shape[1])] < 0.0, -1.0, 1.0)
    return np.sqrt(np.maximum(variances, 1e-20)), axes


def candidates(search: Search) -> Numbers:
    """Return the candidates (population, n) of this generation, in the units of ``origin``."""
    widths, axes = _axes(search)
    draws = np.random.default_rng([search.seed, search.generation]).standard_normal(
        (search.population, search.origin.size)
    )
    return search.origin + search.scale * (search.mean + search.deviation * (draws * widths) @ axes.T)


def next_search(search: Search, drawn: Numbers, costs: Numbers) -> Search:
    """Return the search after its candidates (population, n) cost so much (population,); a NaN is the worst of all.

    DataError where the number of costs is not that of the candidates.
    """
    if costs.shape != (search.population,) or drawn.shape != (search.population, search.origin.size):
        raise DataError(f"{search.population} candidates need as many costs, not {costs.size}")
    n = search.origin.size
    parents = search.population // 2
    weights = math.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    weights = weights / weights.sum()
    effective = 1.0 / float(np.sum(weights**2))
    for_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n)
    for_deviation = (effective + 2.0) / (n + effective + 5.0)
    rank_one = 2.0 / ((n + 1.3) ** 2 + effective)
    rank_mu = min(1.0 - rank_one, 2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0) ** 2 + effective))
    damping = 1.0 + 2.0 * max(0.0, math.sqrt((effective - 1.0) / (n + 1.0)) - 1.0) + for_deviation
    expected = math.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))

    worst_last = np.where(np.isnan(costs), math.inf, costs)
    order = np.argsort(worst_last, kind="stable")[:parents]
    steps = ((drawn[order] - search.origin) / search.scale - search.mean) / search.deviation
    step = weights @ steps
    widths, axes = _axes(search)
    whitened = axes @ ((axes.T @ step) / widths)
    path_of_deviation = (1.0 - for_deviation) * search.path_of_deviation + math.sqrt(
        for_deviation * (2.0 - for_deviation) * effective
    ) * whitened
    length = float(np.linalg.norm(path_of_deviation))
    begun = math.sqrt(1.0 - (1.0 - for_deviation) ** (2.0 * (search.generation + 1)))
    grows = length / begun < (1.4 + 2.0 / (n + 1.0)) * expected
    path_of_covariance = (1.0 - for_path) * search.path_of_covariance
    if grows:
        path_of_covariance = path_of_covariance + math.sqrt(for_path * (2.0 - for_path) * effective) * step
    lost = 0.0 if grows else rank_one * for_path * (2.0 - for_path)
    covariance = (
        (1.0 - rank_one - rank_mu + lost) * search.covariance
        + rank_one * np.outer(path_of_covariance, path_of_covariance)
        + rank_mu * (steps.T * weights) @ steps
    )
    first = int(order[0])
    better = bool(worst_last[first] < search.best_cost)
    return replace(
        search,
        generation=search.generation + 1,
        mean=search.mean + search.deviation * step,
        deviation=search.deviation * math.exp(for_deviation / damping * (length / expected - 1.0)),
        covariance=0.5 * (covariance + covariance.T),
        path_of_deviation=path_of_deviation,
        path_of_covariance=path_of_covariance,
        best=drawn[first] if better else search.best,
        best_cost=float(worst_last[first]) if better else search.best_cost,
    )


def middle(search: Search) -> Numbers:
    """Return the mean of the draws (n,), in the units of ``origin``: steadier than the best of them."""
    return search.origin + search.scale * search.mean


def as_document(search: Search) -> dict[str, Any]:
    """Return a search as plain lists and numbers, which ``from_document`` reads with the same bits."""
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(search).items()}


def from_document(document: dict[str, Any]) -> Search:
    """Return a search from what ``as_document`` made."""
    values: dict[str, Any] = {
        name: np.array(value, float) if isinstance(value, list) else value for name, value in document.items()
    }
    return Search(**values)
