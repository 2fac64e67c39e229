"""Valve map: command against opening; dead band, gain, saturation and hysteresis of a proportional valve.

Flow is divided by what the orifice law (6), (7) gives for the pressures of the moment, so that a supply that sags does
not look like a valve that saturates. What is left is the effective area Cd A(u), positive where chamber 1 is fed:

    Cd A = gain (|u'| - dead band), nothing inside the dead band, at most the full area,   u' = u - s h/2

with s = +1 while the command rises and -1 while it falls: h is the width of the hysteresis.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CurveFit, fit_curve
from ppafo.identification.bench.gas_flow import GasAt, orifice_shape
from ppafo.identification.bench.inputs import check_moves, check_sources, kind_of
from ppafo.identification.bench.picture import Panel, Series
from ppafo.identification.bench.result import BenchResult, verdict_of
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

PROCEDURE = "valve_map"
CHANNELS = ("command", "mass_flow", "upstream_pressure", "downstream_pressure")
FEWEST_SAMPLES = 12
_LEAST_RANGE = 0.5
_GOOD_SHARE = 0.05
_DEAD_BAND, _GAIN, _FULL, _HYSTERESIS = range(4)


@dataclass(frozen=True, slots=True)
class ValveMapSettings:
    """The gas, the valve's path in a set (``valves.main``), and how sure the intervals are [-]."""

    gas: GasAt
    path: str = "valve"
    confidence: float = 0.95


class _Map(NamedTuple):
    """Command [-], effective area [m^2], and 1 or -1 for a command that rises or falls, 0 where it does neither."""

    command: Floats
    area: Floats
    branch: Floats


def valve_map(sources: tuple[Source, ...], settings: ValveMapSettings) -> BenchResult:
    """Return dead band [-], gain [m^2], full area Cd A [m^2], saturation and hysteresis [-] from command and flow."""
    check_sources(sources, PROCEDURE, CHANNELS, FEWEST_SAMPLES)
    measured = _measured(sources, settings.gas)
    two_way = bool((measured.branch > 0).any() and (measured.branch < 0).any())
    fit, scale = _fit(measured, two_way, settings.confidence)
    estimates = _estimates(traces(sources), measured, fit, scale, two_way, settings)
    checks = _checks(measured, fit, two_way)
    values = fit.values
    text = (
        f"{measured.command.size} readings; dead band {values[_DEAD_BAND]:.3g}, hysteresis {values[_HYSTERESIS]:.3g}, "
    )
    text += f"gain {values[_GAIN] * scale * 1e6:.4g} mm^2"
    return BenchResult(PROCEDURE, text, estimates, checks, _panels(measured, fit, scale), kind_of(sources))


def area_of_command(
    command: Floats, branch: Floats, dead_band: float, gain: float, full: float, width: float
) -> Floats:
    """Return the effective area [m^2] of a command [-], positive towards chamber 1; see the head of the module."""
    shifted = command - 0.5 * width * branch
    size = np.clip(gain * (np.abs(shifted) - dead_band), 0.0, full)
    return np.asarray(np.sign(shifted) * size)


def _measured(sources: tuple[Source, ...], gas: GasAt) -> _Map:
    commands, areas, branches = [], [], []
    for source in sources:
        recording = source.recording
        check_moves(source, PROCEDURE, "command")
        check_moves(source, PROCEDURE, "mass_flow")
        command = recording["command"]
        wrong = np.flatnonzero(np.abs(command) > 1.0 + 1e-9)
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'command' is {command[wrong[0]]:g} at sample {wrong[0] + 1}; "
                f"it goes from -1 to 1: scale it in a column map"
            )
        shape = np.abs(
            orifice_shape(_absolute(source, CHANNELS[2]), _absolute(source, CHANNELS[3]), gas.heat_capacity_ratio)
        )
        usable = shape > 0.0
        areas.append(recording["mass_flow"][usable] / (gas.choked_flow_constant * shape[usable]))
        commands.append(command[usable])
        branches.append(_branch(source)[usable])
    measured = _Map(np.concatenate(commands), np.concatenate(areas), np.concatenate(branches))
    if np.ptp(measured.command) < _LEAST_RANGE:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the command moves by {np.ptp(measured.command):.3g} only; "
            f"{_LEAST_RANGE:g} or more is needed to see dead band and gain"
        )
    if float(measured.command @ measured.area) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: flow into chamber 1 falls with the command; "
            f"turn the sign of one of them round"
        )
    return measured


def _absolute(source: Source, name: str) -> Floats:
    values = source.recording[name]
    if values.min() <= 0.0:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: '{name}' is not absolute: it falls to {values.min():g} Pa; "
            f"say bar_g for gauge"
        )
    return values


def _branch(source: Source) -> Floats:
    """Return the direction of the command: what the recording says, else from the command's own last change."""
    if "direction" in source.recording:
        return source.recording["direction"]
    signs = np.sign(np.diff(source.recording["command"], prepend=source.recording["command"][0]))
    last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
    return signs[last]


def _fit(measured: _Map, two_way: bool, confidence: float) -> tuple[CurveFit, float]:
    """Fit on areas over the largest one; values are dead band, gain, full area (both over the largest), hysteresis."""
    scale = float(np.abs(measured.area).max())
    widest = 0.5 if two_way else 1e-9

    def residuals(values: Floats) -> Floats:
        return np.asarray(measured.area / scale - area_of_command(measured.command, measured.branch, *values.tolist()))

    lower, upper = np.zeros(4), np.array([0.9, 100.0, 2.0, widest])
    lower[_GAIN], lower[_FULL] = 1e-3, 1e-2
    starts = [np.array([band, 1.0 / (1.0 - band), 0.95, 0.25 * widest]) for band in (0.02, 0.15, 0.35)]
    fits = [fit_curve(residuals, start, lower, upper, confidence) for start in starts]
    return min(fits, key=lambda fit: fit.rms), scale


def _estimates(
    names: tuple[str, ...], measured: _Map, fit: CurveFit, scale: float, two_way: bool, settings: ValveMapSettings
) -> tuple[Estimate, ...]:
    values, wide = fit.values, fit.half_widths

    def entry(path: str, unit: str, index: int, factor: float, text: str, size: float | None = None) -> Estimate:
        value, half = float(values[index] * factor), float(wide[index] * factor)
        verdict: Verdict = verdict_of(value, value - half, value + half, size)
        return Estimate(
            path, value, unit, max(0.0, value - half), value + half, verdict, text, names, settings.confidence
        )

    saturation = float(values[_DEAD_BAND] + values[_FULL] / values[_GAIN])
    largest = float(np.abs(measured.command).max())
    seen = saturation < largest - 0.02
    told = (
        f"The valve is fully open from a command of {saturation:.3g} on"
        if seen
        else f"No saturation shows up to a command of {largest:.3g}, so this is the area there, or more"
    )
    listed = [
        entry(
            f"{settings.path}.dead_band",
            "",
            _DEAD_BAND,
            1.0,
            "Command below which nothing flows, both ways alike.",
            0.2,
        ),
        entry("valve_map.gain", "m^2", _GAIN, scale, "Effective area Cd A per command beyond the dead band."),
    ]
    if seen:
        listed.append(entry("valve_map.full_area", "m^2", _FULL, scale, f"{told}; Cd A there."))
        half = float(
            np.hypot(wide[_DEAD_BAND], wide[_FULL] / values[_GAIN] + wide[_GAIN] * values[_FULL] / values[_GAIN] ** 2)
        )
        listed.append(
            Estimate(
                "valve_map.saturation_command",
                saturation,
                "",
                saturation - half,
                saturation + half,
                verdict_of(saturation, saturation - half, saturation + half),
                "Command from which the valve opens no further.",
                names,
                settings.confidence,
            )
        )
    if two_way:
        text = "Width between the curves for a rising and a falling command."
        listed.append(entry("valve_map.hysteresis", "", _HYSTERESIS, 1.0, text, 0.2))
    return tuple(listed)


def _checks(measured: _Map, fit: CurveFit, two_way: bool) -> tuple[Check, ...]:
    fits = Check(
        "residuals", fit.rms <= _GOOD_SHARE, f"the map misses the opening by {fit.rms:.2%} of the full one (rms)"
    )
    both = bool((measured.command > 0.1).any() and (measured.command < -0.1).any())
    listed = [fits]
    if both:
        sides = [float(np.mean(fit.residuals[sign * measured.command > 0.1])) * sign for sign in (1.0, -1.0)]
        apart = abs(sides[0] - sides[1])
        text = f"the two directions differ by {apart:.2%} of the full opening"
        listed.append(Check("both ways alike", apart <= _GOOD_SHARE, text))
    else:
        listed.append(Check("both ways alike", True, "only one direction was recorded"))
    text = "rising and falling commands were recorded" if two_way else "the command went one way: hysteresis is unknown"
    return (*listed, Check("hysteresis seen", two_way, text))


def _panels(measured: _Map, fit: CurveFit, scale: float) -> tuple[Panel, ...]:
    command = np.linspace(float(measured.command.min()), float(measured.command.max()), 401)
    series = []
    for name, sign, role in (("command rising", 1.0, "rising"), ("command falling", -1.0, "falling")):
        on = measured.branch == sign
        if on.any():
            series.append(Series(name, measured.command[on], measured.area[on], role))  # type: ignore[arg-type]
            law = scale * area_of_command(command, np.full_like(command, sign), *fit.values.tolist())
            series.append(Series("fitted" if sign > 0 else "", command, law, "law"))
    rest = fit.residuals * scale
    return (
        Panel("Valve map", "Command", "-", "Effective area", "m^2", tuple(series)),
        Panel(
            "Residuals",
            "Command",
            "-",
            "Measured less fitted",
            "m^2",
            (Series("", measured.command, rest, "measured"),),
        ),
    )
