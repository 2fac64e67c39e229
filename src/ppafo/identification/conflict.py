"""Consistency tests of the recordings (Hausman): sensors, recordings, groups of rows and stated limits."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm
from scipy.stats import f as fisher
from scipy.stats import t as student

from ppafo.identification.noise import Noise
from ppafo.identification.residuals import FitRuns, Flags
from ppafo.identification.whitened import root_of_inverse
from ppafo.signals.recording import Floats

SMOOTH = "noise"
"""Marker in ``Conflict.number`` for residuals too smooth to be noise; ``standard_errors`` is then 1 / innovation."""

SHAPE = "shape"
"""Marker in ``Conflict.number`` for residuals whose neighbours have the same sign; the law has another shape."""

STATED = "stated limit"
"""Marker in ``Conflict.group`` for recordings that contradict the stated limit of a tolerance."""

_SMOOTHEST = 0.15
"""Relative innovation [-] below which residuals do not count as noise; a first-order lag of 90 samples gives 0.15.

Noise with a lag of 33 samples, 0.24, is estimated down to 0.19 in two recordings of 500 samples.
"""

_SIGNIFICANCE = 0.01
"""Significance level [-] of a difference between estimates."""
_BY_CHANCE = 0.001
"""Significance level [-] of residuals that follow each other, about 3.1 standard errors of their correlation."""
_PARTING = 0.05
"""Smallest relative excess of a group's variance over the common variance [-] for a direction to be tested."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """Part of the data whose separate estimates differ significantly from the common estimates (Hausman's test).

    ``group`` is a sensor ("pressure_1"), a recording ("back"), a channel of a recording ("pressure_1 of back"), another
    group ("rising branch"), or ``STATED``. ``number`` is the quantity that differs most, by ``standard_errors``
    standard errors. ``p`` is the probability of such a difference in any group if the model is right.
    """

    group: str
    number: str
    standard_errors: float
    p: float


def _groups(runs: FitRuns) -> Iterator[tuple[str, list[slice]]]:
    """Yield name and rows of every sensor, recording, channel of a recording and named group, without duplicates."""
    labels = [
        (block.channel, block.recording, f"{block.channel} of {block.recording}", *block.groups)
        for block in runs.blocks
    ]
    known = {tuple((block.rows.start, block.rows.stop) for block in runs.blocks)}
    for column in zip(*labels, strict=True):
        for name in dict.fromkeys(column):
            rows = [block.rows for block, label in zip(runs.blocks, column, strict=True) if label == name]
            key = tuple((part.start, part.stop) for part in rows)
            if key not in known:
                known.add(key)
                yield name, rows


def too_smooth(sensors: Mapping[str, Noise]) -> Conflict | None:
    """Return a conflict for the channel with the smoothest residuals if they are too smooth to be noise, else None."""
    channel, noise = min(sensors.items(), key=lambda item: item[1].innovation)
    return Conflict(channel, SMOOTH, 1.0 / noise.innovation, 0.0) if noise.innovation < _SMOOTHEST else None


def wrong_shape(sensor: str, series: Sequence[Floats]) -> Conflict | None:
    """Return a conflict if neighbouring residuals of a sensor follow each other, as noise does not; else None.

    ``series`` are residuals divided by their noise [-], each in order of what the law predicts. Their correlation with
    the next one times the root of the count is standard normal under white noise.
    """
    size = sum(float(values @ values) for values in series)
    count = sum(values.size - 1 for values in series)
    # Residuals below the floor are rounding, and no noise.
    if count < 1 or size < 0.5 * sum(values.size for values in series):
        return None
    errors = sum(float(values[1:] @ values[:-1]) for values in series) / size * math.sqrt(count)
    p = float(norm.sf(errors))
    return Conflict(sensor, SHAPE, errors, p) if p < _BY_CHANCE else None


def conflict_of(runs: FitRuns, rows: Floats, point: Floats, free: Flags, freedom: float) -> Conflict | None:
    """Return the group of rows whose separate estimates differ most from the common estimates; None if insignificant.

    Hausman's test: the estimate of a group alone differs by d = -H_g^-1 (J_g' r_g + P (z - m)), with covariance H_g^-1
    - C. With C = L L' and the eigenvalues a of L' H_g L, both are diagonal: d'(H_g^-1 - C)^-1 d is the sum of q^2 / (a
    (1 - a)).
    """
    errors, slopes = rows[:, 0], rows[:, 1:][:, free]
    prior, shift = np.square(runs.prior[free]), (point - runs.start)[free]
    root, seen = root_of_inverse(slopes.T @ slopes + np.diag(prior))
    root = root[:, seen]
    variance = np.square(root).sum(axis=1)
    groups, worst = list(_groups(runs)), None
    names = np.array([number.name for number in runs.numbers])[free]
    count_of_tests = len(groups) + int((prior > 0.0).sum())
    for name, parts in groups:
        group = np.concatenate([slopes[part] for part in parts])
        pull = group.T @ np.concatenate([errors[part] for part in parts]) + prior * shift
        alone, turned = np.linalg.eigh(root.T @ (group.T @ group + np.diag(prior)) @ root)
        # In other directions the group is nearly all that is known, or says nothing: both differences are 0 over 0.
        tested = (alone > 1.0e-6) & (alone < 1.0 / (1.0 + _PARTING))
        count = int(tested.sum())
        if not count:
            continue
        alone, axes = alone[tested], root @ turned[:, tested]
        along = axes.T @ pull
        statistic = float(np.sum(np.square(along) / (alone * (1.0 - alone))))
        p = min(float(fisher.sf(statistic / count, count, freedom)) * count_of_tests, 1.0)
        if p < _SIGNIFICANCE and (worst is None or p < worst.p):
            moved = np.abs(axes @ (along / alone))
            spread = np.sqrt(np.square(axes) @ (1.0 / alone - 1.0))
            # A number of which the group says nothing moves by rounding alone. Along one direction all part as far.
            ratios = np.where(spread > 1.0e-6 * np.sqrt(variance), moved / np.maximum(spread, 1.0e-300), 0.0)
            most = int(np.argmax(ratios > (1.0 - 1.0e-6) * ratios.max()))
            worst = Conflict(group=name, number=str(names[most]), standard_errors=float(ratios[most]), p=p)
    # What is stated of a tolerance is a group of its own: its mean parts from the fit by deviation^2 - C.
    own_variance = 1.0 / np.maximum(prior, 1.0e-300) - variance
    for index in np.flatnonzero((prior > 0.0) & (own_variance >= _PARTING * variance)).tolist():
        ratio = abs(float(shift[index])) / math.sqrt(float(own_variance[index]))
        p = min(2.0 * float(student.sf(ratio, freedom)) * count_of_tests, 1.0)
        if p < _SIGNIFICANCE and (worst is None or p < worst.p):
            worst = Conflict(group=STATED, number=str(names[index]), standard_errors=ratio, p=p)
    families = np.array([number.family for number in runs.numbers])[free]
    for family in dict.fromkeys(families[prior > 0.0].tolist()):
        members = np.flatnonzero((families == family) & (prior > 0.0))
        if family and len(members) > 1 and worst is None:
            worst = _of_family(
                names[members],
                shift[members] * np.sqrt(prior[members]),
                root[members] * np.sqrt(prior[members])[:, None],
            )
    return worst


def _of_family(names: NDArray[np.str_], moved: Floats, root: Floats) -> Conflict | None:
    """Return the most exceeded stated limit of a family of tolerances, None if the family as a whole is consistent.

    ``moved`` are the estimated tolerances and ``root`` is a square root of their covariance, both divided by the prior
    standard deviations [-]. Directions that the unknowns of the fit absorb are not tested.
    """
    known, axes = np.linalg.eigh(np.eye(len(names)) - root @ root.T)
    tested = known > _PARTING
    count = int(tested.sum())
    if not count:
        return None
    # What is stated is known, and no estimate: so this is chi-square, not F.
    p = float(chi2.sf(float(np.sum(np.square(axes.T @ moved)[tested] / known[tested])), count))
    ratios = np.abs(moved) / np.sqrt(np.maximum(1.0 - np.square(root).sum(axis=1), _PARTING))
    most = int(np.argmax(ratios))
    return Conflict(STATED, str(names[most]), float(ratios[most]), p) if p < _SIGNIFICANCE else None
