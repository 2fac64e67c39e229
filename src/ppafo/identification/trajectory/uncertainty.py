"""How far estimates may be from the truth: misfit of the model, intervals, and the verdict of each in words.

Does the model explain all recordings with one set of numbers? Fits of parts are compared with the joint fit. The joint
cost less the sum of the costs of separate fits is a quadratic form of what pulls each part away from the joint optimum.
Where the model is right it is a sum of squares of normal numbers; where something is missing, parts want different
numbers. Residuals alone say less, for a flexible noise model takes misfit for noise.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.estimate import Estimate, Verdict, interval_factor
from ppafo.identification.noise.choice import Left, sensor_noises
from ppafo.identification.noise.sensor_noise import SensorNoise
from ppafo.identification.noise.shapes import Drift
from ppafo.identification.trajectory.information import (
    covariance,
    data_information,
    inverse_with_root,
    prior_information,
    solution,
)
from ppafo.identification.trajectory.posterior import (
    DRAWS,
    HEAVY_DRAWS,
    LinearModel,
    Mixture,
    NoiseDraw,
    draw_posterior,
    whiten,
)
from ppafo.identification.trajectory.problem import Range, Search, is_nuisance
from ppafo.identification.trajectory.residuals import Floats
from ppafo.identification.trajectory.search import Sensor, WhitenedFit, is_at_bound
from ppafo.units import percentage

ALARM = 5.0e-4
"""Chance below which one of the comparisons is called a misfit.

It is small because the chances are those of a linear model; an impact between two samples makes low ones more frequent.
"""
DOUBTFUL = 0.01
"""Chance below which one of them is worth a fit with each effect that the model may lack."""

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
    def is_doubtful(self) -> bool:
        """Whether chance makes parts of the recordings differ as much in few cases only: worth a closer look."""
        return any(one.chance < DOUBTFUL for one in self.comparisons)

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
    the noise is that of the joint fit, of which ``together`` are draws. A few samples at an impact that the model
    misses make tails look somewhat heavy, but no more.
    """
    model, kept = found.model, len(found.optimum.point)
    labels: list[tuple[str, str, slice]] = []
    first = 0
    for prepared in found.optimum.residuals.experiments:
        for channel in prepared.channels:
            labels.append((prepared.label, channel.name, slice(first, first + len(channel.values))))
            first += len(channel.values)
    apart, noises = _fit_apart(found, labels)
    _, draws = draw_posterior(apart, noises, kept, seed, chains=1, count=_DRAWS)
    atoms = []
    for alone, joint in zip(draws, together, strict=False):
        chosen = list(enumerate(joint if one.freedom < _HEAVY else alone for one in alone.noises))
        noise = NoiseDraw(
            noises=tuple(draw.noises[place] for place, draw in chosen),
            weights=tuple(draw.weights[place] for place, draw in chosen),
            mean=joint.mean,
        )
        atoms.append(_atoms(model, noise, labels, kept))
    # An atom is half of a channel of a recording; each kind of parts joins atoms of one name.
    kinds = {
        "experiments": [one for one, _, _ in labels for _ in range(2)],
        "channels": [one for _, one, _ in labels for _ in range(2)],
        "experiments and channels": [f"{one} of {other}" for other, one, _ in labels for _ in range(2)],
        "first and second halves": ["first half", "second half"] * len(labels),
    }
    comparisons = tuple(
        _comparison(parts, keys, atoms, model, kept) for parts, keys in kinds.items() if len(set(keys)) > 1
    )
    # For each coordinate, the channel of the recording that has nearly all that is known of it.
    known = np.mean([np.einsum("aii->ai", one.information) for one in atoms], axis=0)
    pairs = known[0::2] + known[1::2]
    fractions = pairs / np.maximum(pairs.sum(axis=0), 1.0e-300)
    best = np.argmax(fractions, axis=0)
    only = [
        f"{labels[row][1]} of {labels[row][0]}" if fractions[row, index] > 1.0 - _SEEN else ""
        for index, row in enumerate(best.tolist())
    ]
    return Misfit(comparisons, tuple(only))


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
    likely = sensor_noises(
        [
            Left(apart.segments(apart.residuals, place), sensor.is_given, sensor.courses)
            for place, sensor in enumerate(found.sensors)
        ]
    )
    noises = [
        sensor.noise if isinstance(sensor.noise.shape, Drift) else one
        for sensor, one in zip(found.sensors, likely, strict=True)
    ]
    return apart, tuple(noises)


@dataclass(frozen=True, slots=True)
class _Atoms:
    """Information and pull of each half of each channel of each recording, hum taken out."""

    information: Floats
    pull: Floats


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


STRONG = 0.8
"""Correlation from which two numbers are reported as trading off against each other."""

_CONDITIONAL: tuple[Verdict, ...] = ("identified", "weak")
_MAXIMUM_PARTNERS = 3
_LARGEST_LOGARITHM = 300.0
_FREED = 0.5
"""An interval that would shrink below this fraction with all others known is wide because of a trade."""
FROM_PRIOR = 0.8
"""A standard error above this fraction of the prior's says that the recordings added little to it."""


@dataclass(frozen=True, slots=True)
class WithEffect:
    """A fit with an effect that the model lacks: what it is called in a sentence, coordinates and standard errors.

    The errors are None where the fit takes one form of the effect for granted, so that they say too little.
    """

    title: str
    point: Floats
    errors: Floats | None


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a verdict is made of, in coordinates: point, information of data and priors, covariance, bounds, sources.

    ``interval`` has the ends of the intervals, ``beside`` those with effects that nothing shows, and ``conditions``
    says for each parameter which of these must not be, empty for none. ``misfit`` says why the model is wrong, empty
    where it is not, and ``with_effect`` has the effect that would make it right; ``alone`` names for each parameter the
    only channel that speaks of it, empty where several do.
    """

    ranges: tuple[Range, ...]
    point: Floats
    interval: tuple[Floats, Floats]
    information: Floats
    covariance: Floats
    correlation: Floats
    low: Floats
    high: Floats
    prior_deviation: Floats
    inflation: float
    residual_check: str
    misfit: str
    alone: tuple[str, ...]
    sources: tuple[tuple[str, ...], ...]
    search: Search
    conditions: tuple[str, ...] = ()
    beside: tuple[Floats, Floats] | None = None
    with_effect: WithEffect | None = None


_ANYWHERE = 0.99
"""Width of an interval over that of an even distribution between the bounds from which a number may be anything."""


def estimate_of(evidence: Evidence, index: int) -> Estimate:
    """Return the estimate of one parameter."""
    item, at = evidence.ranges[index], float(evidence.point[index])
    half = 0.5 * float(evidence.interval[1][index] - evidence.interval[0][index])
    furthest = _LARGEST_LOGARITHM if item.scale == "log" else math.inf

    def ends(pair: tuple[Floats, Floats]) -> tuple[float, float]:
        one, other = (item.number(float(np.clip(end[index], -furthest, furthest))) for end in pair)
        return max(min(one, other), item.low), min(max(one, other), item.high)

    low, high = ends(evidence.interval)
    # Such a number ends at either bound, and is not known at one more than at the other.
    room = item.coordinate(item.high) - item.coordinate(item.low)
    is_anywhere = 2.0 * half >= _ANYWHERE * evidence.search.confidence * room
    fraction = math.inf if is_anywhere else relative_half_width(evidence, index, half)
    if item.is_tolerance:
        verdict, explanation = _of_bench(item, item.number(at), low, high)
    else:
        verdict = _verdict(evidence, index, fraction)
        explanation = _explanation(evidence, index, verdict, fraction)
    condition, beside = "", None
    is_asked = verdict in _CONDITIONAL and not is_nuisance(item)
    if evidence.beside is not None and is_asked and evidence.conditions[index]:
        condition, beside = f"if {evidence.conditions[index]}", ends(evidence.beside)
        explanation += (
            " These recordings cannot show whether that is so; if not, the interval is the one behind 'else'."
        )
    if evidence.with_effect is not None and verdict == "holds for this model only":
        effect = evidence.with_effect
        unit = f" {item.unit}".removesuffix(" -").removesuffix(" 1")
        explanation += f" Fitted with {effect.title} it is {item.number(float(effect.point[index])):.6g}{unit}"
        if effect.errors is not None:
            reach = interval_factor(evidence.search.confidence) * math.sqrt(evidence.inflation)
            half_with = reach * effect.errors
            least, most = ends((effect.point - half_with, effect.point + half_with))
            explanation += f", {least:.6g} to {most:.6g}{unit} whatever its form"
        explanation += "."
    return Estimate(
        path=item.name,
        value=item.number(at),
        unit=item.unit,
        low=low,
        high=high,
        verdict=verdict,
        explanation=explanation,
        recordings=evidence.sources[index],
        confidence=evidence.search.confidence,
        condition=condition,
        beside=beside,
    )


def relative_half_width(evidence: Evidence, index: int, half: float) -> float:
    """Return a half width in coordinates over the number [-]; over its range where the search began at zero."""
    return relative_to_number(evidence.ranges[index], float(evidence.point[index]), half)


def relative_to_number(item: Range, at: float, half: float) -> float:
    """Return a half width in coordinates relative to the number at a coordinate, as ``relative`` does."""
    if item.scale == "log":
        return half
    value = abs(item.number(at))
    reference = max(value, item.size) if item.start == 0.0 else value
    return half * item.size / reference if reference > 0.0 else math.inf


def partners(evidence: Evidence, index: int) -> list[tuple[str, float]]:
    """Return the parameters that trade against one, with the correlation [-], strongest first."""
    row = evidence.correlation[index]
    order = [int(other) for other in np.argsort(-np.abs(row)) if other != index and abs(row[other]) >= STRONG]
    return [(evidence.ranges[other].name, float(row[other])) for other in order[:_MAXIMUM_PARTNERS]]


def _verdict(evidence: Evidence, index: int, fraction: float) -> Verdict:
    # A number that the data do not hold may end anywhere, at a bound too.
    if _is_prior_alone(evidence, index) or fraction > evidence.search.weak:
        return "not identifiable"
    if is_at_bound(evidence.point, evidence.ranges)[index]:
        return "at its bound"
    if evidence.misfit:
        return "holds for this model only"
    return "identified" if fraction <= evidence.search.identified else "weak"


def _of_bench(item: Range, value: float, low: float, high: float) -> tuple[Verdict, str]:
    """Return whether the interval of a tolerance meets what the bench states, and both in words."""
    assert item.prior is not None
    stated, limit = item.prior.mean, item.prior.standard_deviation * math.sqrt(3.0)
    unit = "" if item.unit in ("1", "-") else f" {item.unit.removesuffix('_d')}"
    text = f"the bench states {stated:.6g} within {limit:.3g}{unit}, the recordings want {value - stated:+.3g}"
    is_beyond = low > stated + limit or high < stated - limit
    return ("beyond its tolerance" if is_beyond else "within its tolerance"), f"{text}."


def _is_prior_alone(evidence: Evidence, index: int) -> bool:
    deviation = float(evidence.prior_deviation[index])
    # Uncertain noise widens what the recordings say, never the prior: the error is that of the posterior as it is.
    error = math.sqrt(float(evidence.covariance[index, index]))
    return math.isfinite(deviation) and error > FROM_PRIOR * deviation


def _explanation(evidence: Evidence, index: int, verdict: Verdict, fraction: float) -> str:
    """Return why, and what the interval rests on; a value of a model that is wrong has no such check."""
    size = percentage(fraction, 2) if fraction < 10.0 else "no useful precision"
    if verdict == "holds for this model only":
        text = f"Determined to {size} if the model were right: {evidence.misfit}"
        alone = evidence.alone[index]
        return (
            f"{text}. Only {alone} shows it, so nothing else here checks it: it needs a prior." if alone else f"{text}."
        )
    others = ", ".join(f"{name} (correlation {number:+.2f})" for name, number in partners(evidence, index))
    if verdict == "identified":
        text = f"The recordings determine it to {size}{f', correlated with {others}' if others else ''}"
    elif verdict == "at its bound":
        item, at = evidence.ranges[index], float(evidence.point[index])
        is_lower = at - evidence.low[index] < evidence.high[index] - at
        side, bound = ("lower", item.low) if is_lower else ("upper", item.high)
        text = f"The search ended at the {side} bound, {bound:.6g} {item.unit}; "
        text += "the interval is valid only inside the bounds"
    elif _is_prior_alone(evidence, index):
        text = "The recordings add little to the prior, which decides the value"
    else:
        # What half the interval would be if all other parameters were known.
        information = float(evidence.information[index, index])
        factor = interval_factor(evidence.search.confidence)
        alone_half = factor * math.sqrt(evidence.inflation / information) if information > 0.0 else math.inf
        free = relative_half_width(evidence, index, alone_half)
        # What may be anything and moves with nothing shows in no residual.
        if free > _FREED * fraction or (math.isinf(fraction) and not others):
            prior = "; no residual shows it, so it needs a prior" if fraction > evidence.search.weak else ""
            text = f"The recordings are hardly sensitive to it: they determine it only to {size}{prior}"
        else:
            known = percentage(free, 2) if free < 10.0 else "no useful precision"
            against = others or "several others at once"
            text = f"It trades off against {against}: determined to {size}, and to {known} if these were known"
    return f"{text}; {evidence.residual_check}."


_TOLD = 1.5


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Distribution of the coordinates about the point of the optimum, and what it is made of.

    ``curvature`` is the information of the recordings with the noise as estimated; ``inflation`` [-] the median over
    all coordinates of the variance over the inverse of that, because the noise is itself uncertain; ``widening`` [-]
    how many times as wide the intervals are as white noise of the size from sample to sample would have them.
    ``low`` and ``high`` are the ends of the intervals in coordinates, ``centre`` the means.
    """

    mixture: Mixture
    covariance: Floats
    curvature: Floats
    inflation: float
    widening: float
    centre: Floats
    low: Floats
    high: Floats
    sensors: tuple[Sensor, ...]
    misfit: Misfit

    @property
    def residual_check(self) -> str:
        """What the intervals rest on, in half a sentence."""
        names = dict.fromkeys(f"{one.channel} {one.in_words}" for one in self.sensors)
        description = f"noise: {'; '.join(names)}"
        if self.widening < _TOLD:
            return description
        return f"{description}; so the interval is {self.widening:.2g} times as wide as with white noise alone"


def uncertainty_of(found: WhitenedFit, search: Search, low: Floats, high: Floats) -> Uncertainty:
    """Return the uncertainty at an optimum of known noise; ``low`` and ``high`` [unit] bound the coordinates."""
    point = found.optimum.point
    kept = len(point)
    count = HEAVY_DRAWS if any(noise.is_heavy for noise in found.noises) else DRAWS
    mixture, shown = draw_posterior(found.model, found.noises, kept, search.seed, count=count)
    matrix, curvature = mixture.covariance, found.optimum.information
    tail = 0.5 - 0.5 * search.confidence
    ends = [
        [
            point[index] + mixture.quantile(index, fraction, low[index] - point[index], high[index] - point[index])
            for index in range(kept)
        ]
        for fraction in (tail, 1.0 - tail)
    ]
    residuals = found.optimum.residuals
    slopes = found.model.slopes[:, :kept]
    white = data_information(slopes, np.ones(len(slopes))) + prior_information(residuals)
    centre = np.clip(point + mixture.mean, low, high)
    return Uncertainty(
        mixture=mixture,
        covariance=matrix,
        curvature=curvature,
        inflation=float(np.median(np.diag(matrix) / np.diag(covariance(curvature)))),
        widening=float(np.sqrt(np.median(np.diag(matrix) / np.diag(covariance(white))))),
        centre=np.clip(centre, ends[0], ends[1]),
        low=np.array(ends[0]),
        high=np.array(ends[1]),
        sensors=found.sensors,
        misfit=misfit_of(found, shown, search.seed),
    )
