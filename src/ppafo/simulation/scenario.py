"""Scenario: one device in one experiment, as frozen values in SI units.

``load_scenario`` reads one from a file; in Python, ``dataclasses.replace`` changes a value and ``controlled_by`` lets
an object of your own control the valve.
"""

import contextlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol

from ppafo.control.kind import OPEN_LOOP, PythonController
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES
from ppafo.documents.json_text import plain
from ppafo.engine.scheme.pneumatics import KEPT_OF_PRESSURE
from ppafo.errors import ScenarioError
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Number
from ppafo.parameters.device import Device, Supply, held
from ppafo.parameters.graph import Graph, outside
from ppafo.simulation.motion_kind import MOTIONS, WALK, MotionKind

if TYPE_CHECKING:
    from ppafo.control.kind import ControllerKind
    from ppafo.model.regulator import SupplyLines
    from ppafo.parameters import ParameterSet

PYTHON_CONTROLLER = "python"
LARGEST_SEED = 2**32 - 1
"""Largest random seed, of noise and of draws (32 bits), exactly representable in a column of floats."""

PRESSURE_WORDS = {
    "supply": "pressure",
    "dorsiflexion_supply": "dorsiflexion_pressure",
    "atmosphere": "atmospheric_pressure",
}
"""Words for the pressures of the device, mapped to the names of these pressures in its supply."""

UNITS = "SI: kg, m, s, K, mol; angles in rad, pressures in Pa absolute, torques in N m"


@dataclass(frozen=True, slots=True)
class ProfileChoice:
    """Profile (function of time): kind in ``control.catalog.PROFILES``; settings in SI units, also as attributes."""

    kind: str
    settings: Mapping[str, float]
    HELD: ClassVar[tuple[str, ...]] = ("settings",)

    def __getattr__(self, name: str) -> Any:
        """Return a setting by its name."""
        return held(self, name)


@dataclass(frozen=True, slots=True)
class Leg:
    """Foot on a shank with prescribed motion, without ground contact. Equation (11) with a prescribed shank.

    ``shank_length`` [m] is from knee to ankle; ``foot_mass_centre`` [m] from the ankle to the foot's centre of mass;
    ``foot_mass`` [kg]; ``foot_inertia`` [kg m^2] about the centre of mass; ``toe_lever`` [m] from the ankle to the
    toes, used only for the toe height. ``ankle_torque`` [N m] is T_2, positive in plantarflexion. ``shank`` is the
    profile of the shank angle [rad], upright at 0. With the kind ``gait``, ``gait`` is the name of the gait and
    ``curves``, a ``model.gait.ShankSeries``, its motion of shank and knee, which starts at the phase ``start``
    [strides].

    Defaults are the paper's subject (after equation (12)), with the centre of mass half way along a foot of 0.18 m.
    """

    shank_length: Annotated[float, Number("m", "knee to ankle", 0.46, 0.1, 1.0)]
    foot_mass_centre: Annotated[float, Number("m", "ankle to the mass centre of the foot", 0.09, 0.0, 0.5)]
    foot_mass: Annotated[float, Number("kg", "mass of the foot", 1.0, 0.05, 10.0)]
    foot_inertia: Annotated[float, Number("kg m^2", "inertia of the foot about its mass centre", 0.001, 1.0e-5, 1.0)]
    toe_lever: Annotated[float, Number("m", "ankle forward to the toes", 0.18, 0.0, 0.5)]
    ankle_torque: Annotated[
        float, Number("N m", "constant torque T_2 of the wearer's ankle, plantarflexion above 0", 0.0, -1.0e3, 1.0e3)
    ]
    shank: ProfileChoice
    gait: str = ""
    curves: Any = None


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """The vane moves freely under the torques on it, alone or with the foot of a leg.

    Starts at ``angle`` [rad] with ``angular_velocity`` [rad/s]; ``external_torque`` [N m] is the constant T_ex of
    equation (1), positive if it opposes plantarflexion. With a ``leg``, T_ex follows from equation (11).
    """

    angle: Annotated[
        float, Number("rad", "angle of the vane, 90 deg neutral, growing in plantarflexion", None, -10.0, 10.0)
    ]
    angular_velocity: Annotated[float, Number("rad/s", "angular velocity at the start", 0.0, -1.0e4, 1.0e4)] = 0.0
    external_torque: Annotated[
        float, Number("N m", "constant torque T_ex, above 0 against plantarflexion", 0.0, -1.0e4, 1.0e4)
    ] = 0.0
    leg: Leg | None = None
    profile: ClassVar[None] = None
    locked_angle: ClassVar[None] = None
    stride_time: ClassVar[float] = 0.0
    HELD: ClassVar[tuple[str, ...]] = ("leg",)

    def __getattr__(self, name: str) -> Any:
        """Return a number of the leg by its name."""
        return held(self, name)

    @property
    def motion_kind(self) -> MotionKind:
        """Kind of this motion: its contribution to the runs."""
        return MOTIONS["free" if self.leg is None else "leg"]

    @property
    def outside_torque(self) -> Any:
        """Constant torque [N m] against plantarflexion; with a leg -T_2 of equation (11)."""
        return self.external_torque if self.leg is None else -self.leg.ankle_torque

    @property
    def label(self) -> str:
        """Short description of the motion."""
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
    """The angle of the vane [rad] is a given function of time; a locked vane has a constant profile.

    ``kind`` is the motion as named in a file, ``locked`` or ``prescribed``.
    """

    profile: ProfileChoice
    kind: str = "prescribed"
    leg: ClassVar[None] = None
    outside_torque: ClassVar[float] = 0.0
    stride_time: ClassVar[float] = 0.0

    @property
    def motion_kind(self) -> MotionKind:
        """Kind of this motion: its contribution to the runs."""
        return MOTIONS[self.kind]

    @property
    def locked_angle(self) -> Any:
        """Angle [rad] of a locked vane; None if the vane moves."""
        return self.profile.level if self.profile.kind == "constant" else None

    @property
    def label(self) -> str:
        """Short description of the motion."""
        level = self.profile.settings.get("level", math.nan)
        if self.profile.kind == "constant":
            return f"locked at {math.degrees(level):.4g} deg"
        return f"prescribed, along the profile {self.profile.kind}"


def locked_vane(angle: float) -> PrescribedMotion:
    """Return the motion of a vane locked at an angle [rad]: both chambers have fixed volumes."""
    return PrescribedMotion(ProfileChoice("constant", {"level": angle}), "locked")


class Motion(Protocol):
    """Motion of the ankle: a vane alone, or a walking leg with the device."""

    @property
    def motion_kind(self) -> MotionKind:
        """Kind of this motion: its contribution to the runs."""

    @property
    def label(self) -> str:
        """Short description of the motion."""

    @property
    def locked_angle(self) -> Any:
        """Angle [rad] of a locked vane; None if the vane moves."""

    @property
    def stride_time(self) -> float:
        """Stride time [s]; 0 for a motion without strides."""


VaneMotion = FreeMotion | PrescribedMotion
"""Motions of a vane alone."""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Times of a run [s], and the allowed pressure error divided by the pressure range [-] for step-size control.

    ``step`` is the largest step (the engine divides it for a faster chamber) and divides ``duration``,
    ``output_interval`` and the sample period of the controller. With the default tolerance the error stays below 1e-3
    of the pressure range and below 2e-4 of the angle range.
    """

    duration: Annotated[float, Number("s", "length of the run", None, 0.0, 1.0e6, minimum_allowed=False)]
    step: Annotated[
        float, Number("s", "largest step; 1 ms unless given, less where a sample comes sooner", 1.0e-3, 1.0e-8, 1.0e3)
    ]
    output_interval: Annotated[
        float, Number("s", "time between two recorded samples; the step unless given", 1.0e-3, 1.0e-8, 1.0e6)
    ]
    tolerance: Annotated[
        float,
        Number(
            "1", "allowed pressure error of the steps, relative to the pressure range", KEPT_OF_PRESSURE, 1.0e-6, 0.1
        ),
    ] = KEPT_OF_PRESSURE


@dataclass(frozen=True, slots=True)
class Initial:
    """Initial pressures of both chambers [Pa absolute]."""

    pressure_1: Annotated[
        float, Number("Pa_a", "pressure in chamber 1 at the start", None, 1.0e3, 1.0e8, words=tuple(PRESSURE_WORDS))
    ]
    pressure_2: Annotated[
        float, Number("Pa_a", "pressure in chamber 2 at the start", None, 1.0e3, 1.0e8, words=tuple(PRESSURE_WORDS))
    ]


@dataclass(frozen=True, slots=True)
class GasModel:
    """Gas with an energy balance: heat transfer coefficient [W/(m^2 K)], wall area per chamber volume [1/m].

    Walls, supply and surroundings have the temperature of the device's gas. A coefficient of 0 is adiabatic; a very
    large one gives the isothermal gas of the paper.
    """

    heat_transfer_coefficient: Annotated[
        float, Number("W/(m^2 K)", "between gas and walls; 0 is adiabatic", None, 0.0, 1.0e9)
    ]
    wall_area_per_volume: Annotated[
        float, Number("1/m", "area of a chamber's walls over its volume; needed unless adiabatic", 0.0, 0.0, 1.0e6)
    ] = 0.0


@dataclass(frozen=True, slots=True)
class RegulatedLine:
    """Regulator with its downstream line: droop [Pa s/kg], largest mass flow [kg/s], line volume [m^3]."""

    droop: Annotated[float, Number("Pa s/kg", "fall of the line pressure per mass flow", None, 1.0, 1.0e10)]
    largest_flow: Annotated[float, Number("kg/s", "maximum mass flow of the regulator", None, 1.0e-6, 1.0)]
    volume: Annotated[float, Number("m^3", "volume between regulator and valve", None, 1.0e-6, 1.0e-2)]


@dataclass(frozen=True, slots=True)
class SupplyLine:
    """Both supply lines: downstream of the bottle's regulator, and of the second regulator, fed by the first line."""

    plantarflexion: RegulatedLine
    dorsiflexion: RegulatedLine

    def row(self, supply: Supply) -> "SupplyLines":
        """Return the lines as engine parameters; their regulators relieve if those of the supply do."""
        from ppafo.model.regulator import SupplyLines

        lines = self.plantarflexion, self.dorsiflexion
        first, second = ((line.droop, line.largest_flow, line.volume) for line in lines)
        return SupplyLines(*first, *second, float(supply.relieving))


@dataclass(frozen=True, slots=True)
class Sensors:
    """Sensors of the controller, ideal by default.

    ``delay`` [s] is the age of a measurement when the controller uses it; ``angle_noise`` [rad] and ``pressure_noise``
    [Pa] are standard deviations; ``angle_resolution`` [rad] and ``pressure_resolution`` [Pa] are quantisation steps;
    ``seed`` is the seed of the noise. ``angle_bandwidth`` and ``pressure_bandwidth`` [Hz] are first-order bandwidths, 0
    for no lag.
    """

    delay: Annotated[float, Number("s", "age of a measurement when the controller uses it", 0.0, 0.0, 1.0e6)] = 0.0
    angle_noise: Annotated[float, Number("rad", "standard deviation of the measured angle", 0.0, 0.0, 10.0)] = 0.0
    pressure_noise: Annotated[
        float, Number("Pa_d", "standard deviation of the measured pressures", 0.0, 0.0, 1.0e8)
    ] = 0.0
    angle_resolution: Annotated[float, Number("rad", "resolution of the measured angle", 0.0, 0.0, 10.0)] = 0.0
    pressure_resolution: Annotated[float, Number("Pa_d", "resolution of the measured pressures", 0.0, 0.0, 1.0e8)] = 0.0
    seed: Annotated[int, Number("", "seed of the noise, a whole number", 1.0, 0.0, float(LARGEST_SEED), whole=True)] = 1
    angle_bandwidth: float = 0.0
    pressure_bandwidth: float = 0.0

    @property
    def flaws(self) -> tuple[float, ...]:
        """Imperfections of the sensors [s, rad, Pa, rad, Pa, Hz, Hz]; all 0 for ideal sensors."""
        noise = (self.angle_noise, self.pressure_noise)
        steps = (self.angle_resolution, self.pressure_resolution)
        return self.delay, *noise, *steps, self.angle_bandwidth, self.pressure_bandwidth


@dataclass(frozen=True, slots=True)
class Control:
    """Sampled controller: kind in ``control.catalog.CONTROLLERS``, settings in SI units, sample period [s].

    Settings are also attributes: ``controller.proportional_gain``. The kind ``python`` has no settings; the object
    ``custom`` is called at each sample.
    """

    kind: str
    settings: Mapping[str, float]
    period: float
    custom: PythonController | None = None
    HELD: ClassVar[tuple[str, ...]] = ("settings",)

    @property
    def is_open_loop(self) -> bool:
        """True for a constant command, which follows no reference and reads no sensor."""
        return self.kind == OPEN_LOOP

    @property
    def is_outside(self) -> bool:
        """True if the command comes from a Python object or from the caller."""
        return self.kind == PYTHON_CONTROLLER

    def __getattr__(self, name: str) -> Any:
        """Return a setting by its name."""
        return held(self, name)


@dataclass(frozen=True, slots=True)
class Assumption:
    """Assumed value without a source: its path in the scenario, the value as written, and the reason for it."""

    path: str
    value: str
    note: str


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin of a scenario: file, parameter set, valve, overrides and the document of the file.

    ``replaced`` is a sentence on values of the file that replace values of another set, or that the file gives for
    another ``kind``, else "". ``parameters`` is the set with all overrides.
    """

    file: str | None
    parameter_set: str
    valve: str
    overrides: tuple[str, ...]
    content: Mapping[str, Any]
    replaced: str = ""
    parameters: "ParameterSet | None" = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True, repr=False)
class Scenario:
    """Scenario: a device in one experiment, in SI units.

    The reference is a torque [N m] or, according to ``controlled`` (``model.controlled``), an angle [rad] or a pressure
    [Pa]. ``beyond_reach`` is the reason for a reference that is beyond the device's reach on purpose, else "". Without
    ``gas_model`` the gas is isothermal, and without ``supply_line`` the supply pressures are constant, both as in the
    paper. ``links`` define which numbers of the scenario follow other numbers that are varied; the device has its own.
    """

    name: str
    description: str
    device: Device
    run: RunSettings
    motion: Motion
    initial: Initial
    controller: Control
    reference: ProfileChoice
    sensors: Sensors
    assumptions: tuple[Assumption, ...]
    origin: Origin
    gas_model: GasModel | None = None
    supply_line: SupplyLine | None = None
    links: Graph = field(default_factory=dict, compare=False)
    controlled: str = TORQUE
    beyond_reach: str = ""

    def __repr__(self) -> str:
        """Return name, device, valve, motion, controller and duration, each on its own line."""
        control = self.controller
        law = control.kind if control.custom is None else f"{control.kind}, {type(control.custom).__name__}"
        return (
            f"Scenario '{self.name}'\n"
            f"  device      {self.device.name}, valve {self.device.valve_name}\n"
            f"  motion      {self.motion.label}\n"
            f"  controller  {law}, every {control.period:g} s\n"
            f"  duration    {self.run.duration:g} s, in steps of at most {self.run.step:g} s"
        )

    @property
    def supply_lines(self) -> "SupplyLines | None":
        """Regulators and lines as engine parameters; None for constant supply pressures."""
        return None if self.supply_line is None else self.supply_line.row(self.device.supply)

    @property
    def law(self) -> "ControllerKind | None":
        """Catalogue entry of the controller, extended for the motion; None for a Python object."""
        return None if self.controller.is_outside else self.motion.motion_kind.law(self)

    @property
    def stiffness(self) -> Any:
        """Stiffness of the gas divided by its isothermal stiffness [-]: above 1 for gas with an energy balance."""
        return 1.0 if self.gas_model is None else self.device.gas.heat_capacity_ratio

    @property
    def follows_reference(self) -> bool:
        """True if the controller follows the scenario's reference: False for a constant command and for a walk."""
        return self.motion.motion_kind.layout != WALK and not self.controller.is_open_loop

    @property
    def graph(self) -> Graph:
        """Links of the device and of the scenario, in this order."""
        # Sources stand before what follows them, and a scenario's numbers follow the device's.
        return {**self.device.links, **self.links}

    def controlled_by(self, controller: PythonController) -> "Scenario":
        """Return the scenario controlled by any object that has ``reset`` and ``update``, at the same sample period.

        Raises ScenarioError for a class, and for an object without these methods.
        """
        # A class has both methods too, and would fail only when it runs.
        if isinstance(controller, type):
            name = controller.__name__
            raise ScenarioError(f"{self.name}: {name} is a class; give an instance, as in controlled_by({name}())")
        for method in ("reset", "update"):
            found = None
            with contextlib.suppress(Exception):  # the attributes of a foreign object may raise anything
                found = getattr(controller, method, None)
            if not callable(found):
                kind = type(controller).__name__
                needs = "it needs 'reset()' and 'update(time, reference, measurement)'"
                raise ScenarioError(f"{self.name}: a controller of type {kind} has no method '{method}'; {needs}")
        # A law that requests a torque in a walk leaves its request to the object.
        names = [quantity.name for quantity in ASSISTING_QUANTITIES]
        settings = self.controller.settings
        requests = self.motion.motion_kind.layout == WALK and settings.keys() >= set(names)
        settings = {name: settings[name] for name in names} if requests else {}
        changed = with_control(self, Control(PYTHON_CONTROLLER, settings, self.controller.period, controller))
        # The torque that a walk requests still follows the device.
        kept = {path: links for path, links in self.links.items() if path.removeprefix("controller.") in settings}
        return replace(changed, links={**changed.links, **kept})


def vane_motion(scenario: Scenario) -> VaneMotion:
    """Motion of a scenario of a vane alone; ScenarioError for a leg that walks with the device."""
    if isinstance(scenario.motion, FreeMotion | PrescribedMotion):
        return scenario.motion
    raise ScenarioError(f"{scenario.name}: its motion is {scenario.motion.label}, but it must not walk here")


def sensor_noise(scenario: Scenario) -> Any:
    """Sum of all noise levels and lost fractions of the controller's sensors, which is 0 only without noise."""
    forces = getattr(scenario.motion, "forces", {}).items()
    own = (number for name, number in forces if name == "force_noise" or name.endswith("lost_share"))
    return sum(own, scenario.sensors.angle_noise + scenario.sensors.pressure_noise)


def scenario_document(scenario: Scenario) -> dict[str, Any]:
    """Return the whole scenario with every number of the device, in SI units, as data that can be written as JSON."""
    return {"units": UNITS, **plain(scenario)}


def with_control(scenario: Scenario, control: Control) -> Scenario:
    """Return a scenario with another control; settings of the previous controller no longer follow other numbers."""
    return replace(scenario, controller=control, links=outside(scenario.links, "controller", "timing"))
