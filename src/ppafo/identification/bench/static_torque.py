"""Static torque over rising and falling pressure: torque constant and static friction; figure 3, top, of the paper.

While the pressure rises, friction keeps part of the torque from the scale; while it falls, friction adds to it. So

    torque = K dP + T_0 - s (T_s + g (dP - mean dP)),   s = +1 rising, -1 falling

K is the common slope, T_s half the distance of the branches, g how the friction grows with pressure, T_0 the zero of
the scale. All are linear, so one regression gives them all.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.inputs import check_moves, check_not_clipped, check_sources, kind_of, pooled
from ppafo.identification.bench.picture import Panel, Series
from ppafo.identification.bench.regression import Labels, Regression, labels_of, regress
from ppafo.identification.bench.result import BenchResult, verdict_of
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

PROCEDURE = "static_torque"
Flags = NDArray[np.bool_]
CHANNELS = ("torque", "pressure_difference", "direction")
FEWEST_SAMPLES = 6
_FEWEST_LEVELS = 3
_LEVEL_GAP = 1.0 / 40.0
_WIDEST_LEVEL = 1.0 / 8.0
_BINS = 20
_FLAT = 0.002
_SAG_THAT_HARMS_NOBODY = 0.02
_SLOPE, _ZERO, _FRICTION, _GROWTH = range(4)


@dataclass(frozen=True, slots=True)
class StaticTorqueSettings:
    """How sure the intervals are [-], and the relative uncertainty of the sensors' calibration [-], same confidence."""

    confidence: float = 0.95
    calibration: float = 0.0


@dataclass(frozen=True, slots=True)
class _Readings:
    """All readings that belong to a branch: pressure difference [Pa], torque [N m], branch (+1, -1), groups."""

    pressure: Floats
    torque: Floats
    branch: Floats
    clusters: Labels
    levels: Labels

    @property
    def middle(self) -> float:
        return float(np.mean(self.pressure))


def static_torque(sources: tuple[Source, ...], settings: StaticTorqueSettings | None = None) -> BenchResult:
    """Return torque constant [m^3], static friction [N m] with its growth [m^3], and zero offset [N m]; equation (2).

    Readings whose direction is 0 belong to no branch and are left out. So is a flat start of the rising branch, where a
    scale that only pulls shows nothing until friction is overcome.
    """
    chosen = settings or StaticTorqueSettings()
    check_sources(sources, PROCEDURE, CHANNELS, 1)
    for source in sources:
        check_moves(source, PROCEDURE, "torque")
        check_not_clipped(source, PROCEDURE, "torque", "pressure_difference")
    readings = _readings(sources)
    growing = _fit(readings, True, chosen.confidence)
    grows = growing.differs_from_zero(_GROWTH)
    fit = growing if grows else _fit(readings, False, chosen.confidence)
    _check_order(sources, fit)
    estimates = _estimates(sources, readings, fit, growing, chosen)
    checks = (_straight(readings, grows, chosen.confidence), _outliers(fit), _growth_check(growing, readings, grows))
    return BenchResult(
        PROCEDURE, _summary(readings, fit, grows), estimates, checks, _panels(readings, fit), kind_of(sources)
    )


def _readings(sources: tuple[Source, ...]) -> _Readings:
    direction = pooled(sources, "direction")
    for source in sources:
        _check_direction(source)
    used = direction != 0.0
    used &= ~_not_broken_away(pooled(sources, "pressure_difference"), pooled(sources, "torque"), direction)
    pressure, torque = pooled(sources, "pressure_difference")[used], pooled(sources, "torque")[used]
    if pressure.size < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {FEWEST_SAMPLES} readings, there are {pressure.size}"
        )
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction[used] == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: {PROCEDURE}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}; without both, friction cannot be told from the zero of the scale"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], PROCEDURE, "pressure_difference")
    levels = _levels(pressure)
    if levels.max() + 1 < _FEWEST_LEVELS:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs readings at {_FEWEST_LEVELS} different pressures or more, "
            f"there are {levels.max() + 1}"
        )
    return _Readings(pressure, torque, direction[used], _clusters(sources)[used], levels)


def _not_broken_away(pressure: Floats, torque: Floats, direction: Floats) -> Flags:
    """Return which rising readings lie on a flat start: a scale that only pulls shows none until friction is overcome.

    A flat start is a lowest reading that belongs to two pressures or more, or is nothing at all.
    """
    lowest = torque.min()
    resting = (direction > 0.0) & (torque <= lowest + _FLAT * np.ptp(torque))
    is_flat = resting.any() and np.ptp(pressure[resting]) > _LEVEL_GAP * np.ptp(pressure)
    return np.asarray(resting if is_flat or lowest == 0.0 else np.zeros_like(resting))


def _check_direction(source: Source) -> None:
    values = source.recording["direction"]
    wrong = np.flatnonzero(~np.isin(values, (-1.0, 0.0, 1.0)))
    if wrong.size:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: channel 'direction' is {values[wrong[0]]:g} at sample {wrong[0] + 1}; "
            f"it is 1 while the pressure rises, -1 while it falls, 0 for neither"
        )


def _clusters(sources: tuple[Source, ...]) -> Labels:
    """Return one label for each repetition of each recording; without repetitions a recording is one cluster."""
    files = np.concatenate([np.full(len(source.recording), number) for number, source in enumerate(sources)])
    repetitions = [
        source.recording["repetition"] if "repetition" in source.recording else np.zeros(len(source.recording))
        for source in sources
    ]
    _, labels = np.unique(np.concatenate(repetitions), return_inverse=True)
    return labels_of([files.astype(np.int64), labels.astype(np.int64)])


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


def _fit(readings: _Readings, with_growth: bool, confidence: float, extra: Floats | None = None) -> Regression:
    columns = [readings.pressure, np.ones_like(readings.pressure), -readings.branch]
    columns += [-readings.branch * (readings.pressure - readings.middle)] if with_growth else []
    columns += [] if extra is None else [extra]
    design = np.stack(columns, axis=1)
    if readings.pressure.size <= design.shape[1]:
        raise IdentificationError(f"{PROCEDURE}: {readings.pressure.size} readings are too few")
    scale = np.sqrt((design**2).mean(axis=0))
    sides = (readings.branch > 0).astype(np.int64)
    cells = labels_of([readings.levels, sides])
    scaled = regress(design / scale, readings.torque, readings.clusters, cells, confidence)
    return Regression(scaled.coefficients / scale, scaled.half_widths / scale, scaled.residuals, scaled.widest)


def _check_order(sources: tuple[Source, ...], fit: Regression) -> None:
    names = ", ".join(source.name for source in sources)
    if fit.coefficients[_SLOPE] <= 0.0:
        raise IdentificationError(
            f"{names}: {PROCEDURE}: the torque falls with the pressure difference; turn the sign of one channel round"
        )
    if fit.coefficients[_FRICTION] < -fit.half_widths[_FRICTION]:
        raise IdentificationError(
            f"{names}: {PROCEDURE}: the rising branch lies above the falling one, as if friction drove the motion; "
            f"turn the sign of channel 'direction' round"
        )


def _estimates(
    sources: tuple[Source, ...],
    readings: _Readings,
    fit: Regression,
    growing: Regression,
    settings: StaticTorqueSettings,
) -> tuple[Estimate, ...]:
    friction, half = fit.coefficients[_FRICTION], fit.half_widths[_FRICTION]
    growth = growing.coefficients[_GROWTH]
    at_rest = growing.coefficients[_FRICTION] - growth * readings.middle
    grown = (
        f"it grows by {growth:.3g} m^3 with the pressure difference (per Pa), from {at_rest:.3g} N m at none"
        if growing.differs_from_zero(_GROWTH)
        else "no growth with pressure shows in these readings"
    )
    torque_span = float(np.ptp(readings.torque))

    def entry(path: str, unit: str, value: float, width: float, text: str, scale: float | None = None) -> Estimate:
        gain = settings.calibration * abs(value)
        total = float(np.hypot(width, gain))
        low, high = float(value - total), float(value + total)
        verdict = verdict_of(value, low, high, scale)
        return Estimate(path, float(value), unit, low, high, verdict, text, traces(sources), settings.confidence)

    return (
        entry(
            "actuator.torque_constant",
            "m^3",
            fit.coefficients[_SLOPE],
            fit.half_widths[_SLOPE],
            f"Common slope of both branches; residuals scatter by {fit.scatter:.3g} N m; "
            f"the interval comes from {_widest(fit)}{_calibration(settings)}.",
        ),
        entry(
            "friction.static_torque",
            "N m",
            friction,
            half,
            f"Half the distance of the branches at the mean pressure difference of {readings.middle:.4g} Pa; {grown}.",
        ),
        entry(
            "static_torque.zero_offset",
            "N m",
            fit.coefficients[_ZERO],
            fit.half_widths[_ZERO],
            "Torque that the scale shows at no pressure difference, midway between the branches.",
            torque_span,
        ),
        entry(
            "static_torque.friction_per_pressure",
            "m^3",
            growth,
            growing.half_widths[_GROWTH],
            "Growth of the static friction with the pressure difference [N m per Pa].",
        ),
    )


def _widest(fit: Regression) -> str:
    return {"independent readings": "the scatter of the readings"}.get(fit.widest, f"the {fit.widest}")


def _calibration(settings: StaticTorqueSettings) -> str:
    if settings.calibration:
        return f" and {settings.calibration:.2%} of calibration"
    return "; calibration of the sensors is not in it"


def _straight(readings: _Readings, grows: bool, confidence: float) -> Check:
    """Ask whether a square of the pressure would explain more, and how much torque it would move."""
    centred = readings.pressure - readings.middle
    square = centred**2 - np.mean(centred**2)
    bent = _fit(readings, grows, confidence, square)
    sag = abs(bent.coefficients[-1]) * float(np.ptp(square))
    share = sag / float(np.ptp(readings.torque))
    holds = bool(not bent.differs_from_zero(bent.coefficients.size - 1) or share < _SAG_THAT_HARMS_NOBODY)
    word = "straight" if holds else "bent"
    return Check(
        "straight line", holds, f"the branches are {word}: a square term would move {share:.1%} of the torque range"
    )


def _outliers(fit: Regression) -> Check:
    spread = 1.4826 * float(np.median(np.abs(fit.residuals - np.median(fit.residuals))))
    worst = int(np.argmax(np.abs(fit.residuals)))
    count = int((np.abs(fit.residuals) > 6.0 * max(spread, 1e-300)).sum())
    share = count / fit.residuals.size
    text = f"{count} of {fit.residuals.size} readings lie more than six scatters off ({spread:.3g} N m each)"
    text += f"; the worst is reading {worst + 1}, {fit.residuals[worst]:+.3g} N m" if count else ""
    return Check("outliers", share <= 0.01, text)


def _growth_check(growing: Regression, readings: _Readings, grows: bool) -> Check:
    """Say whether one number for the friction will do; it is told, not judged."""
    low, high = (
        growing.coefficients[_FRICTION] + growing.coefficients[_GROWTH] * (pressure - readings.middle)
        for pressure in (readings.pressure.min(), readings.pressure.max())
    )
    if grows:
        text = f"friction goes from {low:.3g} N m at the lowest to {high:.3g} N m at the highest pressure difference"
    else:
        text = "one friction torque describes all pressures"
    return Check("friction over pressure", True, text)


def _summary(readings: _Readings, fit: Regression, grows: bool) -> str:
    count, levels = readings.pressure.size, int(readings.levels.max()) + 1
    return (
        f"{count} readings at {levels} pressures, {int(readings.clusters.max()) + 1} repetitions; "
        f"K = {fit.coefficients[_SLOPE]:.4g} m^3, friction {fit.coefficients[_FRICTION]:.3g} N m"
        f"{' on average, growing with pressure' if grows else ''}"
    )


def _panels(readings: _Readings, fit: Regression) -> tuple[Panel, ...]:
    ends = np.array([readings.pressure.min(), readings.pressure.max()])
    nominal = fit.coefficients[_SLOPE] * ends + fit.coefficients[_ZERO]
    branches = (("pressure rising", 1.0, "rising"), ("pressure falling", -1.0, "falling"))
    chosen = [(name, readings.branch == sign, role) for name, sign, role in branches]
    main = [Series(name, readings.pressure[on], readings.torque[on], role) for name, on, role in chosen]  # type: ignore[arg-type]
    rest = [Series("", readings.pressure[on], fit.residuals[on], role) for _, on, role in chosen]  # type: ignore[arg-type]
    line = Series("nominal", ends, nominal, "law")
    zero = Series("", ends, np.zeros(2), "law")
    axis = ("Pressure difference", "Pa_d")
    return (
        Panel("Static torque", *axis, "Torque", "N m", (*main, line)),
        Panel("Residuals", *axis, "Measured less fitted", "N m", (*rest, zero)),
    )
