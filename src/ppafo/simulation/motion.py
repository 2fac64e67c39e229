"""What moves a vane alone, as kinds of motion: locked, free, along a profile, or with the foot of a leg.

Each kind declares what a file says of it, and how that is read and checked against the stops of the device. What only
a run or an ensemble of such a motion needs is loaded when it is called.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import OPEN_LOOP, ControllerKind
from ppafo.errors import DataError, ScenarioError, one_line
from ppafo.model.declaration import Quantity
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
    Reading,
    kind_at,
    motion_quantities,
    profile_settings,
    quantities,
    shank_settings,
    value_at,
)
from ppafo.simulation.motion_kind import Clock, Measured, MotionKind, MotionSection, ProfileTable, Seen
from ppafo.simulation.profiles import TOLERANCE, profile_problem, range_text, read_profile, stops_of
from ppafo.simulation.scenario import FreeMotion, Leg, PrescribedMotion, ProfileChoice, Scenario, vane_motion
from ppafo.simulation.schema import profile_table, shank_table

if TYPE_CHECKING:
    from ppafo.engine.lanes import Floats
    from ppafo.engine.run import Run
    from ppafo.metrics.metric import MetricKind
    from ppafo.model.columns import Problem

_PROFILE, _SHANK = "motion.profile", "motion.shank"


def quantities_of_vane(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declaration of every number of a scenario of a vane, by path."""
    section = scenario.motion.motion_kind.section
    profile = None if section is None or section.profile is None else getattr(scenario.motion, section.profile.name)
    return _beside(scenario, motion_quantities(section, "" if profile is None else profile.kind))


def _beside(scenario: Scenario, of_motion: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """Return the declaration of every number of a scenario, given those of its motion."""
    document: dict[str, Any] = {"controller": {"kind": scenario.controller.kind}}
    # A constant command follows no reference, whatever the scenario has in its place.
    reference = {"kind": scenario.reference.kind, "of": scenario.controlled}
    document |= {} if scenario.controller.kind == OPEN_LOOP else {"reference": reference}
    document |= {} if scenario.gas_model is None else {"gas_model": {"kind": THERMAL}}
    return quantities(document | ({} if scenario.supply_line is None else {SUPPLY_LINE: {}}), of_motion)


def _noise(scenario: Scenario) -> Any:
    return scenario.sensors.angle_noise + scenario.sensors.pressure_noise


def _switches(scenario: Scenario) -> tuple[Any, ...]:
    return scenario.sensors.flaws


def _plan(scenario: Scenario) -> "tuple[Run, tuple[Problem, ...]]":
    from ppafo.simulation.plan import plan_vane

    return plan_vane(scenario)


def _rules(scenario: Scenario) -> "tuple[Problem, ...]":
    from ppafo.simulation.ensemble.vane import rules

    return rules(scenario)


def _clock(scenario: Scenario, times: Mapping[str, Any]) -> "tuple[Clock, tuple[Problem, ...]]":
    from ppafo.simulation.ensemble.vane import clock

    return clock(scenario, times)


def _law(scenario: Scenario) -> ControllerKind:
    return CONTROLLERS[scenario.controller.kind]


def _sees(scenario: Scenario) -> "Seen":
    from ppafo.simulation.torque_loop import seen_in_scenario

    return seen_in_scenario(scenario.controlled, vane_motion(scenario).leg is not None)


def _lacks(scenario: Scenario, kind: "MetricKind") -> str:
    from ppafo.simulation.ensemble.vane import lacks

    return lacks(scenario, kind)


def _measured_free(scenario: Scenario, run: "Run", times: "Floats", rows: "Mapping[str, Floats]") -> Measured:
    from ppafo.simulation.vane_recording import measured_free

    return measured_free(scenario, run, times, rows)


def _measured_prescribed(scenario: Scenario, run: "Run", times: "Floats", rows: "Mapping[str, Floats]") -> Measured:
    from ppafo.simulation.vane_recording import measured_prescribed

    return measured_prescribed(scenario, run, times, rows)


def _read_angle(reading: Reading, device: Device) -> float:
    """Return the angle [rad] of the vane; ScenarioError where it is not between the stops of the device."""
    angle, stops = reading.number(LOCKED_ANGLE, ANGLE), (device.actuator.angle_min, device.actuator.angle_max)
    if not stops[0] - TOLERANCE <= angle <= stops[1] + TOLERANCE:
        raise reading.refusal(LOCKED_ANGLE, f"must be between the stops of {device.name}, {range_text(stops)}")
    return angle


def _read_free(reading: Reading, device: Device, _duration: float, _step: float, _folder: Path) -> FreeMotion:
    _read_angle(reading, device)
    numbers = reading.section("motion", FREE)
    return FreeMotion(numbers["angle"], numbers["angular_velocity"], numbers["external_torque"])


FREE_MOTION = MotionKind(
    name="free",
    plan=_plan,
    rules=_rules,
    quantities=quantities_of_vane,
    places={},
    clock=_clock,
    switches=_switches,
    noise=_noise,
    law=_law,
    sees=_sees,
    lacks=_lacks,
    measured=_measured_free,
    section=MotionSection("the vane moves as the torques demand", FREE, _read_free),
)
"""Equation (1), with a constant external torque."""


def _quantities_of_locked(scenario: Scenario) -> dict[str, Quantity]:
    # The angle comes last, where numbers of a locked vane are listed.
    return _beside(scenario, {}) | {LOCKED_ANGLE: ANGLE}


def _read_locked(reading: Reading, device: Device, _duration: float, _step: float, _folder: Path) -> PrescribedMotion:
    return PrescribedMotion(ProfileChoice("constant", {"level": _read_angle(reading, device)}), "locked")


LOCKED_MOTION = replace(
    FREE_MOTION,
    name="locked",
    quantities=_quantities_of_locked,
    places={LOCKED_ANGLE: ("motion", "profile", "level")},
    measured=_measured_prescribed,
    section=MotionSection("the vane stays at one angle", (ANGLE,), _read_locked),
)
"""A vane on a test bench that is clamped: its profile is constant."""


def _read_prescribed(reading: Reading, device: Device, duration: float, step: float, _folder: Path) -> PrescribedMotion:
    profile = read_profile(reading, _PROFILE, ANGLE_LEVEL)
    problem = profile_problem(stops_of(device), profile, duration, step)
    if problem:
        raise ScenarioError(f"{reading.file}: {problem}")
    return PrescribedMotion(profile)


PRESCRIBED_MOTION = replace(
    FREE_MOTION,
    name="prescribed",
    measured=_measured_prescribed,
    section=MotionSection(
        "the angle of the vane is a given function of time",
        (),
        _read_prescribed,
        ProfileTable(
            "profile",
            "angle in time",
            partial(profile_settings, prescribed=ANGLE_LEVEL),
            partial(profile_table, ANGLE_LEVEL, "Angle"),
        ),
    ),
)
"""The ankle goes along a profile whatever the device does."""


def _read_leg(reading: Reading, device: Device, _duration: float, _step: float, folder: Path) -> FreeMotion:
    """Return the motion with a leg whose shank goes along a profile without corners or as in a gait."""
    _read_angle(reading, device)
    numbers: dict[str, Any] = reading.section("motion", LEG)
    start = numbers.pop("angle"), numbers.pop("angular_velocity")
    kind = kind_at(reading.document, _SHANK)
    shank = ProfileChoice(kind, reading.section(_SHANK, shank_settings(kind)))
    if kind != GAIT_SHANK:
        if not PROFILES[kind].is_smooth:
            smooth = ", ".join([name for name, profile in PROFILES.items() if profile.is_smooth] + [GAIT_SHANK])
            raise reading.refusal(
                f"{_SHANK}.kind", f"this profile has corners, at which the foot would be struck; use one of {smooth}"
            )
        return FreeMotion(*start, leg=Leg(**numbers, shank=shank))
    # A vane alone, or on a shank at rest, loads no gaits.
    from ppafo.gait import list_gaits, load_gait, series_of
    from ppafo.model.gait import ShankSeries

    name = str(value_at(reading.document, f"{_SHANK}.gait"))
    try:
        gait = load_gait(name if name in list_gaits() else folder / name)
    except DataError as error:
        raise reading.refusal(f"{_SHANK}.gait", one_line(error)) from error
    series = ShankSeries(
        frequency=1.0 / gait.stride_time,
        start=shank.start,
        toe_lever=numbers["toe_lever"],
        shank=series_of(gait, "shank_angle"),
        ankle=series_of(gait, "ankle_angle"),
        knee_forward=series_of(gait, "knee_forward"),
        knee_up=series_of(gait, "knee_up"),
    )
    return FreeMotion(*start, leg=Leg(**numbers, shank=shank, gait=gait.name, curves=series))


def _plan_leg(scenario: Scenario) -> "tuple[Run, tuple[Problem, ...]]":
    from ppafo.simulation.leg import plan_leg

    return plan_leg(scenario)


def _measured_leg(scenario: Scenario, run: "Run", times: "Floats", rows: "Mapping[str, Floats]") -> Measured:
    from ppafo.simulation.leg import measured_leg

    return measured_leg(scenario, run, times, rows)


LEG_MOTION = replace(
    FREE_MOTION,
    name="leg",
    plan=_plan_leg,
    measured=_measured_leg,
    section=MotionSection(
        "the vane moves a foot that is free, on a shank that is led",
        LEG,
        _read_leg,
        ProfileTable(
            "shank",
            "angle of the shank in time, 0 upright",
            shank_settings,
            shank_table,
            {GAIT_SHANK: ("gait",)},
        ),
    ),
)
"""Equation (11), without ground."""
