"""Before the search: are the recordings sound, is anything excited, and which numbers cannot be had from them?"""

import numpy as np

from ppafo.identification.check import Prospect
from ppafo.identification.trajectory.information import correlation, covariance, directions_for, precision
from ppafo.identification.trajectory.preparation import Floats, Measured, Prepared
from ppafo.identification.trajectory.problem import Search
from ppafo.identification.trajectory.ranges import Range
from ppafo.identification.trajectory.residuals import FIRST_STEP, Residuals, prior_coordinates
from ppafo.identification.trajectory.search import is_at_bound
from ppafo.identification.trajectory.verdicts import STRONG, interval_factor, relative_to_number

EXCITED = 5.0
"""Range of a channel over its noise below which nothing happens in it."""

_HELD_SAMPLES = 20
_GAP = 1.5
_FROM_PRIOR = 0.8


def prospects_of(residuals: Residuals, search: Search) -> tuple[Prospect, ...]:
    """Return what the recordings can give and what not, from the samples and the slopes at the start of the search."""
    quality = [
        prospect
        for prepared in residuals.experiments
        for prospect in (*_clocks(prepared), *(_channel(prepared, channel) for channel in prepared.channels))
    ]
    return (*quality, *_numbers(residuals, search))


def _clocks(prepared: Prepared) -> list[Prospect]:
    gaps = np.diff(prepared.time)
    usual = float(np.median(gaps))
    longest = float(gaps.max())
    if longest <= _GAP * usual:
        return []
    at = float(prepared.time[int(np.argmax(gaps))])
    told = f"a gap of {longest:.3g} s at {at:.3g} s, where samples are {usual:.3g} s apart; what lies in it is not used"
    return [Prospect(f"clock of {prepared.label}", True, told)]


def _channel(prepared: Prepared, channel: Measured) -> Prospect:
    """Return whether a channel moves, and is not cut off at the limit of its sensor."""
    name, size = f"{channel.name} of {prepared.label}", float(np.ptp(channel.values)) / channel.noise
    held = _held_at_limit(channel.values)
    if held > _HELD_SAMPLES:
        told = f"{held} samples in a row are exactly its greatest or least: the sensor is at its limit or stuck"
        return Prospect(name, False, told)
    if size < EXCITED:
        return Prospect(name, False, f"its range is {size:.2g} times its noise: nothing happens in it")
    return Prospect(name, True, f"its range is {size:.3g} times its noise")


def _held_at_limit(values: Floats) -> int:
    """Return the longest run of samples that all have the greatest or all have the least value."""
    longest = 0
    for limit in (float(values.max()), float(values.min())):
        is_there = np.concatenate([[False], values == limit, [False]])
        changes = np.flatnonzero(np.diff(is_there.astype(np.int8)))
        longest = max(longest, int(np.max(changes[1::2] - changes[::2], initial=0)))
    return longest


def _numbers(residuals: Residuals, search: Search) -> list[Prospect]:
    """Return for each number how well white noise of the estimated size would let it be known, at the start values."""
    ranges = residuals.ranges
    point = np.array([item.coordinate(item.start) for item in ranges])
    fixed = is_at_bound(point, ranges)
    if not np.isfinite(residuals.of_data(point[None, :])).all():
        return [Prospect("numbers", False, "the model diverges at the start values, so nothing is known beforehand")]
    known = precision(residuals.around(point, np.diag(np.full(len(point), FIRST_STEP))), "linear")
    known = precision(residuals.around(point, directions_for(known, fixed)), "linear")
    errors, together = np.sqrt(np.diag(covariance(known))), correlation(covariance(known))
    _, prior, _ = prior_coordinates(ranges)
    return [
        _number(item, float(errors[index]), float(prior[index]), _partners(ranges, together, index), search)
        for index, item in enumerate(ranges)
    ]


def _number(item: Range, error: float, prior: float, partners: str, search: Search) -> Prospect:
    share = relative_to_number(item, item.coordinate(item.start), interval_factor(search.confidence) * error)
    if error > _FROM_PRIOR * prior:
        return Prospect(item.name, False, "the recordings add little to its prior")
    if share <= search.weak:
        return Prospect(item.name, True, f"white noise alone would leave it known to {100.0 * share:.2g} %")
    against = f"it trades against {partners}" if partners else "the recordings hardly react to it"
    return Prospect(item.name, False, f"{against}; hold it, give it a prior, or record something else")


def _partners(ranges: tuple[Range, ...], together: Floats, index: int) -> str:
    row = together[index]
    return ", ".join(ranges[other].name for other in range(len(ranges)) if other != index and abs(row[other]) >= STRONG)
