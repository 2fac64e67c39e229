"""Design requirements of a wearer, tried devices, and the result of each."""

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.analyses.design.wearer.electrical import Electrical
from ppafo.analyses.endurance.answer import Endurance
from ppafo.analyses.parts.sections import doubts_data
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.documents.json_text import fields_of
from ppafo.errors import StudyError, raise_noted
from ppafo.parameters.parts import Part
from ppafo.report.kind import Kind
from ppafo.units import from_si, to_si
from ppafo.units.shown import shown_unit
from ppafo.version import __version__
from ppafo.walking.motion import LONGEST_MINUTES
from ppafo.walking.result import WalkResult
from ppafo.walking.wearer import WEARER
from ppafo.wording import argument_text

WALKS = {"solenoid": "solenoid-regulators", "proportional": "proportional-regulators"}
"""Name of the walk configuration, with its controller, by kind of valve."""
BODY_MASS_INDEX = 22.0
"""Body mass divided by the square of the stature [kg/m^2], for a wearer of unknown stature."""
TOES = 0.01
"""Default toe clearance [m], unless the healthy gait has less."""
REACHED = 0.95
"""Least ratio [-] to the required peak torque that counts as reached: of the mean stride, of the run on a profile."""
SHORTEST = 6.0
"""Shortest time [s] of a walk on a bottle that may be required."""
_SHORTEST_WEARER = 1.0
"""Least stature [m] of a wearer: about four years, the youngest whose leg segments were measured (R. K. Jensen, Body
segment mass, radius and radius of gyration proportions of children, J. Biomech. 19(5), 1986: boys of 4 to 15 years)."""
_STRONGEST, _HIGHEST_TOES = 100.0, 0.2
"""Torque [N m] and clearance [m] above which a requirement is refused as a typing error."""
TORQUE, MASS, CLEARANCE = Kind("", "N m", "torque", ".3g"), Kind("", "kg", "part mass"), Kind("", "m", "length", ".1f")


@dataclass(frozen=True, slots=True)
class DesignRequirements:
    """Design requirements of a wearer on a device.

    ``mass``: body mass [kg]
    ``stature``: stature [m]; None for the stature at ``BODY_MASS_INDEX``
    ``torque``: peak torque of push-off [N m]
    ``pressure``: supply pressure [Pa absolute]
    ``seconds``: walking time on one bottle [s]
    ``toes``: toe clearance in mid-swing [m]; None for ``usual_toes``
    ``gas``: gas species of the supply; empty for the species of the walk
    ``gait``: name or file of the gait; None for the gait of the walk
    """

    mass: float
    stature: float | None
    torque: float
    pressure: float
    seconds: float
    toes: float | None = None
    usual_toes: float = TOES
    gas: str = ""
    gait: str | Path | None = None

    @property
    def height(self) -> float:
        """Stature of the wearer [m]; by default computed from the mass with ``BODY_MASS_INDEX``."""
        return math.sqrt(self.mass / BODY_MASS_INDEX) if self.stature is None else self.stature

    @property
    def clearance(self) -> float:
        """Required toe clearance [m]."""
        return self.usual_toes if self.toes is None else self.toes

    def at_gauge(self, share: float) -> "DesignRequirements":
        """Return the requirements at a fraction of their gauge pressure, rounded to 0.1 psi, 0.01 bar or 1 kPa."""
        unit = shown_unit("Pa_d")
        step = to_si(10.0 ** round(math.log10(from_si(0.1 * PASCALS_PER_PSI, unit, "Pa_d"))), unit, "Pa_d")
        return replace(
            self, pressure=STANDARD_ATMOSPHERE + step * round(share * (self.pressure - STANDARD_ATMOSPHERE) / step)
        )

    def is_reached_by(self, torque: float) -> bool:
        """Return whether a peak torque of the mean stride [N m] suffices, within the variation of strides."""
        return torque >= REACHED * self.torque

    def text(self) -> str:
        """Format torque, pressure, time and toe clearance of the requirements as text."""
        pressure = Kind("", "Pa_a", "pressure").text(self.pressure)
        toes = f"toes {CLEARANCE.text(self.clearance)} over the ground"
        return f"{TORQUE.text(self.torque)} at {pressure} for {self.seconds / 60.0:.4g} min, {toes}"


def check_requirements(requirements: DesignRequirements) -> None:
    """Raise StudyError, naming every argument, for requirements outside the ranges for which devices are sized."""
    mass, tallest = (next(each for each in WEARER if each.name == name) for name in ("body_mass", "stature"))
    ranges = (
        ("mass", requirements.mass, mass.minimum, mass.maximum, "kg"),
        ("minutes", requirements.seconds / 60.0, SHORTEST / 60.0, LONGEST_MINUTES, "min"),
        ("toes", 1000.0 * (requirements.toes or 0.0), 0.0, 1000.0 * _HIGHEST_TOES, "mm"),
        ("stature", requirements.height, _SHORTEST_WEARER, tallest.maximum, "m"),
    )
    problems = {
        name: f" {value:g} {unit}: must be at least {low:g} {unit} and at most {high:g} {unit}"
        for name, value, low, high, unit in ranges
        if not (low or 0.0) <= value <= (high or 0.0)
    }
    if not requirements.pressure > STANDARD_ATMOSPHERE:
        problems["pressure"] = " must be above atmospheric pressure, for example '50 psi_g'"
    if not 0.0 < requirements.torque < _STRONGEST:
        text, most = TORQUE.text(requirements.torque), TORQUE.text(_STRONGEST)
        problems["torque"] = f" {text}: must be above 0 and below {most}"
    raise_noted([StudyError(f"{argument_text(name)}:{problem}") for name, problem in problems.items()])


def shown_clearance(toes: float) -> float:
    """Return a toe clearance [m] rounded down to 0.1 mm, as displayed."""
    return math.floor(1.0e4 * toes) / 1.0e4


@dataclass(frozen=True, slots=True, eq=False)
class WalkedDevice:
    """Valve and actuator after a few strides of walking.

    ``overrides``: overrides of the walk
    ``torque``: peak torque of the mean stride [N m]
    ``flow``: mean gas flow [kg/s]
    ``toes``: lowest toe height above the ground in mid-swing [m]; below 0 the toes would drag
    """

    valve: Part
    actuator: Part
    overrides: tuple[str, ...]
    torque: float
    flow: float
    toes: float

    @property
    def mass(self) -> float:
        """Mass of valve and actuator [kg]."""
        return self.valve.full_mass + self.actuator.full_mass

    def has(self, requirements: DesignRequirements) -> bool:
        """Return whether the strides of the device have the required torque and toe clearance."""
        return requirements.is_reached_by(self.torque) and self.toes >= requirements.clearance


@dataclass(frozen=True, slots=True, eq=False)
class SizedDevice:
    """Device whose walk on a bottle lasts for the required time.

    ``tried``: valve and actuator, after a few strides
    ``bottle``, ``bottle_name``: bottle, and the argument of ``--bottle`` for it
    ``walked``: walk on the bottle
    ``life``: duration of the gas in the bottle
    ``electrical``: electrical energy of the walk, and the battery
    ``masses``: mass [kg] by part
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
        """Lowest toe height above the ground in mid-swing [m], of the mean stride on the bottle."""
        return self.walked.metrics["lowest_toes"].value

    @property
    def command(self) -> str:
        """Command line that repeats the walk with this device."""
        minutes = float(self.walked.recording.time[-1]) / 60.0
        words = ("ppafo", "walk", WALKS[self.tried.valve.kind], "--bottle", self.bottle_name)
        sets = (word for text in self.tried.overrides for word in ("--set", text))
        return shlex.join((*words, "--minutes", f"{minutes:.4g}", *sets))


@dataclass(frozen=True, slots=True)
class Alternative:
    """Relaxed requirements, with the parts that met them in a walk on a bottle."""

    requirements: DesignRequirements
    tried: WalkedDevice
    bottle: Part

    def text(self, asked: DesignRequirements) -> str:
        """Format the alternative as text: relaxed requirements first, then its parts."""
        changes = [
            *(["less torque"] if self.requirements.torque < asked.torque else []),
            *(["lower toes"] if self.requirements.clearance < asked.clearance else []),
            *(["less pressure"] if self.requirements.pressure < asked.pressure else []),
            *(["more pressure"] if self.requirements.pressure > asked.pressure else []),
            *(["fewer minutes"] if self.requirements.seconds < asked.seconds else []),
        ]
        parts = f"{self.tried.valve.name} and {self.tried.actuator.name} on {self.bottle.name}"
        return f"{', '.join(changes)}: {self.requirements.text()}, with {parts}"


@dataclass(frozen=True, slots=True, eq=False)
class WearerSizing:
    """Result of a sizing for a wearer: requirements, tried devices, and the sized device.

    ``healthy_toes``: toe clearance of the healthy gait [m]
    ``device``: lightest device that meets the requirements; None if there is none
    ``instead``: alternatives if there is no device
    ``gas``: species of the gas
    ``own_valves``: valves of the user's own catalogue; empty for the catalogue of the package
    """

    requirements: DesignRequirements
    healthy_toes: float
    tried: tuple[WalkedDevice, ...]
    device: SizedDevice | None
    instead: tuple[str, ...]
    gas: str = ""
    own_valves: tuple[Part, ...] = ()

    @property
    def parts(self) -> list[Part]:
        """Valve, actuator, bottle and battery cell of the device; empty without a device."""
        device = self.device
        if device is None:
            return []
        return [device.tried.valve, device.tried.actuator, device.bottle, device.electrical.cell]

    @property
    def doubtful(self) -> list[tuple[Part, str]]:
        """Quoted or assumed figures of the parts of the device, as pairs of part and figure name."""
        return [(part, name) for part in self.parts for name in part.doubtful]

    def json_document(self) -> dict[str, Any]:
        """Return the device and all tried pairs as plain data in SI."""
        requirements, device = self.requirements, self.device
        return {
            "format": "ppafo wearer sizing",
            "schema_version": 1,
            "kind": "simulated",
            "ppafo": __version__,
            "wish": {
                "body_mass": requirements.mass,
                "stature": requirements.height,
                "stature_is_assumed": requirements.stature is None,
                "torque": requirements.torque,
                "pressure": requirements.pressure,
                "time": requirements.seconds,
                "toes": requirements.clearance,
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
                **fields_of(device, "torque", "toes", "command"),
                "masses": dict(device.masses),
                "electrical_power": dict(device.electrical.powers),
                "battery": {
                    "cell": device.electrical.cell.name,
                    **fields_of(device.electrical, "cells", "mass", "lasts"),
                },
            },
            "instead": list(self.instead),
            "tried": [
                {
                    "valve": tried.valve.name,
                    "actuator": tried.actuator.name,
                    **fields_of(tried, "torque", "toes", "flow"),
                }
                for tried in self.tried
            ],
            "check_before_buying": doubts_data(self.doubtful),
        }
