"""Design requirements of a wearer, the devices that were tried, and the result of each."""

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ppafo.analyses.design.wearer.electrical import Electrical
from ppafo.analyses.endurance.answer import Endurance
from ppafo.analyses.parts.sections import doubts_data
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.errors import StudyError
from ppafo.parameters.parts import Part
from ppafo.report.kind import Kind
from ppafo.units import from_si, to_si
from ppafo.units.shown import shown_unit
from ppafo.version import __version__
from ppafo.walking.motion import LONGEST_MINUTES
from ppafo.walking.result import WalkResult
from ppafo.walking.wearer import STATURES, WEARER

WALKS = {"solenoid": "solenoid-regulators", "proportional": "proportional-regulators"}
"""The walk, with its controller, of each kind of valve."""
BODY_MASS_INDEX = 22.0
"""Body mass over the square of the stature [kg/m^2] of a wearer of whom the mass alone is known."""
TOES = 0.01
"""Clearance of the toes [m] that is wanted where none is given, unless the healthy gait itself has less."""
REACHED = 0.95
"""Peak torque of the mean stride over the wanted one from which on a device reaches it: in offers and in refusals."""
SHORTEST = 6.0
"""Time [s] that a walk on a bottle takes at least."""
_STRONGEST, _HIGHEST_TOES = 100.0, 0.2
"""Torque [N m] and clearance [m] from which on a wish is a slip of the pen."""
TORQUE, MASS, CLEARANCE = Kind("", "N m", "torque", ".3g"), Kind("", "kg", "part mass"), Kind("", "m", "length", ".1f")


@dataclass(frozen=True, slots=True)
class Wish:
    """Design requirements: body mass [kg], stature [m] or None, torque [N m], supply [Pa absolute], time [s].

    ``toes`` is how far the toes clear the ground in mid-swing [m]; where it is None, ``usual_toes`` are wanted.
    """

    mass: float
    stature: float | None
    torque: float
    pressure: float
    seconds: float
    toes: float | None = None
    usual_toes: float = TOES

    @property
    def height(self) -> float:
        """Stature [m]; unless one is given, of a wearer with ``BODY_MASS_INDEX``."""
        return math.sqrt(self.mass / BODY_MASS_INDEX) if self.stature is None else self.stature

    @property
    def clearance(self) -> float:
        """Clearance of the toes [m]."""
        return self.usual_toes if self.toes is None else self.toes

    def at_gauge(self, share: float) -> "Wish":
        """Return this wish at a share of its gauge pressure, rounded to what gauges show: 0.1 psi, 0.01 bar, 1 kPa."""
        unit = shown_unit("Pa_d")
        step = to_si(10.0 ** round(math.log10(from_si(0.1 * PASCALS_PER_PSI, unit, "Pa_d"))), unit, "Pa_d")
        return replace(
            self,
            pressure=STANDARD_ATMOSPHERE + step * round(share * (self.pressure - STANDARD_ATMOSPHERE) / step),
        )

    def is_reached_by(self, torque: float) -> bool:
        """Tell whether a peak torque of the mean stride [N m] is the wanted one, but for what a stride differs."""
        return torque >= REACHED * self.torque

    def text(self) -> str:
        """Return torque, pressure, time and clearance in words."""
        pressure = Kind("", "Pa_a", "pressure").text(self.pressure)
        toes = f"toes {CLEARANCE.text(self.clearance)} over the ground"
        return f"{TORQUE.text(self.torque)} at {pressure} for {self.seconds / 60.0:.4g} min, {toes}"


def check_wish(wish: Wish) -> None:
    """Raise StudyError for a wish that no device can be sized for, with the argument and what is allowed."""
    low, high = STATURES
    mass = next(quantity for quantity in WEARER if quantity.name == "body_mass")
    if not mass.minimum <= wish.mass <= mass.maximum:
        raise StudyError(
            f"--mass: {wish.mass:g} kg: must be at least {mass.minimum:g} kg and at most {mass.maximum:g} kg"
        )
    if wish.stature is None and not low <= wish.height <= high:
        raise StudyError(
            f"--mass: {wish.mass:g} kg: with a body mass index of {BODY_MASS_INDEX:g} kg/m^2 the wearer would be "
            f"{wish.height:.3g} m tall, and segments are known of adults of {low:g} to {high:g} m; give --stature"
        )
    if not wish.pressure > STANDARD_ATMOSPHERE:
        raise StudyError("--pressure: must be above the atmosphere, for example '50 psi_g'")
    if not 0.0 < wish.torque < _STRONGEST:
        text, most = TORQUE.text(wish.torque), TORQUE.text(_STRONGEST)
        raise StudyError(f"--torque: {text}: must be above 0 and below {most}")
    if not SHORTEST <= wish.seconds <= 60.0 * LONGEST_MINUTES:
        raise StudyError(
            f"--minutes: {wish.seconds / 60.0:g} min: a walk on a bottle is followed for 0.1 to {LONGEST_MINUTES:g} min"
        )
    if wish.toes is not None and not 0.0 <= wish.toes <= _HIGHEST_TOES:
        raise StudyError(
            f"--toes: {1000.0 * wish.toes:g} mm: must be at least 0 mm and at most {1000.0 * _HIGHEST_TOES:g} mm"
        )
    if wish.stature is not None and not low <= wish.stature <= high:
        raise StudyError(
            f"--stature: {wish.stature:g} m: segments are known of adults of {low:g} to {high:g} m; take a gait and "
            "a wearer of your own in a walk file"
        )


def shown_clearance(toes: float) -> float:
    """Return a clearance [m] rounded down to the tenth of a millimetre that is shown, which a few strides then have."""
    return math.floor(1.0e4 * toes) / 1.0e4


@dataclass(frozen=True, slots=True, eq=False)
class WalkedDevice:
    """Valve, actuator and overrides of a walk; peak torque of the mean stride [N m], mean flow of gas [kg/s].

    ``toes`` is the lowest height of the toes over the ground in mid-swing [m]; below 0 they would drag.
    """

    valve: Part
    actuator: Part
    overrides: tuple[str, ...]
    torque: float
    flow: float
    toes: float

    @property
    def mass(self) -> float:
        """Mass of both parts [kg]."""
        return self.valve.full_mass + self.actuator.full_mass

    def has(self, wish: Wish) -> bool:
        """Tell whether a few strides have the torque and the clearance of a wish."""
        return wish.is_reached_by(self.torque) and self.toes >= wish.clearance


@dataclass(frozen=True, slots=True, eq=False)
class SizedDevice:
    """A device that was walked with on its bottle for the time that is wanted, how long it lasts, what it takes.

    ``bottle_name`` is what ``--bottle`` takes for the bottle.
    """

    tried: WalkedDevice
    bottle: Part
    bottle_name: str
    walked: WalkResult
    life: Endurance
    electrical: Electrical
    masses: Mapping[str, float]

    @property
    def torque(self) -> float:
        """Peak torque of the mean stride on the bottle [N m]."""
        return float(self.walked.averages["torque"].mean.max())

    @property
    def toes(self) -> float:
        """Lowest toes over the ground in mid-swing [m], of the mean stride on the bottle."""
        return self.walked.metrics["lowest_toes"].value

    @property
    def command(self) -> str:
        """The command that walks with it."""
        minutes = float(self.walked.recording.time[-1]) / 60.0
        words = ("ppafo", "walk", WALKS[self.tried.valve.kind], "--bottle", self.bottle_name)
        sets = (word for text in self.tried.overrides for word in ("--set", text))
        return shlex.join((*words, "--minutes", f"{minutes:.4g}", *sets))


@dataclass(frozen=True, slots=True)
class Offer:
    """A wish that can be met in place of another, with the parts that walked."""

    wish: Wish
    tried: WalkedDevice
    bottle: Part

    def text(self, asked: Wish) -> str:
        """Return the offer whole, with what it changes of the wish that was asked in front, and its parts."""
        changes = [
            *(["less torque"] if self.wish.torque < asked.torque else []),
            *(["lower toes"] if self.wish.clearance < asked.clearance else []),
            *(["less pressure"] if self.wish.pressure < asked.pressure else []),
            *(["more pressure"] if self.wish.pressure > asked.pressure else []),
            *(["fewer minutes"] if self.wish.seconds < asked.seconds else []),
        ]
        parts = f"{self.tried.valve.name} and {self.tried.actuator.name} on {self.bottle.name}"
        return f"{', '.join(changes)}: {self.wish.text()}, with {parts}"


@dataclass(frozen=True, slots=True, eq=False)
class WearerSizing:
    """Requirements and every device tried; ``device`` is None if none meets them, ``instead`` has the alternatives.

    ``healthy_toes`` is the clearance of the toes in the healthy gait [m].
    """

    wish: Wish
    healthy_toes: float
    tried: tuple[WalkedDevice, ...]
    device: SizedDevice | None
    instead: tuple[str, ...]

    @property
    def parts(self) -> list[Part]:
        """The parts that the device is made of, of those with figures to check."""
        device = self.device
        if device is None:
            return []
        return [device.tried.valve, device.tried.actuator, device.bottle, device.electrical.cell]

    @property
    def doubtful(self) -> list[tuple[Part, str]]:
        """Figures of these parts that are quoted or assumed."""
        return [(part, name) for part in self.parts for name in part.doubtful]

    def json_document(self) -> dict[str, Any]:
        """Return the device and all that was tried as plain data in SI."""
        wish, device = self.wish, self.device
        return {
            "format": "ppafo wearer sizing",
            "schema_version": 1,
            "kind": "simulated",
            "ppafo": __version__,
            "wish": {
                "body_mass": wish.mass,
                "stature": wish.height,
                "stature_is_assumed": wish.stature is None,
                "torque": wish.torque,
                "pressure": wish.pressure,
                "time": wish.seconds,
                "toes": wish.clearance,
            },
            "healthy_toes": self.healthy_toes,
            "device": None
            if device is None
            else {
                "valve": device.tried.valve.name,
                "actuator": device.tried.actuator.name,
                "bottle": device.bottle.name,
                "controller": device.walked.scenario.controller.kind,
                "walk": WALKS[device.tried.valve.kind],
                "overrides": list(device.tried.overrides),
                "lasts": device.life.discharge.walking_time,
                "torque": device.torque,
                "toes": device.toes,
                "masses": dict(device.masses),
                "electrical_power": dict(device.electrical.powers),
                "battery": {
                    "cell": device.electrical.cell.name,
                    "cells": device.electrical.cells,
                    "mass": device.electrical.mass,
                    "lasts": device.electrical.lasts,
                },
                "command": device.command,
            },
            "instead": list(self.instead),
            "tried": [
                {
                    "valve": tried.valve.name,
                    "actuator": tried.actuator.name,
                    "torque": tried.torque,
                    "toes": tried.toes,
                    "flow": tried.flow,
                }
                for tried in self.tried
            ],
            "check_before_buying": doubts_data(self.doubtful),
        }
