"""Static torque over rising and falling pressure: torque constant and friction; figure 3, top, of the paper.

While the pressure rises, friction keeps part of the torque from the scale; while it falls, friction adds to it. So

    torque = K dP + T_0 - s (T_s + g (dP - mean dP)),   s = +1 rising, -1 falling

K is the common slope, by equation (2) T = K (P1 - P2), T_s half the distance of the branches, g how the friction
grows with pressure, T_0 the zero of the scale. All are linear, so one regression gives them all. Its intervals stay
honest where readings are not independent of each other: those of one repetition, or of one pressure, share an error.

Where a position or an angle moves with the direction, and not the pressure, the actuator slid, and T_s is its friction
in motion. A ``force`` in place of the torque gives an area and forces, for which a set has no place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CHANCE, exceeds_chance, quantile
from ppafo.identification.bench.result import BenchResult, Evidence, Number, Panel, Role, Series, prospect_of
from ppafo.identification.estimate import Check, Prospect
from ppafo.identification.linear_systems import inverse_of, rank_of, solution_of
from ppafo.identification.source import (
    Source,
    check_moves,
    check_not_clipped,
    check_sources,
    kind_of,
    pauses,
    pool,
    traces,
)
from ppafo.signals.recording import Floats

Labels = NDArray[np.int64]

PROCEDURE = "static-torque"
_OWN = "static_torque"
"""Where the numbers are that no set has a place for."""
_TORQUE, _FORCE = "torque", "force"
_MOVING = ("position", "angle")
MINIMUM_SAMPLES = 6
_MINIMUM_LEVELS = 3
_SLOPE, _ZERO, _FRICTION, _GROWTH = range(4)

_MORE_THAN_FRICTION = 0.3
"""Fraction of its range by which the torque may move at one pressure, as friction turns round."""
_SAG_THAT_HARMS_NOBODY = 0.02
_FEWEST_CLUSTERS = 3
_LEVEL_GAP, _WIDEST_LEVEL, _BINS = 1.0 / 40.0, 1.0 / 8.0, 20
"""Gap between two pressure levels and width of one, over the whole span; equal parts where readings have no levels."""
_FLAT = 0.002
_MOVES_WITH_DIRECTION = 0.5
"""Share of its range by which a channel moves with the direction in a sweep, where that is what the direction is of."""


@dataclass(frozen=True, slots=True)
class StaticTorqueSettings:
    """How sure the intervals are [-], and the relative uncertainty of the sensors' calibration [-], same confidence."""

    confidence: float = 0.95
    calibration: float = 0.0


def static_torque(sources: tuple[Source, ...], settings: StaticTorqueSettings | None = None) -> BenchResult:
    """Return torque constant [m^3], friction [N m] with its growth [m^3], and zero offset [N m]; equation (2).

    The friction is that at rest, or in motion where the actuator slid; of a force they are in m^2 and N. Readings whose
    direction is 0 belong to no branch and are left out. So is a flat start of the rising branch, where a scale that
    only pulls shows nothing until friction is overcome.
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    chosen = settings or StaticTorqueSettings()
    load = load_of(sources)
    for source in sources:
        check_moves(source, PROCEDURE, load)
        pressure = source.recording["pressure_difference"]
        check_not_clipped(source, PROCEDURE, load, "pressure_difference", pressure)
    readings = readings_of(sources)
    for source in sources:
        torque = source.recording[load]
        check_not_clipped(source, PROCEDURE, "pressure_difference", load, torque, _MORE_THAN_FRICTION)
    growing = _fit(readings, True, chosen.confidence)
    grows = _fit(readings, True, 1.0 - CHANCE).differs_from_zero(_GROWTH)
    fit = growing if grows else _fit(readings, False, chosen.confidence)
    names = ", ".join(source.name for source in sources)
    if fit.coefficients[_SLOPE] <= 0.0:
        raise IdentificationError(
            f"{names}: {PROCEDURE}: the {load} falls with the pressure difference; reverse the sign of one channel"
        )
    if fit.coefficients[_FRICTION] < -fit.half_widths[_FRICTION]:
        raise IdentificationError(
            f"{names}: {PROCEDURE}: the rising branch lies above the falling one, as if friction drove the motion; "
            f"reverse the sign of channel 'direction'"
        )
    evidence = Evidence(traces(sources), chosen.confidence, chosen.calibration)
    numbers = _numbers(evidence, readings, fit, growing, grows)
    count, levels = readings.pressure.size, int(readings.levels.max()) + 1
    return BenchResult(
        PROCEDURE,
        f"{count} readings at {levels} pressures, {int(readings.clusters.max()) + 1} repetitions; "
        f"K = {fit.coefficients[_SLOPE]:.4g} {readings.names.slope_unit}, "
        f"{readings.names.friction} {fit.coefficients[_FRICTION]:.3g} {readings.names.unit}"
        f"{' on average, growing with pressure' if grows else ''}",
        tuple(evidence.with_calibration(number) for number in numbers),
        (
            _straight_check(readings, grows, chosen.confidence),
            _outlier_check(readings, fit),
            _growth_check(growing, readings, grows),
        ),
        _panels(readings, fit),
        kind_of(sources),
        pauses(sources),
    )


def static_prospects(sources: tuple[Source, ...], settings: StaticTorqueSettings) -> tuple[Prospect, ...]:
    """Return how well torque constant, friction and its growth can be had; intervals from scatter and design."""
    readings = readings_of(sources)
    names = readings.names
    pressure, torque, rising = readings.pressure, readings.torque, readings.branch > 0
    # The scatter within pressures and branches, about lines of their own: what the law misses is not in it.
    cells = readings.cells
    left, count = 0.0, 0
    for cell in range(int(cells.max()) + 1):
        x, y = pressure[cells == cell], torque[cells == cell]
        if y.size > 2 and np.ptp(x) > 0.0:
            y = y - np.polyval(np.polyfit(x - x.mean(), y, 1), x - x.mean())
        left, count = left + float(((y - y.mean()) ** 2).sum()), count + y.size - 1
    noise = float(np.sqrt(left / max(count, 1)))
    line = np.polyfit(pressure, torque, 1)
    rest = torque - np.polyval(line, pressure)
    friction = 0.5 * float(np.mean(rest[~rising]) - np.mean(rest[rising]))
    design = _design(readings, True)
    scale = np.sqrt((design**2).mean(axis=0))
    factor = quantile(settings.confidence, max(1, pressure.size - 4)) * noise
    inverse = inverse_of((design / scale).T @ (design / scale))
    half = factor * np.sqrt(np.diag(inverse)) / scale
    span, levels = float(np.ptp(pressure)), int(readings.levels.max()) + 1
    where = f"{levels} pressures over {span / 1e3:.3g} kPa"
    return (
        prospect_of(names.slope, half[_SLOPE], float(line[0]), where),
        prospect_of(names.friction, half[_FRICTION], friction, f"both branches at {where}"),
        Prospect(
            "growth of the friction",
            bool(levels > 2 and half[_GROWTH] * span < abs(friction)),
            f"{half[_GROWTH] * span:.2g} {names.unit} from the lowest to the highest pressure would show",
        ),
    )


@dataclass(frozen=True, slots=True)
class Names:
    """What the numbers are of a load in a unit, by path, unit and word: the slope, and a friction at rest or in motion.

    Only what a set has a place for has a path of a set.
    """

    load: str
    unit: str
    slope: str
    slope_path: str
    slope_unit: str
    friction: str
    friction_path: str


def names_of(load: str, slides: bool) -> Names:
    """Return what the numbers of a torque or a force are called, of an actuator that slides or is held."""
    word, key = ("friction in motion", "dynamic") if slides else ("static friction", "static")
    if load == _FORCE:
        return Names(load, "N", "area", f"{_OWN}.area", "m^2", word, f"{_OWN}.{key}_friction")
    return Names(load, "N m", "torque constant", "actuator.torque_constant", "m^3", word, f"friction.{key}_torque")


@dataclass(frozen=True, slots=True)
class Readings:
    """All readings of a branch: pressure difference [Pa], load [N m or N], branch (+1, -1), groups, place in a file."""

    pressure: Floats
    torque: Floats
    branch: Floats
    clusters: Labels
    levels: Labels
    places: tuple[str, ...]
    names: Names

    @property
    def middle(self) -> float:
        """Mean pressure difference [Pa]."""
        return float(np.mean(self.pressure))

    @property
    def cells(self) -> Labels:
        """One label for each pressure level of each branch."""
        return labels_of([self.levels, (self.branch > 0).astype(np.int64)])


def load_of(sources: tuple[Source, ...]) -> str:
    """Return the channel that all recordings have, ``torque`` or ``force``; IdentificationError where one lacks it."""
    is_force = bool(sources) and all(_FORCE in one.recording and _TORQUE not in one.recording for one in sources)
    load = _FORCE if is_force else _TORQUE
    check_sources(sources, PROCEDURE, (load, "pressure_difference", "direction"), 1)
    return load


def slides(sources: tuple[Source, ...]) -> bool:
    """Tell whether a position or an angle moves with the direction and the pressure does not."""
    pressure = float(np.ptp(pool(sources, "pressure_difference")))
    moving = [
        _swept(one, name) / max(float(np.ptp(one.recording[name])), 1.0e-300)
        for one in sources
        for name in _MOVING
        if name in one.recording
    ]
    branches = [_swept(one, "pressure_difference") / max(pressure, 1.0e-300) for one in sources]
    return bool(moving) and min(moving) > _MOVES_WITH_DIRECTION > max(branches)


def _swept(source: Source, name: str) -> float:
    """By how much a channel moves with or against the direction in a sweep, the mean of all sweeps."""
    direction = source.recording["direction"]
    within = (direction[1:] == direction[:-1]) & (direction[1:] != 0.0)
    used = direction[direction != 0.0]
    sweeps = 1 + int(np.count_nonzero(np.diff(used)))
    return abs(float(np.sum((direction[1:] * np.diff(source.recording[name]))[within]))) / sweeps


def readings_of(sources: tuple[Source, ...]) -> Readings:
    """Return the readings of all recordings; IdentificationError where they cannot separate slope from friction."""
    load = load_of(sources)
    for source in sources:
        values = source.recording["direction"]
        wrong = np.flatnonzero(~np.isin(values, (-1.0, 0.0, 1.0)))
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'direction' is {values[wrong[0]]:g} at sample {wrong[0] + 1}; "
                f"it is 1 while the pressure rises, -1 while it falls, 0 for neither"
            )
    pressure, torque, direction = (pool(sources, name) for name in ("pressure_difference", load, "direction"))
    used = direction != 0.0
    # A scale that only pulls shows nothing until friction is overcome: the rising branch then has a flat start, a
    # lowest reading that belongs to two pressures or more, or is nothing at all.
    lowest = torque.min()
    resting = (direction > 0.0) & (torque <= lowest + _FLAT * np.ptp(torque))
    is_flat = resting.any() and np.ptp(pressure[resting]) > _LEVEL_GAP * np.ptp(pressure)
    if is_flat or lowest == 0.0:
        used &= ~resting
    pressure, torque, direction = pressure[used], torque[used], direction[used]
    if pressure.size < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} readings, there are {pressure.size}"
        )
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: {PROCEDURE}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}; without both, friction cannot be separated from "
                "the zero of the scale"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], PROCEDURE, "pressure_difference")
    levels = _levels(pressure)
    if levels.max() + 1 < _MINIMUM_LEVELS:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs readings at {_MINIMUM_LEVELS} different pressures or more, "
            f"there are {levels.max() + 1}"
        )
    # A repetition of a recording is one cluster; so is a recording without repetitions.
    recordings = [source.recording for source in sources]
    files = np.concatenate([np.full(len(one), number) for number, one in enumerate(recordings)])
    repetitions = [one["repetition"] if "repetition" in one else np.zeros(len(one)) for one in recordings]
    _, repetition = np.unique(np.concatenate(repetitions), return_inverse=True)
    clusters = labels_of([files.astype(np.int64), repetition.astype(np.int64)])
    places = [
        f"sample {number} of {source.name}" for source in sources for number in range(1, len(source.recording) + 1)
    ]
    kept = tuple(place for place, is_used in zip(places, used.tolist(), strict=True) if is_used)
    names = names_of(load, slides(sources))
    return Readings(pressure, torque, direction, clusters[used], levels, kept, names)


def _levels(pressure: Floats) -> Labels:
    """Return which pressure level each reading belongs to: groups with gaps between them, else equal parts."""
    span = float(pressure.max() - pressure.min())
    if span == 0.0:
        return np.zeros(pressure.size, dtype=np.int64)
    order = np.argsort(pressure)
    steps = np.diff(pressure[order]) > _LEVEL_GAP * span
    levels = np.empty(pressure.size, dtype=np.int64)
    levels[order] = np.concatenate(([0], np.cumsum(steps)))
    widths = [float(np.ptp(pressure[levels == level])) for level in range(int(levels.max()) + 1)]
    if max(widths) <= _WIDEST_LEVEL * span:
        return levels
    bins = np.minimum((pressure - pressure.min()) / span * _BINS, _BINS - 1).astype(np.int64)
    return labels_of([bins])


def labels_of(parts: Sequence[Labels]) -> Labels:
    """Return one label for each combination of labels."""
    _, labels = np.unique(np.stack(parts), axis=1, return_inverse=True)
    return np.asarray(labels, dtype=np.int64).reshape(-1)


@dataclass(frozen=True, slots=True)
class Regression:
    """Coefficients in the order of the design's columns, half widths of their intervals, and the residuals.

    ``widened`` says how many times as wide each interval is as independent readings would have it, 1 where the line
    misses the cells by no more than the readings scatter in them.
    """

    coefficients: Floats
    half_widths: Floats
    residuals: Floats
    widest: str
    widened: Floats

    @property
    def scatter(self) -> float:
        """Standard deviation of the residuals, in the unit of what was fitted."""
        freedom = max(1, self.residuals.size - self.coefficients.size)
        return float(np.sqrt(self.residuals @ self.residuals / freedom))

    def differs_from_zero(self, index: int) -> bool:
        """Whether the interval of a coefficient leaves zero out."""
        return bool(abs(self.coefficients[index]) > self.half_widths[index])

    def number(self, index: int, path: str, unit: str, text: str) -> Number:
        """Return a coefficient as a number of the result."""
        half, widened = self.half_widths[index], self.widened[index]
        return Number(path, unit, self.coefficients[index], half, text, widened=widened)


def regress(
    design: Floats, values: Floats, clusters: Labels, cells: Labels, confidence: float, judged_by: int = 0
) -> Regression:
    """Return the least-squares fit; for each coefficient, in its unit, the widest of three intervals.

    1. Readings independent of each other. 2. Readings of one cluster (a repetition, a stroke) share an error: the
    cluster-robust covariance, where there are three clusters or more. 3. Readings of one cell (a pressure, one
    branch) share an error, as they do where the straight line does not quite hold: the regression of the cells' means.
    ``widest`` names the one that counted for the coefficient ``judged_by``.
    """
    count, columns = design.shape
    products = design.T @ design
    inverse, coefficients = inverse_of(products), solution_of(products, design.T @ values)
    residuals = values - design @ coefficients
    candidates = {
        "independent readings": _independent_half_widths(design, inverse, residuals, confidence),
        "scatter between repetitions": np.zeros(columns),
        "departure of pressure levels from a straight line": np.zeros(columns),
    }
    groups = int(clusters.max()) + 1
    if _FEWEST_CLUSTERS <= groups < count:
        scores = np.zeros((groups, columns))
        np.add.at(scores, clusters, design * residuals[:, None])
        correction = groups / (groups - 1) * (count - 1) / (count - columns)
        errors = np.sqrt(correction * np.square(scores @ inverse).sum(axis=0))
        half_widths = quantile(confidence, groups - 1) * errors
        candidates["scatter between repetitions"] = np.asarray(half_widths)
    counts = np.bincount(cells)
    if columns < counts.size < count:
        means = np.stack([np.bincount(cells, weights=column) / counts for column in (*design.T, values)])
        mean_design, mean_values = means[:-1].T, means[-1]
        products = mean_design.T @ mean_design
        if rank_of(products) == columns:
            of_means = inverse_of(products)
            left = mean_values - mean_design @ solution_of(products, mean_design.T @ mean_values)
            half_widths = _independent_half_widths(mean_design, of_means, left, confidence)
            candidates["departure of pressure levels from a straight line"] = half_widths
    stacked = np.array(list(candidates.values()))
    half_widths = stacked.max(axis=0)
    widened = np.ones_like(half_widths)
    # Whether the line misses the cells by more than the readings scatter in them: the test of lack of fit.
    freedom, inner = counts.size - columns, count - counts.size
    if freedom >= 1 and inner >= 1:
        centres = np.bincount(cells, weights=residuals) / counts
        between = float(counts @ centres**2 / freedom)
        within = float(((residuals - centres[cells]) ** 2).sum()) / inner
        if exceeds_chance(between, within, freedom, inner, CHANCE):
            np.divide(half_widths, stacked[0], out=widened, where=stacked[0] > 0.0)
    name = list(candidates)[int(np.argmax(stacked[:, judged_by]))]
    return Regression(coefficients, half_widths, residuals, name, widened)


def _independent_half_widths(design: Floats, inverse: Floats, residuals: Floats, confidence: float) -> Floats:
    freedom = design.shape[0] - design.shape[1]
    variance = residuals @ residuals / freedom
    return np.asarray(quantile(confidence, freedom) * np.sqrt(variance * np.diag(inverse)))


def _design(readings: Readings, with_growth: bool, at: float | None = None) -> Floats:
    """Return the columns of K, T_0, T_s and, on request, g; T_s is that ``at`` a pressure [Pa], the mean if None."""
    columns = [readings.pressure, np.ones_like(readings.pressure), -readings.branch]
    middle = readings.middle if at is None else at
    columns += [-readings.branch * (readings.pressure - middle)] if with_growth else []
    return np.stack(columns, axis=1)


def _fit(
    readings: Readings, with_growth: bool, confidence: float, extra: Floats | None = None, at: float | None = None
) -> Regression:
    """Return the regression, on columns of one size; ``extra`` is a further column, its coefficient the last."""
    design = _design(readings, with_growth, at)
    design = design if extra is None else np.column_stack([design, extra])
    if readings.pressure.size <= design.shape[1]:
        raise IdentificationError(f"{PROCEDURE}: {readings.pressure.size} readings are too few")
    scale = np.sqrt((design**2).mean(axis=0))
    scaled = regress(design / scale, readings.torque, readings.clusters, readings.cells, confidence)
    return replace(scaled, coefficients=scaled.coefficients / scale, half_widths=scaled.half_widths / scale)


def _numbers(
    evidence: Evidence, readings: Readings, fit: Regression, growing: Regression, grows: bool
) -> tuple[Number, ...]:
    """Return what the readings give; where the friction grows, it is that at the mean pressure, which it says."""
    source = "the scatter of the readings" if fit.widest == "independent readings" else f"the {fit.widest}"
    names = readings.names
    unit, growth_unit = names.unit, names.slope_unit
    slope_text = (
        f"Common slope of both branches; residuals scatter by {fit.scatter:.3g} {unit}; "
        f"the interval comes from {source}; {evidence.calibration_text}."
    )
    condition, grown = "", "no growth with pressure shows in these readings"
    if grows:
        growth = growing.coefficients[_GROWTH]
        at_rest = growing.coefficients[_FRICTION] - growth * readings.middle
        condition = f"at {readings.middle / 1e3:.4g} kPa"
        grown = f"it grows by {growth:.3g} {growth_unit} with the pressure difference (per Pa), from {at_rest:.3g} "
        grown += f"{unit} at none, and a model with one friction {names.load} is right at that pressure only"
    text = (
        f"Half the distance between the branches at the mean pressure difference of {readings.middle:.4g} Pa; {grown}."
    )
    zero_text = (
        f"{names.load.capitalize()} that the scale shows at no pressure difference, midway between the branches."
    )
    growth_text = f"Growth of the {names.friction} with the pressure difference [{unit} per Pa]."
    friction = fit.number(_FRICTION, names.friction_path, unit, text)
    zero = fit.number(_ZERO, f"{_OWN}.zero_offset", unit, zero_text)
    found = (
        fit.number(_SLOPE, names.slope_path, growth_unit, slope_text),
        replace(friction, condition=condition),
        replace(zero, scale=float(np.ptp(readings.torque))),
        growing.number(_GROWTH, f"{_OWN}.friction_per_pressure", growth_unit, growth_text),
    )
    if not grows:
        return found
    lowest = float(readings.pressure.min())
    text = f"{names.friction.capitalize()} without a pressure difference, on a line through readings "
    text += f"from {lowest:.4g} Pa upwards."
    at_none = _fit(readings, True, evidence.confidence, at=0.0)
    return (*found, at_none.number(_FRICTION, f"{_OWN}.friction_at_no_pressure", unit, text))


def _straight_check(readings: Readings, grows: bool, confidence: float) -> Check:
    """Ask whether a square of the pressure would explain more, and how much torque it would move."""
    centred = readings.pressure - readings.middle
    square = centred**2 - np.mean(centred**2)
    bent = _fit(readings, grows, confidence, square)
    sag = abs(bent.coefficients[-1]) * float(np.ptp(square))
    fraction = sag / float(np.ptp(readings.torque))
    holds = bool(not bent.differs_from_zero(bent.coefficients.size - 1) or fraction < _SAG_THAT_HARMS_NOBODY)
    word = "straight" if holds else "bent"
    return Check(
        "straight line",
        holds,
        f"the branches are {word}: a quadratic term would change the {readings.names.load} by {fraction:.1%} "
        "of its range",
    )


def _outlier_check(readings: Readings, fit: Regression) -> Check:
    # 1.4826 times the median of distances is the standard deviation of normal scatter, whatever the outliers do.
    spread = 1.4826 * float(np.median(np.abs(fit.residuals - np.median(fit.residuals))))
    worst = int(np.argmax(np.abs(fit.residuals)))
    count = int((np.abs(fit.residuals) > 6.0 * max(spread, 1e-300)).sum())
    unit = readings.names.unit
    text = f"{count} of {fit.residuals.size} readings lie more than six scatters off ({spread:.3g} {unit} each)"
    text += f"; the worst is {readings.places[worst]}, {fit.residuals[worst]:+.3g} {unit}" if count else ""
    return Check("outliers", count / fit.residuals.size <= 0.01, text)


def _growth_check(growing: Regression, readings: Readings, grows: bool) -> Check:
    """Ask whether one number for the friction will do: a friction that grows fails, but for a chance of one percent."""
    friction, growth = growing.coefficients[_FRICTION], growing.coefficients[_GROWTH]
    load, unit = readings.names.load, readings.names.unit
    if grows:
        ends = readings.pressure.min(), readings.pressure.max()
        low, high = (friction + growth * (pressure - readings.middle) for pressure in ends)
        text = f"friction goes from {low:.3g} {unit} at the lowest to {high:.3g} {unit} at the highest pressure "
        text += f"difference; a model with one friction {load} is right at one of them only"
    elif rank_of(_products(readings)) <= _GROWTH:
        few = "a branch has readings at a single pressure, so that growing friction and K cannot be distinguished"
        return Check("friction over pressure", False, f"{few}; measure both branches at several pressures")
    else:
        most = (abs(growth) + growing.half_widths[_GROWTH]) * float(np.ptp(readings.pressure))
        text = f"one friction {load} describes all pressures; more than {most:.2g} {unit} of growth would have shown"
    return Check("friction over pressure", not grows, text)


def _products(readings: Readings) -> Floats:
    """Return the products of the columns of K, T_0, T_s and g."""
    design = _design(readings, True)
    return np.asarray(design.T @ design)


def _panels(readings: Readings, fit: Regression) -> tuple[Panel, ...]:
    ends = np.array([readings.pressure.min(), readings.pressure.max()])
    nominal = fit.coefficients[_SLOPE] * ends + fit.coefficients[_ZERO]
    branches: dict[Role, float] = {"rising": 1.0, "falling": -1.0}
    main, rest = [], []
    for role, sign in branches.items():
        on = readings.branch == sign
        main.append(Series(f"pressure {role}", readings.pressure[on], readings.torque[on], role))
        rest.append(Series("", readings.pressure[on], fit.residuals[on], role))
    line = Series("nominal", ends, nominal, "law")
    zero = Series("", ends, np.zeros(2), "law")
    axis, load, unit = ("Pressure difference", "Pa_d"), readings.names.load, readings.names.unit
    return (
        Panel(f"Static {load}", *axis, load.capitalize(), unit, (*main, line)),
        Panel("Residuals", *axis, "Measured minus fitted", unit, (*rest, zero)),
    )
