"""Static torque over rising and falling pressure: torque constant and friction; figure 3, top, of the paper.

While the pressure rises, friction reduces the torque at the scale; while it falls, friction adds to it:

    T = K dP + T_0 - s (T_s + g |dP|),   s = +1 rising, -1 falling                               equations (2), (10)

T is the reading of the scale [N m], dP the pressure difference [Pa], K the torque constant [m^3], T_0 the zero of the
scale [N m], T_s the friction without pressure [N m], g its growth with pressure [m^3] (effect ``seal_friction``). Zero
and gain of the pressure sensor and gain of the scale are tolerances. So is the friction of each of several recordings,
because seals grip differently from one to another. If a position or an angle moves with the direction while the
pressure does not, the actuator slid, and T_s is the kinetic friction. A ``force`` [N] in place of the torque gives an
area [m^2] and forces, for which a set has no entry.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import PooledReadings, Values, solve, sought, within
from ppafo.identification.bench.result import BenchResult, ReportedNumber, result_of
from ppafo.identification.bench.torque_readings import FORCE, PROCEDURE, TorqueReadings, torque_readings
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.identification.wording import in_shown_unit
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

_ZERO = "static_torque.zero_offset"
"""Path of the zero error of the scale, which is no parameter of a set."""
_GAIN, _SENSOR_ZERO = "gain of the pressure sensor", "zero of the pressure sensor"
_SIGMAS = 4.0
"""Standard errors below zero from which a negative friction guess means a wrong sign instead of noise."""


@dataclass(frozen=True, slots=True)
class _Unknowns:
    """Unit of the load, and words, paths and units of slope, friction and growth of the friction.

    Unknowns without an entry in a parameter set have a path that starts with ``static_torque``.
    """

    unit: str
    slope: str
    slope_path: str
    slope_unit: str
    friction: str
    friction_path: str
    growth_path: str


def _unknowns_of(readings: TorqueReadings) -> _Unknowns:
    """Return the unknowns for a torque or a force; an actuator that slides has kinetic friction."""
    key, friction = ("dynamic", "friction in motion") if readings.slides else ("static", "static friction")
    if readings.channel == FORCE:
        return _Unknowns(
            unit="N",
            slope="area",
            slope_path="static_torque.area",
            slope_unit="m^2",
            friction=friction,
            friction_path=f"static_torque.{key}_friction",
            growth_path="static_torque.friction_per_pressure",
        )
    return _Unknowns(
        unit="N m",
        slope="torque constant",
        slope_path="actuator.torque_constant",
        slope_unit="m^3",
        friction=friction,
        friction_path=f"friction.{key}_torque",
        growth_path=f"effects.seal_friction.{key}_per_pressure",
    )


def static_torque(
    sources: tuple[RecordingSource, ...], confidence: float = 0.95, tolerances: Tolerances = DEFAULTS
) -> BenchResult:
    """Identify torque constant [m^3], friction without pressure [N m], its growth [m^3], and scale zero [N m].

    The model is equation (2). The friction is static, or kinetic if the actuator slid. For a force the units are m^2
    and N. Readings with direction 0 belong to no branch and are left out. So is a flat start of the rising branch,
    where a scale that only pulls shows nothing until friction is overcome.

    Arguments:
        sources: recordings of pressure difference, direction, and torque or force
        confidence: confidence level of the intervals [-]
        tolerances: limits of the errors of the bench

    Returns:
        the estimates with intervals and verdicts, a summary and two panels

    Raises:
        IdentificationError: recordings that cannot separate the unknowns; names file, sample and remedy
    """
    readings = torque_readings(sources, tolerances.zero_of_pressure)
    unknowns, channel = _unknowns_of(readings), readings.channel
    files = [source.name for source in sources]
    slope, zero, friction, friction_scale = _straight_line(readings, ", ".join(files))
    frictions = [f"friction of {file}" for file in files] if len(files) > 1 else []
    has_zeros = "zero" in tolerances.each_recording and len(files) > 1
    zeros = [f"{_SENSOR_ZERO} of {file}" for file in files] if has_zeros else [_SENSOR_ZERO]
    load_gain = f"gain of the {channel} sensor"
    numbers = (
        sought(unknowns.slope_path, slope),
        sought(unknowns.friction_path, friction, scale=friction_scale),
        sought(unknowns.growth_path, 0.0, scale=friction_scale / float(np.abs(readings.pressure).max())),
        sought(_ZERO, zero, scale=friction_scale),
        *(number for name in zeros for number in within(name, tolerances.zero_of_pressure)),
        *within(_GAIN, tolerances.gain_of("pressure")),
        *within(load_gain, tolerances.gain_of(channel)),
        *(number for name in frictions for number in within(name, tolerances.friction, "friction")),
    )

    def law(at: Values) -> Floats:
        pressure = (readings.pressure - _of_files(at, zeros, readings.files)) / (1.0 + at[_GAIN])
        resisting = readings.branch * (at[unknowns.friction_path] + at[unknowns.growth_path] * np.abs(pressure))
        resisting = resisting * (1.0 + _of_files(at, frictions, readings.files))
        load = (1.0 + at[load_gain]) * (at[unknowns.slope_path] * pressure - resisting)
        return np.asarray(readings.weight * (load + at[_ZERO]))

    middle = 0.5 * float(readings.pressure.max() + readings.pressure.min())
    groups = (
        np.where(readings.branch > 0.0, "the rising branch", "the falling branch").tolist(),
        np.where(readings.pressure > middle, "readings at higher pressures", "readings at lower pressures").tolist(),
    )
    # Loads over their noise.
    weighted = PooledReadings(
        readings.weight * readings.load, [channel] * readings.pressure.size, readings.recordings, groups
    )
    fitted, weighted_model = solve(law, weighted, numbers, confidence)
    values, residuals = fitted.by_name, readings.load - weighted_model / readings.weight
    shown_slope, slope_unit = in_shown_unit(values[unknowns.slope_path], unknowns.slope_unit)
    shown_friction, unit = in_shown_unit(values[unknowns.friction_path], unknowns.unit)
    scatter, _ = in_shown_unit(float(np.std(residuals)), unknowns.unit)
    result = result_of(
        PROCEDURE,
        sources,
        fitted,
        (
            ReportedNumber(
                unknowns.slope_path,
                unknowns.slope_unit,
                f"{unknowns.slope.capitalize()}, the common slope of both branches",
            ),
            ReportedNumber(
                unknowns.friction_path, unknowns.unit, f"{unknowns.friction.capitalize()} without a pressure difference"
            ),
            ReportedNumber(
                unknowns.growth_path,
                f"{unknowns.unit}/Pa",
                f"Growth of the {unknowns.friction} with the pressure difference",
            ),
            # A zero of the scale may be an answer.
            ReportedNumber(_ZERO, unknowns.unit, f"Zero of the {channel} sensor", float(np.ptp(readings.load))),
        ),
        f"{readings.pressure.size} readings, {count_of(readings.repetitions, 'repetition')}; {unknowns.slope} "
        f"{shown_slope:.4g} {slope_unit}, {unknowns.friction} {shown_friction:.3g} {unit}; "
        f"scatter {scatter:.3g} {unit}",
        with_residuals(
            f"Static {channel}",
            Kind("Pressure difference", "Pa_d", "pressure change"),
            Kind(channel.capitalize(), unknowns.unit, channel),
            _marks(readings, values[unknowns.slope_path], values[_ZERO]),
            readings.pressure,
            residuals,
        ),
        f"a constant {unknowns.slope} and a {unknowns.friction} linear in pressure do not describe the readings",
    )
    return _with_possible_friction(result, unknowns)


def _with_possible_friction(result: BenchResult, unknowns: _Unknowns) -> BenchResult:
    """Limit the result to this model if friction or its growth with pressure is certainly negative."""
    if result.conflict:
        return result
    if result[unknowns.friction_path].high < 0.0:
        fault = f"the {unknowns.friction} without pressure is negative, as if it drove the motion"
    elif result[unknowns.growth_path].high < 0.0:
        fault = f"the {unknowns.friction} falls as the pressure rises, as if pressure loosened the seal"
    else:
        return result
    estimates = tuple(
        replace(estimate, verdict="holds for this model only") if estimate.verdict == "identified" else estimate
        for estimate in result.estimates
    )
    remedy = "check the channels and their units, or add recordings at other pressures"
    return replace(result, estimates=estimates, conflict=f"{fault}; {remedy}")


def _straight_line(readings: TorqueReadings, files: str) -> tuple[float, float, float, float]:
    """Return start values from a linear fit of both branches: slope, zero, friction, and scale of the friction.

    The slope is in units of load per Pa, the others in units of load; the scale is at least the scatter. Raises
    IdentificationError, with ``files`` first, if a sign is impossible.
    """
    design = np.stack((readings.pressure, np.ones_like(readings.pressure), -readings.branch), axis=1)
    # Pressures are some 1e5 times as large as the other columns.
    scale = np.sqrt((design**2).mean(axis=0))
    solution = np.linalg.lstsq(design / scale, readings.load, rcond=None)[0] / scale
    slope, zero, friction = solution.tolist()
    if slope <= 0.0:
        raise IdentificationError(
            f"{files}: {PROCEDURE}: the {readings.channel} decreases while the pressure difference increases; reverse "
            "the sign of one of them"
        )
    deviation = float(np.std(readings.load - design @ solution))
    # Where friction is small its sign is the noise's, and no reason to refuse.
    if friction < -_SIGMAS * deviation / np.sqrt(readings.pressure.size):
        raise IdentificationError(
            f"{files}: {PROCEDURE}: the rising branch lies above the falling one, as if friction drove the motion; "
            "reverse the sign of channel 'direction'"
        )
    return slope, zero, friction, max(abs(friction), deviation)


def _of_files(at: Values, names: list[str], files: NDArray[np.int64]) -> Floats:
    """Return the tolerance of each reading: value of its file, or common value; 0 without tolerance."""
    values = np.array([at[name] for name in names] or [0.0])
    return np.asarray(values[files] if len(names) > 1 else values)


def _marks(readings: TorqueReadings, slope: float, zero: float) -> list[Mark]:
    """Return the plot marks of both branches over pressure, and of the frictionless line with this slope and zero."""
    marks = []
    for role, sign, motion in (("rising", 1.0, "with"), ("falling", -1.0, "against")):
        # An actuator that slides at constant pressure has two directions of motion as branches.
        label = f"moving {motion} the pressure" if readings.slides else f"pressure {role}"
        on = readings.branch == sign
        marks.append(readings_mark(label, readings.pressure[on], readings.load[on], role))
    ends = np.array([readings.pressure.min(), readings.pressure.max()])
    return [*marks, curve_mark("without friction", ends, slope * ends + zero)]
