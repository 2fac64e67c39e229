"""Changes of the model as values: a sensor, a change, and a candidate for a cause."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from ppafo.signals.recording import Floats
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.validation.replay import Motion

SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)
"""Channels that a sensor of the device measures; torque and pressure difference follow from these."""
SWAPPED = {PRESSURE_1: PRESSURE_2, PRESSURE_2: PRESSURE_1}
"""Channel by the one in whose place it stands, where both are swapped."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Sensor model: gain [-] about a value, zero offset in the channel's unit, delay [s]."""

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
    """Difference between a recording with its device and the set; none by default.

    ``sensors`` are by channel, ``numbers`` of the set by path [SI], ``effects`` are settings by the name of an effect.
    Pressures 1 and 2 may be swapped, all sensors may be later than the command by a ``delay`` [s], the clock may
    run ``clock`` times as fast as its times say, and the vane may do another ``motion``. With a ``start``, samples
    that no sensor made are left out. It is where a channel begins whose first samples are among them, as a fraction
    [-] of its range.
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
        """True where all sensors are later than the command, by themselves or behind a valve that is."""
        return self.delay != 0.0 or any(path.endswith("delay") for path in self.numbers)


def joined(first: ModelChange, second: ModelChange) -> ModelChange:
    """Return two changes at once; of numbers and settings that both have, the first's."""
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
    """A cause before its size is known: what a size changes, its words with the place of ``shown`` times the size.

    ``sizes`` are tried first; a cause with one has nothing to fit. A size that ``is_ratio`` is sought as a logarithm.
    ``usual`` is the largest size, or logarithm, that any bench has, ``is_usual`` says so of one without a size.
    ``is_of_samples`` is true of samples that no sensor made, which they show themselves; ``is_of_unit`` of a misread
    unit, which is no hint where it leaves more than noise. ``unit`` is the unit of the number of the set.
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
    unit: str = ""

    @property
    def has_size(self) -> bool:
        """True of a cause whose size is fitted; a swap or a sign has none."""
        return len(self.sizes) > 1

    @property
    def is_of_bench(self) -> bool:
        """True of an error that any bench has, of one sensor: those of groups are sums of these."""
        return self.usual > 0.0 and len(self.at(self.usual).sensors) <= 1

    @property
    def grid(self) -> list[float]:
        """Sizes that are tried first, as they are sought: logarithms of a ratio."""
        return [math.log(size) if self.is_ratio else size for size in self.sizes]

    def at(self, size: float) -> ModelChange:
        """Return the change of a size that was sought."""
        return self.change(math.exp(size) if self.is_ratio else size)

    def in_words(self, size: float) -> str:
        """Return what a size that was sought seems to be."""
        return self.words.format(self.shown * (math.exp(size) if self.is_ratio else size))
