"""Values of the cause search: sensor model, change of the model, candidate cause."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from ppafo.signals.recording import Floats
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.validation.replay import Motion

SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)
"""Channels with a sensor on the device; torque and pressure difference are computed from them."""
SWAPPED = {PRESSURE_1: PRESSURE_2, PRESSURE_2: PRESSURE_1}
"""Channel recorded under each name when the two chamber pressures are swapped."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Sensor model: gain [-] about the value ``about``, zero offset (both in the channel's unit), delay [s]."""

    gain: float = 1.0
    zero: float = 0.0
    about: float = 0.0
    delay: float = 0.0

    def of(self, true: Floats) -> Floats:
        """Return the readings of true values [unit of the channel]."""
        return self.about + self.gain * (true - self.about) + self.zero

    def true(self, readings: Floats) -> Floats:
        """Return the true values of readings [unit of the channel]."""
        return self.about + (readings - self.zero - self.about) / self.gain


@dataclass(frozen=True, slots=True)
class ModelChange:
    """Difference between the recorded device and its parameter set; by default no difference.

    ``sensors``: sensor models by channel. ``numbers``: changed parameters by path [SI]. ``effects``: settings of
    effects by the name of the effect. ``is_swapped``: pressures 1 and 2 are exchanged. ``delay``: delay [s] of all
    sensors with respect to the command. ``clock``: true rate of the recording's clock [-]. ``motion``: motion of the
    vane, if another. ``start``: if not None, faulty samples are ignored, and a channel whose first samples are faulty
    starts at this fraction [-] of its range.
    """

    sensors: Mapping[str, SensorModel] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_swapped: bool = False
    delay: float = 0.0
    clock: float = 1.0
    motion: Motion | None = None
    start: float | None = None

    @property
    def has_delay(self) -> bool:
        """True if all sensors lag behind the command, by a sensor delay or the delay of the valve."""
        return self.delay != 0.0 or any(path.endswith("delay") for path in self.numbers)


def joined(first: ModelChange, second: ModelChange) -> ModelChange:
    """Return the combination of two changes; ``first`` has precedence for parameters and settings in both."""
    sensors = dict(first.sensors)
    for name, other in second.sensors.items():
        sensor = sensors.get(name, SensorModel())
        sensors[name] = SensorModel(
            gain=sensor.gain * other.gain,
            zero=sensor.zero + other.zero,
            # A zero and a delay turn about nothing, so that the gain's point stays.
            about=other.about if other.gain != 1.0 else sensor.about,
            delay=sensor.delay + other.delay,
        )
    numbers, effects = {**second.numbers, **first.numbers}, {**second.effects, **first.effects}
    delay, clock = first.delay + second.delay, first.clock * second.clock
    return replace(first, sensors=sensors, numbers=numbers, effects=effects, delay=delay, clock=clock)


@dataclass(frozen=True, slots=True)
class CandidateCause:
    """Candidate cause whose magnitude is still to be fitted.

    ``words``: message with a placeholder for ``shown`` times the magnitude. ``change``: function from magnitude to
    change. ``sizes``: trial magnitudes; a single one means that there is nothing to fit. ``is_ratio``: the magnitude is
    a ratio, fitted as its logarithm. ``usual``: largest usual sensor error (of a ratio, its logarithm). ``is_usual``:
    the cause has no magnitude and is usual on any bench. ``is_of_samples``: faulty samples, which are visible without a
    model. ``is_of_unit``: misread unit, reported only if it explains the recordings. ``is_off``: the model lacks the
    number or effect, so that a ratio of 1 is a change too. ``unit``: unit of the changed parameter.
    """

    name: str
    words: str
    change: Callable[[float], ModelChange]
    sizes: tuple[float, ...] = (0.0,)
    is_ratio: bool = False
    shown: float = 1.0
    usual: float = 0.0
    is_usual: bool = False
    is_of_samples: bool = False
    is_of_unit: bool = False
    is_off: bool = False
    unit: str = ""

    @property
    def has_size(self) -> bool:
        """True if the magnitude is fitted; a swap or a wrong sign has no magnitude."""
        return len(self.sizes) > 1

    @property
    def is_of_bench(self) -> bool:
        """True for a usual error of a single sensor; an error of a sensor group is a sum of single errors."""
        return self.usual > 0.0 and len(self.at(self.usual).sensors) <= 1

    @property
    def grid(self) -> list[float]:
        """Trial magnitudes, as logarithms if they are ratios."""
        return [math.log(size) if self.is_ratio else size for size in self.sizes]

    def at(self, size: float) -> ModelChange:
        """Return the change of the model for a fitted magnitude (for ratios, its logarithm)."""
        return self.change(math.exp(size) if self.is_ratio else size)

    def in_words(self, size: float) -> str:
        """Return the message for a fitted magnitude (for ratios, its logarithm)."""
        return self.words.format(self.shown * (math.exp(size) if self.is_ratio else size))
