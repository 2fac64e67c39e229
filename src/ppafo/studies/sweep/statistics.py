"""Mean, spread and quantiles of a column that is read chunk by chunk, exact and in bounded memory.

The quantile of share q of n sorted values is the value at place (n - 1) q, on a line between its neighbours: definition
7 of Hyndman and Fan (The American Statistician, 1996). The standard deviation divides by n - 1.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.studies.sweep.sampling.distributions import Floats

QUANTILE_DEFINITION = (
    "value at place (n - 1) q of the n sorted values, on a line between neighbours (Hyndman and Fan 1996, definition 7)"
)
MOST_IN_MEMORY = 16_000_000
"""Values up to which a column is sorted in memory; beyond, order statistics are looked up digit by digit."""

_DIGIT_BITS, _DIGITS = 16, 4
_SIGN = np.uint64(1 << 63)

Parts = Callable[[], Iterator[Floats]]
"""Gives the finite values of a column anew each time, in parts whose order is always the same."""


def described(parts: Parts, shares: Sequence[float]) -> dict[str, Any]:
    """Return count, and unless it is 0 mean, standard deviation (from 2 values on), extremes and quantiles by share."""
    sums = [(part.size, float(np.sum(part)), float(part.min()), float(part.max())) for part in parts() if part.size]
    count = sum(item[0] for item in sums)
    if count == 0:
        return {"count": 0}
    mean = math.fsum(item[1] for item in sums) / count
    squares = math.fsum(float(np.sum((part - mean) ** 2)) for part in parts())
    return {
        "count": count,
        "mean": mean,
        **({"sd": math.sqrt(squares / (count - 1))} if count > 1 else {}),
        "minimum": min(item[2] for item in sums),
        "maximum": max(item[3] for item in sums),
        "quantiles": {f"{share:g}": value for share, value in quantiles(parts, count, shares).items()},
    }


def quantiles(parts: Parts, count: int, shares: Sequence[float]) -> dict[float, float]:
    """Return the quantile of each share."""
    if count <= MOST_IN_MEMORY:
        values = np.quantile(np.concatenate(list(parts())), shares, method="linear", overwrite_input=True)
        return dict(zip(shares, values.tolist(), strict=True))
    places = {share: divmod((count - 1) * share, 1.0) for share in shares}
    ranks = sorted({min(int(low) + up, count - 1) for low, _ in places.values() for up in (0, 1)})
    sorted_values = order_statistics(parts, ranks)
    found = {}
    for share, (low, inside) in places.items():
        below, above = sorted_values[int(low)], sorted_values[min(int(low) + 1, count - 1)]
        found[share] = below + inside * (above - below)
    return found


def order_statistics(parts: Parts, ranks: Sequence[int]) -> dict[int, float]:
    """Return the values at ranks (from 0) of the sorted column, by a radix selection: four passes over the parts."""
    known = dict.fromkeys(ranks, (0, 0))
    for digit in range(_DIGITS):
        counts = _digit_counts(parts, digit, {prefix for prefix, _ in known.values()})
        for rank, (prefix, below) in known.items():
            cumulated = np.cumsum(counts[prefix])
            place = int(np.searchsorted(cumulated, rank - below, side="right"))
            before = int(cumulated[place - 1]) if place else 0
            known[rank] = ((prefix << _DIGIT_BITS) | place, below + before)
    return {rank: _number(key) for rank, (key, _) in known.items()}


def _digit_counts(parts: Parts, digit: int, prefixes: set[int]) -> dict[int, NDArray[np.int64]]:
    """Return how often each value of a digit comes behind each prefix of higher digits."""
    shift = np.uint64(_DIGIT_BITS * (_DIGITS - 1 - digit))
    size = 1 << _DIGIT_BITS
    counts = {prefix: np.zeros(size, dtype=np.int64) for prefix in prefixes}
    for part in parts():
        keys = _keys(part) >> shift
        for prefix in prefixes:
            own = keys if digit == 0 else keys[(keys >> np.uint64(_DIGIT_BITS)) == np.uint64(prefix)]
            counts[prefix] += np.bincount((own & np.uint64(size - 1)).astype(np.int64), minlength=size)
    return counts


def _keys(values: Floats) -> NDArray[np.uint64]:
    """Return whole numbers in the same order as the values."""
    bits = np.ascontiguousarray(values).view(np.uint64)
    return np.where(bits & _SIGN != 0, ~bits, bits | _SIGN)


def _number(key: int) -> float:
    """Return the value that has a key."""
    bits = key ^ (1 << 63) if key >> 63 else key ^ (2**64 - 1)
    return float(np.array(bits, dtype=np.uint64).view(np.float64))
