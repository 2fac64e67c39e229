"""Motions of a vane alone: locked, free, along a profile, or with the foot of a leg.

Each motion declares its section of a file, and how that section is read and checked against the device's stops. Code
that only a run or an ensemble needs is imported on use.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.errors import DataError, ScenarioError
from ppafo.model import controlled
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import kind_at, value_at
from ppafo.parameters.device import Device
from ppafo.simulation.declaration import (
    ANGLE,
    ANGLE_LEVEL,
    FREE,
    GAIT_SHANK,
    LEG,
    LOCKED_ANGLE,
    SUPPLY_LINE,
    THERMAL,
    profile_settings,
    quantities,
    shank_settings,
)
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.motion_kind import VANE, LawSignals, Measured, MotionSection, ProfileTable, RunTimes
from ppafo.simulation.profiles import TOLERANCE, profile_problem, read_profile, stops_of
from ppafo.simulation.scenario import FreeMotion, Leg, PrescribedMotion, ProfileChoice, Scenario, vane_motion
from ppafo.units.shown import shown_text
from ppafo.wording import one_line

if TYPE_CHECKING:
    from ppafo.engine.lanes import Floats
    from ppafo.engine.run import Run
    from ppafo.metrics.metric import MetricKind
    from ppafo.model.columns import Problem

_PROFILE, _SHANK = "motion.profile", "motion.shank"


@dataclass(frozen=True, slots=True, eq=False)
class VaneKind:
    """Type of motion of a vane alone; code that only its runs need is imported on use.

    Motions differ in their section of the file, in the planning of a run, and in the recorded channels.
    """

    name: str
    section: MotionSection
    plan: "Callable[[Scenario], tuple[Run, tuple[Problem, ...]]]"
    measured: "Callable[[Scenario, Run, Floats, Mapping[str, Floats]], Measured]"
    places: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    layout: ClassVar[str] = VANE
    command: ClassVar[str] = "simulate"
    python_call: ClassVar[str] = "ppafo.simulate({name!r}, [{overrides}])"
    is_measured_at_once: ClassVar[bool] = False
    is_repeated_for_its_error: ClassVar[bool] = True

    def contradictory_numbers(self, scenario: Scenario) -> "tuple[Problem, ...]":
        """Return the problems of contradictory numbers: vane beyond a stop, delay too long."""
        from ppafo.simulation.ensemble.vane import contradictory_numbers

        return contradictory_numbers(scenario)

    def quantities(self, scenario: Scenario) -> dict[str, Quantity]:
        """Return the declarations of all numbers of a scenario except those of its device, keyed by path."""
        profile = self.section.profile
        moved = {} if profile is None else {profile.name: {"kind": getattr(scenario.motion, profile.name).kind}}
        document: dict[str, Any] = {
            "motion": moved,
            "controller": {"kind": scenario.controller.kind},
        }
        # A constant command follows no reference, whatever the scenario has in its place.
        if self.follows_reference(scenario):
            document["reference"] = {"kind": scenario.reference.kind, "of": scenario.controlled}
        document |= {} if scenario.gas_model is None else {"gas_model": {"kind": THERMAL}}
        document |= {} if scenario.supply_line is None else {SUPPLY_LINE: {}}
        declared = quantities(document, self.section)
        # Numbers that are not where their path says come last, where those of a vane are listed.
        return declared | {path: declared.pop(path) for path in self.places if path in declared}

    def clock(self, scenario: Scenario, times: Mapping[str, Any]) -> "tuple[RunTimes, tuple[Problem, ...]]":
        """Return the clock with other times [s], by path, and the problems of contradictory times."""
        from ppafo.simulation.ensemble.vane import clock

        return clock(scenario, times)

    def switches(self, scenario: Scenario) -> tuple[Any, ...]:
        """Return the imperfections of the sensors; in one program each is either 0 for all runs or nonzero for all."""
        return scenario.sensors.flaws

    def noise(self, scenario: Scenario) -> Any:
        """Return the sum of the standard deviations of all sensor noise, which is 0 only without noise."""
        return scenario.sensors.angle_noise + scenario.sensors.pressure_noise

    def law(self, scenario: Scenario) -> ControllerKind:
        """Return the catalogue entry of the scenario's controller."""
        return CONTROLLERS[scenario.controller.kind]

    def sees(self, scenario: Scenario) -> LawSignals:
        """Return the signals that the controller reads, for a joint with or without a foot."""
        motion = vane_motion(scenario)
        if scenario.controlled == controlled.ANGLE:
            return LawSignals(scenario.reference.kind, "reference", has_leg=motion.leg is not None)
        if self.name == "locked":
            return LawSignals(is_locked=True)
        return LawSignals(motion.profile.kind if isinstance(motion, PrescribedMotion) else "", "motion.profile")

    def follows_reference(self, scenario: Scenario) -> bool:
        """Tell whether the controller follows a reference: False for a constant command."""
        return not scenario.controller.is_open_loop

    def asks_gradually(self, law: ControllerKind) -> bool:
        """Tell whether a controller commands partial valve openings to follow a reference."""
        return law.needs_reference and not law.only_switches

    def lacks(self, scenario: Scenario, metric: "MetricKind") -> str:
        """Return the reason why a metric does not apply to a scenario; "" if it applies."""
        from ppafo.simulation.ensemble.vane import lacks

        return lacks(scenario, metric)

    def further_command(self, _file: str) -> str:
        """Return an empty text: ``simulate`` reports everything about a vane alone."""
        return ""


def _plan(scenario: Scenario) -> "tuple[Run, tuple[Problem, ...]]":
    from ppafo.simulation.plan import plan_vane

    return plan_vane(scenario)


def _measured(scenario: Scenario, run: "Run", times: "Floats", rows: "Mapping[str, Floats]") -> Measured:
    from ppafo.simulation.vane_recording import measured_vane

    return measured_vane(scenario, run, times, rows)


def _read_angle(reading: DocumentReader, device: Device) -> float:
    """Return the angle [rad] of the vane; ScenarioError if it is not between the stops of the device."""
    angle, stops = reading.number(LOCKED_ANGLE, ANGLE), (device.actuator.angle_min, device.actuator.angle_max)
    if not stops[0] - TOLERANCE <= angle <= stops[1] + TOLERANCE:
        low, high = (shown_text(stop, "rad") for stop in stops)
        raise reading.refusal(LOCKED_ANGLE, f"must be between the stops of {device.name}, {low} to {high}")
    return angle


def _read_free(reading: DocumentReader, device: Device, _duration: float, _step: float, _folder: Path) -> FreeMotion:
    _read_angle(reading, device)
    numbers = reading.section("motion", FREE)
    return FreeMotion(numbers["angle"], numbers["angular_velocity"], numbers["external_torque"])


FREE_MOTION = VaneKind(
    name="free", section=MotionSection("the torques move the vane", FREE, _read_free), plan=_plan, measured=_measured
)
"""Free motion by equation (1), with a constant external torque."""


def _read_locked(
    reading: DocumentReader, device: Device, _duration: float, _step: float, _folder: Path
) -> PrescribedMotion:
    return PrescribedMotion(ProfileChoice("constant", {"level": _read_angle(reading, device)}), "locked")


LOCKED_MOTION = VaneKind(
    name="locked",
    section=MotionSection("the vane stays at one angle", (ANGLE,), _read_locked),
    plan=_plan,
    measured=_measured,
    places={LOCKED_ANGLE: ("motion", "profile", "level")},
)
"""Vane clamped on a test bench: its profile is constant."""


def _read_prescribed(
    reading: DocumentReader, device: Device, duration: float, step: float, _folder: Path
) -> PrescribedMotion:
    profile = read_profile(reading, _PROFILE, profile_settings(kind_at(reading.document, _PROFILE), ANGLE_LEVEL))
    problem = profile_problem(stops_of(device), profile, duration, step)
    if problem:
        raise ScenarioError(f"{reading.file}: {problem}")
    return PrescribedMotion(profile)


PRESCRIBED_MOTION = VaneKind(
    name="prescribed",
    section=MotionSection(
        "the angle of the vane is a given function of time",
        (),
        _read_prescribed,
        ProfileTable(
            "profile",
            "angle in time",
            partial(profile_settings, prescribed=ANGLE_LEVEL),
        ),
    ),
    plan=_plan,
    measured=_measured,
)
"""The ankle follows a profile, independent of the device."""


def _read_leg(reading: DocumentReader, device: Device, _duration: float, _step: float, folder: Path) -> FreeMotion:
    """Return the motion with a leg whose shank follows a smooth profile or a gait."""
    _read_angle(reading, device)
    numbers: dict[str, Any] = reading.section("motion", LEG)
    start = numbers.pop("angle"), numbers.pop("angular_velocity")
    kind = kind_at(reading.document, _SHANK)
    shank = read_profile(reading, _SHANK, shank_settings(kind))
    if kind != GAIT_SHANK:
        if not PROFILES[kind].is_smooth:
            smooth = ", ".join([name for name, profile in PROFILES.items() if profile.is_smooth] + [GAIT_SHANK])
            raise reading.refusal(
                f"{_SHANK}.kind", f"this profile has corners where the angular velocity jumps; use {smooth}"
            )
        return FreeMotion(*start, leg=Leg(**numbers, shank=shank))
    # A vane alone, or on a shank at rest, loads no gaits.
    from ppafo.simulation.leg import on_gait

    name = str(value_at(reading.document, f"{_SHANK}.gait"))
    try:
        leg = on_gait(Leg(**numbers, shank=shank), name, folder)
    except DataError as error:
        raise reading.refusal(f"{_SHANK}.gait", one_line(error)) from error
    return FreeMotion(*start, leg=leg)


def _plan_leg(scenario: Scenario) -> "tuple[Run, tuple[Problem, ...]]":
    from ppafo.simulation.leg import plan_leg

    return plan_leg(scenario)


def _measured_leg(scenario: Scenario, run: "Run", times: "Floats", rows: "Mapping[str, Floats]") -> Measured:
    from ppafo.simulation.leg import measured_leg

    return measured_leg(scenario, run, times, rows)


LEG_MOTION = VaneKind(
    name="leg",
    section=MotionSection(
        "the vane moves a free foot on a shank with prescribed motion",
        LEG,
        _read_leg,
        ProfileTable(
            "shank",
            "angle of the shank in time, 0 upright",
            shank_settings,
            {GAIT_SHANK: {"gait": "name of a gait, or a path relative to this file"}},
        ),
    ),
    plan=_plan_leg,
    measured=_measured_leg,
)
"""Motion with the foot of a leg by equation (11), without ground contact."""
