"""Static torque over rising and falling pressure: torque constant and static friction; figure 3, top, of the paper.

While the pressure rises, friction keeps part of the torque from the scale; while it falls, friction adds to it. So

    torque = K dP + T_0 - s (T_s + g (dP - mean dP)),   s = +1 rising, -1 falling

K is the common slope, T_s half the distance of the branches, g how the friction grows with pressure, T_0 the zero of
the scale. All are linear, so one regression gives them all.
"""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CHANCE, quantile
from ppafo.identification.bench.inputs import check_moves, check_not_clipped, check_sources, kind_of, pauses
from ppafo.identification.bench.result import BenchResult, Evidence, Number, Panel, Role, Series, prospect_of
from ppafo.identification.bench.static_readings import PROCEDURE, Readings, Regression, labels_of, readings_of, regress
from ppafo.identification.estimate import Check, Estimate, Prospect
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

CHANNELS = ("torque", "pressure_difference", "direction")
_MORE_THAN_FRICTION = 0.3
"""Fraction of its range by which the torque may move at one pressure, as friction turns round."""

_SAG_THAT_HARMS_NOBODY = 0.02
_SLOPE, _ZERO, _FRICTION, _GROWTH = range(4)


@dataclass(frozen=True, slots=True)
class StaticTorqueSettings:
    """How sure the intervals are [-], and the relative uncertainty of the sensors' calibration [-], same confidence."""

    confidence: float = 0.95
    calibration: float = 0.0


def static_torque(sources: tuple[Source, ...], settings: StaticTorqueSettings | None = None) -> BenchResult:
    """Return torque constant [m^3], static friction [N m] with its growth [m^3], and zero offset [N m]; equation (2).

    Readings whose direction is 0 belong to no branch and are left out. So is a flat start of the rising branch, where a
    scale that only pulls shows nothing until friction is overcome.
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    chosen = settings or StaticTorqueSettings()
    check_sources(sources, PROCEDURE, CHANNELS, 1)
    for source in sources:
        check_moves(source, PROCEDURE, "torque")
        pressure = source.recording["pressure_difference"]
        check_not_clipped(source, PROCEDURE, "torque", "pressure_difference", pressure)
    readings = readings_of(sources)
    for source in sources:
        check_not_clipped(
            source, PROCEDURE, "pressure_difference", "torque", source.recording["torque"], _MORE_THAN_FRICTION
        )
    growing = _fit(readings, True, chosen.confidence)
    grows = _fit(readings, True, 1.0 - CHANCE).differs_from_zero(_GROWTH)
    fit = growing if grows else _fit(readings, False, chosen.confidence)
    _check_order(sources, fit)
    evidence = Evidence(traces(sources), chosen.confidence, chosen.calibration)
    estimates = _estimates(evidence, readings, fit, growing if grows else None, growing)
    if grows:
        estimates = (*estimates, evidence.with_calibration(_at_no_pressure(readings, chosen.confidence)))
    straight = _straight_check(readings, grows, chosen.confidence)
    return BenchResult(
        PROCEDURE,
        _summary(readings, fit, grows),
        estimates,
        (straight, _outliers(readings, fit), _growth_check(growing, readings, grows)),
        _panels(readings, fit),
        kind_of(sources),
        pauses(sources),
    )


def static_prospects(sources: tuple[Source, ...], settings: StaticTorqueSettings) -> tuple[Prospect, ...]:
    """Return how well torque constant, static friction and its growth can be had; intervals from scatter and design."""
    check_sources(sources, PROCEDURE, CHANNELS, 1)
    readings = readings_of(sources)
    design = np.stack(
        [
            readings.pressure,
            np.ones_like(readings.pressure),
            -readings.branch,
            -readings.branch * (readings.pressure - readings.middle),
        ],
        axis=1,
    )
    scale = np.sqrt((design**2).mean(axis=0))
    noise, means = _cells(readings)
    factor = quantile(settings.confidence, max(1, readings.pressure.size - 4)) * noise
    inverse = np.linalg.pinv((design / scale).T @ (design / scale))
    half = factor * np.sqrt(np.diag(inverse)) / scale
    span = float(np.ptp(readings.pressure))
    slope = float(np.polyfit(readings.pressure, readings.torque, 1)[0])
    levels = int(readings.levels.max()) + 1
    where = f"{levels} pressures over {span / 1e3:.3g} kPa"
    return (
        prospect_of("torque constant", half[0], slope, where),
        prospect_of("static friction", half[2], means, f"both branches at {where}"),
        Prospect(
            "growth of the friction",
            bool(levels > 2 and half[3] * span < abs(means)),
            f"{half[3] * span:.2g} N m from the lowest to the highest pressure would show",
        ),
    )


def _cells(readings: Readings) -> tuple[float, float]:
    """Return the scatter within pressures and branches [N m], about lines of their own, and half their distance."""
    cells = labels_of([readings.levels, (readings.branch > 0).astype(np.int64)])
    left, count = 0.0, 0
    for cell in range(int(cells.max()) + 1):
        x, y = readings.pressure[cells == cell], readings.torque[cells == cell]
        if y.size > 2 and np.ptp(x) > 0.0:
            y = y - np.polyval(np.polyfit(x - x.mean(), y, 1), x - x.mean())
        left, count = left + float(((y - y.mean()) ** 2).sum()), count + y.size - 1
    rising = readings.branch > 0
    line = np.polyfit(readings.pressure, readings.torque, 1)
    rest = readings.torque - np.polyval(line, readings.pressure)
    return float(np.sqrt(left / max(count, 1))), 0.5 * float(np.mean(rest[~rising]) - np.mean(rest[rising]))


def _fit(
    readings: Readings, with_growth: bool, confidence: float, extra: Floats | None = None, at: float | None = None
) -> Regression:
    """Return the regression; a friction that grows is that ``at`` a pressure difference [Pa], the mean one if None."""
    columns = [readings.pressure, np.ones_like(readings.pressure), -readings.branch]
    middle = readings.middle if at is None else at
    columns += [-readings.branch * (readings.pressure - middle)] if with_growth else []
    columns += [] if extra is None else [extra]
    design = np.stack(columns, axis=1)
    if readings.pressure.size <= design.shape[1]:
        raise IdentificationError(f"{PROCEDURE}: {readings.pressure.size} readings are too few")
    scale = np.sqrt((design**2).mean(axis=0))
    sides = (readings.branch > 0).astype(np.int64)
    cells = labels_of([readings.levels, sides])
    scaled = regress(design / scale, readings.torque, readings.clusters, cells, confidence)
    return replace(scaled, coefficients=scaled.coefficients / scale, half_widths=scaled.half_widths / scale)


def _check_order(sources: tuple[Source, ...], fit: Regression) -> None:
    names = ", ".join(source.name for source in sources)
    if fit.coefficients[_SLOPE] <= 0.0:
        raise IdentificationError(
            f"{names}: {PROCEDURE}: the torque falls with the pressure difference; reverse the sign of one channel"
        )
    if fit.coefficients[_FRICTION] < -fit.half_widths[_FRICTION]:
        raise IdentificationError(
            f"{names}: {PROCEDURE}: the rising branch lies above the falling one, as if friction drove the motion; "
            f"reverse the sign of channel 'direction'"
        )


def _estimates(
    evidence: Evidence, readings: Readings, fit: Regression, seen: Regression | None, growing: Regression
) -> tuple[Estimate, ...]:
    """Return what the readings give; ``seen`` is the growing friction where it was found to grow."""
    numbers = (
        _torque_constant(evidence, fit),
        _static_torque(readings, fit, seen),
        Number(
            "static_torque.zero_offset",
            "N m",
            fit.coefficients[_ZERO],
            fit.half_widths[_ZERO],
            "Torque that the scale shows at no pressure difference, midway between the branches.",
            scale=float(np.ptp(readings.torque)),
            widened=fit.widened[_ZERO],
        ),
        Number(
            "static_torque.friction_per_pressure",
            "m^3",
            growing.coefficients[_GROWTH],
            growing.half_widths[_GROWTH],
            "Growth of the static friction with the pressure difference [N m per Pa].",
            widened=growing.widened[_GROWTH],
        ),
    )
    return tuple(evidence.with_calibration(number) for number in numbers)


def _torque_constant(evidence: Evidence, fit: Regression) -> Number:
    source = {"independent readings": "the scatter of the readings"}.get(fit.widest, f"the {fit.widest}")
    text = f"Common slope of both branches; residuals scatter by {fit.scatter:.3g} N m; "
    text += f"the interval comes from {source}; {evidence.calibration_text}."
    value, half = fit.coefficients[_SLOPE], fit.half_widths[_SLOPE]
    return Number("actuator.torque_constant", "m^3", value, half, text, widened=fit.widened[_SLOPE])


def _static_torque(readings: Readings, fit: Regression, seen: Regression | None) -> Number:
    """Return the friction; where it grows, that at the mean pressure difference, which the number says."""
    condition = ""
    grown = "no growth with pressure shows in these readings"
    if seen is not None:
        growth = seen.coefficients[_GROWTH]
        at_rest = seen.coefficients[_FRICTION] - growth * readings.middle
        condition = f"at {readings.middle / 1e3:.4g} kPa"
        grown = f"it grows by {growth:.3g} m^3 with the pressure difference (per Pa), from {at_rest:.3g} N m at none, "
        grown += "and a model with one friction torque is right at that pressure only"
    text = (
        f"Half the distance between the branches at the mean pressure difference of {readings.middle:.4g} Pa; {grown}."
    )
    value, half = fit.coefficients[_FRICTION], fit.half_widths[_FRICTION]
    widened = fit.widened[_FRICTION]
    return Number("friction.static_torque", "N m", value, half, text, widened=widened, condition=condition)


def _at_no_pressure(readings: Readings, confidence: float) -> Number:
    """Return the friction that is left without a pressure difference, where it grows along a straight line."""
    fit = _fit(readings, True, confidence, at=0.0)
    lowest = float(readings.pressure.min())
    text = f"Static friction without a pressure difference, on a line through readings from {lowest:.4g} Pa upwards."
    value, half, widened = fit.coefficients[_FRICTION], fit.half_widths[_FRICTION], fit.widened[_FRICTION]
    return Number("static_torque.friction_at_no_pressure", "N m", value, half, text, widened=widened)


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
        f"the branches are {word}: a quadratic term would change the torque by {fraction:.1%} of its range",
    )


def _outliers(readings: Readings, fit: Regression) -> Check:
    spread = 1.4826 * float(np.median(np.abs(fit.residuals - np.median(fit.residuals))))
    worst = int(np.argmax(np.abs(fit.residuals)))
    count = int((np.abs(fit.residuals) > 6.0 * max(spread, 1e-300)).sum())
    fraction = count / fit.residuals.size
    text = f"{count} of {fit.residuals.size} readings lie more than six scatters off ({spread:.3g} N m each)"
    text += f"; the worst is {readings.places[worst]}, {fit.residuals[worst]:+.3g} N m" if count else ""
    return Check("outliers", fraction <= 0.01, text)


def _growth_check(growing: Regression, readings: Readings, grows: bool) -> Check:
    """Ask whether one number for the friction will do: a friction that grows fails, but for a chance of one percent."""
    low, high = (
        growing.coefficients[_FRICTION] + growing.coefficients[_GROWTH] * (pressure - readings.middle)
        for pressure in (readings.pressure.min(), readings.pressure.max())
    )
    if grows:
        text = (
            f"friction goes from {low:.3g} N m at the lowest to {high:.3g} N m at the highest pressure difference; a "
        )
        text += "model with one friction torque is right at one of them only"
    else:
        most = (abs(growing.coefficients[_GROWTH]) + growing.half_widths[_GROWTH]) * float(np.ptp(readings.pressure))
        text = f"one friction torque describes all pressures; more than {most:.2g} N m of growth would have shown"
    return Check("friction over pressure", not grows, text)


def _summary(readings: Readings, fit: Regression, grows: bool) -> str:
    count, levels = readings.pressure.size, int(readings.levels.max()) + 1
    return (
        f"{count} readings at {levels} pressures, {int(readings.clusters.max()) + 1} repetitions; "
        f"K = {fit.coefficients[_SLOPE]:.4g} m^3, friction {fit.coefficients[_FRICTION]:.3g} N m"
        f"{' on average, growing with pressure' if grows else ''}"
    )


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
    axis = ("Pressure difference", "Pa_d")
    return (
        Panel("Static torque", *axis, "Torque", "N m", (*main, line)),
        Panel("Residuals", *axis, "Measured minus fitted", "N m", (*rest, zero)),
    )
