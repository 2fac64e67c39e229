"""The controller of a walk as firmware for an MSP430G2553, and on the chip's simulator beside the same in Python.

Readings of a gait for the comparison of a chip with Python: made ones for each sign and limit, and drawn ones.

The made ones reach what drawn gaits reach by chance or never: each sign, its limits, counts at their ends. With them
every condition of the controller in C is reached both ways, and each decides alone. A test measures it. Drawn are
strides of all paces, people who stop, and faults; their pressures follow command and angle as the observer of the
chambers believes, so that only faults contradict it. Nothing here is a model of anybody: it is made to reach every
phase, every level and most signs.
"""

import math
import random
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.control.fixed.torque_laws import WALK_TARGETS
from ppafo.control.fixed.walking_law import TOP, GaitConverter, GaitReadings, read_gait
from ppafo.control.fixed.walking_numbers import FIXED_WALKS, SIGN_BITS
from ppafo.control.fixed.whole_numbers import COMMAND_STEPS
from ppafo.control.walking import observer
from ppafo.control.walking.observer import NominalDevice
from ppafo.control.walking.signs import SIGNS
from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import leaf_paths, rebuilt, row_numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError
from ppafo.exports import filled, in_markdown, licence, template
from ppafo.exports.firmware import TICK, ChipController, law_source, parameters_header, ticks_of
from ppafo.exports.firmware.catalog import MSP430G2553
from ppafo.exports.firmware.lock_step import ChipLaw, Comparison, Cost, PythonChip, compare_with, cost_of
from ppafo.exports.firmware.simulators import chip_simulator
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT
from ppafo.simulation.declaration import quantity_text
from ppafo.simulation.sampled import run_sampled, state_row_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__
from ppafo.walking.declaration import ARITHMETIC, quantities
from ppafo.walking.events import SAFE_ROW
from ppafo.walking.planning import converter_of_walk, numbers_of_walk, plan_walk
from ppafo.walking.walk import lasting

ROOM, FILLED = 1.013e5, 4.4e5
"""Pressures [Pa] of a chamber that is vented and of one that is fed."""
UPRIGHT = 1.57
"""Ankle angle [rad] of who stands."""
_TREMBLE, _SWAY = 5.0, 5.0e-3
_SOME = 1.4e5
"""Pressure [Pa] of a chamber that should be vented and is not."""
_LOAD = 250.0
"""Force [N] that may be gone at once."""


@dataclass(frozen=True, slots=True)
class Part:
    """So many samples: forces [N], angle from the upright one at the start and at the end [rad], pressures [Pa].

    A pressure of 0 follows the command. Forces and angle tremble from sample to sample, as those of sound sensors do;
    the sensor that is ``still`` does not.
    """

    samples: int
    heel: float = 0.0
    toe: float = 0.0
    start: float = 0.0
    end: float = 0.0
    pressure_1: float = 0.0
    pressure_2: float = 0.0
    still: str = ""


Episode = tuple[Part, ...]


def nominal_device(configuration: Scenario) -> NominalDevice:
    """The device that the controller of a walk believes in."""
    names = (path.rpartition(".")[2] for path in leaf_paths(NominalDevice, ""))
    given = configuration.control.settings
    lines = {f"{name}_{line}": f"nominal_line_{name}_{line}" for name in _OF_LINES for line in (1, 2)}
    lines["relieving"] = "nominal_line_relieving"
    found: NominalDevice = rebuilt(NominalDevice, [given[lines.get(name, name)] for name in names])
    return found


_OF_LINES = ("droop", "largest_flow", "volume")


class Gas:
    """Pressures in the chambers of a sound device, which follow command and angle as the observer believes."""

    def __init__(self, nominal: NominalDevice, period: float) -> None:
        self._nominal, self._period = nominal, period
        self.begin()

    def begin(self) -> None:
        """Both chambers are vented."""
        self._state, self._angle = observer.START, UPRIGHT
        self._pressures = self._nominal.nominal_atmospheric_pressure, self._nominal.nominal_atmospheric_pressure

    def follow(self, command: int, angle: float) -> tuple[float, float]:
        """Pressures [Pa] a sample after a command [steps], at an angle [rad]."""
        sent = float(command) / COMMAND_STEPS if command else VENT
        self._state = observer.next_observer(
            self._nominal,
            self._state._replace(command=sent),
            self._angle,
            *self._pressures,
            angle,
            *self._pressures,
            self._period,
        )
        first, second = observer.volumes(self._nominal, angle)
        self._pressures = self._state.chamber_1.content / first, self._state.chamber_2.content / second
        self._angle = angle
        return self._pressures


def _measurements(episode: Episode) -> Iterator[GaitMeasurement]:
    """What the sensors show in each sample; a pressure of 0 is yet to follow the command."""
    for part in episode:
        for place in range(part.samples):
            sign = 1.0 if place % 2 else -1.0
            heel, toe, angle = (0.0 if part.still == name else sign for name in ("heel", "toe", "angle"))
            turned = part.start + (part.end - part.start) * place / part.samples
            yield GaitMeasurement(
                angle=UPRIGHT + turned + _SWAY * angle,
                pressure_1=part.pressure_1,
                pressure_2=part.pressure_2,
                torque=0.0,
                heel_force=part.heel + _TREMBLE * heel if part.heel else 0.0,
                toe_force=part.toe + _TREMBLE * toe if part.toe else 0.0,
            )


def made_readings(converter: GaitConverter, gas: Gas) -> Generator[tuple[GaitReadings, bool], int, None]:
    """Readings, and whether an episode begins with them; is sent the command [steps] that they led to."""
    for end in (TOP, 0):
        for begins in (True, False):
            yield GaitReadings._make([end] * len(GaitReadings._fields)), begins
    for episode in MADE_EPISODES:
        command, begins = 0, True
        gas.begin()
        for seen in _measurements(episode):
            first, second = gas.follow(command, seen.angle)
            shown = seen._replace(pressure_1=seen.pressure_1 or first, pressure_2=seen.pressure_2 or second)
            command = yield read_gait(converter, shown), begins
            begins = False


_LANDING, _FLAT = Part(100, _LOAD, 0.0, 0.0, -0.1), Part(350, _LOAD, _LOAD, -0.1, -0.2)
_PUSH, _SWING = Part(170, 0.0, _LOAD, -0.2, 0.1), Part(380, 0.0, 0.0, 0.1, 0.0)
_STRIDE: Episode = (_LANDING, _FLAT, _PUSH, _SWING)
"""One second; the next one that begins is a steady one."""
_AIR, _STANDS = Part(20), Part(600, _LOAD, _LOAD)


def _turned_up(down: float, toes: float) -> Episode:
    """A swing in which the foot turns up, and is on the heel until an angle [rad], and until another one."""
    swing = (Part(300, 0.0, 0.0, 0.1, 0.2), Part(80, 0.0, 0.0, 0.2, 0.08))
    landing = (Part(50, _LOAD, 0.0, 0.08, down), Part(50, _LOAD, 0.0, down, toes))
    return (*swing, *landing, Part(350, _LOAD, _LOAD, toes, -0.2), _PUSH)


def _leaves(angle: float) -> Episode:
    """A stride whose toes leave the ground at an angle [rad]."""
    return (_LANDING, _FLAT, Part(100, 0.0, _LOAD, -0.2, angle), Part(20, 0.0, 0.0, angle, angle), Part(30))


def _stands(pressure_1: float, pressure_2: float) -> Episode:
    """Who stands with pressures [Pa] that stay what they are."""
    return (Part(350, _LOAD, _LOAD, 0.0, 0.0, pressure_1, pressure_2),)


def _flat_at(heel: float, angle: float) -> Episode:
    """A steady walk, and a force under the heel [N] and an angle [rad] where the foot must stand flat."""
    return (*_STRIDE, _LANDING, Part(170, heel, _LOAD, angle, angle), _AIR)


def _shorter(count: int) -> Iterator[Part]:
    """Strides on both, shorter and shorter as far as that is good, and so many of the shortest."""
    known, stride = 1100.0, 1100
    while stride > 20:
        stride = max(20, math.ceil(0.53 * known))
        known += 0.3 * (stride - known)
        yield from (Part(stride // 2, 100.0, 100.0), Part(stride - stride // 2))
    for _ in range(count):
        yield from (Part(10, 100.0, 100.0), Part(10))


def _of_signs() -> Iterator[Episode]:
    """Episodes for the signs."""
    late = _turned_up(-0.05, -0.1)
    yield (*_STRIDE, _LANDING, _FLAT, _PUSH, *3 * late, *late[:2], Part(150, 0.0, _LOAD, 0.08, -0.1), _SWING)
    yield (*_STRIDE, _LANDING, _FLAT, _PUSH, *_turned_up(-0.05, 0.03)[:4])
    yield tuple(part for angle in (0.3, 0.52, 0.52, 0.52, 0.46) for part in _leaves(angle))
    yield from (_flat_at(_LOAD, -0.5), _flat_at(_LOAD, 0.5), _flat_at(0.0, -0.5))
    yield (*_STRIDE, Part(300, _LOAD, 0.0, 0.0, -0.1), _STANDS)
    yield (*_STRIDE, _LANDING, *2 * (_FLAT,), Part(100, 0.0, _LOAD, -0.2, 0.1), Part(100, 0.0, 0.0, 0.1, 0.0), _LANDING)
    yield (Part(1400), Part(300, _LOAD, _LOAD), _AIR, _STANDS, _AIR)
    yield (*_STRIDE, Part(50, _LOAD), Part(50), _STANDS, _AIR)
    yield (Part(1400), *2 * _STRIDE, _LANDING)
    yield (Part(400, 400.0, 400.0), Part(20, 0.0, 400.0))
    yield (Part(400, 400.0, 400.0), Part(20, 400.0, 0.0))
    yield (Part(300, _LOAD, _LOAD), *6 * (Part(100, 0.0, _LOAD), Part(100, _LOAD, _LOAD)), _AIR)
    yield (Part(620, _LOAD), Part(380), Part(620, _LOAD), Part(50))
    yield (Part(100, 0.0, _LOAD), _STANDS, Part(50, 45.0, 45.0), _AIR)
    yield (Part(600, 0.0, _LOAD), _AIR)
    for still in ("heel", "toe"):
        alone = Part(300, *((_LOAD, 0.0) if still == "heel" else (0.0, _LOAD)), still=still)
        yield (_AIR, alone, replace(alone, samples=50, heel=_LOAD, toe=_LOAD), _AIR)
    forces = ((100, _LOAD, 0.0), (150, _LOAD, _LOAD), (200, 0.0, _LOAD), (550, 0.0, 0.0), (100, _LOAD, 0.0))
    yield tuple(Part(*force, still="angle") for force in forces)


def _of_ranges() -> Iterator[Episode]:
    """Episodes for readings that cannot be, and for pressures that the valve does not make."""
    yield from (_stands(_SOME, ROOM), _stands(ROOM, _SOME), _stands(ROOM, ROOM), _stands(5.0e4, ROOM))
    yield (Part(350, _LOAD, _LOAD, -0.6, -0.6, 1.28e5, ROOM),)
    yield from (_stands(4.0e4, ROOM), _stands(1.0e6, ROOM), _stands(ROOM, 1.0e6))
    yield (
        Part(100, 0.0, 0.0, 0.7, 0.7),
        Part(50, 0.0, 0.0, 0.7, 0.7, ROOM, 1.0e6),
        Part(50, 0.0, 0.0, 0.5, 0.5, ROOM, 1.0e6),
    )
    yield from ((Part(20, force),) for force in (3.2e3, -100.0))
    yield from ((Part(20, 0.0, 0.0, angle, angle),) for angle in (-1.4, 0.9))
    yield (Part(100, _LOAD, 0.0, 0.0, 0.0, ROOM, ROOM),)
    yield (Part(450, _LOAD, _LOAD), Part(100, 0.0, _LOAD, 0.0, 0.0, ROOM, ROOM))
    fed = Part(150, _LOAD, 0.0, 0.0, -0.05)
    for pressure in (1.6e5, 2.6e5, 6.5e5):
        yield (*_STRIDE, replace(fed, samples=40), replace(fed, pressure_2=pressure))
    for pressure in (FILLED, 3.0e5, 7.0e4):
        yield (*_STRIDE, _LANDING, Part(250, _LOAD, _LOAD, -0.1, -0.15), Part(60, _LOAD, _LOAD, -0.15, -0.15, pressure))
        yield (*_STRIDE, _LANDING, _FLAT, _PUSH, Part(60, 0.0, 0.0, 0.1, 0.1, pressure))
    falls = (Part(12, _LOAD, _LOAD, 0.0, 0.0, FILLED * 0.9**place, ROOM) for place in range(14))
    yield (Part(200, _LOAD, _LOAD, 0.0, 0.0, FILLED, ROOM), *falls)


def _of_counts() -> Iterator[Episode]:
    """Episodes for counts that end: of samples, of strides on the toes, of good strides."""
    yield (Part(16_400, _LOAD, _LOAD), Part(15), Part(15, _LOAD, _LOAD))
    yield 1004 * (Part(10, 0.0, 100.0), Part(10))
    yield tuple(_shorter(1004))


MADE_EPISODES: tuple[Episode, ...] = (*_of_signs(), *_of_ranges(), *_of_counts())
"""Those of the signs first, the long ones last."""

SAMPLES: int = 4 + sum(part.samples for episode in MADE_EPISODES for part in episode)
"""Of all that is made."""


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


def gait_readings(
    converter: GaitConverter, gas: Gas, samples: int, seed: int
) -> Generator[tuple[GaitReadings, bool], int, None]:
    """Readings without end, and whether an episode begins with them; is sent the command [steps] that they led to.

    Those that are made come first, where there is room for them in so many ``samples``, and then drawn ones.
    """
    if samples >= SAMPLES:
        yield from made_readings(converter, gas)
    drawn, command = DrawnGait(converter, gas, seed), 0
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

    def __init__(self, converter: GaitConverter, gas: Gas, seed: int) -> None:
        self._converter, self._gas = converter, gas
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
        self._gas.begin()
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

    def _measured(self, command: int) -> GaitMeasurement:
        part = self._at / self._length
        # Forces under heel and toes [N] at a part of the stride.
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
        heel, toe = odd.get(self._odd, (500.0 * _bump(part, 0.0, 0.45), 700.0 * _bump(part, 0.12, 0.62)))
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
        angle = UPRIGHT + turned + 1.0e-3 * moves
        first, second = self._gas.follow(command, angle)
        return GaitMeasurement(
            angle=angle,
            pressure_1=first,
            pressure_2=second,
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


_TEMPLATES = (
    "Makefile",
    "README.md",
    "board.h",
    "board_simulated.c",
    "controller.h",
    "host.c",
    "main.c",
    *MSP430G2553.templates,
)


def walk_chip(configuration: Scenario) -> ChipController:
    """The integer controller of a walk whose arithmetic is fixed.

    ScenarioError where it is not, or where the chip's timer or converter cannot do what it asks for.
    """
    name, period, given = configuration.name, configuration.control.period, configuration.control.settings
    if not configuration.control.is_fixed:
        if configuration.control.kind in FIXED_WALKS:
            raise ScenarioError(f"{name}: the controller computes with floats; set {ARITHMETIC}=fixed")
        raise ScenarioError(
            f"{name}: the controller '{configuration.control.kind}' has no form on whole numbers; those that have "
            f"one: {', '.join(FIXED_WALKS)}"
        )
    if given["converter_bits"] > MSP430G2553.converter_bits:
        raise ScenarioError(
            f"{name}: controller.converter_bits = {given['converter_bits']:g}: the converter of the chip has "
            f"{MSP430G2553.converter_bits}"
        )
    ticks = ticks_of(name, period)
    law = FIXED_WALKS[configuration.control.kind]
    numbers = numbers_of_walk(configuration)
    return ChipController(law=law, numbers=numbers, converter=converter_of_walk(configuration), ticks=ticks)


def walk_firmware(configuration: Scenario, target: str = WALK_TARGETS[0]) -> dict[str, bytes]:
    """Files of the firmware of a walk's controller, by name. ScenarioError where it has no integer form."""
    if target not in WALK_TARGETS:
        raise ScenarioError(f"{configuration.name}: a walk's firmware is for {', '.join(WALK_TARGETS)}, not '{target}'")
    chip = walk_chip(configuration)
    words = _words(configuration, chip, target)
    texts = {name: filled(template("firmware.walking", name), words) for name in _TEMPLATES}
    texts |= {name: template("firmware", name) for name in ("msp430.h", "start_msp430.c")}
    texts["LICENSE"] = licence()
    texts["controller.c"] = law_source(
        chip.law,
        f"The walking controller '{chip.law.name}' of ppafo {__version__} on whole numbers.",
        ("controller_readings readings", "given", ", ".join(f"readings.{name}" for name in GaitReadings._fields)),
        {"int16_t controller_level": "state.safety.level", "int16_t controller_sign": "state.safety.sign"},
    )
    bits, period = int(configuration.control.settings["converter_bits"]), configuration.control.period
    texts["parameters.h"] = parameters_header(
        f"the controller '{chip.law.name}' of the walk {configuration.name}, ppafo {__version__},",
        _origins(configuration),
        f"#define CONTROLLER_TICKS {chip.ticks}u /* of 125 us in a sample period of {period:.9g} s */\n"
        f"#define CONTROLLER_BITS {bits} /* of the converter; counts are of 14 bits */",
        chip.law,
        chip.numbers,
    )
    return {name: text.encode() for name, text in sorted(texts.items())}


def _words(configuration: Scenario, chip: ChipController, target: str) -> dict[str, str]:
    """What fills the templates."""
    given, converter = configuration.control.settings, chip.converter
    return {
        "title": configuration.name,
        "description": in_markdown(configuration.description),
        "kind": chip.law.name,
        "target": target,
        "version": __version__,
        "period": quantity_text(configuration.control.period, "s"),
        "force_zero": f"{given['force_zero']:.6g} N",
        "force_range": f"{given['force_range']:.6g} N",
        "force_step": f"{converter.force_step:.3g} N",
        "angle_range": f"{math.degrees(given['angle_range']):.4g} deg",
        "angle_step": f"{math.degrees(converter.angle_step):.3g} deg",
        "pressure_range": f"{given['converter_range'] / 1.0e3:.6g} kPa",
        "pressure_step": f"{converter.pressure_step / 1.0e3:.3g} kPa",
        "silence": f"{(2 * chip.ticks * TICK + 2.05e-3) * 1.0e3:.4g} ms",
        "signs": "\n".join(f"      {number:2.0f}  {sign.summary}" for number, sign in SIGNS.items()),
    }


def _origins(configuration: Scenario) -> Iterator[str]:
    """Settings that the numbers come from, each with unit and value in SI units."""
    declared = quantities(configuration.control.kind)
    yield f"period {configuration.control.period:.9g} s (controller.rate or controller.period of {configuration.name})"
    for name, value in configuration.control.settings.items():
        yield f"{name} {value:.9g} {declared[f'controller.{name}'].unit} (controller.{name})".replace("  ", " ")


_INSIDE = ("controller_state.", "gait_seen.")
"""What only the lanes keep: state of their controller, and the last readings."""


@dataclass(frozen=True, slots=True)
class WalkOnChip:
    """A walk with the chip's simulator in charge, and the same with the integer controller in the lanes.

    ``differences`` are samples of the recording at which the commands differ; ``same_bits`` is true where all that is
    no state of a controller is the same. ``level`` is that of the chip at the end.
    """

    cost: Cost
    samples: int
    differences: int
    same_bits: bool
    level: int
    gas: float


def walk_on_chip(configuration: Scenario, minutes: float | None = None) -> WalkOnChip:
    """Walk with the controller on the chip's simulator, in virtual time, and once more in the lanes.

    ScenarioError where the controller has no integer form, SimulationError where a tool is missing.
    """
    chip = walk_chip(configuration)
    walked = lasting(configuration, minutes)
    run = plan_walk(walked)
    with chip_simulator(walk_firmware(configuration), MSP430G2553) as (simulator, image):
        law = ChipLaw(simulator, lambda _, measurement: read_gait(chip.converter, measurement), at_zero=VENT)
        outside = run_sampled(batch_of(plan_walk(walked.controlled_by(law))), law)
        cost = cost_of(MSP430G2553, image, simulator.stack(), law.decisions)
    inside = run_batch(batch_of(run))
    rows = state_row_numbers(run)
    shared = [path for path in rows if not path.startswith(_INSIDE)]
    own = row_numbers(replace(run.program, controller=None).state_rows())
    both = ((outside, own), (inside, rows))
    mine, theirs = (one.record[:, [places[path] for path in shared], 0] for one, places in both)
    differ = int(np.count_nonzero(mine[:, shared.index("result.command")] != theirs[:, shared.index("result.command")]))
    level = law.decisions[-1].is_sound >> SIGN_BITS
    same = bool(np.array_equal(mine, theirs) and level == inside.record[-1, rows[SAFE_ROW], 0])
    gas = float(mine[-1, shared.index("state.supplied_mass")])
    return WalkOnChip(cost, len(law.decisions), differ, same, level, gas)


def compare_drawn_walk(configuration: Scenario, samples: int, seed: int = 1) -> Comparison:
    """Give drawn readings of a gait to the chip's simulator and to Python, with a reset before every episode."""
    chip = walk_chip(configuration)
    gas = Gas(nominal_device(configuration), configuration.control.period)
    given = gait_readings(chip.converter, gas, samples, seed)
    return compare_with(PythonChip(chip), given, samples, walk_firmware(configuration), MSP430G2553)
