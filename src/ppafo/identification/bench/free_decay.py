"""Free decay after an impulse: viscous damping and Coulomb friction, separated; figure 3, bottom, of the paper.

With no pressure and no gravity, equation (1) is, until the vane stands still,

    I w' = -beta w - T_c (1 + q / (1 + (w / w_s)^2))                                             equations (1), (10)

I is the inertia [kg m^2], w the angular velocity [rad/s] in the direction of the push, beta the viscous damping
[N m s/rad], T_c the dynamic friction [N m]. Viscous damping bends the curve from the start, Coulomb friction ends it:
that is what tells the two apart. Near standstill a seal grips up to as hard as at rest (Stribeck; Hess and Soom, J.
Tribology 112, 1990): q, up to T_s / T_c - 1, and w_s are tolerances, as are the inertia and the gain of the sensor.
Without an inertia only beta/I [1/s] and T_c/I [rad/s^2] follow.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError, count_of
from ppafo.identification.bench.law import Readings, Values, recordings_of, solve, sought, tolerance, within
from ppafo.identification.bench.result import BenchResult, Reported, result_of
from ppafo.identification.residuals import Free
from ppafo.identification.source import Source, check_moves, check_no_gap, check_no_outlier, check_sources, window
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.residuals import curve_mark, readings_mark
from ppafo.report.style import GREY
from ppafo.signals.faults import is_at_limit, noise_of, plateaus
from ppafo.signals.recording import Floats

PROCEDURE = "free-decay"
ANGLE = "angle"
VELOCITY = "angular_velocity"
"""Fitted besides the angle where it was recorded."""

MINIMUM_SAMPLES = 20
_FEWEST_SMOOTHED, _SMOOTHED_FRACTION = 5, 0.04
_VELOCITY_MAY_DIFFER = 0.1
_MINIMUM_OVER_NOISE = 20.0
_RISE, _RISE_VELOCITY, _INERTIA, _GAIN = "rise of the friction near standstill", "its velocity", "inertia", "gain"
_STRIBECK = 0.1, 1.0e-3, 2.0
"""Velocity at which half of the rise is left [rad/s]: usual, lowest and highest."""


def free_decay(
    sources: tuple[Source, ...],
    start: float | None = None,
    end: float | None = None,
    inertia: float | None = None,
    inertia_deviation: float = 0.0,
    rise: float = 1.0,
    confidence: float = 0.95,
    tolerances: Tolerances = DEFAULTS,
) -> BenchResult:
    """Return viscous damping [N m s/rad] and dynamic friction [N m], or both over the inertia [1/s, rad/s^2]; (1).

    The angular velocity is fitted with the angle where a recording has it. Several recordings are several impulses to
    the same device: the numbers are common, each has its own start. The vane turns freely from ``start`` to ``end``
    [s]; without a start the decay begins where the speed is largest. Without an inertia [kg m^2], whose standard
    deviation is ``inertia_deviation``, only ratios over it are known. ``rise`` is friction at rest over dynamic
    friction, less 1 [-], by which seals may grip near standstill.
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    check_sources(sources, PROCEDURE, (ANGLE,), MINIMUM_SAMPLES)
    decays = tuple(decay_of(source, start, end) for source in sources)
    names, mass = (_OF_DEVICE, inertia) if inertia else (_OVER_INERTIA, 1.0)
    rough = _rough_rates(decays)
    numbers = (
        sought(names.damping, mass * rough.damping, 0.0),
        sought(names.friction, mass * rough.friction, 0.0),
        *_starts(decays),
        *_near_rest(rise),
        *tolerance(_INERTIA, inertia_deviation / mass),
        *within(_GAIN, tolerances.gain_of(ANGLE)),
    )

    def law(at: Values) -> Floats:
        moved = mass * (1.0 + at[_INERTIA])
        rates = Rates(max(at[names.damping], 0.0) / moved, max(at[names.friction], 0.0) / moved)
        parts = []
        for number, decay in enumerate(decays, start=1):
            angle, speed = at[f"start angle {number}"], at[f"start speed {number}"]
            swept, speeds = course(decay.time, speed, *rates, math.expm1(at[_RISE]), at[_RISE_VELOCITY])
            parts.append(angle + (1.0 + at[_GAIN]) * decay.sign * swept)
            parts += [] if decay.velocity is None else [decay.sign * speeds]
        return np.concatenate(parts)

    fitted, model = solve(law, _readings(sources, decays), numbers, confidence)
    values = fitted.by_name
    rates = Rates(values[names.damping] / mass, values[names.friction] / mass)
    near_rest = math.expm1(values.get(_RISE, 0.0)), values.get(_RISE_VELOCITY, 0.0)
    at_rest = sum(
        float(decay.time[-1]) > course_times(values[f"start speed {number}"], *rates, *near_rest)[0][-1]
        for number, decay in enumerate(decays, start=1)
    )
    missing = "" if inertia else "; the inertia is not known, so only ratios to it follow"
    return result_of(
        PROCEDURE,
        sources,
        fitted,
        names.reported(),
        f"{count_of(len(decays), 'decay')}, {at_rest} to standstill; beta/I = {rates.damping:.4g} 1/s, T_c/I = "
        f"{rates.friction:.4g} rad/s^2{missing}",
        _panels(decays, model, rates, near_rest),
        "another torque acts, such as gravity, an end stop or a friction of another shape",
    )


class Rates(NamedTuple):
    """Damping [1/s] and friction [rad/s^2] over the inertia."""

    damping: float
    friction: float


class _Names(NamedTuple):
    """Paths and units of damping and friction, of the device or over its inertia, which ``over`` says in words."""

    damping: str
    damping_unit: str
    friction: str
    friction_unit: str
    over: str

    def reported(self) -> tuple[Reported, Reported]:
        """Return both as they are reported."""
        return (
            Reported(self.damping, self.damping_unit, f"Viscous damping{self.over}"),
            Reported(self.friction, self.friction_unit, f"Dynamic friction{self.over}"),
        )


_OF_DEVICE = _Names("friction.viscous_damping", "N m s/rad", "friction.dynamic_torque", "N m", "")
_OVER_INERTIA = _Names(
    "free_decay.damping_over_inertia", "1/s", "free_decay.friction_over_inertia", "rad/s^2", " over the inertia"
)


def _readings(sources: tuple[Source, ...], decays: tuple["Decay", ...]) -> Readings:
    """Return angles and velocities of all decays, in groups of the fast and the slow half of the way."""
    series, halves, sensors = list[Floats](), list[str](), list[str]()
    for decay in decays:
        moved = np.abs(decay.angle - decay.angle[0])
        half = int(np.searchsorted(np.maximum.accumulate(moved), 0.5 * float(moved.max())))
        for sensor, samples in ((ANGLE, decay.angle), (VELOCITY, decay.velocity)):
            if samples is not None:
                series.append(samples)
                sensors += [sensor] * samples.size
                # A law that is wrong parts the fast from the slow.
                halves += ["the first half of the way"] * half + ["the second half of the way"] * (samples.size - half)
    counts = [decay.time.size * (1 if decay.velocity is None else 2) for decay in decays]
    return Readings(np.concatenate(series), sensors, recordings_of(sources, counts), (halves,))


def _way_of(decay: "Decay") -> tuple[float, float]:
    """Return the speed [rad/s] with which a decay begins, roughly, and the angle [rad] that it sweeps."""
    velocity, _ = smoothed_rates(decay.time, decay.angle)
    speed = max(float(np.abs(velocity[:_FEWEST_SMOOTHED]).max()), 1e-6)
    return speed, max(abs(float(decay.angle[-1] - decay.angle[0])), 1e-9)


def _starts(decays: tuple["Decay", ...]) -> list[Free]:
    """Return angle and speed with which each decay begins, which are sought."""
    starts = list[Free]()
    for number, decay in enumerate(decays, start=1):
        speed, swept = _way_of(decay)
        starts.append(sought(f"start angle {number}", float(decay.angle[0]), scale=swept))
        # The direction is the push's: a speed of 0 or below would be another decay.
        starts.append(sought(f"start speed {number}", speed, 1e-9 * speed, 10.0 * speed))
    return starts


def _rough_rates(decays: tuple["Decay", ...]) -> Rates:
    """Return first guesses of damping and friction, the medians over all decays.

    With viscous damping alone the way is speed over rate, with Coulomb friction alone speed^2 over twice the
    deceleration: half of each is a start between the two.
    """
    ways = [_way_of(decay) for decay in decays]
    rates = [(0.5 * speed / swept, 0.25 * speed**2 / swept) for speed, swept in ways]
    damping, friction = np.median(rates, axis=0).tolist()
    return Rates(damping, friction)


def _near_rest(rise: float) -> tuple[Free, ...]:
    """Return the tolerances of seals that grip harder near standstill: by how much, and from which velocity on."""
    most, usual = math.log1p(rise), _STRIBECK[0]
    if not most > 0.0:
        return ()
    # Between no rise and all of it nothing is known, not even the order of magnitude: an even distribution of the
    # logarithm, its width over the root of 12.
    return (
        Free(_RISE, 0.5 * most, 0.0, 2.0 * most, most, most / math.sqrt(12.0)),
        Free(_RISE_VELOCITY, usual, *_STRIBECK[1:], usual, usual),
    )


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_STEPS = 240
_SLOWEST = 1.0e-9
"""Deceleration, over that at the start, below which none counts: without Coulomb friction there is no standstill."""


def course_times(
    speed: float, damping_rate: float, deceleration: float, rise: float = 0.0, rise_velocity: float = 0.0
) -> tuple[Floats, Floats, Floats]:
    """Return times [s], angle swept [rad] and speed [rad/s] from the start to standstill; equation (1).

    From dt = -dw / (b w + d (1 + q / (1 + (w / w_s)^2))), by Gauss's rule over the speed; b [1/s], d [rad/s^2].
    """
    # Cubed, for the slowing near standstill, where a seal grips, needs the shortest steps.
    speeds = speed * np.linspace(1.0, 0.0, _STEPS + 1) ** 3
    middle, half = 0.5 * (speeds[1:] + speeds[:-1]), 0.5 * (speeds[:-1] - speeds[1:])
    at = middle[:, None] + half[:, None] * _NODES
    more = rise / (1.0 + np.square(at / rise_velocity)) if rise_velocity > 0.0 else np.zeros_like(at)
    slowing = damping_rate * at + deceleration * (1.0 + more)
    # Without any friction the time would be infinite.
    slowing = np.maximum(slowing, _SLOWEST * float(slowing.max()) + 1e-300)
    times = half * ((1.0 / slowing) @ _WEIGHTS)
    swept = half * ((at / slowing) @ _WEIGHTS)
    return np.concatenate(([0.0], np.cumsum(times))), np.concatenate(([0.0], np.cumsum(swept))), speeds


def course(times: Floats, speed: float, *friction: float) -> tuple[Floats, Floats]:
    """Return angle swept [rad] and speed [rad/s] at times [s]; the other arguments as in ``course_times``."""
    from scipy.interpolate import CubicHermiteSpline

    known, swept, speeds = course_times(speed, *friction)
    rising = np.concatenate(([True], np.diff(known) > 0.0))
    inside = np.minimum(times, known[-1])
    angle = CubicHermiteSpline(known[rising], swept[rising], speeds[rising])
    return np.asarray(angle(inside)), np.asarray(angle.derivative()(inside))


class Decay(NamedTuple):
    """One decay: times from its start [s], angle [rad], its direction (1 or -1), and its velocity [rad/s] if known."""

    time: Floats
    angle: Floats
    sign: float
    velocity: Floats | None


def decay_of(source: Source, start: float | None, end: float | None) -> Decay:
    """Return the decay in a recording between two times [s]; without a start it begins where the speed is largest.

    IdentificationError where too few samples are left.
    """
    check_moves(source, PROCEDURE, ANGLE)
    part = window(source.recording, start, end)
    if len(part) < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} samples between start and end, "
            f"there are {len(part)}"
        )
    swept, noise = float(np.ptp(part[ANGLE])), noise_of(part[ANGLE])
    if swept < _MINIMUM_OVER_NOISE * noise:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: nothing moves: the angle changes by {swept:.3g} rad with a noise of "
            f"{noise:.3g} rad; push the vane"
        )
    skipped = check_no_gap(source, PROCEDURE, part)
    for name in (name for name in (ANGLE, VELOCITY) if name in part):
        check_no_outlier(source, PROCEDURE, name, part)
    velocity, _ = smoothed_rates(part.time, part[ANGLE])
    first = 0 if start is not None else int(np.argmax(np.abs(velocity)))
    sign = 1.0 if velocity[first] > 0.0 else -1.0
    # A push ends a little after the highest speed of the smoothed signal; that much is left out.
    first += 0 if start is not None else _smoothing_width(part.time.size) // 2
    # A vane at rest has a rate of 0 but for noise; one that swings back has more.
    back = np.flatnonzero(sign * velocity[first:] < -0.02 * np.abs(velocity).max())
    last = first + int(back[0]) if back.size else part.time.size
    if last - first < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last - first} samples lie between the highest speed and the end or the "
            f"first reversal, {MINIMUM_SAMPLES} are needed; record longer, or give start and end"
        )
    time, angle = part.time[first:last], part[ANGLE][first:last]
    for plateau in plateaus(angle):
        if is_at_limit(angle, plateau):
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'angle' stays at exactly {plateau.value:g} rad for "
                f"{plateau.count} samples, from sample {skipped + first + plateau.first + 1}, and was still moving "
                f"before: the sensor is saturated or the vane is at a stop; give end"
            )
    if VELOCITY not in part:
        return Decay(time=time - time[0], angle=angle, sign=sign, velocity=None)
    measured = part[VELOCITY][first:last]
    # How fast the angle changes, by the area under the velocity: another unit or another sign is no 1.
    moved = np.concatenate(([0.0], np.cumsum(0.5 * (measured[1:] + measured[:-1]) * np.diff(time))))
    away = angle - angle.mean()
    gain = float(away @ moved / (away @ away))
    if abs(gain - 1.0) > _VELOCITY_MAY_DIFFER:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: channel '{VELOCITY}' is {gain:.3g} times as fast as 'angle' changes; "
            f"check unit and sign of both"
        )
    return Decay(time=time - time[0], angle=angle, sign=sign, velocity=measured)


def smoothed_rates(time: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return angular velocity [rad/s] and acceleration [rad/s^2] from local parabolas, at the times of the samples."""
    from scipy.signal import savgol_filter

    # The filter wants an even clock.
    even = np.linspace(time[0], time[-1], time.size)
    step, width = float(even[1] - even[0]), _smoothing_width(time.size)
    values = np.interp(even, time, angle)
    rates = [savgol_filter(values, width, 2, deriv=order, delta=step) for order in (1, 2)]
    velocity, acceleration = (np.interp(time, even, rate) for rate in rates)
    return velocity, acceleration


def _smoothing_width(count: int) -> int:
    """Return an odd number of samples to smooth over."""
    return max(_FEWEST_SMOOTHED, int(_SMOOTHED_FRACTION * count)) | 1


def _panels(
    decays: tuple[Decay, ...], model: Floats, rates: Rates, near_rest: tuple[float, float]
) -> tuple[Panel, ...]:
    angles, shown, place = list[Mark](), list[Mark](), 0
    measured, fitted, fastest = "measured", "fitted", 0.0
    for decay in decays:
        count = decay.time.size
        angles.append(readings_mark(measured, decay.time, decay.angle))
        angles.append(curve_mark(fitted, decay.time, model[place : place + count]))
        place += count if decay.velocity is None else 2 * count
        velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
        inner = slice(_smoothing_width(count), None, max(1, count // 200))
        moving = velocity[inner] > 0.03 * velocity.max()
        shown.append(readings_mark(measured, velocity[inner][moving], acceleration[inner][moving]))
        fastest = max(fastest, float(velocity.max()))
        measured = fitted = ""  # the legend names the first decay only
    line = np.linspace(0.0, fastest, 200)
    shown.append(curve_mark("$-\\beta\\omega/I - T_c/I$", line, -rates.damping * line - rates.friction))
    rise, velocity_of_rise = near_rest
    if rise > 0.0 and velocity_of_rise > 0.0:
        # The formula of the legend is a straight line; what was fitted near rest bends, and has a name of its own.
        more = rise / (1.0 + np.square(line / velocity_of_rise))
        fit = Mark(
            "line",
            line,
            -rates.damping * line - rates.friction * (1.0 + more),
            label="fit, with more friction near rest",
        )
        shown.append(replace(fit, colour=GREY, style={"linestyle": "--", "linewidth": 1.2}))
    rate, acceleration_kind = Kind("Angular velocity", "rad/s"), Kind("Angular acceleration", "rad/s$^2$")
    return (
        Panel(TIME, Kind("Angle", "rad", "angle"), angles, "Free decay", legend="inside"),
        Panel(rate, acceleration_kind, shown, "Damping", legend="inside"),
    )
