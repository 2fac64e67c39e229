"""Motions of a vane alone: locked, free, along a profile, or with the foot of a leg.

Each declares its section of a file, and how that is read and checked against the stops of the device; for an ensemble,
all runs are checked at once: numbers that contradict each other, and times.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.errors import DataError, ScenarioError
from ppafo.metrics.metric import MetricKind
from ppafo.model.columns import Problem, at
from ppafo.model.controlled import ANGLE as ANGLE_CONTROLLED
from ppafo.model.controlled import CONTROLLED
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import kind_at, value_at
from ppafo.signals.meter import LED_SHANK
from ppafo.signals.meter import WALK as OF_WALK
from ppafo.simulation.clock import MAXIMUM_STEPS_OF_DELAY, read_clock, time_texts
from ppafo.simulation.contradictions import Contradiction
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
from ppafo.simulation.leg import measured_leg, on_gait, plan_leg
from ppafo.simulation.motion_kind import VANE, LawSignals, MotionKind, MotionSection, ProfileTable
from ppafo.simulation.numbers import path_of_locked_angle
from ppafo.simulation.plan import plan_vane
from ppafo.simulation.profiles import (
    Limits,
    ProfileCourse,
    disordered_knots,
    excursion,
    limits_of,
    profile_bounds,
    profile_parameters,
    profiles_of,
    read_profile,
)
from ppafo.simulation.scenario import (
    FreeMotion,
    Leg,
    PrescribedMotion,
    ProfileChoice,
    Scenario,
    locked_vane,
    vane_motion,
)
from ppafo.simulation.vane_recording import measured_vane
from ppafo.units.shown import shown_text
from ppafo.wording import one_line

_PROFILE = "motion.profile"
_SHANK = "motion.shank"


def contradictions(scenario: Scenario) -> Iterator[Contradiction]:
    """Yield the contradictions of a vane alone: knots not in order, angle or profile beyond a limit, delay too long."""
    disordered = [disordered_knots(choice, section) for section, choice in profiles_of(scenario).items()]
    yield from (Contradiction("", is_bad, line) for is_bad, line in disordered)
    # The bounds of a curve need its knots in order.
    if any(np.any(is_bad) for is_bad, _ in disordered):
        return
    delay = scenario.sensors.delay
    step = scenario.run.step
    device = scenario.device
    motion = vane_motion(scenario)
    followed = CONTROLLED[scenario.controlled]
    stops = limits_of(device, CONTROLLED[ANGLE_CONTROLLED])
    profile = ProfileChoice("constant", {"level": motion.angle}) if motion.profile is None else motion.profile

    def beyond_stops(run: int) -> str:
        low, high = (shown_text(at(stop, run), "rad") for stop in (stops.lowest, stops.highest))
        return f"must be between the stops of {device.name}, {low} to {high}"

    if profile.kind == "constant":
        yield Contradiction(path_of_locked_angle(scenario) or LOCKED_ANGLE, _is_beyond(stops, profile), beyond_stops)
    else:
        yield Contradiction("", *_beyond(scenario, stops, profile, "motion.profile"))
    if followed.reach is not None and scenario.follows_reference:
        yield Contradiction("", *_beyond(scenario, limits_of(device, followed), scenario.reference, "reference"))
    no_measurement = "must not be longer than run.duration, or no measurement would arrive"
    yield Contradiction("sensors.delay", delay > scenario.run.duration, lambda _run: no_measurement)

    def most_steps(run: int) -> str:
        longest = shown_text(MAXIMUM_STEPS_OF_DELAY * at(step, run), "s")
        return f"must be at most {longest}, {MAXIMUM_STEPS_OF_DELAY:.0e} steps"

    yield Contradiction("sensors.delay", delay / step > MAXIMUM_STEPS_OF_DELAY, most_steps)


def _is_beyond(limits: Limits, profile: ProfileChoice) -> NDArray[np.bool_]:
    """Tell for each run (runs,) whether a profile leaves its limits at any time."""
    # What another package says of its profile is not relied on: each run is checked at its own times.
    lowest, highest = profile_bounds(profile) if PROFILES.is_own(profile.kind) else (-np.inf, np.inf)
    lower, upper = limits.allowed
    return np.atleast_1d(np.logical_or(lowest < lower, highest > upper))


def _beyond(scenario: Scenario, limits: Limits, profile: ProfileChoice, section: str) -> Problem:
    """Problem of a profile that exceeds its limits; ``section`` is the profile's section of the file."""
    outside = _is_beyond(limits, profile)
    # The bounds hold for all time; a run that may leave them is checked at its own times.
    problems: dict[int, str] = {}
    for run in np.flatnonzero(outside).tolist():
        settings = {name: at(value, run) for name, value in profile.settings.items()}
        duration = at(scenario.run.duration, run)
        step = at(scenario.run.step, run)
        profile_of_run = ProfileChoice(profile.kind, settings)
        lowest, highest, room = (at(number, run) for number in (limits.lowest, limits.highest, limits.room))
        limits_of_run = limits._replace(lowest=lowest, highest=highest, room=room)
        course = ProfileCourse(PROFILES[profile.kind].value)
        numbers = profile_parameters(profile_of_run)
        moment, reached = excursion(numbers, *limits_of_run.allowed, duration, step, parts=course)
        outside[run] = moment >= 0.0
        ends = f"{limits_of_run.text(lowest)} to {limits_of_run.text(highest)}"
        found = f"{limits_of_run.text(reached)} at {moment:.6g} s"
        problems[run] = f"[{section}] leaves {limits.words}, {ends}: {found}"
    return outside, lambda run: problems[run]


def clock(base: Scenario, times: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[Problem, ...]]:
    """Return the times of runs [s] by path for columns of times [s], and the problems of contradictory times.

    Times are read as overrides of a file, once for each combination, of which an ensemble has few.
    """
    texts = time_texts(base)
    changed = [path.split(".") for path in times]
    combinations, index_of_run = np.unique(np.stack(list(times.values()), axis=1), axis=0, return_inverse=True)
    index_of_run = index_of_run.reshape(-1)
    reasons = [""] * len(combinations)
    table = np.full((len(combinations), 4), np.nan)
    # A rate takes the place of a period that the file has, and the reverse.
    texts |= {section: {} for section, _ in changed if section == "controller"}
    for index, combination in enumerate(combinations.tolist()):
        document = {section: dict(written) for section, written in texts.items()}
        for (section, name), value in zip(changed, combination, strict=True):
            document[section][name] = f"{value!r} {'Hz' if name == 'rate' else 's'}"
        try:
            table[index] = read_clock(DocumentReader(base.name, document, frozenset(times)))
        except ScenarioError as error:
            reasons[index] = str(error)
    is_refused = np.array([bool(reason) for reason in reasons])[index_of_run]
    columns = zip(
        ("run.duration", "run.step", "run.output_interval", "controller.period"), table[index_of_run].T, strict=True
    )
    return {path: column.copy() for path, column in columns}, ((is_refused, lambda run: reasons[index_of_run[run]]),)


def lacks(scenario: Scenario, kind: MetricKind) -> str:
    """Return the reason why a metric does not apply to a vane alone; "" if it applies."""
    if OF_WALK in kind.needs:
        return "the metric needs a walk"
    leg = vane_motion(scenario).leg
    if LED_SHANK in kind.needs and not (leg is not None and leg.gait):
        return "the metric needs a leg whose shank follows a gait"
    if not kind.of_reference:
        return ""
    if not scenario.follows_reference:
        return "the controller has no reference"
    controlled = scenario.controlled
    return "" if kind.of_reference == controlled else f"reference.of is '{controlled}', not '{kind.of_reference}'"


def numbers_of_vane(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all numbers of a scenario except those of its device, keyed by path."""
    kind = scenario.motion.motion_kind
    motion = scenario.motion
    profile = None if kind.section is None else kind.section.profile
    moved = {} if profile is None else {profile.name: {"kind": getattr(motion, profile.name).kind}}
    document: dict[str, Any] = {"motion": moved, "controller": {"kind": scenario.controller.kind}}
    # A constant command follows no reference, whatever the scenario has in its place.
    if scenario.follows_reference:
        document["reference"] = {"kind": scenario.reference.kind, "of": scenario.controlled}
    document |= {} if scenario.gas_model is None else {"gas_model": {"kind": THERMAL}}
    document |= {} if scenario.supply_line is None else {SUPPLY_LINE: {}}
    declared = quantities(document, kind.section)
    # Numbers that are not where their path says come last, where those of a vane are listed.
    return declared | {path: declared.pop(path) for path in kind.places if path in declared}


def signals_seen(scenario: Scenario) -> LawSignals:
    """Return the signals that the controller reads, for a joint with or without a foot."""
    motion = vane_motion(scenario)
    if scenario.controlled == ANGLE_CONTROLLED:
        return LawSignals(scenario.reference.kind, "reference", has_leg=motion.leg is not None)
    if scenario.motion.motion_kind.name == "locked":
        return LawSignals(is_locked=True)
    return LawSignals(motion.profile.kind if isinstance(motion, PrescribedMotion) else "", "motion.profile")


VaneKind = partial(
    MotionKind,
    layout=VANE,
    plan=plan_vane,
    measured=measured_vane,
    contradictions=contradictions,
    quantities=numbers_of_vane,
    clock=clock,
    flaws=lambda scenario: scenario.sensors.flaws,
    law=lambda scenario: CONTROLLERS[scenario.controller.kind],
    asks_gradually=lambda law: law.needs_reference and not law.only_switches,
    sees=signals_seen,
    lacks=lacks,
)
"""Motions of a vane alone, which differ in their section of the file, in the plan of a run and in what is recorded."""


FREE_MOTION = VaneKind(
    name="free",
    section=MotionSection(
        "the torques move the vane", FREE, lambda reading, _: FreeMotion(**reading.section("motion", FREE))
    ),
)
"""Free motion by equation (1), with a constant external torque."""


LOCKED_MOTION = VaneKind(
    name="locked",
    section=MotionSection(
        "the vane stays at one angle", (ANGLE,), lambda reading, _: locked_vane(reading.number(LOCKED_ANGLE, ANGLE))
    ),
    places={LOCKED_ANGLE: ("motion", "profile", "level")},
)
"""Vane clamped on a test bench: its profile is constant."""


def _read_prescribed(reading: DocumentReader, _folder: Path) -> PrescribedMotion:
    settings = profile_settings(kind_at(reading.document, _PROFILE), ANGLE_LEVEL)
    return PrescribedMotion(read_profile(reading, _PROFILE, settings))


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
)
"""The ankle follows a profile, independent of the device."""


def _read_leg(reading: DocumentReader, folder: Path) -> FreeMotion:
    """Return the motion with a leg whose shank follows a smooth profile or a gait."""
    numbers: dict[str, Any] = reading.section("motion", LEG)
    start = numbers.pop("angle"), numbers.pop("angular_velocity")
    kind = kind_at(reading.document, _SHANK)
    shank = read_profile(reading, _SHANK, shank_settings(kind))
    if kind != GAIT_SHANK:
        if not PROFILES[kind].is_smooth:
            smooth = ", ".join([name for name, profile in PROFILES.items() if profile.is_smooth] + [GAIT_SHANK])
            raise reading.refusal(f"{_SHANK}.kind", f"this profile has corners; use {smooth}")
        return FreeMotion(*start, leg=Leg(**numbers, shank=shank))
    name = str(value_at(reading.document, f"{_SHANK}.gait"))
    try:
        leg = on_gait(Leg(**numbers, shank=shank), name, folder)
    except DataError as error:
        raise reading.refusal(f"{_SHANK}.gait", one_line(error)) from error
    return FreeMotion(*start, leg=leg)


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
    plan=plan_leg,
    measured=measured_leg,
)
"""Motion with the foot of a leg by equation (11), without ground contact."""
