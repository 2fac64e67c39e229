"""Gait: one periodic stride as Fourier series, in SI units and in the signs of the package.

- ``shank_angle`` phi [rad]: from the vertical, positive with the ankle in front of the knee.
- ``ankle_angle`` theta [rad]: 90 deg neutral (foot square to the shank), increasing in plantarflexion (toes down).
- ``ankle_moment`` [N m/kg]: internal moment of the wearer per body mass, positive in plantarflexion.
- ``vertical_force`` [body weights]: ground reaction on this foot, positive upwards.
- ``centre_of_pressure`` [m]: distance forward of the ankle along the foot; undefined while the foot is off the ground.
- ``knee_forward``, ``knee_up`` [m/s^2]: acceleration of the knee in the sagittal plane, without gravity.

With a flat foot theta is 90 deg plus phi. The phase counts strides from one heel strike of the foot to its next.
At another walking speed the stride time changes; the motion as a function of the phase stays the same.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from ppafo.errors import DataError
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import HARMONICS as ENGINE_HARMONICS
from ppafo.model.gait import Harmonic, Series
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import Floats
from ppafo.wording import check_known

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Origin = Literal["measured", "imported", "synthetic"]
"""Origin of a gait: stated as measured, imported from a file that does not state its origin, or made by a model."""

CURVES: dict[str, str] = {
    "shank_angle": "rad",
    "ankle_angle": "rad",
    "ankle_moment": "N m/kg",
    "vertical_force": "-",
    "centre_of_pressure": "m",
    "knee_forward": "m/s^2",
    "knee_up": "m/s^2",
}
"""Curves of a gait with their units; the first two are mandatory."""

# Body masses [kg], statures [m] and walking speeds [m/s] of a wearer: wide limits that exclude only typing errors.
BODY_MASSES = (1.0, 500.0)
STATURES = (0.5, 2.5)
SPEEDS = (0.05, 4.0)

REQUIRED = ("shank_angle", "ankle_angle")

KNEE = ("knee_forward", "knee_up")
"""Curves of the knee acceleration, which scale with the square of the cadence."""
LARGEST_CHANGE = 0.2
"""Largest relative change of the recorded speed; beyond it, angles and moments would change too much."""
SLOWEST_CONSTANT_WALK_RATIO = 1.03
"""Speed [m/s] below which step length divided by cadence is no longer constant: Murakami and Otaka (2017), J Phys Ther
Sci 29:819 (62 m/min)."""
_RATE = 200.0
"""Default sampling rate of the recording of a gait [Hz]."""
_MAXIMUM_STRIDES = 100_000
"""Largest number of strides in the recording of a gait."""


def clinical_angle(angle: Floats) -> Floats:
    """Return an ankle angle theta [rad] in the clinical convention [rad]: 0 at neutral, dorsiflexion positive."""
    return 0.5 * math.pi - angle


def plain_unit(unit: str) -> str:
    """Return the unit of a curve as ``ppafo.units`` writes it: empty for a dimensionless number."""
    return unit.removeprefix("-")


@dataclass(frozen=True, slots=True)
class GaitCurve:
    """Periodic curve: coefficients of its Fourier series in SI units, and the variation between strides.

    ``mean`` is the constant term, ``cosines`` and ``sines`` are the coefficients of the harmonics. ``deviation`` is the
    standard deviation between strides, as root mean square over the stride; 0 if unknown.
    """

    mean: float
    cosines: tuple[float, ...]
    sines: tuple[float, ...]
    deviation: float = 0.0

    def __post_init__(self) -> None:
        if len(self.cosines) != len(self.sines) or not self.cosines:
            raise DataError(
                f"a Fourier series needs as many cosines as sines, not {len(self.cosines)} cosines and "
                f"{len(self.sines)} sines"
            )

    @property
    def harmonics(self) -> int:
        """Number of harmonics of the series."""
        return len(self.cosines)

    def value(self, phase: float) -> float:
        """Return the value of the curve at a phase [strides]."""
        return float(self.values_at(phase))

    def derivative(self, stride_time: float) -> "GaitCurve":
        """Return the time derivative for a stride time [s]; its deviation between strides is unknown and set to 0."""
        angular = 2.0 * np.pi / stride_time * (1.0 + np.arange(self.harmonics))
        cosines = angular * np.array(self.sines)
        sines = -angular * np.array(self.cosines)
        return GaitCurve(0.0, tuple(cosines.tolist()), tuple(sines.tolist()))

    def scale(self, factor: float) -> "GaitCurve":
        """Return the curve multiplied by a factor [-], including its deviation between strides."""
        cosines, sines = (tuple(factor * value for value in values) for values in (self.cosines, self.sines))
        return replace(
            self, mean=factor * self.mean, cosines=cosines, sines=sines, deviation=abs(factor) * self.deviation
        )

    def values_at(self, phases: "ArrayLike") -> Floats:
        """Return the values of the curve at an array of phases [strides]."""
        first_sine, first_cosine = sine_and_cosine(np.asarray(phases, dtype=np.float64))
        sine = first_sine
        cosine = first_cosine
        # The mean in the shape of the phases, a number or an array.
        values = self.mean + 0.0 * first_cosine
        for of_cosine, of_sine in zip(self.cosines, self.sines, strict=True):
            values = values + (of_cosine * cosine + of_sine * sine)
            # Angle sums instead of a cosine for each harmonic: the same bits on every computer.
            cosine, sine = cosine * first_cosine - sine * first_sine, sine * first_cosine + cosine * first_sine
        return np.asarray(values, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Gait:
    """Stride of one wearer, as curves over the phase; a curve that was not recorded is None.

    The module docstring defines units and signs of the curves.

    - ``body_mass``, ``stature``: body mass [kg] and stature [m] of the subject; the stature is None if unknown
    - ``walking_speed``: walking speed [m/s], None if it was not recorded
    - ``stride_time``: stride time [s]
    - ``stance_share``: fraction of the stride until toe-off [-]
    - ``stride_time_deviation``, ``stance_share_deviation``: standard deviations between strides [s] and [-], 0 if
      unknown
    - ``strides``: number of strides in the mean
    - ``recorded_speed``: speed of the recording [m/s], if it differs from ``walking_speed``
    """

    name: str
    title: str
    origin: Origin
    source: str
    body_mass: float
    walking_speed: float | None
    stride_time: float
    stance_share: float
    shank_angle: GaitCurve
    ankle_angle: GaitCurve
    ankle_moment: GaitCurve | None = None
    vertical_force: GaitCurve | None = None
    centre_of_pressure: GaitCurve | None = None
    knee_forward: GaitCurve | None = None
    knee_up: GaitCurve | None = None
    stride_time_deviation: float = 0.0
    stance_share_deviation: float = 0.0
    strides: int = 0
    recorded_speed: float | None = None
    notes: str = ""
    stature: float | None = None

    def __post_init__(self) -> None:
        if not (self.body_mass > 0.0 and self.stride_time > 0.0 and 0.0 < self.stance_share < 1.0):
            raise DataError(
                f"gait '{self.name}': body mass {self.body_mass:g} kg and stride time {self.stride_time:g} s must "
                f"be above 0, and stance fraction {self.stance_share:g} must be between 0 and 1"
            )

    @property
    def curves(self) -> dict[str, GaitCurve]:
        """Curves that the gait contains, by name, in the order of ``CURVES``."""
        return {name: curve for name in CURVES if (curve := getattr(self, name)) is not None}

    def curve(self, name: str) -> GaitCurve:
        """Return a curve by name; raises DataError if this gait does not contain the curve."""
        curves = self.curves
        check_known(name, curves, DataError, f"gait '{self.name}' has no curve '{name}'")
        return curves[name]


def series_of(gait: Gait, name: str) -> Series:
    """Return the first harmonics of a curve [SI] as used by the engine; a curve that was not measured is 0."""
    curve = gait.curves.get(name)
    # A curve that was not measured is 0: no moment, no force, a knee at rest.
    if curve is None:
        return Series(mean=0.0, harmonics=(Harmonic(0.0, 0.0),) * ENGINE_HARMONICS)
    count = ENGINE_HARMONICS
    # A series with fewer harmonics than the engine takes is continued with zeros.
    missing = (0.0,) * count
    pairs = zip((*curve.cosines, *missing)[:count], (*curve.sines, *missing)[:count], strict=True)
    return Series(mean=curve.mean, harmonics=tuple(Harmonic(cosine, sine) for cosine, sine in pairs))


HARMONICS: dict[str, int] = {
    "shank_angle": 6,
    "ankle_angle": 10,
    "ankle_moment": 10,
    "vertical_force": 12,
    "centre_of_pressure": 10,
    "knee_forward": 6,
    "knee_up": 6,
}
"""Number of harmonics of each curve: the fit error is well below the spread; more would make the acceleration noisy."""


@dataclass(frozen=True, slots=True)
class FitError:
    """Error of a Fourier series: root mean square and largest absolute value, in the unit of the curve."""

    root_mean_square: float
    largest: float


def fit_curve(values: Floats, harmonics: int, deviation: float = 0.0) -> tuple[GaitCurve, FitError]:
    """Return the Fourier series fitted to values at equally spaced phases from 0 to 1, ends included, and its error.

    Series and error are in the unit of ``values`` [SI]. Raises DataError if there are too few values.
    """
    if values.size < 2 * harmonics + 2:
        raise DataError(f"{harmonics} harmonics need at least {2 * harmonics + 2} samples, not {values.size}")
    # Both ends are the same phase: a series through both weighs it twice, as the recording has it.
    turns = 2.0 * np.pi * np.linspace(0.0, 1.0, values.size)
    orders = np.arange(1, harmonics + 1)
    terms = [np.ones((values.size, 1)), np.cos(np.outer(turns, orders)), np.sin(np.outer(turns, orders))]
    design = np.hstack(terms)
    # Least squares over all samples, not a transform: both ends belong to one phase, and samples may be few.
    solution = np.linalg.lstsq(design, values, rcond=None)[0]
    residuals = design @ solution - values
    cosines = solution[1 : harmonics + 1].tolist()
    sines = solution[harmonics + 1 :].tolist()
    error = FitError(float(np.sqrt(np.mean(residuals**2))), float(np.max(np.abs(residuals))))
    return GaitCurve(float(solution[0]), tuple(cosines), tuple(sines), deviation), error


def speed_range(gait: Gait) -> tuple[float, float]:
    """Return the lowest and highest speed [m/s] to which a gait may be scaled: within 20 % of the recorded speed.

    The lowest speed is also limited to 1.03 m/s, or to the recorded speed of a slower gait. Raises DataError for a
    gait without a speed.
    """
    recorded = _recorded_speed(gait)
    lowest = (1.0 - LARGEST_CHANGE) * recorded
    return max(lowest, min(recorded, SLOWEST_CONSTANT_WALK_RATIO)), (1.0 + LARGEST_CHANGE) * recorded


def at_speed(gait: Gait, speed: float) -> Gait:
    """Return the gait at a walking speed [m/s]; the stride time is proportional to speed to the power -1/2.

    The walk ratio, step length divided by cadence, stays constant (Sekiya and Nagasaki 1998, Gait Posture 7:225).
    Amplitudes, moments per mass, force in body weights and stance fraction stay as recorded, so only a small change of
    speed is allowed. The motion of the knee relative to its mean speed is kept too, so its acceleration is proportional
    to 1/T^2. Raises DataError for a speed out of range.
    """
    recorded = _recorded_speed(gait)
    low, high = speed_range(gait)
    # A speed that was rounded to the printed limit is still within it.
    if not (math.isfinite(speed) and low * (1.0 - 1e-9) <= speed <= high * (1.0 + 1e-9)):
        raise DataError(
            f"gait '{gait.name}' was recorded at {recorded:g} m/s and can be scaled to speeds of {low:.3g} to "
            f"{high:.3g} m/s, not to {speed:g} m/s; import a gait recorded near that speed"
        )
    # A gait that was scaled before is scaled from where it is, and judged by where it was recorded.
    current = gait.walking_speed or recorded
    return replace(
        gait,
        walking_speed=speed,
        recorded_speed=recorded,
        # At a constant walk ratio step length and cadence each go with the root of the speed.
        stride_time=gait.stride_time * math.sqrt(current / speed),
        stride_time_deviation=gait.stride_time_deviation * math.sqrt(current / speed),
        knee_forward=gait.knee_forward and gait.knee_forward.scale(speed / current),
        knee_up=gait.knee_up and gait.knee_up.scale(speed / current),
    )


def _recorded_speed(gait: Gait) -> float:
    speed = gait.recorded_speed or gait.walking_speed
    if speed is None:
        raise DataError(
            f"gait '{gait.name}' has no walking speed, so it cannot be scaled; import it with a walking speed"
        )
    return speed


def walk_recording(gait: Gait, strides: int) -> Recording:
    """Return a recording of equal strides of a gait, marked as synthetic; SI units, signs of the package.

    Raises DataError for an implausible number of strides.
    """
    if not 1 <= strides <= _MAXIMUM_STRIDES:
        raise DataError(f"strides = {strides}: must be from 1 to {_MAXIMUM_STRIDES}")
    # A whole number of samples a stride: all strides are then equal to the last bit.
    per_stride = max(10, round(_RATE * gait.stride_time))
    phase = np.arange(strides * per_stride + 1) / per_stride
    # One stride is evaluated and repeated, so that all are equal to the last bit.
    one = np.arange(per_stride) / per_stride
    channels = {
        name: Channel(np.append(np.tile(curve.values_at(one), strides), curve.value(0.0)), CURVES[name])
        for name, curve in gait.curves.items()
    }
    return Recording(f"{gait.name}, {strides} equal strides", phase * gait.stride_time, channels, "synthetic")
