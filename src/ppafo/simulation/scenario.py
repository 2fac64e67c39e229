"""What is run: one device in one experiment, as frozen values in SI units.

``load_scenario`` makes one from a file; in Python, ``dataclasses.replace`` changes a value and ``controlled_by`` puts
an object of your own in charge of the valve.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from ppafo.control.kind import PythonController
from ppafo.documents.json_text import plain
from ppafo.engine.scheme.pneumatics import KEPT_OF_PRESSURE
from ppafo.errors import ScenarioError
from ppafo.model.gait import ShankSeries
from ppafo.model.regulator import SupplyLines
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph

PYTHON_CONTROLLER = "python"

UNITS = "SI: kg, m, s, K, mol; angles in rad, pressures in Pa absolute, torques in N m"


@dataclass(frozen=True, slots=True)
class ProfileChoice:
    """A function of time: its kind in ``control.catalog.PROFILES`` and all its settings in SI units."""

    kind: str
    settings: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Leg:
    """A foot on a shank that is led, without ground. Equation (11) with a prescribed shank.

    Mass of the foot [kg], from the ankle to its mass centre [m], inertia about that [kg m^2], length of the shank [m],
    from the ankle to the toes [m], which nothing but the height of the toes asks for.
    ``ankle_torque`` [N m] is T_2, positive in plantarflexion. ``shank`` is its angle in time [rad], upright at 0; with
    the kind ``gait`` that of a ``gait`` by its ``curves``, whose knee moves too, from the phase ``start`` [strides] on.
    """

    foot_mass: float
    foot_mass_centre: float
    foot_inertia: float
    shank_length: float
    toe_lever: float
    ankle_torque: float
    shank: ProfileChoice
    gait: str = ""
    curves: ShankSeries | None = None


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """The vane moves as the torques demand, alone or with the foot of a leg.

    Starts at ``angle`` [rad] with ``angular_velocity`` [rad/s]; ``external_torque`` [N m] is the constant T_ex of
    equation (1), positive where it works against plantarflexion. With a ``leg`` T_ex follows from equation (11).
    """

    angle: float
    angular_velocity: float = 0.0
    external_torque: float = 0.0
    leg: Leg | None = None

    @property
    def label(self) -> str:
        """The motion in a few words."""
        start = f"from {math.degrees(self.angle):.4g} deg"
        if self.leg is None:
            return f"free, {start}"
        shank = self.leg.shank
        level = shank.settings.get("level", math.nan)
        at_rest = f"at rest at {math.degrees(level):.4g} deg"
        led = at_rest if shank.kind == "constant" else f"led along the profile {shank.kind}"
        led = f"of gait {self.leg.gait}" if self.leg.gait else led
        return f"a foot that is free, {start}, on a shank {led}"


@dataclass(frozen=True, slots=True)
class PrescribedMotion:
    """The angle of the vane [rad] is a given function of time; that of a held vane is a constant profile.

    ``kind`` is the kind of motion that a file names, ``held`` or ``prescribed``.
    """

    profile: ProfileChoice
    kind: str = "prescribed"

    @property
    def label(self) -> str:
        """The motion in a few words."""
        level = self.profile.settings.get("level", math.nan)
        if self.profile.kind == "constant":
            return f"held at {math.degrees(level):.4g} deg"
        return f"prescribed, along the profile {self.profile.kind}"


@dataclass(frozen=True, slots=True)
class MotionKind:
    """What a motion of a leg that wears the device brings to the runs of its scenarios, as functions of the scenario.

    ``plan`` gives the run and what may be wrong with it, as ``plan_runs`` does; ``rules`` which numbers contradict each
    other. Any number may be an array (runs,) in both. ``quantities`` declares the numbers of the scenario beside those
    of its device, ``places`` says by path which attributes lead to those that are not where all scenarios have them.
    ``clock(scenario, times)`` gives the clock with other times [s], which may be arrays too, and what is wrong with it.
    ``noise`` is the sum of all levels of noise that its controller receives, ``switches`` are settings that are 0 for
    all runs of a program or for none. ``lacks(scenario, metric)`` says why it has not what a metric needs, an empty
    text where it has it. ``measured(scenario, run, times, rows)`` gives recording and metrics of rows (samples,) by
    path, and how a run that was completed ended, in words.
    """

    name: str
    plan: Callable[..., Any]
    rules: Callable[..., Any]
    quantities: Callable[..., Any]
    places: Mapping[str, tuple[str, ...]]
    clock: Callable[..., Any]
    switches: Callable[..., tuple[Any, ...]]
    noise: Callable[..., Any]
    lacks: Callable[..., str]
    measured: Callable[..., Any]


class WornMotion(Protocol):
    """The motion of a leg that wears the device, which a room above this one knows."""

    @property
    def kind(self) -> MotionKind:
        """What it brings to the runs of its scenarios."""

    @property
    def label(self) -> str:
        """The motion in a few words."""


VaneMotion = FreeMotion | PrescribedMotion
"""The motions of a vane alone."""


@dataclass(frozen=True, slots=True)
class Thermal:
    """Gas with an energy balance: heat transfer coefficient [W/(m^2 K)], area of the walls over the volume [1/m].

    The walls, the source and the room have the temperature of the device's gas. A coefficient of 0 is adiabatic; a
    very large one gives the isothermal gas of the paper.
    """

    heat_transfer_coefficient: float
    area_per_volume: float


@dataclass(frozen=True, slots=True)
class Sensors:
    """What the controller sees, ideal by default.

    Age of a measurement when it is used [s], standard deviations [rad], [Pa], steps of quantisation [rad], [Pa], the
    seed of the noise, and first-order bandwidths of the angle sensor and the pressure sensors [Hz], 0 for none.
    """

    delay: float = 0.0
    angle_noise: float = 0.0
    pressure_noise: float = 0.0
    angle_resolution: float = 0.0
    pressure_resolution: float = 0.0
    seed: int = 1
    angle_bandwidth: float = 0.0
    pressure_bandwidth: float = 0.0

    @property
    def flaws(self) -> tuple[float, ...]:
        """What makes these sensors worse than ideal ones [s, rad, Pa, rad, Pa, Hz, Hz]; each 0 where it does not."""
        noise, steps = (self.angle_noise, self.pressure_noise), (self.angle_resolution, self.pressure_resolution)
        return self.delay, *noise, *steps, self.angle_bandwidth, self.pressure_bandwidth


@dataclass(frozen=True, slots=True)
class Control:
    """A sampled controller: kind in ``control.catalog.CONTROLLERS``, settings in SI units, sample period [s].

    With kind ``python`` there are no settings and ``custom`` is asked sample by sample.
    """

    kind: str
    settings: Mapping[str, float]
    period: float
    custom: PythonController | None = None

    @property
    def label(self) -> str:
        """The controller in a few words."""
        name = self.kind if self.custom is None else f"{self.kind}, {type(self.custom).__name__}"
        return f"{name}, every {self.period:g} s"


@dataclass(frozen=True, slots=True)
class Assumption:
    """A value that no source gives: its path in the scenario, the value as written, and why this one."""

    path: str
    value: str
    note: str


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a scenario comes from, for the record: file, parameter set, valve, overrides and what the file said."""

    file: str | None
    parameter_set: str
    valve: str
    overrides: tuple[str, ...]
    content: dict[str, Any]


@dataclass(frozen=True, slots=True, repr=False)
class Scenario:
    """A device in one experiment.

    Times [s]: ``time_step`` is the largest step (the engine divides it where a chamber is faster) and divides
    ``duration``, ``output_interval`` and the sample period of ``control``. Initial pressures [Pa absolute]; the
    reference is a torque [N m]. Without ``thermal`` the gas keeps its temperature, without ``supply_lines`` the supply
    pressures are constant, both as in the paper. ``tolerance`` is the error of a pressure over the pressure range [-]
    that the step size control keeps to. ``links`` say which numbers follow others that are varied, beside those of the
    device.
    """

    name: str
    description: str
    device: Device
    duration: float
    time_step: float
    output_interval: float
    motion: VaneMotion | WornMotion
    initial_pressure_1: float
    initial_pressure_2: float
    control: Control
    reference: ProfileChoice
    sensors: Sensors
    assumptions: tuple[Assumption, ...]
    origin: Origin
    thermal: Thermal | None = None
    supply_lines: SupplyLines | None = None
    tolerance: float = KEPT_OF_PRESSURE
    links: Graph = field(default_factory=dict, compare=False)

    def __repr__(self) -> str:
        """Return name, device, valve, motion, controller and duration, a line each."""
        return (
            f"Scenario '{self.name}'\n"
            f"  device      {self.device.name}, valve {self.device.valve_name}\n"
            f"  motion      {self.motion.label}\n"
            f"  controller  {self.control.label}\n"
            f"  duration    {self.duration:g} s, in steps of at most {self.time_step:g} s"
        )

    @property
    def effect_sections(self) -> dict[str, Any]:
        """Settings of effects beside those of the device, by section."""
        return {"sensors": self.sensors}

    @property
    def graph(self) -> Graph:
        """All links, those of the device first."""
        return {**self.device.links, **self.links}

    def controlled_by(self, controller: PythonController) -> "Scenario":
        """Return the scenario with any object that has ``reset`` and ``update``, at the same sample period.

        ScenarioError for a class, or for an object without these methods.
        """
        if isinstance(controller, type):
            name = controller.__name__
            raise ScenarioError(
                f"{self.name}: {name} is a class; give an instance of it, as in controlled_by({name}())"
            )
        for method in ("reset", "update"):
            if not callable(getattr(controller, method, None)):
                kind = type(controller).__name__
                raise ScenarioError(
                    f"{self.name}: a controller of type {kind} has no method '{method}'; it needs 'reset()' and "
                    f"'update(time, reference, measurement)', the latter returning a command from -1 to 1"
                )
        own = ("controller.", "timing.")
        links = {path: link for path, link in self.links.items() if not path.startswith(own)}
        return replace(self, control=Control(PYTHON_CONTROLLER, {}, self.control.period, controller), links=links)


def vane_motion(scenario: Scenario) -> VaneMotion:
    """The motion of a scenario of a vane alone; ScenarioError for a leg that wears the device."""
    if isinstance(scenario.motion, FreeMotion | PrescribedMotion):
        return scenario.motion
    raise ScenarioError(f"{scenario.name}: is {scenario.motion.label}, and here a scenario without a wearer is needed")


def worn_kind(scenario: Scenario) -> MotionKind | None:
    """What the motion of a leg that wears the device brings, None for a vane alone."""
    motion = scenario.motion
    return None if isinstance(motion, FreeMotion | PrescribedMotion) else motion.kind


def scenario_document(scenario: Scenario) -> dict[str, Any]:
    """Return the whole scenario with every number of the device, in SI units, as data that JSON can hold."""
    document: dict[str, Any] = plain(scenario)
    lines = scenario.supply_lines
    document["supply_lines"] = None if lines is None else plain(lines._asdict())
    return {"units": UNITS, **document}
