"""A gait: one periodic stride as Fourier series, in SI units and in the signs of the package.

- ``shank_angle`` phi [rad]: from the vertical, above 0 while the ankle is in front of the knee.
- ``ankle_angle`` theta [rad]: 90 deg neutral (foot square to the shank), growing in plantarflexion (toes down).
- ``ankle_moment`` [N m/kg]: internal moment of the wearer per body mass, above 0 in plantarflexion.
- ``vertical_force`` [body weights]: ground reaction on this foot, above 0 upwards.
- ``centre_of_pressure`` [m]: where it acts, forward of the ankle along the foot; without meaning while the foot is off.
- ``knee_forward``, ``knee_up`` [m/s^2]: acceleration of the knee in the sagittal plane, without gravity.

With a flat foot theta is 90 deg plus phi. The phase counts strides from one heel strike of the foot to its next.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from ppafo.errors import DataError, nearest_name

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ppafo.signals.recording import Floats

Origin = Literal["measured", "synthetic"]

CURVES: dict[str, str] = {
    "shank_angle": "rad",
    "ankle_angle": "rad",
    "ankle_moment": "N m/kg",
    "vertical_force": "-",
    "centre_of_pressure": "m",
    "knee_forward": "m/s^2",
    "knee_up": "m/s^2",
}
"""The curves of a gait and the unit in which each is kept; the first two are always there."""

REQUIRED = ("shank_angle", "ankle_angle")

KNEE = ("knee_forward", "knee_up")
"""Curves that are accelerations: they go with the square of the cadence."""


def clinical_angle(angle: "Floats") -> "Floats":
    """Return an ankle angle theta [rad] as people read it [rad]: 0 at neutral, dorsiflexion positive."""
    return 0.5 * math.pi - angle


def plain_unit(unit: str) -> str:
    """Return the unit of a curve as ``ppafo.units`` writes it: a plain number has none."""
    return unit.removeprefix("-")


@dataclass(frozen=True, slots=True)
class Curve:
    """One periodic curve: coefficients of its series in SI units, and how much strides differ.

    ``deviation`` is the standard deviation between strides, root mean square over the stride; 0 where it is not known.
    """

    mean: float
    cosines: tuple[float, ...]
    sines: tuple[float, ...]
    deviation: float = 0.0

    def __post_init__(self) -> None:
        if len(self.cosines) != len(self.sines) or not self.cosines:
            raise DataError(f"a series has as many cosines as sines, not {len(self.cosines)} and {len(self.sines)}")

    @property
    def harmonics(self) -> int:
        """Number of harmonics."""
        return len(self.cosines)

    def value(self, phase: float) -> float:
        """Return the value at a phase [strides]."""
        return float(self.values_at(phase))

    def rate(self, phase: float, stride_time: float) -> float:
        """Return the first derivative by time at a phase [strides], for a stride of this time [s]."""
        return self.derivative(stride_time).value(phase)

    def acceleration(self, phase: float, stride_time: float) -> float:
        """Return the second derivative by time at a phase [strides], for a stride of this time [s]."""
        return self.derivative(stride_time).rate(phase, stride_time)

    def derivative(self, stride_time: float) -> "Curve":
        """Return the derivative by time for a stride of this time [s]; how much strides differ in it is not known."""
        import numpy as np

        angular = 2.0 * np.pi / stride_time * (1.0 + np.arange(self.harmonics))
        cosines, sines = angular * np.array(self.sines), -angular * np.array(self.cosines)
        return Curve(0.0, tuple(cosines.tolist()), tuple(sines.tolist()))

    def scale(self, factor: float) -> "Curve":
        """Return the curve times a factor [-], with its deviation between strides."""
        cosines, sines = (tuple(factor * value for value in values) for values in (self.cosines, self.sines))
        return replace(
            self, mean=factor * self.mean, cosines=cosines, sines=sines, deviation=abs(factor) * self.deviation
        )

    def values_at(self, phases: "ArrayLike") -> "Floats":
        """Return the values at many phases [strides]."""
        import numpy as np

        from ppafo.model.elementary import sine_and_cosine

        first_sine, first_cosine = sine_and_cosine(np.asarray(phases, dtype=np.float64))
        sine, cosine = first_sine, first_cosine
        values = self.mean + 0.0 * first_cosine
        for of_cosine, of_sine in zip(self.cosines, self.sines, strict=True):
            values = values + (of_cosine * cosine + of_sine * sine)
            cosine, sine = cosine * first_cosine - sine * first_sine, sine * first_cosine + cosine * first_sine
        return np.asarray(values, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Gait:
    """One stride of one wearer, as curves over the phase; those that were not recorded are None.

    ``body_mass`` [kg], ``stature`` [m] of the subject, None where not known, ``stride_time`` [s], ``stance_share``
    (share of the stride until toe-off), ``walking_speed`` [m/s], None where nobody recorded it. The two deviations are
    between strides, 0 where not known. ``recorded_speed`` is the speed at which the curves were recorded, where it is
    another than ``walking_speed``.
    """

    name: str
    title: str
    origin: Origin
    source: str
    body_mass: float
    walking_speed: float | None
    stride_time: float
    stance_share: float
    shank_angle: Curve
    ankle_angle: Curve
    ankle_moment: Curve | None = None
    vertical_force: Curve | None = None
    centre_of_pressure: Curve | None = None
    knee_forward: Curve | None = None
    knee_up: Curve | None = None
    stride_time_deviation: float = 0.0
    stance_share_deviation: float = 0.0
    strides: int = 0
    recorded_speed: float | None = None
    notes: str = ""
    stature: float | None = None

    def __post_init__(self) -> None:
        if not (self.body_mass > 0.0 and self.stride_time > 0.0 and 0.0 < self.stance_share < 1.0):
            raise DataError(
                f"gait '{self.name}': body mass {self.body_mass:g} kg and stride time {self.stride_time:g} s must be "
                f"above 0, and the stance fraction {self.stance_share:g} between 0 and 1"
            )

    @property
    def curves(self) -> dict[str, Curve]:
        """The curves that there are, by name, in the order of ``CURVES``."""
        return {name: curve for name in CURVES if (curve := getattr(self, name)) is not None}

    def curve(self, name: str) -> Curve:
        """Return a curve by its name; DataError where this gait does not have it."""
        curves = self.curves
        if name not in curves:
            hint = nearest_name(name, curves)
            raise DataError(f"gait '{self.name}' has no curve '{name}'{hint}; it has {', '.join(curves)}")
        return curves[name]
