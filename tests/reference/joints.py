"""Chambers and torque of a cylinder with a lever and of a measured bladder, written from their drawings.

Nothing of the package's actuators is called: the cylinder is a triangle whose third side it is, and the bladder is its
CSV file, a spline of SciPy over the angle for each pressure and straight lines from one pressure to the next.
"""

import csv
import math
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from ppafo.simulation.scenario import Scenario


class Chamber(NamedTuple):
    """Volume [m^3], its growth with the pressure [m^3/Pa] and with the angle [m^3/rad]."""

    volume: float
    by_pressure: float
    by_angle: float


class Joint(Protocol):
    """An actuator by chamber, 0 or 1, at an angle [rad] and an absolute pressure [Pa]."""

    def chamber(self, which: int, angle: float, pressure: float) -> Chamber:
        """The chamber there."""

    def pressure(self, which: int, angle: float, content: float) -> float:
        """Absolute pressure [Pa] at which pressure times volume is a content [J]."""

    def torque(self, angle: float, pressure_1: float, pressure_2: float) -> float:
        """Torque on the joint [N m]."""


class CylinderJoint:
    """Two pins at fixed distances from the joint; the cylinder is the third side of the triangle."""

    def __init__(self, scenario: Scenario) -> None:
        actuator = scenario.device.actuator
        self.sides = actuator.lever_length, actuator.base_distance
        self.offset = actuator.lever_offset
        piston, rod = (math.pi * (diameter / 2.0) ** 2 for diameter in (actuator.bore, actuator.rod_diameter))
        self.areas = piston, piston - rod
        self.dead = actuator.dead_volume_1, actuator.dead_volume_2
        self.ends = self._length(actuator.angle_min)[0], self._length(actuator.angle_max)[0]
        self.room = scenario.device.supply.atmospheric_pressure

    def _length(self, angle: float) -> tuple[float, float]:
        lever, base = self.sides
        # The rod end over a joint at the origin, with the base along the first axis.
        x = lever * math.cos(angle + self.offset)
        y = lever * math.sin(angle + self.offset)
        length = math.hypot(x - base, y)
        # The rod end moves across the lever; only its part along the cylinder makes that longer.
        return length, (-y * (x - base) + x * y) / length

    def chamber(self, which: int, angle: float, pressure: float) -> Chamber:
        """A rigid chamber on either side of the piston."""
        length, arm = self._length(angle)
        way = 1.0 if which == 0 else -1.0
        swept = self.areas[which] * way * (length - self.ends[which])
        return Chamber(self.dead[which] + swept, 0.0, way * self.areas[which] * arm)

    def pressure(self, which: int, angle: float, content: float) -> float:
        """The content over the volume."""
        return content / self.chamber(which, angle, 0.0).volume

    def torque(self, angle: float, pressure_1: float, pressure_2: float) -> float:
        """Both forces at the arm, above the atmosphere that pushes on the rod."""
        _, arm = self._length(angle)
        return arm * (self.areas[0] * (pressure_1 - self.room) - self.areas[1] * (pressure_2 - self.room))


class BladderJoint:
    """Volumes as a file has them: angle [deg], pressure [kPa_g] and one or two volumes [mL] a line."""

    def __init__(self, scenario: Scenario, file: Path) -> None:
        actuator = scenario.device.actuator
        with file.open(encoding="utf-8") as lines:
            rows = list(csv.reader(line for line in lines if not line.startswith("#")))
        measured = np.array([[float(cell) for cell in row] for row in rows[1:]])
        angles = np.unique(measured[:, 0])
        gauges = np.unique(measured[:, 1])
        self.room = scenario.device.supply.atmospheric_pressure
        self.pressures = self.room + 1.0e3 * gauges
        self.curves: list[CubicSpline | None] = [None, None]
        for which in range(measured.shape[1] - 2):
            volumes = np.array(
                [
                    [measured[(measured[:, 0] == a) & (measured[:, 1] == p), 2 + which][0] for p in gauges]
                    for a in angles
                ]
            )
            self.curves[which] = CubicSpline(np.radians(angles), 1.0e-6 * volumes)
        self.dead = actuator.dead_volume_1, actuator.dead_volume_2
        self.stiffness = actuator.passive_stiffness
        self.rest = actuator.rest_angle

    def _levels(self, which: int, angle: float, derivative: int = 0) -> Any:
        curve = self.curves[which]
        return np.zeros(self.pressures.size) if curve is None else curve(angle, derivative)

    def chamber(self, which: int, angle: float, pressure: float) -> Chamber:
        """Straight lines between measured pressures, constant beyond them."""
        levels = self._levels(which, angle)
        slopes = self._levels(which, angle, 1)
        place = int(np.searchsorted(self.pressures, pressure, side="right"))
        inside = 0 < place < self.pressures.size
        grows = (levels[place] - levels[place - 1]) / (self.pressures[place] - self.pressures[place - 1])
        return Chamber(
            self.dead[which] + float(np.interp(pressure, self.pressures, levels)),
            float(grows) if inside else 0.0,
            float(np.interp(pressure, self.pressures, slopes)),
        )

    def pressure(self, which: int, angle: float, content: float) -> float:
        """Bisection over the pressure: pressure times volume only grows with it."""
        levels = self._levels(which, angle)
        low = 0.0
        high = content / self.dead[which]
        while high - low > 1.0e-13 * high:
            middle = 0.5 * (low + high)
            if middle * (self.dead[which] + float(np.interp(middle, self.pressures, levels))) > content:
                high = middle
            else:
                low = middle
        return 0.5 * (low + high)

    def torque(self, angle: float, pressure_1: float, pressure_2: float) -> float:
        """The integral of the volume's slope over the pressure, by the trapezoidal rule that is exact here."""
        total = -self.stiffness * (angle - self.rest)
        for which, pressure in enumerate((pressure_1, pressure_2)):
            slopes = self._levels(which, angle, 1)
            knots = np.array([self.room, *self.pressures[(self.pressures > self.room) & (self.pressures < pressure)]])
            grid = np.append(knots, max(pressure, self.room))
            total += float(np.trapezoid(np.interp(grid, self.pressures, slopes), grid))
            # Below the atmosphere the volume is that of no pressure.
            total += min(pressure - self.room, 0.0) * float(slopes[0])
        return total
