"""Drawn readings of a gait for the comparison of a chip with Python: strides of all paces, people who stop, faults.

The pressures follow the command, so that what the safety checks make of the valve is reached too. Nothing here is a
model of anybody: it is made to reach every phase, every level and most signs.
"""

import math
import random
from collections.abc import Callable, Generator
from typing import NamedTuple

from ppafo.control.fixed.walking_law import TOP, GaitConverter, GaitReadings, read_gait
from ppafo.exports.firmware.walking.made import ROOM, SAMPLES, UPRIGHT, made_readings, next_pressures
from ppafo.model.gait_sensors import GaitMeasurement

EPISODES = (1200, 3600)
"""Samples from one reset to the next, at least and at most."""
_ENDS = ("low end", "high end", "noise", "edges")
_FAULTS = (
    "none",
    "none",
    "stuck",
    "frozen",
    "frozen",
    "room",
    "room",
    "offset",
    "swapped",
    "on and off",
    "half",
    *_ENDS,
)
_LATE = "late"
_ODD = (
    "stands",
    "in the air",
    "rocks",
    "on toes",
    "stays on toes",
    "no toes",
    "late toes",
    "short swing",
    "bent",
    "turns down",
)


def gait_readings(converter: GaitConverter, samples: int, seed: int) -> Generator[tuple[GaitReadings, bool], int, None]:
    """Readings without end, and whether an episode begins with them; is sent the command [steps] that they led to.

    Those that are made come first, where there is room for them in so many ``samples``, and then drawn ones.
    """
    if samples >= SAMPLES:
        yield from made_readings(converter)
    drawn, command = DrawnGait(converter, seed), 0
    while True:
        command = yield drawn.next(command)


class Manner(NamedTuple):
    """How an episode is drawn: stride [samples] and its spread, share of odd strides, the fault and its first sample.

    ``odd`` is what is odd in an odd stride. The fault is in the sensor at a place, and has a value where it needs one.
    """

    stride: int
    spread: float
    odd_share: float
    odd: str
    sensor: int
    fault: str
    begins: int
    value: int


class DrawnGait:
    """Readings of one episode after the other; ``next`` takes the command that the last ones led to [steps]."""

    def __init__(self, converter: GaitConverter, seed: int) -> None:
        self._converter = converter
        self._draw = random.Random(seed)
        self._begin_drawn()

    def _begin_drawn(self) -> None:
        draw = self._draw
        left = draw.randint(*EPISODES)
        fault = draw.choice(_FAULTS)
        manner = Manner(
            stride=draw.choice((600, 700, 800, 1100)),
            spread=draw.choice((0.0, 0.0, 0.0, 0.02, 0.4)),
            odd_share=draw.choice((0.0, 0.1, 0.3, 1.0)),
            odd=draw.choice((*_ODD, _LATE, _LATE)),
            sensor=draw.randrange(5),
            fault=fault,
            # A reading at an end stops at once: it comes late, so that more is seen before.
            begins=left - draw.randrange(50, 400 if fault in _ENDS else left),
            value=draw.randint(0, TOP),
        )
        self.begin(manner, left)

    def begin(self, manner: Manner, samples: int) -> None:
        """Begin an episode of some manner and so many samples."""
        self._manner, self._left, self._sample = manner, samples, 0
        self._pressures = (ROOM, ROOM)
        self._shown: tuple[int, ...] = (0,) * 5
        self._stride()

    def _stride(self) -> None:
        """Draw the next stride."""
        draw, manner = self._draw, self._manner
        self._at = 0
        self._length = round(manner.stride * (1.0 + manner.spread * draw.uniform(-1.0, 1.0)))
        self._odd = manner.odd if draw.random() < manner.odd_share and self._sample > 0 else ""

    def next(self, command: int) -> tuple[GaitReadings, bool]:
        """The next readings, and whether an episode begins with them."""
        if self._left == 0:
            self._begin_drawn()
        begins = self._sample == 0
        if self._at >= self._length:
            self._stride()
        self._shown = self._faulty(tuple(read_gait(self._converter, self._measured(command))))
        self._left -= 1
        self._at += 1
        self._sample += 1
        return GaitReadings._make(self._shown), begins

    def _forces(self, part: float) -> tuple[float, float]:
        """Forces under heel and toes [N] at a part of the stride."""
        rocking = 250.0 + 240.0 * math.sin(2.0 * math.pi * self._at / 90.0)
        odd = {
            "stands": (300.0, 300.0),
            "in the air": (0.0, 0.0),
            "rocks": (rocking, 500.0 - rocking),
            "on toes": (0.0, 700.0 * _bump(part, 0.0, 0.62)),
            "stays on toes": (0.0, 400.0 + 50.0 * math.sin(self._at / 20.0)),
            "no toes": (500.0 * _bump(part, 0.0, 0.3), 0.0),
            "late toes": (500.0 * _bump(part, 0.0, 0.45), 700.0 * _bump(part, 0.3, 0.62)),
            "short swing": (500.0 * (_bump(part, 0.0, 0.45) + _bump(part, 0.75, 1.0)), 700.0 * _bump(part, 0.12, 0.62)),
        }
        return odd.get(self._odd, (500.0 * _bump(part, 0.0, 0.45), 700.0 * _bump(part, 0.12, 0.62)))

    def _measured(self, command: int) -> GaitMeasurement:
        part = self._at / self._length
        heel, toe = self._forces(part)
        moves = 0.0 if self._odd == "stands" else self._draw.uniform(-5.0, 5.0)
        # Up in the swing, down after the strike, up over the foot that stands, down in the push-off.
        turned = -0.1 * math.sin(2.0 * math.pi * part / 0.14) if part < 0.14 else -0.2 * math.sin(5.0 * (part - 0.14))
        turned = 0.25 * math.sin(math.pi * (part - 0.5) / 0.5) if part > 0.5 else turned
        if self._odd == "bent":
            turned += 0.5
        if self._odd == "turns down" and 0.5 < part < 0.7:
            turned = 0.55
        if self._odd == _LATE:
            turned = 0.15 * math.sin(2.0 * math.pi * (part + 0.08))
        self._pressures = next_pressures(self._pressures, command)
        return GaitMeasurement(
            angle=UPRIGHT + turned + 1.0e-3 * moves,
            pressure_1=self._pressures[0],
            pressure_2=self._pressures[1],
            torque=0.0,
            heel_force=max(0.0, heel + moves) if heel > 0.0 else 0.0,
            toe_force=max(0.0, toe + moves) if toe > 0.0 else 0.0,
        )

    def _faulty(self, readings: tuple[int, ...]) -> tuple[int, ...]:
        manner, found = self._manner, list(readings)
        if self._sample < manner.begins or manner.fault == "none":
            return readings
        place, value = manner.sensor, readings[manner.sensor]
        other = (1, 0, 2, 4, 3)[place]
        kinds: dict[str, Callable[[], int]] = {
            "stuck": lambda: manner.value,
            "frozen": lambda: self._shown[place],
            "low end": lambda: 0,
            "high end": lambda: TOP,
            "room": lambda: self._room[place],
            "offset": lambda: min(TOP, max(0, value + manner.value // 8 - TOP // 16)),
            "swapped": lambda: readings[other],
            "half": lambda: value // 2,
            "on and off": lambda: value if self._sample // 300 % 2 else self._room[place],
            "noise": lambda: self._draw.randint(0, TOP),
            "edges": lambda: self._draw.choice((1, 2, TOP // 2, TOP - 1, value)),
        }
        found[place] = kinds[manner.fault]()
        return tuple(found)

    @property
    def _room(self) -> GaitReadings:
        """Nothing on the foot, and no gas in the chambers."""
        seen = GaitMeasurement(
            angle=UPRIGHT, pressure_1=ROOM, pressure_2=ROOM, torque=0.0, heel_force=0.0, toe_force=0.0
        )
        return read_gait(self._converter, seen)


def _bump(part: float, start: float, end: float) -> float:
    """Root of half a sine from ``start`` to ``end`` of a stride: its sides are steep."""
    return math.sqrt(math.sin(math.pi * (part - start) / (end - start))) if start < part < end else 0.0
