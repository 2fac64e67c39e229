"""Free decay after an impulse: viscous damping and Coulomb friction, separated; figure 3, bottom, of the paper.

With no pressure and no gravity, equation (1) is, until the vane stands still,

    I w' = -beta w - T_c (1 + q / (1 + (w / w_s)^2))                                             equations (1), (10)

I is the inertia [kg m^2], w the angular velocity [rad/s] in the direction of the push, beta the viscous damping [N m
s/rad], T_c the dynamic friction [N m]. Viscous damping curves w(t) from the start and Coulomb friction stops the vane
in finite time, which separates the two. Near standstill a seal may grip as hard as at rest (Stribeck; Hess and Soom, J.
Tribology 112, 1990): q, up to T_s / T_c - 1, and w_s are tolerances, as are the inertia and the gain of the sensor.
Without an inertia only beta/I [1/s] and T_c/I [rad/s^2] can be estimated.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from ppafo.identification.bench import law as bench
from ppafo.identification.bench import readings
from ppafo.identification.fit import FitNumber, tolerance
from ppafo.identification.source import RecordingSource, Sources
from ppafo.model.declaration import Number
from ppafo.parameters.records import keyed
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.residuals import curve_mark, readings_mark
from ppafo.report.style import GREY
from ppafo.signals.faults import is_at_limit, noise_of, plateaus
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

# Fitted channels; the velocity is fitted together with the angle, if recorded.
_ANGLE = "angle"
_VELOCITY = "angular_velocity"
_MINIMUM_SAMPLES = 20
# Least number and fraction of the samples of a decay to which a local parabola is fitted.
_FEWEST_SMOOTHED = 5
_SMOOTHED_FRACTION = 0.04
_REVERSAL = 0.02
"""Backward velocity relative to the largest velocity [-] that counts as a reversal; noise at rest stays below."""
_VELOCITY_MAY_DIFFER = 0.1
"""Largest relative difference of velocity and rate of the angle [-]; a wrong unit or sign differs by more."""
_MINIMUM_OVER_NOISE = 20.0
"""Least range of the angle divided by its noise [-] for motion to be detected."""
# Distance from the end of a swing within which the vane is near it: fraction of the swing [-], at least this noise.
_NEAR = 0.05
_NOISE_NEAR = 6.0
_AT_ONCE = 2.0
"""Duration near the end of a swing, relative to the last half of the swing [-], below which the vane did not rest."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
"""Nodes and weights of three-point Gauss-Legendre quadrature, used in each step of the speed."""
_STEPS = 240
"""Number of steps of the speed from the start to standstill."""
_SLOWEST = 1.0e-9
"""Lower bound of the deceleration, relative to the largest [-], so that the vane stops without Coulomb friction too."""
# Names of the tolerances: log of 1 + q [-], w_s [rad/s], relative errors of the inertia and of the angle [-].
_RISE = "rise of the friction near standstill"
_RISE_VELOCITY = "its velocity"
_INERTIA = "inertia"
_GAIN = "gain"
# Names of the variables for initial angle [rad] and speed [rad/s], by number of the decay.
_START_ANGLE = "start angle {}"
_START_SPEED = "start speed {}"
# Velocity at which the friction rise is halved [rad/s]: usual, lowest and highest value.
_USUAL_RISE_VELOCITY = 0.1
_LOWEST_RISE_VELOCITY = 1.0e-3
_HIGHEST_RISE_VELOCITY = 2.0
_STEPS_OF_DECAY = 5.0e-6, 0.2
"""Times between samples of a free decay [s], which lasts seconds at most; others mean a wrong unit of time."""
_MOST_OF_STOPS = 10.0
"""Largest plausible ratio of swing in a free decay to angle between the stops [-]; more means a wrong unit."""
# Least initial speed [rad/s] and swept angle [rad] for a fit without visible motion.
_LEAST_SPEED = 1.0e-6
_LEAST_SWEPT = 1.0e-9
_MOVING = 0.03
"""Fraction of the largest speed [-] below which the damping panel omits the noisy acceleration."""


_OF_INERTIA = "friction.viscous_damping", "friction.dynamic_torque", ("N m s/rad", "N m"), "", ""
_OVER_INERTIA = (
    "free_decay.damping_over_inertia",
    "free_decay.friction_over_inertia",
    ("1/s", "rad/s^2"),
    " over the inertia",
    "; the inertia is unknown, so only ratios to the inertia are identified",
)
"""Paths of damping and friction, their units, and ends of their texts and of the summary, by whether I is known."""


class FreeDecay(NamedTuple):
    """Free decay: times from the start [s], angle [rad], direction (1 or -1), fitted channels, and its number.

    The channels are the angle and, if recorded, the velocity [rad/s].
    """

    time: Floats
    angle: Floats
    sign: float
    sensors: dict[str, Floats]
    number: int


def decay_of(source: RecordingSource, start: float | None, end: float | None, number: int) -> FreeDecay:
    """Return the decay between two times [s] of a recording; by default it starts at the largest speed.

    Raises IdentificationError, with file, sample and remedy, if there are too few samples, if nothing moves, if the
    largest swing ends in a return swing without rest, as on a spring, or if the sensor is saturated or contradicts the
    velocity.
    """
    readings.check_moves(source, _ANGLE)
    part, skipped = readings.timed_part(source, start, end)
    readings.check_enough(source, len(part), _MINIMUM_SAMPLES, "samples from start to end")
    swept = np.ptp(part[_ANGLE])
    noise = noise_of(part[_ANGLE])
    if swept < _MINIMUM_OVER_NOISE * noise:
        source.refuse(f"no motion: the angle changes by {swept:.3g} rad at a noise of {noise:.3g} rad")
    speeds, _ = smoothed_rates(part.time, part[_ANGLE])
    # A start that the user gave is after the push, which ends a little after the highest speed of the smoothed signal.
    fastest = int(np.argmax(np.abs(speeds))) if start is None else 0
    pushed = smoothing_width(part.time.size) // 2 if start is None else 0
    time = part.time[fastest:]
    angle = part[_ANGLE][fastest:]
    # Friction alone stops the vane.
    turn = max(np.argmin(angle), np.argmax(angle))
    distance = np.abs(angle - angle[turn])
    near = max(_NEAR * distance.max(), _NOISE_NEAR * noise)
    away = time[turn:][distance[turn:] > near]
    if away.size:
        halfway, reached = (time[:turn][distance[:turn] > far][-1] for far in (0.5 * distance.max(), near))
        if away[0] - reached < _AT_ONCE * (reached - halfway):
            source.refuse(
                f"the vane turns back at {time[turn]:.3g} s without coming to rest, so another torque acts, such as a "
                "spring, gravity, a stop or a hand"
            )
    sign = 1.0 if speeds[fastest] > 0.0 else -1.0
    first = fastest + pushed
    is_back = sign * speeds[first:] < -_REVERSAL * np.abs(speeds).max()
    last = first + int(np.argmax(is_back)) if is_back.any() else part.time.size
    until = "samples from the highest speed to the first reversal or end"
    readings.check_enough(source, last - first, _MINIMUM_SAMPLES, until)
    time = part.time[first:last]
    angle = part[_ANGLE][first:last]
    for plateau in plateaus(angle):
        if is_at_limit(angle, plateau):
            source.refuse(
                f"channel 'angle' stays at {plateau.value:g} rad in {plateau.count} rows, from sample "
                f"{skipped + first + plateau.first + 1}: saturated, or at a stop"
            )
    sensors = {name: part[name][first:last] for name in (_ANGLE, _VELOCITY) if name in part}
    if _VELOCITY in sensors:
        velocity = sensors[_VELOCITY]
        # The angle is compared with the area under the velocity.
        moved = np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))
        deviation = angle - angle.mean()
        gain = deviation @ [0.0, *moved] / (deviation @ deviation)
        if abs(gain - 1.0) > _VELOCITY_MAY_DIFFER:
            source.refuse(f"channel '{_VELOCITY}' is {gain:.3g} times the derivative of 'angle'")
    return FreeDecay(time - time[0], angle, sign, sensors, number)


def smoothed_rates(time: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return angular velocity [rad/s] and acceleration [rad/s^2] at the samples, from local parabolas."""
    from scipy.signal import savgol_filter

    # The filter wants an even clock.
    even = np.linspace(time[0], time[-1], time.size)
    step = float(even[1] - even[0])
    width = smoothing_width(time.size)
    values = np.interp(even, time, angle)
    rates = [savgol_filter(values, width, 2, deriv=order, delta=step) for order in (1, 2)]
    velocity, acceleration = (np.interp(time, even, rate) for rate in rates)
    return velocity, acceleration


def smoothing_width(count: int) -> int:
    """Return the length of the smoothing window, an odd number of samples, for a decay of ``count`` samples."""
    return max(_FEWEST_SMOOTHED, int(_SMOOTHED_FRACTION * count)) | 1


class Slowing(NamedTuple):
    """Damping and dynamic friction, divided by inertia [1/s, rad/s^2], and rise of the friction near standstill.

    ``rise`` is the ratio of friction at rest to dynamic friction, minus 1 [-]. At ``rise_velocity`` [rad/s] half of the
    rise is left; a ``rise_velocity`` of 0 means no rise.
    """

    damping_rate: float
    deceleration: float
    rise: float = 0.0
    rise_velocity: float = 0.0

    def at(self, speed: Floats) -> Floats:
        """Return the deceleration [rad/s^2] at given speeds [rad/s]; equation (1)."""
        has_rise = self.rise_velocity > 0.0
        grip = self.rise / (1.0 + np.square(speed / self.rise_velocity)) if has_rise else np.zeros_like(speed)
        return self.damping_rate * speed + self.deceleration * (1.0 + grip)


def fall_to_standstill(speed: float, slowing: Slowing) -> tuple[Floats, Floats, Floats]:
    """Return time [s], swept angle [rad] and speed [rad/s] of a decay from a speed to standstill.

    They are the Gauss quadrature of dt = -dw / deceleration over w.
    """
    # Cubed, for the slowing near standstill, where a seal grips, needs the shortest steps.
    speeds = speed * np.linspace(1.0, 0.0, _STEPS + 1) ** 3
    middle = 0.5 * (speeds[1:] + speeds[:-1])
    half = 0.5 * (speeds[:-1] - speeds[1:])
    nodes = middle[:, None] + half[:, None] * _NODES
    decelerations = slowing.at(nodes)
    # Without any friction the time would be infinite.
    decelerations = np.maximum(decelerations, _SLOWEST * decelerations.max() + 1e-300)
    steps = (half * ((each / decelerations) @ _WEIGHTS) for each in (1.0, nodes))
    times, swept = (np.concatenate(([0.0], np.cumsum(step))) for step in steps)
    return times, swept, speeds


def course(times: Floats, speed: float, slowing: Slowing) -> tuple[Floats, Floats]:
    """Return swept angle [rad] and speed [rad/s] at times [s] after a start at a speed; 0 from standstill on."""
    from scipy.interpolate import CubicHermiteSpline

    fall = fall_to_standstill(speed, slowing)
    inside = np.minimum(times, fall[0][-1])
    angle = CubicHermiteSpline(*np.stack(fall)[:, np.diff(fall[0], prepend=-1.0) > 0.0])
    return np.asarray(angle(inside)), np.asarray(angle.derivative()(inside))


@dataclass(frozen=True, kw_only=True)
class FreeDecayProblem(bench.TimedLaw):
    """Table of procedure free-decay: viscous damping and Coulomb friction from the decay after an impulse."""

    needed = (_ANGLE,)
    kind: Literal["free-decay"]
    inertia: float | None = keyed(
        Number(
            "kg m^2",
            "such as '8.4 g m^2', or 'unknown'; default: the set's",
            minimum=0.0,
            minimum_allowed=False,
            words=("unknown",),
        ),
        None,
    )

    def inertia_of(self, context: bench.BenchContext) -> tuple[float | None, float]:
        """Return the inertia and its standard deviation [kg m^2], by default from the set; None or 0 if unknown."""
        path = "foot_plate.inertia"
        if self.inertia is not None:
            return self.inertia, context.tolerances.deviation_of(path, self.inertia, 0.0)
        inertia = context.number(path)
        return inertia, 0.0 if inertia is None else context.deviation(path, inertia)

    def run(self, sources: Sources, context: bench.BenchContext) -> bench.BenchResult:
        """Identify viscous damping [N m s/rad] and dynamic friction [N m], or both over inertia [1/s, rad/s^2].

        The model is equation (1), fitted to angle and, if recorded, angular velocity. Several recordings are several
        impulses to the same device, with common parameters and separate initial states. Raises IdentificationError for
        recordings that determine neither parameter, or times or angles in a wrong unit.
        """
        readings.check_sources(sources, _MINIMUM_SAMPLES)
        low, high = (context.number(f"actuator.angle_{end}") or 0.0 for end in ("min", "max"))
        for source in sources:
            step = np.median(np.diff(source.recording.time))
            if not _STEPS_OF_DECAY[0] < step < _STEPS_OF_DECAY[1]:
                unit = "ms" if step > 1.0e-3 else "s"
                source.refuse(f"the times of the samples are {step:.3g} s apart; is the unit of time {unit}?")
            turned = np.ptp(source.recording[_ANGLE])
            if turned > _MOST_OF_STOPS * (high - low) > 0.0:
                source.refuse(
                    f"'angle' covers {turned:.4g} rad ({turned / math.tau:.3g} turns), but the stops are "
                    f"{math.degrees(high - low):.4g} deg apart; in degrees, give it the unit deg"
                )
        static, dynamic = (context.number(f"friction.{kind}_torque") for kind in ("static", "dynamic"))
        # Near standstill, the friction of a seal is at most the static friction; its ln(1 + q) has a uniform prior.
        most = math.log1p(max(static / dynamic - 1.0, 0.0) if static and dynamic else 1.0)
        # Without an inertia the fitted parameters are parameters divided by the inertia.
        inertia, deviation = self.inertia_of(context)
        damping, friction, units, over, unknown = _OF_INERTIA if inertia else _OVER_INERTIA
        inertia = inertia or 1.0
        sources, remarks = readings.without_wrong_samples(sources, (_ANGLE, _VELOCITY), self.start, self.end)
        decays = [decay_of(source, self.start, self.end, number) for number, source in enumerate(sources, start=1)]
        initial = []
        rates = []
        parts = []
        for decay in decays:
            velocity, _ = smoothed_rates(decay.time, decay.angle)
            speed = max(np.abs(velocity[:_FEWEST_SMOOTHED]).max(), _LEAST_SPEED)
            moved = np.abs(decay.angle - decay.angle[0])
            swept = max(moved[-1], _LEAST_SWEPT)
            initial.append(bench.sought(_START_ANGLE.format(decay.number), decay.angle[0], scale=swept))
            # The sign of the decay has the direction, so that the speed is positive.
            initial.append(bench.sought(_START_SPEED.format(decay.number), speed, 1e-9 * speed, 10.0 * speed))
            # Half of the rate w_0 / s of damping alone, and of the deceleration w_0^2 / (2 s) of friction alone.
            rates.append((0.5 * speed / swept, 0.25 * speed**2 / swept))
            # A wrong law gives different parameters for fast and for slow motion.
            parts.append((int(np.argmax(moved >= 0.5 * moved.max())), decay.sensors))
        starts = inertia * np.median(rates, axis=0)
        # The standard deviation of a uniform prior is its width over sqrt(12).
        usual = _USUAL_RISE_VELOCITY
        near_rest = (
            FitNumber(_RISE, 0.5 * most, 0.0, 2.0 * most, most, most / math.sqrt(12.0)),
            FitNumber(_RISE_VELOCITY, usual, _LOWEST_RISE_VELOCITY, _HIGHEST_RISE_VELOCITY, usual, usual),
        )
        variables = (
            bench.sought(damping, starts[0], 0.0, unit=units[0], text=f"Viscous damping{over}"),
            bench.sought(friction, starts[1], 0.0, unit=units[1], text=f"Dynamic friction{over}"),
            *initial,
            *(near_rest if most > 0.0 else ()),
            *tolerance(_INERTIA, deviation / inertia),
            *bench.within(context.tolerances.gain_of(_ANGLE), _GAIN),
        )
        halves = "the first half of the travel", "the second half of the travel"
        measured, groups = bench.halved_readings(sources, parts, halves)

        def slowing_of(at: bench.Values, inertia: float) -> Slowing:
            damping_rate, deceleration = (max(at[path], 0.0) / inertia for path in (damping, friction))
            return Slowing(damping_rate, deceleration, math.expm1(at.get(_RISE, 0.0)), at.get(_RISE_VELOCITY, 0.0))

        def shown(at: bench.Values) -> Floats:
            slowing = slowing_of(at, inertia * (1.0 + at[_INERTIA]))
            series = []
            for decay in decays:
                swept, speed = course(decay.time, at[_START_SPEED.format(decay.number)], slowing)
                angle = at[_START_ANGLE.format(decay.number)] + (1.0 + at[_GAIN]) * decay.sign * swept
                series += [angle, decay.sign * speed][: len(decay.sensors)]
            return np.concatenate(series)

        fit, model = bench.solve(shown, measured, groups, variables, self.confidence)
        slowing = slowing_of(fit.by_name, inertia)
        at_rest = sum(
            decay.time[-1] > fall_to_standstill(fit.by_name[_START_SPEED.format(decay.number)], slowing)[0][-1]
            for decay in decays
        )
        used = TIME.text(sum(decay.time[-1] for decay in decays), ".3g")
        recorded = TIME.text(sum(np.ptp(source.recording.time) for source in sources), ".3g")
        return bench.result_of(
            sources,
            fit,
            f"{count_of(len(decays), 'decay')} ({used} of {recorded}), {at_rest} to standstill; beta/I = "
            f"{slowing.damping_rate:.4g} 1/s, T_c/I = {slowing.deceleration:.4g} rad/s^2{unknown}",
            _panels(decays, model, slowing),
            remarks=remarks,
        )


def _panels(decays: Sequence[FreeDecay], model: Floats, slowing: Slowing) -> tuple[Panel, Panel]:
    """Return two panels: angle over time, and acceleration over velocity with the straight line of equation (1)."""
    angles = list[Mark]()
    rates = []
    measured = "measured"
    fitted = "fitted"
    fastest = 0.0
    for decay in decays:
        angles.extend(
            (readings_mark(measured, decay.time, decay.angle), curve_mark(fitted, decay.time, model[: decay.time.size]))
        )
        model = model[len(decay.sensors) * decay.time.size :]
        velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
        inner = slice(smoothing_width(decay.time.size), None, max(1, decay.time.size // 200))
        moving = velocity[inner] > _MOVING * velocity.max()
        rates.append(readings_mark(measured, velocity[inner][moving], acceleration[inner][moving]))
        fastest = max(fastest, velocity.max())
        measured = fitted = ""  # the legend names the first decay only
    speeds = np.linspace(0.0, fastest, 200)
    rates.append(curve_mark("$-\\beta\\omega/I - T_c/I$", speeds, -slowing._replace(rise=0.0).at(speeds)))
    # A rise within 2 % of the velocities would be drawn as an upright line on the axis.
    if slowing.rise > 0.0 and slowing.rise_velocity > speeds[4]:
        # The formula of the legend is a straight line; what was fitted near rest bends, and has a name of its own.
        bent = Mark("line", speeds, -slowing.at(speeds), label="fit near rest")
        rates.append(replace(bent, colour=GREY, style={"linestyle": "--", "linewidth": 1.2}))
    return (
        Panel(TIME, Kind("Angle", "rad", "angle"), angles, "Free decay"),
        Panel(Kind("Angular velocity", "rad/s"), Kind("Angular acceleration", "rad/s$^2$"), rates, "Damping"),
    )
