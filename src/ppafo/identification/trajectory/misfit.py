"""Does the model explain all recordings with one set of numbers? Fits of parts are compared with the joint fit.

The joint cost less the sum of the costs of separate fits is a quadratic form of what pulls each part away from the
joint optimum. Where the model is right it is a sum of squares of normal numbers; where something is missing, parts
want different numbers. Residuals alone say less, for a flexible noise model takes misfit for noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.trajectory.information import inverse_with_root, solution
from ppafo.identification.trajectory.posterior import LinearModel, NoiseDraw, draw_posterior, whiten
from ppafo.identification.trajectory.preparation import Floats, PreparedExperiment
from ppafo.identification.trajectory.sensor_noise import SensorNoise, sensor_noise
from ppafo.identification.trajectory.weighing import WhitenedFit
from ppafo.identification.trajectory.whitening import Drift

ALARM = 5.0e-4
"""Chance below which one of the comparisons is called a misfit.

It is small because the chances are those of a linear model; an impact between two samples makes low ones more frequent.
"""

_SMALLEST_FRACTION = 0.02
"""Directions of which a part knows less than this fraction are not compared: its fit would leave the linear range."""
_SEEN = 0.05
_DRAWS = 180
"""Every tenth is compared: of 60 the chance of one fit was 0.001 or 0.065, as the seed had it; of 180 0.02 to 0.05."""
_HEAVY = 5.0
"""Degrees of freedom below which tails are heavy everywhere, and not at an impact alone."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """The joint fit against separate fits of ``parts``.

    ``saved`` is twice the cost that these save, ``freedom`` what is expected of it where the model is right, ``chance``
    the probability of as much then, ``worst`` the part that pulls most.
    """

    parts: str
    saved: float
    freedom: float
    chance: float
    worst: str


@dataclass(frozen=True, slots=True)
class Misfit:
    """All comparisons, and for each coordinate the only part that speaks of it, empty where several do."""

    comparisons: tuple[Comparison, ...]
    alone: tuple[str, ...]

    @property
    def is_found(self) -> bool:
        """Whether parts of the recordings want different numbers."""
        return any(one.chance < ALARM for one in self.comparisons)

    @property
    def in_words(self) -> str:
        """The comparison that says most, in a sentence."""
        if not self.comparisons:
            return "there is one part only, so the model could not be tested against itself"
        one = min(self.comparisons, key=lambda item: item.chance)
        description = (
            f"{one.parts} fitted separately lower the misfit by {one.saved:.3g} where {one.freedom:.3g} is expected"
        )
        chance = f"chance {one.chance:.2g}" if one.chance >= 1.0e-6 else "chance below 1e-6"
        return f"{description} ({chance}; most in {one.worst})" if self.is_found else f"{description} ({chance})"


def misfit_of(found: WhitenedFit, together: Sequence[NoiseDraw], seed: int) -> Misfit:
    """Return what fits of parts say against the joint fit, over draws of the noise.

    The noise is that of the finest parts, each fitted apart: what is left of the joint fit has the misfit in it, and
    would hide it. Not so where tails are heavy: a sample that a part fits by itself alone would weigh much, so that
    the noise is that of the joint fit, of which ``together`` are draws.
    """
    model, kept = found.model, len(found.optimum.point)
    labels = _labels(found.optimum.residuals.experiments)
    apart, noises = _fit_apart(found, labels)
    _, draws = draw_posterior(apart, noises, kept, seed, chains=1, count=_DRAWS)
    atoms = [_atoms(model, _join_noise(*pair), labels, kept) for pair in zip(draws, together, strict=False)]
    halves = [f"{label} half" for label in ("first", "second")]
    kinds = {
        "experiments": [one for one, _, _ in labels],
        "channels": [one for _, one, _ in labels],
        "experiments and channels": [f"{one} of {other}" for other, one, _ in labels],
        "first and second halves": halves,
    }
    comparisons = []
    for parts, names in kinds.items():
        keys = [name for name in names for _ in range(2)] if names is not halves else halves * len(labels)
        if len(set(keys)) > 1:
            comparisons.append(_comparison(parts, keys, atoms, model, kept))
    return Misfit(tuple(comparisons), _only_channels(labels, atoms))


def _join_noise(apart: NoiseDraw, together: NoiseDraw) -> NoiseDraw:
    """Return the noise of sensors fitted apart, and that of the joint fit for those whose tails are heavy even then.

    A few samples at an impact that the model misses make tails look somewhat heavy, but no more.
    """
    chosen = [together if one.freedom < _HEAVY else apart for one in apart.noises]
    return NoiseDraw(
        noises=tuple(draw.noises[place] for place, draw in enumerate(chosen)),
        weights=tuple(draw.weights[place] for place, draw in enumerate(chosen)),
        mean=together.mean,
    )


def _fit_apart(
    found: WhitenedFit, labels: Sequence[tuple[str, str, slice]]
) -> tuple[LinearModel, tuple[SensorNoise, ...]]:
    """Return the linear model with columns of its own for each channel of each recording, and the noise it leaves."""
    model, kept = found.model, len(found.optimum.point)
    weights = [sensor.weights for sensor in found.sensors]
    rows = whiten(model, found.noises, weights)[:, :kept]
    _, root = inverse_with_root(rows.T @ rows + model.precision[:kept, :kept])
    blocks = []
    for _, _, place in labels:
        values, vectors = np.linalg.eigh(root.T @ (rows[place].T @ rows[place]) @ root)
        is_known = values > _SMALLEST_FRACTION
        block = np.zeros((len(rows), int(is_known.sum())))
        block[place] = model.columns[place, :kept] @ root @ vectors[:, is_known] / np.sqrt(values[is_known])
        blocks.append(block)
    columns = np.hstack([*blocks, model.columns[:, kept:]])
    width = columns.shape[1] - 1
    apart = LinearModel(columns, model.sensors, np.zeros(width), np.zeros((width, width)))
    whole = whiten(apart, found.noises, weights)
    columns[:, -1] -= columns[:, :-1] @ np.linalg.lstsq(whole[:, :-1], whole[:, -1], rcond=None)[0]
    # Parts take much of a slow drift with them. Its numbers are drawn without their columns, but from what they leave,
    # which may look white, the draws would not find it again.
    noises = [
        sensor.noise
        if isinstance(sensor.noise.shape, Drift)
        else sensor_noise(apart.segments(apart.residuals, place), sensor.is_given)
        for place, sensor in enumerate(found.sensors)
    ]
    return apart, tuple(noises)


@dataclass(frozen=True, slots=True)
class _Atoms:
    """Information and pull of each half of each channel of each recording, hum taken out."""

    information: Floats
    pull: Floats


def _labels(experiments: Sequence[PreparedExperiment]) -> list[tuple[str, str, slice]]:
    found, first = [], 0
    for prepared in experiments:
        for channel in prepared.channels:
            found.append((prepared.label, channel.name, slice(first, first + len(channel.values))))
            first += len(channel.values)
    return found


def _atoms(model: LinearModel, draw: NoiseDraw, labels: Sequence[tuple[str, str, slice]], kept: int) -> _Atoms:
    rows = whiten(model, draw.noises, draw.weights)
    products = rows.T @ rows
    mean = -solution(products[:-1, :-1] + model.precision, products[:-1, -1] + model.pull)
    slopes, left = rows[:, :kept], rows[:, -1] + rows[:, :-1] @ mean
    if rows.shape[1] > kept + 1:
        basis = np.linalg.qr(rows[:, kept:-1])[0]
        slopes = slopes - basis @ (basis.T @ slopes)
    information, pull = [], []
    scale = 1.0 / np.maximum(np.diag(slopes.T @ slopes), 1.0e-300)
    for _, _, place in labels:
        own = slopes[place]
        known = np.cumsum(np.square(own) @ scale)
        middle = place.start + int(np.searchsorted(known, 0.5 * known[-1])) + 1
        for part in (slice(place.start, middle), slice(middle, place.stop)):
            information.append(slopes[part].T @ slopes[part])
            pull.append(slopes[part].T @ left[part])
    return _Atoms(np.array(information), np.array(pull))


def _comparison(parts: str, keys: Sequence[str], atoms: Sequence[_Atoms], model: LinearModel, kept: int) -> Comparison:
    names = list(dict.fromkeys(keys))
    saved, freedom, chances = [], [], []
    contributions = np.zeros(len(names))
    for one in atoms:
        joined = [[index for index, key in enumerate(keys) if key == name] for name in names]
        information = np.array([one.information[places].sum(axis=0) for places in joined])
        pull = np.array([one.pull[places].sum(axis=0) for places in joined])
        squares, mean, chance = _quadratic(information, pull, model.precision[:kept, :kept])
        contributions += squares
        saved.append(float(squares.sum()))
        freedom.append(mean)
        chances.append(chance)
    worst = names[int(np.argmax(contributions))]
    return Comparison(parts, float(np.mean(saved)), float(np.mean(freedom)), float(np.mean(chances)), worst)


def _quadratic(information: Floats, pull: Floats, prior: Floats) -> tuple[Floats, float, float]:
    """Return what each part would save, what is expected in all, and the chance of as much (Satterthwaite)."""
    from scipy.stats import chi2

    joint = information.sum(axis=0) + prior
    _, root = inverse_with_root(joint)
    count, width = pull.shape
    steps, known = [], []
    for own, along in zip(information, pull, strict=True):
        values, vectors = np.linalg.eigh(root.T @ own @ root)
        chosen = vectors[:, values > _SMALLEST_FRACTION]
        steps.append((root @ chosen).T @ along / np.sqrt(values[values > _SMALLEST_FRACTION]))
        known.append((root @ chosen) / np.sqrt(values[values > _SMALLEST_FRACTION]))
    squares = np.array([float(one @ one) for one in steps])
    # The pulls of the parts at the joint optimum are those of independent noise less what the optimum took out.
    spread = np.zeros((count * width, count * width))
    for first in range(count):
        for second in range(count):
            block = -information[first] @ root @ root.T @ information[second]
            if first == second:
                block = block + information[first]
            spread[first * width : (first + 1) * width, second * width : (second + 1) * width] = block
    whole = np.zeros((count * width, sum(one.shape[1] for one in known)))
    column = 0
    for index, one in enumerate(known):
        whole[index * width : (index + 1) * width, column : column + one.shape[1]] = one
        column += one.shape[1]
    matrix = whole.T @ spread @ whole
    mean, square = float(np.trace(matrix)), float(np.sum(matrix * matrix))
    if mean < 0.5:
        return squares, mean, 1.0
    stretch = square / mean
    return squares, mean, float(chi2.sf(squares.sum() / stretch, mean / stretch))


def _only_channels(labels: Sequence[tuple[str, str, slice]], atoms: Sequence[_Atoms]) -> tuple[str, ...]:
    """Return, for each coordinate, the channel of the recording that has nearly all that is known of it."""
    known = np.mean([np.einsum("aii->ai", one.information) for one in atoms], axis=0)
    pairs = known[0::2] + known[1::2]
    fractions = pairs / np.maximum(pairs.sum(axis=0), 1.0e-300)
    found = []
    for index in range(fractions.shape[1]):
        best = int(np.argmax(fractions[:, index]))
        name = f"{labels[best][1]} of {labels[best][0]}"
        found.append(name if fractions[best, index] > 1.0 - _SEEN else "")
    return tuple(found)
