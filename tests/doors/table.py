"""The cases that every door of the package is given: each shipped scenario and walk, and each key that adds to a run.

A feature is one thing that adds state, history or a clock to a program, with the overrides that turn it on. A case is a
scenario with some features: a few of the richest are short tests, and every feature stands in a drawn group, which is a
long one. ``tests/architecture/test_doors.py`` refuses a key or a kind of the
catalogues that stands in no feature.
"""

import math
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.loading import load_scenario
from ppafo.simulation.loading import list_scenarios
from ppafo.simulation.scenario import Scenario
from ppafo.walking import list_walks
from ppafo.walking.motion import with_duration

ROOT = Path(__file__).parents[2]
BLADDER = ROOT / "tests" / "actuators" / "measured-bladder.toml"
MUSCLES = ROOT / "src" / "ppafo" / "examples" / "add-an-actuator" / "muscle-pair.toml"

# What a feature is added to.
VANE_BASE = "torque-task-proportional"
WALK_BASE = "proportional"
Texts = tuple[str, ...]

BASES: dict[str, Texts] = {
    VANE_BASE: ("run.duration=0.1 s", "reference.ramp_time=30 ms", "reference.level=4 N m"),
    "pressure-loop": ("run.duration=0.1 s", "reference.ramp_time=30 ms", "sensors.delay=0 ms"),
    "cylinder-servo": ("run.duration=0.1 s", "reference.frequency=5 Hz", "sensors.delay=0 ms"),
    WALK_BASE: (),
}
"""Overrides of each, with which a run of 100 steps moves all that is there."""
WALKED = 1.0
"""Seconds of a walk, the shortest that there is: from heel strike through push-off, with 1000 samples."""


@dataclass(frozen=True, slots=True)
class Feature:
    """Overrides that turn one thing on.

    ``needs`` are words of which another feature of the same case has none: ``valve``, ``motion``, ``law``,
    ``reference`` or ``clock``, where it has one of its own. ``base`` is the scenario that it needs.
    """

    texts: Texts
    needs: frozenset[str] = frozenset()
    base: str = ""

    @property
    def paths(self) -> frozenset[str]:
        """The paths that it sets."""
        return frozenset(text.partition("=")[0] for text in self.texts)

    def goes_with(self, other: "Feature") -> bool:
        """Whether both can stand in one scenario: no path set twice, nothing had twice, no two scenarios needed."""
        is_one = not (self.base and other.base)
        return is_one and self.paths.isdisjoint(other.paths) and self.needs.isdisjoint(other.needs)


def _feature(*texts: str, needs: str = "", base: str = "") -> Feature:
    return Feature(texts, frozenset(needs.split()), base)


_SOLENOID = ("device.valve=solenoid", "controller.kind=on_off", "controller.rate=200 Hz")
_FREE = ("motion.kind=free", "motion.angle=75 deg")
_THERMAL = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
)
_LINES = (
    *("supply_line.plantarflexion.droop=3e6 Pa s/kg", "supply_line.plantarflexion.largest_flow=4 g/s"),
    *("supply_line.plantarflexion.volume=4 cm^3", "supply_line.dorsiflexion.droop=6e7 Pa s/kg"),
    *("supply_line.dorsiflexion.largest_flow=1 g/s", "supply_line.dorsiflexion.volume=3 cm^3"),
)
_KNOTS = (
    # Above this level a smooth curve through the knots leaves the range of a fixed-point converter.
    *(
        "reference.level=3 N m",
        "reference.period=0.2 s",
        "reference.value_01=0 N m",
        "reference.time_02=20 ms",
        "reference.value_02=3 N m",
    ),
    *("reference.time_03=0.1 s", "reference.value_03=1 N m"),
)

_TABLE = tuple(
    f"effects.opening.{name}_{number:02}={value:g}"
    for number in range(1, 13)
    for name, value in (("command", 0.07 * number), ("opening", (number - 1) ** 2 / 150.0))
)

VANE_FEATURES: dict[str, Feature] = {
    # Valves: what they keep between two steps, and commands that come late.
    "late command": _feature("valve.delay=3 ms", needs="valve"),
    "command late by parts of a step": _feature("valve.delay=2.3 ms", needs="valve"),
    "dead band": _feature("valve.dead_band=0.05", needs="valve"),
    "table of openings": _feature(*_TABLE),
    "spool": _feature("valve.spool_frequency=40 Hz", "valve.spool_damping_ratio=0.5", needs="valve"),
    "slew": _feature("valve.slew_limit=30 1/s", needs="valve"),
    "solenoid": _feature(*_SOLENOID, needs="valve law clock actuator"),
    "opening delays": _feature(
        *_SOLENOID,
        *("valve.opening_delay=3.3 ms", "valve.closing_delay=2 ms", "valve.switching_interval=7 ms"),
        needs="valve law clock actuator",
    ),
    "regulators": _feature(
        *("device.set=cylinder-lever", "device.valve=pressure_regulator", "valve.delay=1.3 ms"),
        *("valve.lowest_pressure=0.1 bar_g", "valve.highest_pressure=4 bar_g", "valve.response_time=20 ms"),
        *("valve.band=0.02", "valve.hysteresis=0.01", "valve.resolution=0.004"),
        needs="valve law actuator area",
    ),
    "parts of steps": _feature("valve.area=150 mm^2", "run.tolerance=1e-4", needs="area"),
    # Gas.
    "thermal gas": _feature(*_THERMAL),
    "supply lines": _feature(*_LINES),
    "relieving regulators": _feature("supply.relieving=true", "initial.pressure_1=70 psi_g"),
    "line resistance": _feature(
        "effects.line_resistance.area=6 mm^2", "effects.line_resistance.discharge_coefficient=0.6"
    ),
    "laminar leak": _feature("effects.laminar_leak.coefficient=1e-16 kg/(s Pa^2)"),
    # The joint.
    "free": _feature(*_FREE, "motion.angular_velocity=100 deg/s", "motion.external_torque=1 N m", needs="motion"),
    "impact": _feature(*_FREE, "motion.angular_velocity=2000 deg/s", "actuator.restitution=0.4", needs="motion"),
    "joint load": _feature(
        *_FREE,
        *("effects.joint_load.drag=0.01 N m s^2/rad^2", "effects.joint_load.stiffness=2 N m/rad"),
        *("effects.joint_load.weight=0.5 N m", "effects.joint_load.rest_angle=60 deg"),
        needs="motion",
    ),
    "seal friction": _feature(
        *_FREE,
        *(
            "effects.seal_friction.static_per_pressure=2e-6 N m/Pa",
            "effects.seal_friction.dynamic_per_pressure=1e-6 N m/Pa",
        ),
        needs="motion",
    ),
    "Stribeck": _feature(*_FREE, "effects.stribeck.velocity=1 rad/s", "effects.stribeck.share=0.5", needs="motion"),
    "leg": _feature(
        *("motion.kind=leg", "motion.angle=75 deg", "motion.ankle_torque=1 N m", "motion.shank.kind=sine"),
        *("motion.shank.level=0 deg", "motion.shank.amplitude=20 deg", "motion.shank.frequency=2 Hz"),
        needs="motion",
    ),
    "leg of a gait": _feature(
        *("motion.kind=leg", "motion.angle=75 deg", "motion.ankle_torque=-1 N m", "motion.shank.kind=gait"),
        *("motion.shank.gait=falisse2019-subject1", "motion.shank.start=0.64"),
        needs="motion",
    ),
    "prescribed": _feature(
        *("motion.kind=prescribed", "motion.profile.kind=sine", "motion.profile.level=80 deg"),
        *("motion.profile.amplitude=15 deg", "motion.profile.frequency=4 Hz"),
        needs="motion",
    ),
    # Sensors.
    "late sensors": _feature("sensors.delay=2 ms"),
    "sensors late by parts of a step": _feature("sensors.delay=2.3 ms"),
    "noise": _feature("sensors.angle_noise=0.5 deg", "sensors.pressure_noise=0.5 psi_d", "sensors.seed=7"),
    "resolution": _feature("sensors.angle_resolution=1 deg", "sensors.pressure_resolution=0.5 psi_d"),
    "bandwidth": _feature("sensors.angle_bandwidth=30 Hz", "sensors.pressure_bandwidth=40 Hz"),
    # Clocks.
    "samples that do not divide the run": _feature("controller.rate=70 Hz", "run.duration=0.05 s", needs="clock"),
    "samples between steps": _feature("controller.rate=333 Hz", needs="clock"),
    "records between steps": _feature("run.output_interval=1.5 ms", "run.duration=90 ms"),
    "steps that do not divide the record": _feature("run.step=0.3 ms", "run.duration=60 ms"),
    "period": _feature("controller.period=3 ms", "run.output_interval=2 ms", needs="clock"),
    # Laws.
    "constant": _feature("controller.kind=constant", "controller.command=0.7", needs="law"),
    "hysteresis": _feature("controller.kind=hysteresis", "controller.band=0.1 N m", needs="law"),
    "on_off": _feature("controller.kind=on_off", needs="law"),
    "dead zone": _feature(
        *("controller.kind=on_off_dead_zone", "controller.dead_zone=0.3 N m", "controller.release=0.1 N m"),
        "controller.opening=0.5",
        needs="law",
    ),
    "filters": _feature("controller.derivative_filter=5 ms", "controller.anti_windup=10 1/s", needs="law"),
    "feedforward": _feature("controller.kind=pid_feedforward", needs="law"),
    "sliding mode": _feature("controller.kind=sliding_mode", needs="law"),
    "damped": _feature("controller.kind=damped_proportional", needs="law"),
    "feedback linearisation": _feature("controller.kind=feedback_linearisation", needs="law"),
    "cascade": _feature(needs="motion law reference area", base="cylinder-servo"),
    "fixed point": _feature("controller.kind=pid_fixed_point", needs="law"),
    "fixed point on/off": _feature("controller.kind=on_off_fixed_point", needs="law"),
    "fixed point dead zone": _feature(
        *("controller.kind=on_off_dead_zone_fixed_point", "controller.dead_zone=0.3 N m"),
        *("controller.release=0.1 N m", "controller.opening=0.5"),
        needs="law",
    ),
    # References.
    "constant reference": _feature("reference.kind=constant", needs="reference"),
    "sine": _feature(
        "reference.kind=sine",
        "reference.level=2 N m",
        "reference.amplitude=2 N m",
        "reference.frequency=10 Hz",
        needs="reference",
    ),
    "table": _feature("reference.kind=tabulated", *_KNOTS, needs="reference"),
    "smooth": _feature("reference.kind=smooth", *_KNOTS, needs="reference"),
    "angle": _feature("controller.kind=sliding_mode", needs="motion law reference area", base="cylinder-servo"),
    "pressure 1": _feature(needs="law reference", base="pressure-loop"),
    "pressure 2": _feature("reference.of=pressure_2", needs="law reference", base="pressure-loop"),
    "difference": _feature(
        *("reference.of=pressure_difference", "reference.start_level=0 psi_d", "reference.level=15 psi_d"),
        needs="law reference",
        base="pressure-loop",
    ),
    # Actuators.
    "cylinder": _feature("device.set=cylinder-lever", needs="actuator area"),
    "bladder": _feature(f"device.set={BLADDER}", needs="actuator area"),
    "muscle pair": _feature(f"device.set={MUSCLES}", needs="actuator"),
}
"""Each is added to ``VANE_BASE``."""


WALK_FEATURES: dict[str, Feature] = {
    "late command": _feature("valve.delay=5 ms", needs="valve"),
    "spool": _feature("valve.spool_frequency=30 Hz", "valve.slew_limit=20 1/s", needs="valve"),
    "table of openings": _feature(*_TABLE),
    "thermal gas": _feature(*_THERMAL),
    "supply lines": _feature(*_LINES),
    "joint load": _feature("effects.joint_load.drag=0.01 N m s^2/rad^2", "effects.joint_load.stiffness=1 N m/rad"),
    "noise": _feature(
        *(
            "sensors.angle_noise=0.3 deg",
            "sensors.pressure_noise=0.3 psi_d",
            "sensors.force_noise=5 N",
            "sensors.seed=5",
        ),
    ),
    "resolution": _feature(
        *("sensors.angle_resolution=0.5 deg", "sensors.pressure_resolution=0.2 psi_d", "sensors.force_resolution=2 N"),
    ),
    "bandwidth": _feature(
        "sensors.angle_bandwidth=40 Hz", "sensors.pressure_bandwidth=60 Hz", "sensors.force_bandwidth=20 Hz"
    ),
    "lost samples": _feature(
        "sensors.lost_share=0.2", "sensors.angle_lost_share=0.2", "sensors.pressure_lost_share=0.2"
    ),
    "samples between steps": _feature("controller.rate=330 Hz", "run.step=0.4 ms"),
    "cylinder": _feature("device.set=cylinder-lever", needs="actuator"),
    "bladder": _feature(f"device.set={BLADDER}", needs="actuator area"),
    "muscle pair": _feature(f"device.set={MUSCLES}", needs="actuator"),
    "off": _feature("controller.kind=off", needs="law"),
    "on_off law": _feature("controller.kind=event_on_off", needs="law"),
    "dead zone": _feature("controller.kind=event_on_off_dead_zone", needs="law"),
    "pid": _feature("controller.kind=event_pid", needs="law"),
    "feedforward": _feature("controller.kind=event_pid_feedforward", needs="law"),
    "sliding mode": _feature("controller.kind=event_sliding_mode", needs="law"),
    "feedback linearisation": _feature("controller.kind=event_feedback_linearisation", needs="law"),
    "damped": _feature("controller.kind=damped_proportional", needs="law"),
}
"""Each is added to ``WALK_BASE``."""


@dataclass(frozen=True, slots=True)
class Case:
    """A scenario as the doors are given it: a shipped scenario or walk, and overrides.

    ``suite`` is ``short`` or ``long``. ``has_object`` puts an object of Python in charge of the valve.
    """

    name: str
    suite: str
    scenario: str
    texts: Texts = ()
    has_object: bool = False

    @property
    def walks(self) -> bool:
        """Whether it is a walk, and no vane alone."""
        return self.scenario in list_walks()

    @property
    def is_shipped(self) -> bool:
        """Whether it has the program of a shipped scenario or walk, whatever its times are."""
        return all(text.startswith(("run.", "controller.rate")) for text in self.texts)

    @property
    def leaves(self) -> bool:
        """Whether a library can be made of it: of integer laws and of objects of Python there is none."""
        return not self.has_object and not any("_fixed_point" in text for text in self.texts)

    def load(self) -> Scenario:
        """The scenario."""
        scenario = load_scenario(self.scenario, self.texts)
        scenario = with_duration(scenario, WALKED) if self.walks else scenario
        return scenario.controlled_by(Integrating()) if self.has_object else scenario


class Integrating:
    """A controller that is an object of Python, with a state of its own."""

    def __init__(self) -> None:
        self.sum = 0.0

    def reset(self) -> None:
        """Forget the run before."""
        self.sum = 0.0

    def update(self, time: float, reference: float, measurement: Any) -> float:
        """Command [-] of a proportional and integral law."""
        error = reference - measurement.torque
        self.sum += 1.0e-3 * error
        return 0.1 * error + 0.5 * self.sum + 0.1 * math.sin(20.0 * time)


def _joined(suite: str, base: str, features: Mapping[str, Feature]) -> Case:
    """A scenario with some features, beside those settings of its base that they do not replace."""
    scenario = next((feature.base for feature in features.values() if feature.base), base)
    given = [text for feature in features.values() for text in feature.texts]
    paths = {text.partition("=")[0] for text in given}
    # Another kind of reference has none of the settings of the one before.
    replaced = ("reference.",) if "reference.kind" in paths else ()
    kept = [text for text in BASES[scenario] if text.partition("=")[0] not in paths and not text.startswith(replaced)]
    # A text that two features share stands once.
    texts = tuple(dict.fromkeys((*kept, *given)))
    kind = "walk" if base == WALK_BASE else "vane"
    name = f"{kind}: {', '.join(features)}"
    return Case(name, suite, scenario, texts)


def _chosen(base: str, *names: str) -> Case:
    """A short case with some features."""
    features = WALK_FEATURES if base == WALK_BASE else VANE_FEATURES
    case = _joined("short", base, {name: features[name] for name in names})
    # The ramp is over by then, and Python takes its time for each step.
    return replace(case, texts=tuple(text.replace("run.duration=0.1 s", "run.duration=50 ms") for text in case.texts))


SHORT = (
    Case("torque-task-slow-valve", "short", "torque-task-slow-valve", ("run.duration=60 ms",)),
    Case("late totals", "short", "step-response", ("run.duration=50 ms", "controller.rate=7 Hz")),
    _chosen(VANE_BASE, "cascade", "late sensors", "late command", "cylinder", "thermal gas", "seal friction"),
    _chosen(VANE_BASE, "difference", "supply lines", "bandwidth", "samples between steps", "parts of steps"),
    _chosen(VANE_BASE, "opening delays", "noise", "resolution"),
    _chosen(VANE_BASE, "joint load", "Stribeck", "line resistance", "sensors late by parts of a step", "regulators"),
    _chosen(VANE_BASE, "leg of a gait"),
    _chosen(VANE_BASE, "prescribed", "line resistance", "records between steps"),
    _chosen(VANE_BASE, "bladder", "slew", "dead band", "damped", "smooth"),
    _chosen(VANE_BASE, "muscle pair", "hysteresis", "laminar leak", "relieving regulators"),
    _chosen(WALK_BASE, "late command", "noise", "lost samples"),
    _chosen(WALK_BASE, "spool", "bandwidth", "resolution", "thermal gas"),
)
"""Twelve cases in which most of what has a state, a history or a clock meets something else."""

SHIPPED = (
    *(Case(name, "long", name, ("run.duration=0.2 s",)) for name in list_scenarios() if name != SHORT[0].name),
    *(Case(name, "long", name) for name in list_walks()),
)

_SEED = 72
_LARGEST = 6
"""Features of a drawn group at most."""


def _groups(base: str, features: Mapping[str, Feature]) -> Iterator[Case]:
    """Every feature once, beside as many others as go with it."""
    left = list(features)
    random.Random(_SEED).shuffle(left)
    while left:
        group: list[str] = []
        for name in left:
            if len(group) < _LARGEST and all(features[name].goes_with(features[other]) for other in group):
                group.append(name)
        left = [name for name in left if name not in group]
        yield _joined("long", base, {name: features[name] for name in group})


OBJECTS = (
    Case("vane: an object of Python", "long", VANE_BASE, BASES[VANE_BASE], has_object=True),
    Case("walk: an object of Python", "long", WALK_BASE, has_object=True),
)
REFUSED: tuple[tuple[str, float, str], ...] = (
    ("valve.area", -1.0, "valve.area"),
    ("valve.delay", -1.0, "valve.delay"),
    ("gas.temperature", -5.0, "gas.temperature"),
    ("sensors.delay", -1.0e-3, "sensors.delay"),
    ("sensors.seed", 1.9, "sensors.seed"),
    ("actuator.dead_volume_1", 2.0, "actuator.dead_volume_1"),
    ("run.duration", 0.0, "run.duration"),
    ("run.output_interval", 7.0e-3, "run.output_interval"),
    ("controller.period", 1.0e-4, "run.step"),
    ("friction.dynamic_torque", 1.0e3, "friction.dynamic_torque"),
    ("actuator.angle_min", 3.0, "actuator.angle_min"),
    ("motion.angle", 0.1, "motion.angle"),
)
"""Numbers [SI] that ``VANE_BASE`` cannot have, by path, and the path that every door names."""
NOT_EXPORTED: dict[str, Case] = {
    "an integer law": Case("integer", "short", VANE_BASE, ("controller.kind=pid_fixed_point",)),
    "an object of Python": Case("object", "short", VANE_BASE, has_object=True),
    "an object of Python in a walk": Case("walking object", "short", WALK_BASE, has_object=True),
    "a bottle": Case("bottle", "short", WALK_BASE, ("bottle.name=paper-co2-9oz",)),
}
"""What no door leads out of Python."""

_ALL = ((VANE_BASE, VANE_FEATURES), (WALK_BASE, WALK_FEATURES))
GROUPS = tuple(case for base, features in _ALL for case in _groups(base, features))
CASES = (*SHORT, *SHIPPED, *OBJECTS, *GROUPS)
EXPORTED = tuple(case for case in CASES if case.leaves)
"""Cases that leave Python."""
