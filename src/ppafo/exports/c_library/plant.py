"""Export of the plant of a scenario or walk without its controller: inputs come from outside at each step."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import singledispatch

from ppafo.control.controllers import switching
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import expected_csv, library_files
from ppafo.exports.c_library.library import ExportedProgram, ExportParameter, Library, LibraryApi, c_identifier
from ppafo.exports.c_library.walk_preparation import check_can_be_exported
from ppafo.model.controlled import CONTROLLED
from ppafo.model.valves.kind import VENT
from ppafo.parameters.graph import outside
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.plan import step_counts
from ppafo.simulation.scenario import Control, FreeMotion, Motion, PrescribedMotion, ProfileChoice, Scenario, Sensors
from ppafo.walking.declaration import FORCES
from ppafo.walking.motion import WalkMotion

_WALKING = "command to the valve, clipped to -1 to 2; above 0 feeds chamber 1, above 1.5 vents both"
STEPS = "run.step"
"""Path of the setting for the input interval."""
_AS_STEPS = ("controller_period", "run_output_interval")
"""Other time settings, which must equal the input interval."""
_WITHOUT_EFFECT = ("run.duration", "run.output_interval", "controller.command", "controller.period")
"""Settings without effect on a plant that is stepped from outside."""
_REPLACED = ("sensors.", "motion.external_torque", "motion.ankle_torque")
_PATH = "motion.profile."
"""Prefixes of the paths replaced by inputs: in any plant, and in a plant with an ankle driven by inputs."""
_FIRST_RAMP = 0.0078125
"""Duration [s] of the initial ramp of an angle; short, so that a fast ankle stays in the range of a level."""
EXAMPLE = 0.5
"""Command [-] of the example, nonzero to have an effect."""


@dataclass(frozen=True, slots=True)
class Input:
    """Input of a plant at each step: name, unit, meaning, initial value, minimum and maximum (None for no limit)."""

    name: str
    unit: str
    summary: str
    start: float
    minimum: float | None = None
    maximum: float | None = None


COMMAND = Input("command", "-", "command to the valve, clipped to -1 to 1; above 0 feeds chamber 1", 0.0, -1.0, 1.0)
WALKING_COMMAND = Input("command", "-", _WALKING, VENT, -1.0, VENT)


Assignment = tuple[str, str]
"""C field and the expression assigned to it: ``{angle}`` is the input of this name, ``{settings}`` the pointer."""


@dataclass(frozen=True, slots=True)
class Drive:
    """External drive of a plant: its command, its other inputs, and the motion of its joint within a step.

    ``motion`` describes the motion in words. ``settings`` assigns the first inputs to settings of the run.
    ``parameters`` assigns the inputs to engine parameters at each step, which starts at ``time`` [s] and takes
    ``length`` [s]. ``steps`` is the path of the setting for the time from input to input.
    """

    motion: str
    command: Input = COMMAND
    inputs: tuple[Input, ...] = ()
    settings: tuple[Assignment, ...] = ()
    parameters: tuple[Assignment, ...] = ()
    steps: str = STEPS


@dataclass(frozen=True, slots=True)
class PlantAlone:
    """Plant with external inputs: its library, its inputs and motion, and the input interval ``step`` [s].

    ``hidden`` are the paths of settings without effect, since inputs replace them.
    """

    library: Library
    drive: Drive
    hidden: frozenset[str]
    step: float

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Inputs at each step, starting with the command."""
        return (self.drive.command, *self.drive.inputs)


def plant_of(scenario: Scenario) -> PlantAlone:
    """Return the plant of a scenario; inputs are a torque for a free joint, angle and rate for a locked joint.

    A joint on a path defined by the scenario and a device on a walking leg take only the command.
    """
    plant = _commanded(scenario.motion, scenario)
    # An ankle that is locked is on a ramp that inputs can turn: one that is level.
    angle = plant.motion.locked_angle if isinstance(plant.motion, PrescribedMotion) else None
    if angle is not None:
        settings = {"start_level": angle, "level": angle, "ramp_start": 0.0, "ramp_time": 2.0}
        plant = replace(plant, motion=PrescribedMotion(ProfileChoice("ramp_hold", settings)))
    library = library_of(plant)
    drive = _drive_of(scenario.motion, {setting.path: setting for setting in library.settings})
    of_steps = ((name, f"{{settings}}->{c_identifier(STEPS)}") for name in _AS_STEPS)
    drive = replace(drive, settings=(*of_steps, *drive.settings))
    input_names = {variable.name for variable in (drive.command, *drive.inputs)}
    references = {kind.reference for kind in CONTROLLED.values()}
    outputs = tuple(name for name in library.program.outputs if name not in input_names | references)
    # Metrics need a whole run, which only the caller sees.
    # Where a locked joint may take its steps whole, this one does as long as it stands still.
    is_turned = "angle" in input_names
    program = library.program.program
    rests_whole = is_turned and program.feed is None and not (program.actuator.gives or program.valve.regulates)
    program = replace(program, meters=(), traced=outputs, rests_whole=rests_whole)
    beginnings = (*_REPLACED, _PATH) if is_turned else _REPLACED
    replaced = {setting.path for setting in library.settings if setting.path.startswith(beginnings)}
    library = replace(library, program=ExportedProgram(program, ()), rules=())
    if is_turned:
        # The inputs that turn a joint are held to its stops at each step.
        library = replace(library, checking=None)
    alone = PlantAlone(library, drive, frozenset(replaced.union(_WITHOUT_EFFECT)), plant.controller.period)
    return replace(alone, library=replace(library, api=_api_of(alone)))


@singledispatch
def _drive_of(_motion: Motion, _settings: Mapping[str, ExportParameter]) -> Drive:
    """Return the external drive of a plant with this motion, within the ranges of its settings: here a walk."""
    return Drive(motion="The leg follows its gait.", command=WALKING_COMMAND)


@_drive_of.register
def _angle_drive(motion: PrescribedMotion, settings: Mapping[str, ExportParameter]) -> Drive:
    """Return the drive of a prescribed joint: inputs angle and rate if locked, no input if on a path."""
    if motion.locked_angle is None:
        return Drive(motion="The ankle follows the prescribed motion of the scenario.")
    stop_1 = settings["actuator.angle_min"].value
    stop_2 = settings["actuator.angle_max"].value
    # So fast that the short ramp of the first angle still ends within what a level may be.
    fastest = (settings["motion.profile.level"].quantity.maximum - max(abs(stop_1), abs(stop_2))) / _FIRST_RAMP
    start = motion.locked_angle
    summary = "angle of the ankle, 90 deg neutral, growing in plantarflexion"
    return Drive(
        motion=(
            "Within a step the angle changes at the given angular velocity; the next step starts at the "
            "next given angle."
        ),
        inputs=(
            Input("angle", "rad", summary, start, stop_1, stop_2),
            Input("angular_velocity", "rad/s", "its rate", 0.0, -fastest, fastest),
        ),
        settings=(
            ("motion_profile_start_level", "{angle}"),
            ("motion_profile_level", f"{{angle}} + {{angular_velocity}} * {_FIRST_RAMP}"),
            ("motion_profile_ramp_start", "0.0"),
            ("motion_profile_ramp_time", f"{_FIRST_RAMP}"),
        ),
        parameters=(
            ("path.start_level", "{angle}"),
            ("path.level", "{angle} + {angular_velocity} * (2.0 * length)"),
            ("path.ramp_start", "time"),
            ("path.ramp_time", "2.0 * length"),
        ),
    )


@_drive_of.register
def _torque_drive(motion: FreeMotion, settings: Mapping[str, ExportParameter]) -> Drive:
    """Return the drive of a free joint: T_ex on a vane without leg, or T_2, opposed to T_ex, on the ankle of a leg."""
    name = "external_torque"
    summary = "T_ex, above 0 against plantarflexion"
    load = ""
    start = motion.external_torque
    if motion.leg is not None:
        name = "ankle_torque"
        summary = "T_2, above 0 towards plantarflexion"
        load = "-"
        start = motion.leg.ankle_torque
    limits = settings[f"motion.{name}"].quantity
    torque = Input(name, "N m", f"torque on the ankle, {summary}", start, limits.minimum, limits.maximum)
    return Drive(
        motion="The torque is constant until the next value.",
        inputs=(torque,),
        settings=((c_identifier(f"motion.{name}"), f"{{{name}}}"),),
        parameters=(("plant.external_torque", f"{load}{{{name}}}"),),
    )


def plant_library(scenario: Scenario) -> dict[str, bytes]:
    """Return the C files of the plant by name; ``NAME_step(run, command, ...)`` advances by one step."""
    library = plant_of(scenario).library
    return {**library_files(library), "expected.csv": expected_csv(half_open(scenario), library.program.outputs)}


def half_open(scenario: Scenario) -> Scenario:
    """Return the plant under a constant command for at least 0.1 s, the example of the library, as a scenario."""
    plant = _commanded(scenario.motion, scenario)
    command = replace(plant.controller, settings={**plant.controller.settings, "command": EXAMPLE})
    duration = max(0.1, declared_numbers(plant)["run.duration"].minimum)
    return replace(plant, controller=command, run=replace(plant.run, duration=duration))


def _api_of(alone: PlantAlone) -> LibraryApi:
    """Return the API of a plant, which takes its inputs at each step."""
    names = [variable.name for variable in alone.inputs]
    by_name = {name: name for name in names}
    # An example whose command does something.
    example = [EXAMPLE if variable.name == "command" else variable.start for variable in alone.inputs]
    summaries = [(variable, alone.library.worded(variable.summary)) for variable in alone.inputs]
    comments = [f" * {variable.name}, {summary} [{variable.unit}]" for variable, summary in summaries]
    entries = [f"- `{variable.name}` [{variable.unit}]: {summary}." for variable, summary in summaries]
    are_numbers = [f"{name} - {name} == 0.0" for name in names]
    if "angle" in names and alone.library.program.program.actuator.shape is None:
        # Both chambers of a prescribed vane have a volume, now and at the end of the step: beyond where
        # V = V_dead + B (angle - stop) is 0 a chamber would have none.
        plant = "run->parameters.plant"
        low = f"{plant}.angle_min - {plant}.dead_volume_1 / {plant}.displacement_per_radian"
        high = f"{plant}.angle_max + {plant}.dead_volume_2 / {plant}.displacement_per_radian"
        ends = ("angle", "angle + angular_velocity * run->parameters.timing.step")
        are_numbers += [f"({low} < {end} && {end} < {high})" for end in ends]
    words = {
        "arguments": ", ".join(f"double {name}" for name in names),
        "inputs": ", ".join(names),
        "first_inputs": ", ".join(map(repr, example)),
        "check_inputs": "".join(f", {value!r}" for value in example),
        "check_first": "",
        "check_metrics": "",
        "are_numbers": " && ".join(are_numbers),
        "said_inputs": ";\n".join(comments) + ".",
        "listed_inputs": "\n".join(entries),
        "motion": alone.drive.motion,
        "highest": repr(alone.drive.command.maximum),
        "lead": "\n".join(
            f"    parameters->{field} = {expression.format(**by_name)};" for field, expression in alone.drive.parameters
        ),
        "follow_inputs": follow_lines(alone, "first", by_name),
        "hidden": ", ".join(f"`{c_identifier(path)}`" for path in sorted(alone.hidden)),
        "step": f"{alone.step:g}",
        "first": "".join(f"    before.{setting} = before.{c_identifier(STEPS)};\n" for setting in _AS_STEPS),
    }
    return LibraryApi("plant.h", "plant_main.c", "plant_README.md", ("interface.c", "plant.c"), words)


def follow_lines(alone: PlantAlone, settings: str, inputs: Mapping[str, str]) -> str:
    """Return C lines that assign the ``inputs``, C expressions by name, to the struct at pointer ``settings``."""
    return "\n".join(
        f"    {settings}->{field} = {expression.format(settings=settings, **inputs)};"
        for field, expression in alone.drive.settings
    )


@singledispatch
def _commanded(_motion: Motion, scenario: Scenario) -> Scenario:
    """Return the scenario with an external command at every engine step."""
    # The engine's own step: commands come once in each, and nothing lies between.
    step = step_counts(
        scenario.run.duration, scenario.run.step, scenario.run.output_interval, scenario.controller.period
    ).step
    return replace(
        scenario,
        name=f"{scenario.name}-plant",
        description=f"Plant without controller of this scenario: {scenario.description}",
        run=replace(scenario.run, step=step, output_interval=step),
        controller=Control("constant", {"command": 0.0}, step),
        # Sensor readings are not used here, but their times divide a step of the engine, and so does their lag.
        sensors=Sensors(
            delay=scenario.sensors.delay,
            angle_bandwidth=scenario.sensors.angle_bandwidth,
            pressure_bandwidth=scenario.sensors.pressure_bandwidth,
        ),
        links=outside(scenario.links, "controller", "reference"),
    )


@_commanded.register
def _commanded_walk(motion: WalkMotion, walk: Scenario) -> Scenario:
    # Sensors are there that nothing reads.
    check_can_be_exported(walk)
    step = step_counts(1.0, walk.run.step, 1.0, walk.controller.period).step
    control = Control(switching.CONSTANT.name, {"command": 0.0}, step)
    # The forces under the foot are among the outputs.
    forces = dict.fromkeys(FORCES, 0.0) | {"force_bandwidth": motion.forces["force_bandwidth"]}
    return replace(
        walk,
        name=f"{walk.name}-plant",
        description=f"Plant without controller of this walk, on its leg: {walk.description}",
        controller=control,
        run=replace(walk.run, step=step, output_interval=step),
        sensors=Sensors(),
        motion=replace(motion, forces=forces),
        links=outside(walk.links, "controller"),
    )
