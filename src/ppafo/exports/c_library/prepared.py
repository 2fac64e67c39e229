"""Data of the preparation of a run: settings by their names in C, and rows of settings.

``Preparation`` has all that does not depend on the numbers of the settings, ``PreparedLane`` all that does.
"""

from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.step.lane import Lane
from ppafo.model.actuators.kind import Range
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.controlled import CONTROLLED, Ends
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import Effect
from ppafo.model.gait import ShankSeries
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.simulation.declaration import LOCKED_ANGLE, SUPPLY_LINE, SUPPLY_LINES
from ppafo.simulation.numbers import path_of_locked_angle
from ppafo.simulation.plan import StepCounts
from ppafo.simulation.profiles import ProfileCourse
from ppafo.simulation.scenario import Leg, Scenario, vane_motion

VANE_ONLY_FIELDS = ("torque_constant", "displacement_per_radian")
"""Parameters of the vane without meaning for an actuator of another shape."""


class PreparedLane(Lane):
    """Numbers of one run by group, and intermediate numbers of its preparation."""

    counts_of_steps: StepCounts
    tolerance: float  # error that a step may have, over the default [-]
    needs_parts: bool  # True where the error decides about the parts of a step
    step: float  # length of a step [s]
    signal_steps: float  # whole steps in the delay of the sensors [-]
    command_steps: float  # whole steps in the dead time of the valve [-]
    fault: float  # place of the setting that breaks a rule on profiles, counted from 1; 0 for none [-]
    gas: Any
    device: Any


@dataclass(frozen=True, slots=True)
class Preparation:
    """Scenario and program of a library: all data that does not depend on the settings.

    ``places`` has the place of each setting in the library, counted from 1, by path.
    """

    scenario: Scenario
    program: Program
    places: Mapping[str, float] = field(default_factory=dict)

    @property
    def device(self) -> Device:
        """Device of the scenario."""
        return self.scenario.device

    @property
    def leg(self) -> Leg | None:
        """Leg on a prescribed shank, attached to the vane; None for other motions and in a walk."""
        return None if self.program.walks else vane_motion(self.scenario).leg

    @property
    def shank_numbers(self) -> dict[str, float]:
        """Numbers of a shank prescribed by a gait, by path."""
        assert self.leg is not None, "a shank is of a leg"
        return dict(zip(leaf_paths(ShankSeries, "shank"), numbers(self.leg.curves), strict=True))

    @property
    def plant_without_leg(self) -> str:
        """Variable name of the plant before a walking leg is added."""
        return "bare" if self.program.walks else "plant"

    @property
    def plant_of_vane(self) -> str:
        """Variable name of the plant before the shape of its actuator is set."""
        return self.plant_without_leg if self.program.actuator.shape is None else f"vane_{self.plant_without_leg}"

    @property
    def vane_only_fields(self) -> tuple[str, ...]:
        """Vane parameters without meaning for an actuator of another shape; empty for a vane."""
        return () if self.program.actuator.shape is None else VANE_ONLY_FIELDS

    @property
    def locked_angle(self) -> str:
        """Path of the setting for the angle of a locked joint."""
        return path_of_locked_angle(self.scenario) or LOCKED_ANGLE

    @property
    def reach(self) -> Callable[[Ends], tuple[float, float]] | None:
        """Function that returns the range of the reference; None for a reference that nothing limits."""
        return CONTROLLED[self.scenario.controlled].reach if self.scenario.follows_reference else None

    @property
    def moves_on_path(self) -> bool:
        """True for a joint that a profile moves."""
        return self.program.angle is not None and path_of_locked_angle(self.scenario) is None

    @property
    def flaw(self) -> Callable[[Any, Range], float] | None:
        """Function that finds a setting of the actuator at fault; None if declared limits suffice."""
        return ACTUATORS[self.device.actuator.kind].flaw

    @property
    def first_of_actuator(self) -> str:
        """Path of the first setting of an actuator that is no vane."""
        return f"actuator.{next(iter(self.device.actuator.settings))}"

    @property
    def has_rules(self) -> bool:
        """True if there are rules on the profiles, of knots or of what they may reach, or on the actuator."""
        return (
            self.flaw is not None
            or self.reach is not None
            or self.moves_on_path
            or any(path.endswith("time_02") for path in self.places)
        )

    @property
    def course_of_reference(self) -> ProfileCourse:
        """Reference over time."""
        return ProfileCourse(self.program.reference.value)

    @property
    def course_of_angle(self) -> ProfileCourse:
        """Prescribed angle over time."""
        assert self.program.angle is not None, "a joint on a path"
        return ProfileCourse(self.program.angle.value)

    def place_of(self, path: str) -> float:
        """Return the place of a setting in the library, counted from 1."""
        return self.places[path]

    @property
    def line_fields(self) -> list[str]:
        """Settings of droop, largest flow and volume of each supply line, then ``relieving``, which is no setting."""
        names = ("droop", "largest_flow", "volume")
        return [*(f"{SUPPLY_LINE}.{line}.{name}" for line in SUPPLY_LINES for name in names), "relieving"]

    @property
    def valve_settings(self) -> Any:
        """Class of the valve's settings."""
        return self.row("ValveSettings", names_of(VALVES[self.device.valve.kind].quantities))

    @property
    def actuator_settings(self) -> Any:
        """Class of the settings of an actuator that is no vane."""
        return self.row("ActuatorSettings", self.device.actuator.settings)

    @property
    def tables(self) -> list[Any]:
        """Table of a measured actuator as a list; empty for other actuators."""
        return [] if self.device.actuator.table is None else [self.device.actuator.table]

    def row(self, name: str, fields: Iterable[str]) -> Any:
        """Return a NamedTuple class of settings with the given field names."""
        new_class: Any = namedtuple
        row = new_class(name, list(fields), module=__name__)
        row.__doc__ = ""  # not the list of its fields, which stands in the library below it
        return row

    def section_row(self, name: str, *further: str) -> Any:
        """Return a NamedTuple class of a device section as visible to effects, with ``further`` fields."""
        fields = names_of(members(name, self.device.actuator.kind))
        return self.row(name.title().replace("_", ""), [*fields, *further])

    def effect_row(self, effect: Effect) -> Any:
        """Return a NamedTuple class of the settings of an effect."""
        return self.row(f"{effect.name.title().replace('_', '')}Settings", names_of(effect.quantities))

    def orifice_row(self, section: str) -> Any:
        """Return a NamedTuple class of orifice settings: ISO 6358 coefficients, or area and discharge coefficient."""
        if self.is_sonic(section):
            return self.row("SonicOrifice", ("sonic_conductance", "critical_ratio"))
        return self.row("Orifice", ("area", "discharge_coefficient"))

    def is_sonic(self, section: str) -> bool:
        """True for an orifice specified by ISO 6358 sonic conductance and critical ratio."""
        return isinstance(self.device.valve.orifice if section == "valve" else self.device.actuator.leak, SonicOrifice)

    def constant(self, row: Any) -> Any:
        """Return a NamedTuple of constants that no setting changes, converted to floats."""
        return rebuilt(type(row), numbers(row))


def names_of(quantities: Iterable[Quantity]) -> list[str]:
    """Return the names of declared quantities."""
    return [quantity.name for quantity in quantities]
