"""Valve map: command against opening; dead band, gain, saturation and hysteresis of a proportional valve.

Flow is divided by what the orifice law (6), (7) gives for the pressures of the moment, so that a supply that sags does
not look like a valve that saturates. What is left is the effective area Cd A(u), positive where chamber 1 is fed:

    Cd A = gain (|u'| - dead band), nothing inside the dead band, at most the full area,   u' = u - s h/2

with s = +1 while the command rises and -1 while it falls: h is the width of the hysteresis.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CurveFit, fit_curve
from ppafo.identification.bench.flow_laws import GasAt, orifice_shape
from ppafo.identification.bench.result import BenchResult, Evidence, Number, Panel, Role, Series
from ppafo.identification.estimate import Check, Estimate, Prospect
from ppafo.identification.source import Source, check_absolute, check_moves, check_sources, kind_of, pauses, traces
from ppafo.signals.faults import FEWEST_AT_LIMIT, plateaus, scatters
from ppafo.signals.recording import Floats

PROCEDURE = "valve-map"
CHANNELS = ("command", "mass_flow", "upstream_pressure", "downstream_pressure")
MINIMUM_SAMPLES = 12
_MINIMUM_RANGE = 0.5
_SEEN_BEYOND = 0.02
_SMALL_COMMAND, _FEWEST_SMALL = 0.2, 5
_GOOD_FRACTION = 0.05
_DEAD_BAND, _GAIN, _FULL, _HYSTERESIS = range(4)


@dataclass(frozen=True, slots=True)
class ValveMapSettings:
    """The gas, the valve's path in a set (``valves.main``), how sure the intervals are [-], the sensors' gain [-]."""

    gas: GasAt
    path: str = "valve"
    confidence: float = 0.95
    calibration: float = 0.0


class _Map(NamedTuple):
    """Command [-], effective area [m^2], and 1 or -1 for a command that rises or falls, 0 where it does neither."""

    command: Floats
    area: Floats
    branch: Floats

    @property
    def is_two_way(self) -> bool:
        """Whether commands both rise and fall."""
        return bool((self.branch > 0).any() and (self.branch < 0).any())

    @property
    def has_both_directions(self) -> bool:
        """Whether the valve was opened both ways."""
        return bool((self.command > 0.1).any() and (self.command < -0.1).any())


def valve_map(sources: tuple[Source, ...], settings: ValveMapSettings) -> BenchResult:
    """Return dead band [-], gain [m^2], full area Cd A [m^2], saturation and hysteresis [-] from command and flow.

    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    measured = _read_map(sources, settings.gas)
    # Fitted on areas over the largest one: dead band, gain and full area in its multiples, hysteresis.
    scale = float(np.abs(measured.area).max())
    widest = 0.5 if measured.is_two_way else 1e-9

    def residuals(values: Floats) -> Floats:
        return np.asarray(measured.area / scale - area_of_command(measured.command, measured.branch, *values.tolist()))

    lower, upper = np.zeros(4), np.array([0.9, 100.0, 2.0, widest])
    lower[_GAIN], lower[_FULL] = 1e-3, 1e-2
    starts = [np.array([band, 1.0 / (1.0 - band), 0.95, 0.25 * widest]) for band in (0.02, 0.15, 0.35)]
    fits = [fit_curve(residuals, start, lower, upper, settings.confidence, (measured.command,)) for start in starts]
    fit = min(fits, key=lambda fit: fit.rms)
    evidence = Evidence(traces(sources), settings.confidence, settings.gas.flow_uncertainty(settings.calibration))
    band, gain, _, hysteresis = fit.values
    text = f"{measured.command.size} readings; dead band {band:.3g}, hysteresis {hysteresis:.3g}, "
    text += f"gain {gain * scale * 1e6:.4g} mm^2"
    one_way = "only one direction was recorded: whether the other behaves the same is unknown"
    return BenchResult(
        PROCEDURE,
        text,
        _estimates(evidence, measured, fit, scale, settings.path),
        (*_checks(measured, fit), _meter_check(sources)),
        _panels(measured, fit, scale),
        kind_of(sources),
        (*(() if measured.has_both_directions else (one_way,)), *pauses(sources)),
    )


def map_prospects(sources: tuple[Source, ...], _settings: ValveMapSettings) -> tuple[Prospect, ...]:
    """Return whether dead band, both directions and hysteresis can be had from the commands that were given."""
    command = np.concatenate([source.recording["command"] for source in sources])
    small = int((np.abs(command) < _SMALL_COMMAND).sum())
    low, high = float(command.min()), float(command.max())
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    branches = np.concatenate([_branch(source) for source in sources])
    ways = bool((branches > 0).any() and (branches < 0).any())
    both = low < -0.1 and high > 0.1
    return (
        Prospect("dead band", small >= _FEWEST_SMALL, f"{small} commands below {_SMALL_COMMAND:g}"),
        Prospect("both directions", both, f"commands from {low:.3g} to {high:.3g}"),
        Prospect("hysteresis", ways, "commands rise and fall" if ways else "the command goes one way only"),
    )


def area_of_command(
    command: Floats, branch: Floats, dead_band: float, gain: float, full: float, width: float
) -> Floats:
    """Return the effective area [m^2] of a command [-], positive towards chamber 1; see the head of the module."""
    shifted = command - 0.5 * width * branch
    size = np.clip(gain * (np.abs(shifted) - dead_band), 0.0, full)
    return np.asarray(np.sign(shifted) * size)


def _read_map(sources: tuple[Source, ...], gas: GasAt) -> _Map:
    commands, areas, branches = [], [], []
    for source in sources:
        recording = source.recording
        check_moves(source, PROCEDURE, "command")
        check_moves(source, PROCEDURE, "mass_flow")
        check_absolute(source, PROCEDURE, CHANNELS[2:])
        command = recording["command"]
        wrong = np.flatnonzero(np.abs(command) > 1.0 + 1e-9)
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'command' is {command[wrong[0]]:g} at sample {wrong[0] + 1}; "
                f"it goes from -1 to 1: scale it in a column map"
            )
        shape = np.abs(orifice_shape(recording[CHANNELS[2]], recording[CHANNELS[3]], gas.heat_capacity_ratio))
        usable = shape > 0.0
        areas.append(recording["mass_flow"][usable] / (gas.choked_flow_constant * shape[usable]))
        commands.append(command[usable])
        branches.append(_branch(source)[usable])
    measured = _Map(np.concatenate(commands), np.concatenate(areas), np.concatenate(branches))
    if np.ptp(measured.command) < _MINIMUM_RANGE:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the command covers a range of only {np.ptp(measured.command):.3g}; "
            f"{_MINIMUM_RANGE:g} or more is needed to identify dead band and gain"
        )
    if float(measured.command @ measured.area) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: flow into chamber 1 falls with the command; "
            f"reverse the sign of one of them"
        )
    return measured


def _branch(source: Source) -> Floats:
    """Return the direction of the command: what the recording says, else from the command's own last change."""
    if "direction" in source.recording:
        return source.recording["direction"]
    signs = np.sign(np.diff(source.recording["command"], prepend=source.recording["command"][0]))
    last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
    return signs[last]


def _estimates(evidence: Evidence, measured: _Map, fit: CurveFit, scale: float, path: str) -> tuple[Estimate, ...]:
    """Return what the map has; a wrong gain of the sensors passes on to areas, not to commands."""

    def area(index: int, name: str, text: str) -> Estimate:
        found = fit.number(index, f"valve_map.{name}", "m^2", text)
        return evidence.with_calibration(replace(found, value=found.value * scale, half_width=found.half_width * scale))

    text = "Command below which nothing flows, the same in both directions."
    band = replace(fit.number(_DEAD_BAND, f"{path}.dead_band", "", text), scale=_SMALL_COMMAND)
    gain = area(_GAIN, "gain", "Effective area Cd A per command beyond the dead band.")
    listed = [evidence.without_calibration(band), gain]
    # The command from which the valve opens no further: dead band + full area / gain.
    values, wide = fit.values, fit.half_widths
    saturation = values[_DEAD_BAND] + values[_FULL] / values[_GAIN]
    of_slope = wide[_FULL] / values[_GAIN] + wide[_GAIN] * values[_FULL] / values[_GAIN] ** 2
    if saturation < float(np.abs(measured.command).max()) - _SEEN_BEYOND:
        text = f"The valve is fully open from a command of {saturation:.3g} on; Cd A there."
        listed.append(area(_FULL, "full_area", text))
        half, widened = float(np.hypot(wide[_DEAD_BAND], of_slope)), float(fit.widened.max())
        name, text = "valve_map.saturation_command", "Command from which the valve opens no further."
        listed.append(evidence.without_calibration(Number(name, "", saturation, half, text, widened=widened)))
    if measured.is_two_way:
        text = "Width between the curves for a rising and a falling command."
        width = fit.number(_HYSTERESIS, "valve_map.hysteresis", "", text)
        listed.append(evidence.without_calibration(replace(width, scale=_SMALL_COMMAND)))
    return tuple(listed)


def _checks(measured: _Map, fit: CurveFit) -> tuple[Check, ...]:
    text = f"the map misses the opening by {fit.rms:.2%} of the full one (rms)"
    listed = [Check("residuals", fit.rms <= _GOOD_FRACTION, text)]
    if measured.has_both_directions:
        sides = [float(np.mean(fit.residuals[sign * measured.command > 0.1])) * sign for sign in (1.0, -1.0)]
        apart = abs(sides[0] - sides[1])
        text = f"the two directions differ by {apart:.2%} of the full opening"
        listed.append(Check("both ways alike", apart <= _GOOD_FRACTION, text))
    both_ways, one_way = "rising and falling commands were recorded", "the command went one way: hysteresis is unknown"
    text = both_ways if measured.is_two_way else one_way
    return (*listed, Check("hysteresis seen", measured.is_two_way, text))


def _meter_check(sources: tuple[Source, ...]) -> Check:
    """Ask whether the flow loses its scatter at its largest or smallest value, as a meter at its limit does.

    A valve that is fully open keeps the scatter, unless the meter is too coarse to show it.
    """
    for source in sources:
        flow = source.recording["mass_flow"]
        for plateau in plateaus(flow):
            if plateau.count >= FEWEST_AT_LIMIT and scatters(flow):
                return Check(
                    "flow meter",
                    False,
                    f"{source.name}: channel 'mass_flow' stays at exactly {plateau.value:g} kg/s for {plateau.count} "
                    f"samples, from sample {plateau.first + 1}: saturated, or too coarse to show any scatter",
                )
    return Check("flow meter", True, "the flow scatters at its largest values too")


def _panels(measured: _Map, fit: CurveFit, scale: float) -> tuple[Panel, ...]:
    command = np.linspace(float(measured.command.min()), float(measured.command.max()), 401)
    series = []
    branches: dict[Role, float] = {"rising": 1.0, "falling": -1.0}
    for role, sign in branches.items():
        on = measured.branch == sign
        if on.any():
            series.append(Series(f"command {role}", measured.command[on], measured.area[on], role))
            law = scale * area_of_command(command, np.full_like(command, sign), *fit.values.tolist())
            series.append(Series("fitted" if sign > 0 else "", command, law, "law"))
    rest = Series("", measured.command, fit.residuals * scale, "measured")
    return (
        Panel("Valve map", "Command", "-", "Effective area", "m^2", tuple(series)),
        Panel("Residuals", "Command", "-", "Measured minus fitted", "m^2", (rest,)),
    )
