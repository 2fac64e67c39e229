"""The search for the optimum: several starts, each refined with scipy's bounded least squares."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.engine.lane_rows import LANES
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.information import (
    ROBUST_SCALE,
    directions_for,
    precision,
    robust_cost,
    standard_errors,
)
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import Range, Search, is_nuisance
from ppafo.identification.trajectory.residuals import FIRST_STEP, Mask, Neighbourhood, Residuals, coordinate_bounds
from ppafo.progress import Progress, Report, report_nothing

DRAWS_PER_START = 8
STAGES = 3
PASSES = 2
AT_BOUND = 1.0e-4
"""Fraction of a number, or of the way between its bounds if that is less, within which it counts as being at one."""

_TOLERANCES = (1.0e-4, 3.0e-8)
"""Of the first stage, which only comes near, and of the others."""

_SETTLED = 0.05
"""A further stage that moves no coordinate by more than this fraction of its standard error is the last."""
_WIDEST_DRAW = 1.5
_NOTABLE = 1.0e-3
_EXPLAINED = 1.5**2
"""Mean square of the residuals over their noise up to which they are no more than noise."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """Where a search ended: coordinates, cost (half the sum of squares, or of the loss), runs, information."""

    residuals: Residuals
    point: Floats
    cost: float
    evaluations: int
    information: Floats
    has_converged: bool


def optimum(residuals: Residuals, search: Search, report: Report = report_nothing) -> Optimum:
    """Return the best optimum of all starts; ``report`` hears what is being done.

    IdentificationError where the model diverges at every start.
    """
    best: Optimum | None = None
    nested = _nested_descent(residuals, search, report)
    evaluations = 0 if nested is None else nested.evaluations
    starts = [*_starts(residuals, search), *([] if nested is None else [nested.point])]
    for number, start in enumerate(starts, start=1):
        least = "" if best is None else f", lowest misfit so far {best.cost:.6g}"
        report(Progress(f"trajectory fit: start {number} of {len(starts)}{least}"))
        found = _refine(residuals, start, search)
        evaluations += found.evaluations
        if best is None or found.cost < best.cost:
            best = found
    if best is None:
        raise IdentificationError("the model diverges at every start; check start values and bounds (ppafo audit)")
    others = _without_one(residuals, best, search, report)
    evaluations += sum(one.evaluations for one in others)
    for one in others:
        if _beats(one, best):
            found = _refine(residuals, one.point, search)
            evaluations += found.evaluations
            best = found if found.cost < best.cost else best
    fewer = others if nested is None else (nested, *others)
    has_converged = best.has_converged and not any(_beats(one, best) for one in fewer)
    return Optimum(best.residuals, best.point, best.cost, evaluations, best.information, has_converged)


def _beats(nested: "Descent", best: Optimum) -> bool:
    return nested.cost < best.cost * (1.0 - _NOTABLE)


def _without_one(residuals: Residuals, best: Optimum, search: Search, report: Report) -> tuple["Descent", ...]:
    """Return where the search ends with one number at a time held at its start.

    None where the residuals are no larger than the noise, for then no fit can be notably lower.
    """
    count = len(residuals.ranges)
    if count < 2 or 2.0 * best.cost <= _EXPLAINED * residuals.channel_slices()[-1].stop:
        return ()
    report(Progress("trajectory fit: with one number at a time held at its start"))
    start = np.array([item.coordinate(item.start) for item in residuals.ranges])
    found = (_descend_holding(residuals, start, np.arange(count) == index, search) for index in range(count))
    return tuple(one for one in found if one is not None)


@dataclass(frozen=True, slots=True)
class Descent:
    """Where scipy's trust region ended from one start."""

    point: Floats
    cost: float
    evaluations: int
    has_converged: bool


def descend(
    residuals: Residuals, start: Floats, directions: Floats, search: Search, tolerance: float = _TOLERANCES[-1]
) -> Descent:
    """Return where the trust region ends from one start, with fixed steps of differences.

    Points and directions are in units of the coordinates, ``tolerance`` is relative [-].
    """
    from scipy.optimize import least_squares

    low, high = coordinate_bounds(residuals.ranges)
    margin = np.where(np.isfinite(high - low), 1.0e-9 * (high - low), 0.0)
    tried: dict[bytes, Neighbourhood] = {}

    def around(point: Floats) -> Neighbourhood:
        """Run a point and its differences together: a Jacobian is requested nearly wherever a residual was."""
        key = point.tobytes()
        if key not in tried:
            tried.clear()
            tried[key] = residuals.around(point, directions)
        return tried[key]

    done = least_squares(
        lambda point: around(point).all_residuals(),
        np.clip(start, low + margin, high - margin),
        jac=lambda point: around(point).jacobian(),
        bounds=(low, high),
        method="trf",
        loss=search.loss,
        f_scale=1.0 if search.loss == "linear" else ROBUST_SCALE,
        xtol=tolerance,
        ftol=tolerance,
        gtol=tolerance,
        max_nfev=search.maximum_evaluations,
    )
    return Descent(done.x, float(done.cost), int(done.nfev), done.status > 0)


def _nested_descent(residuals: Residuals, search: Search, report: Report) -> Descent | None:
    """Return where the search ends with all nuisances held at their start, as a start with them free.

    A fit with more numbers that ends above one with fewer has not found its least. None where no nuisance is fitted, or
    nothing else.
    """
    is_held = np.array([is_nuisance(item) for item in residuals.ranges])
    if not is_held.any() or is_held.all():
        return None
    report(Progress("trajectory fit: with initial states and time offsets held"))
    return _descend_holding(
        residuals, np.array([item.coordinate(item.start) for item in residuals.ranges]), is_held, search
    )


def _descend_holding(residuals: Residuals, start: Floats, is_held: Mask, search: Search) -> Descent | None:
    """Return where the search ends with some numbers held at the start; None where the model diverges there."""
    point, free = start.copy(), ~is_held
    fewer = residuals.hold({index: float(point[index]) for index in np.flatnonzero(is_held).tolist()})
    if not np.isfinite(fewer.of_data(point[None, free])).all():
        return None
    found = descend(fewer.quick(), point[free], np.diag(np.full(int(free.sum()), FIRST_STEP)), search, _TOLERANCES[0])
    point[free] = found.point
    return Descent(point, _cost_at(fewer, found.point, search), found.evaluations, found.has_converged)


def _cost_at(residuals: Residuals, point: Floats, search: Search) -> float:
    """Return the cost at a point, infinite where the model diverges there."""
    left = np.concatenate([residuals.of_data(point[None, :])[:, 0], residuals.of_priors(point)])
    return robust_cost(left, search.loss) if np.isfinite(left).all() else math.inf


def is_at_bound(point: Floats, ranges: Sequence[Range]) -> Mask:
    """Return which coordinates, in their units, are at a bound."""
    low, high = coordinate_bounds(ranges)
    return np.asarray(np.minimum(point - low, high - point) <= AT_BOUND * np.minimum(high - low, 1.0))


def _refine(residuals: Residuals, start: Floats, search: Search) -> Optimum:
    """Return the optimum from one start; steps of differences follow the numbers, in stages."""
    directions = np.diag(np.full(len(start), FIRST_STEP))
    evaluations = 0
    for stage in range(STAGES):
        used, tolerance = (residuals, _TOLERANCES[1]) if stage else (residuals.quick(), _TOLERANCES[0])
        found = descend(used, start, directions, search, tolerance)
        evaluations += found.evaluations
        information, directions = _information(residuals, found.point, directions, search)
        moved = np.abs(found.point - start) / standard_errors(information)
        start = found.point
        if stage > 0 and bool(np.all(moved <= _SETTLED)):
            break
    return Optimum(residuals, found.point, found.cost, evaluations, information, found.has_converged)


def _information(residuals: Residuals, point: Floats, directions: Floats, search: Search) -> tuple[Floats, Floats]:
    """Return the information at a point and the steps that suit it; two passes, since each needs the other."""
    fixed, quick = is_at_bound(point, residuals.ranges), residuals.quick()
    for _ in range(PASSES):
        directions = directions_for(precision(quick.around(point, directions), search.loss), fixed)
    return precision(residuals.around(point, directions), search.loss), directions


def _starts(residuals: Residuals, search: Search) -> Sequence[Floats]:
    """Return the given start and the best of many draws around it, all of which are tried in one block."""
    first = np.array([item.coordinate(item.start) for item in residuals.ranges])
    if not np.isfinite(residuals.of_data(first[None, :])).all():
        if search.other_starts == 0:
            raise IdentificationError("the model diverges at the start values; check them (ppafo audit)")
        return _best_draws(residuals, first, search)
    return [first, *_best_draws(residuals, first, search)]


def _best_draws(residuals: Residuals, first: Floats, search: Search) -> list[Floats]:
    if search.other_starts == 0:
        return []
    low, high = _box_of_draws(residuals.ranges, first)
    random = np.random.default_rng(search.seed)
    points = low + (high - low) * random.random((DRAWS_PER_START * search.other_starts, len(first)))
    # In blocks: the records of hundreds of runs at once would fill the memory.
    blocks = [points[first : first + LANES] for first in range(0, len(points), LANES)]
    costs = np.concatenate([np.sum(np.square(residuals.of_data(block)), axis=0) for block in blocks])
    order = [int(index) for index in np.argsort(costs) if np.isfinite(costs[index])]
    return [points[index] for index in order[: search.other_starts]]


def _box_of_draws(ranges: Sequence[Range], first: Floats) -> tuple[Floats, Floats]:
    """Return the box of the draws: the bounds, on the log scale at most a factor of 4.5 from the start."""
    low, high = coordinate_bounds(ranges)
    return np.maximum(low, first - _WIDEST_DRAW), np.minimum(high, first + _WIDEST_DRAW)
