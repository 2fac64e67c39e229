"""The plant of a scenario or a walk alone: its inputs come from outside at each step."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from typing import NamedTuple

from ppafo.control.catalog import PROFILES
from ppafo.control.controllers import switching
from ppafo.errors import ScenarioError
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.exported import ExportedProgram
from ppafo.exports.c_library.files import Library, Setting, Surface, c_identifier, library_files
from ppafo.exports.c_library.walk_preparation import check_can_leave
from ppafo.model.controlled import CONTROLLED
from ppafo.model.valves.kind import VENT
from ppafo.simulation.plan import step_counts
from ppafo.simulation.profiles import profile_parameters
from ppafo.simulation.scenario import (
    Control,
    FreeMotion,
    Motion,
    PrescribedMotion,
    ProfileChoice,
    Scenario,
    Sensors,
)
from ppafo.walking.declaration import FORCES
from ppafo.walking.motion import WalkMotion
from ppafo.walking.preparation import FaultSettings


@dataclass(frozen=True, slots=True)
class Input:
    """What a plant is given at each step: name, unit, meaning, first value and limits, None for none."""

    name: str
    unit: str
    summary: str
    start: float
    minimum: float | None = None
    maximum: float | None = None


COMMAND = Input("command", "-", "command to the valve, clipped to -1 to 1; above 0 feeds chamber 1", 0.0, -1.0, 1.0)
WALKING_COMMAND = Input(
    "command",
    "-",
    "command to the valve, clipped to -1 to 2; above 0 feeds chamber 1, above 1.5 vents both",
    VENT,
    -1.0,
    VENT,
)
LED = "From there on the angle goes on with the angular velocity that is given; the next step begins at the next angle."
FREE = "The external torque is constant until the next one."
ON_LEG = "The leg walks on by its gait."


@dataclass(frozen=True, slots=True)
class PlantAlone:
    """A plant that is driven from outside: its library, inputs, and how the joint moves between them, in words.

    ``first`` are settings of a run that inputs decide, ``lead`` its parameters, both as C with the names of inputs;
    ``hidden`` are the settings without effect. ``step`` [s] of the engine and of the inputs.
    """

    library: Library
    inputs: tuple[Input, ...]
    motion: str
    first: tuple[tuple[str, str], ...]
    lead: tuple[tuple[str, str], ...]
    highest: float
    hidden: frozenset[str]
    step: float


_SHORT = 0.0078125
"""Length [s] of the ramp that the angle begins with."""
_FIRST_ANGLE = (
    ("motion_profile_start_level", "angle"),
    ("motion_profile_level", f"angle + angular_velocity * {_SHORT}"),
    ("motion_profile_ramp_start", "0.0"),
    # Short: a fast ankle stays in the range of a level.
    ("motion_profile_ramp_time", f"{_SHORT}"),
)
_LEAD_ANGLE = (
    ("path.start_level", "angle"),
    ("path.level", "angle + angular_velocity * (2.0 * length)"),
    ("path.ramp_start", "time"),
    ("path.ramp_time", "2.0 * length"),
)


class Driven(NamedTuple):
    """How a plant goes on between two steps, in words, and what comes from outside beside the command.

    ``first`` and ``lead`` as in ``PlantAlone``; ``given`` are the channels that are no outputs, since they come in,
    ``highest`` is the largest command.
    """

    motion: str
    command: Input = COMMAND
    further: tuple[Input, ...] = ()
    first: tuple[tuple[str, str], ...] = ()
    lead: tuple[tuple[str, str], ...] = ()
    given: tuple[str, ...] = ()
    highest: float = 1.0


def plant_of(scenario: Scenario) -> PlantAlone:
    """The plant; an unconstrained vane takes an external torque, one with a prescribed angle takes angle and rate.

    For a walk it is the device on its walking leg, which takes the command alone.
    """
    chosen = _commanded(scenario.motion, scenario)
    library = library_of(chosen)
    driven = _driven(chosen.motion, library.settings)
    unseen = {"command", *driven.given, *(kind.reference for kind in CONTROLLED.values())}
    unused = ("sensors.", "motion.profile.", "motion.external_torque", "motion.ankle_torque")
    # Times of a run and of a controller mean nothing to a plant that is stepped from outside.
    hidden = {"run.duration", "run.output_interval", "controller.period", "controller.command"}
    outputs = tuple(name for name in library.program.outputs if name not in unseen)
    # Metrics need a whole run, which only the caller sees.
    program = replace(library.program.program, meters=(), traced=outputs)
    return PlantAlone(
        library=replace(library, program=ExportedProgram(program, ()), rules=()),
        inputs=(driven.command, *driven.further),
        motion=driven.motion,
        first=(("controller_period", "@.run_step"), ("run_output_interval", "@.run_step"), *driven.first),
        lead=driven.lead,
        highest=driven.highest,
        hidden=frozenset(hidden | {setting.path for setting in library.settings if setting.path.startswith(unused)}),
        step=chosen.run.step,
    )


@singledispatch
def _driven(motion: Motion, _settings: Sequence[Setting]) -> Driven:
    """What drives a plant that moves so, whose library has these settings."""
    raise ScenarioError(f"{motion.label}: a plant that moves so has no library")


@_driven.register
def _prescribed(motion: PrescribedMotion, settings: Sequence[Setting]) -> Driven:
    # An angle and its rate at each step make a ramp, which the profile of the library already is.
    by_path = {setting.path: setting for setting in settings}
    stops = [by_path[f"actuator.angle_{end}"].value for end in ("min", "max")]
    # So fast that the short ramp of the first angle still ends within what a level may be.
    fastest = (by_path["motion.profile.level"].quantity.maximum - max(map(abs, stops))) / _SHORT
    angle = motion.profile.start_level
    further = (
        Input("angle", "rad", "angle of the ankle, 90 deg neutral, growing in plantarflexion", angle, *stops),
        Input("angular_velocity", "rad/s", "its rate", 0.0, -fastest, fastest),
    )
    return Driven(LED, COMMAND, further, _FIRST_ANGLE, _LEAD_ANGLE, ("angle", "angular_velocity"))


@_driven.register
def _free(motion: FreeMotion, settings: Sequence[Setting]) -> Driven:
    # T_ex of a vane alone, or T_2 of the ankle of a leg, which is opposed.
    path, sign, joint = "motion.external_torque", "", "T_ex on the joint"
    if motion.leg is not None:
        path, sign, joint = "motion.ankle_torque", "-", "on the ankle of the leg, -T_2"
    words = f"torque {joint}, above 0 works against plantarflexion"
    quantity = next(setting.quantity for setting in settings if setting.path == path)
    torque = Input("external_torque", "N m", words, motion.outside_torque, quantity.minimum, quantity.maximum)
    first = ((c_identifier(path), f"{sign}external_torque"),)
    return Driven(FREE, COMMAND, (torque,), first, (("plant.external_torque", "external_torque"),))


@_driven.register
def _on_leg(_motion: WalkMotion, _settings: Sequence[Setting]) -> Driven:
    return Driven(ON_LEG, WALKING_COMMAND, highest=VENT)


def plant_library(scenario: Scenario) -> dict[str, bytes]:
    """Files of the plant in C by name: ``NAME_step(run, command, ...)`` goes on by one step under its inputs."""
    return library_files(surfaced(plant_of(scenario)).library)


def _volume_conditions(alone: PlantAlone, names: list[str]) -> list[str]:
    """Conditions in C that both chambers of a prescribed vane have a volume, now and at the end of the step."""
    if "angle" not in names or alone.library.program.program.actuator.shape is not None:
        return []
    plant = "run->parameters.plant"
    # Where V = V_dead + B (angle - stop) is 0: beyond it a chamber would have no volume.
    low = f"{plant}.angle_min - {plant}.dead_volume_1 / {plant}.displacement_per_radian"
    high = f"{plant}.angle_max + {plant}.dead_volume_2 / {plant}.displacement_per_radian"
    ends = ["angle"]
    if "angular_velocity" in names:
        ends.append("angle + angular_velocity * run->parameters.timing.step")
    return [f"({low} < {end} && {end} < {high})" for end in ends]


def surfaced(alone: PlantAlone) -> PlantAlone:
    """A plant whose library is called with its inputs."""
    names = [variable.name for variable in alone.inputs]
    says = [f"{variable.name}, {variable.summary} [{variable.unit}]" for variable in alone.inputs]
    words = {
        "arguments": ", ".join(f"double {name}" for name in names),
        "inputs": ", ".join(names),
        "first_inputs": ", ".join(
            repr(0.5 if variable.name == "command" else variable.start) for variable in alone.inputs
        ),
        "are_numbers": " && ".join([*(f"{name} - {name} == 0.0" for name in names), *_volume_conditions(alone, names)]),
        "said_inputs": ";\n".join(f" * {line}" for line in says) + ".",
        "listed_inputs": "\n".join(
            f"- `{variable.name}` [{variable.unit}]: {variable.summary}." for variable in alone.inputs
        ),
        "motion": alone.motion,
        "highest": repr(alone.highest),
        "lead": "\n".join(f"    parameters->{field} = {value};" for field, value in alone.lead),
        "follow_inputs": follow_lines(alone, "first", {name: name for name in names}),
        "hidden": ", ".join(f"`{c_identifier(path)}`" for path in sorted(alone.hidden)),
        "step": f"{alone.step:g}",
    }
    surface = Surface(
        "plant.h",
        "plant_main.c",
        "plant_README.md",
        "plant.c",
        words,
        "run_step",
        ("controller_period", "run_output_interval"),
    )
    return replace(alone, library=replace(alone.library, surface=surface))


def follow_lines(alone: PlantAlone, settings: str, inputs: Mapping[str, str]) -> str:
    """Lines of C that give settings what inputs decide, of which each is called something."""
    words = re.compile(rf"\b({'|'.join(inputs)})\b")
    lines = [(field, words.sub(lambda match: inputs[match[1]], value)) for field, value in alone.first]
    return "\n".join(f"    {settings}->{field} = {value.replace('@.', f'{settings}->')};" for field, value in lines)


@singledispatch
def _commanded(_motion: Motion, scenario: Scenario) -> Scenario:
    """The scenario under a command at every step of its engine; an ankle is prescribed from outside as well."""
    return _commanded_vane(scenario)


@_commanded.register
def _commanded_ankle(motion: PrescribedMotion, scenario: Scenario) -> Scenario:
    start: tuple[float, float, float] = PROFILES[motion.profile.kind].value(profile_parameters(motion.profile), 0.0)
    settings = {"start_level": start[0], "level": start[0], "ramp_start": 0.0, "ramp_time": 2.0}
    # It begins where the scenario has it.
    return replace(_commanded_vane(scenario), motion=PrescribedMotion(ProfileChoice("ramp_hold", settings)))


def _commanded_vane(scenario: Scenario) -> Scenario:
    # The engine's own step: commands come once in each, and nothing lies between.
    step = step_counts(
        scenario.run.duration, scenario.run.step, scenario.run.output_interval, scenario.controller.period
    ).step
    return replace(
        scenario,
        name=f"{scenario.name}-plant",
        description=f"The plant alone of this scenario: {scenario.description}",
        run=replace(scenario.run, step=step, output_interval=step),
        controller=Control("constant", {"command": 0.0}, step),
        sensors=Sensors(),
    )


@_commanded.register
def _commanded_walk(motion: WalkMotion, walk: Scenario) -> Scenario:
    # Sensors are there that nothing reads.
    check_can_leave(walk)
    step = step_counts(1.0, walk.run.step, 1.0, walk.controller.period).step
    # The forces under the foot are among the outputs.
    forces = dict.fromkeys(FORCES, 0.0) | {"force_bandwidth": motion.forces["force_bandwidth"]}
    return replace(
        walk,
        name=f"{walk.name}-plant",
        description=f"The plant alone of this walk, on its leg: {walk.description}",
        controller=Control(switching.CONSTANT.name, {"command": 0.0}, step),
        run=replace(walk.run, step=step),
        sensors=Sensors(),
        motion=replace(motion, forces=forces, faults={sensor: FaultSettings() for sensor in motion.faults}),
    )
