"""Which designs of a front to show, and which one to look at first."""

import numpy as np

from ppafo.studies.design.candidates import Floats

MOST_SHOWN = 12


def shares(objectives: Floats) -> Floats:
    """Return objectives (points, objectives) as shares: 0 the best value on the front, 1 the worst."""
    lowest, highest = objectives.min(axis=0), objectives.max(axis=0)
    span = np.where(highest > lowest, highest - lowest, 1.0)
    return np.asarray((objectives - lowest) / span)


def knee(objectives: Floats) -> int:
    """Return the place of the design with the smallest sum of shares.

    What any other design gains in some objectives it loses at least as much of in the rest, counted in shares.
    """
    return int(np.argmin(shares(objectives).sum(axis=1)))


def representatives(objectives: Floats, most: int = MOST_SHOWN) -> tuple[int, ...]:
    """Return places of designs that stand for the front, in its order.

    The best of each objective and the knee first, then always the one farthest from all that are there.
    """
    scaled = shares(objectives)
    chosen = list(dict.fromkeys([*np.argmin(objectives, axis=0).tolist(), knee(objectives)]))[:most]
    distance = np.min([np.linalg.norm(scaled - scaled[place], axis=1) for place in chosen], axis=0)
    while len(chosen) < min(most, objectives.shape[0]) and distance.max() > 0.0:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return tuple(sorted(chosen))
