"""The plant of a scenario alone: valve, gas and supply under a command, on a vane that is free or moved."""

from dataclasses import replace

from ppafo.control.catalog import PROFILES
from ppafo.control.controllers import switching
from ppafo.exports.c_library import commanded, scenario_library, walk_library
from ppafo.exports.c_library.files import Library, steps_source
from ppafo.exports.c_library.walk_preparation import check_can_leave
from ppafo.exports.fmu.description import Input, Interface
from ppafo.model.command import VENT
from ppafo.simulation.preparation import step_counts
from ppafo.simulation.scenario import (
    Control,
    FreeMotion,
    PrescribedMotion,
    ProfileChoice,
    Scenario,
    Sensors,
    vane_motion,
    worn_kind,
)
from ppafo.walking.declaration import FORCES
from ppafo.walking.motion import walk_of
from ppafo.walking.sensor_settings import FaultSettings

COMMAND = Input("command", "-", "command to the valve, clipped to -1 to 1; above 0 feeds chamber 1", 0.0)
WALKING_COMMAND = Input(
    "command", "-", "command to the valve, clipped to -1 to 2; above 0 feeds chamber 1, above 1.5 vents both", VENT
)
TIME = (
    "Inputs are taken at the beginning of a communication step. It is a multiple of <code>run.step</code>; the engine "
    "divides it further where its error asks for that. {motion} There is no end."
)
LED = "From there on the angle goes on with the angular velocity that is given; the next step begins at the next angle."
FREE = "The external torque is constant until the next one."
ON_LEG = "The leg walks on by its gait."
TUNING = "They are taken at the next communication step."

_FOLLOW_ANGLE = """\
    settings->motion_profile_start_level = inputs[1];
    settings->motion_profile_level = inputs[1] + inputs[2] * 0.0078125;
    settings->motion_profile_ramp_start = 0.0;
    settings->motion_profile_ramp_time = 0.0078125; /* short: a fast ankle stays in the range of a level */"""
_LEAD_ANGLE = """\
    rows[PARAMETER_PATH_START_LEVEL] = inputs[1];
    rows[PARAMETER_PATH_LEVEL] = inputs[1] + inputs[2] * (2.0 * length);
    rows[PARAMETER_PATH_RAMP_START] = time;
    rows[PARAMETER_PATH_RAMP_TIME] = 2.0 * length;"""


def plant_alone(item: Scenario | Scenario) -> Interface:
    """The plant; a free vane takes an external torque, one whose angle is prescribed takes angle and rate.

    That of a walk is the device on its walking leg, which takes the command alone.
    """
    return _plant(item) if worn_kind(item) is None else _walking_plant(item)


def _walking_plant(configuration: Scenario) -> Interface:
    check_can_leave(configuration)
    chosen = _walk_of_plant(configuration)
    library = walk_library(chosen)
    return Interface(
        name=chosen.name,
        library=library,
        template="plant.c",
        time=TIME.format(motion=ON_LEG),
        tuning=TUNING,
        step=chosen.time_step,
        duration=configuration.duration,
        outputs=tuple(name for name in library.program.outputs if name not in ("command", "reference")),
        shows_metrics=False,
        is_step_fixed=True,
        clock=None,
        hidden=_hidden(library),
        inputs=(WALKING_COMMAND,),
        words={"steps": steps_source(library), "highest": repr(VENT), "follow": "", "lead": ""},
    )


def _hidden(library: Library) -> frozenset[str]:
    """Settings that are none of the unit's variables."""
    hidden = {"run.duration", "run.output_interval", "controller.period", "controller.command"}
    unused = ("sensors.", "motion.profile.", "motion.external_torque")
    return frozenset(hidden | {item.path for item in library.settings if item.path.startswith(unused)})


def _plant(scenario: Scenario) -> Interface:
    # The ankle is led from outside, from where the scenario has it at the start.
    motion = scenario.motion
    if isinstance(motion, PrescribedMotion):
        from ppafo.simulation.plan import profile_parameters

        found: tuple[float, float, float] = PROFILES[motion.profile.kind].value(profile_parameters(motion.profile), 0.0)
        angle, _, _ = found
        settings = {"start_level": angle, "level": angle, "ramp_start": 0.0, "ramp_time": 2.0}
        motion = PrescribedMotion(ProfileChoice("ramp_hold", settings))
    chosen = replace(commanded(scenario), motion=motion)
    library = scenario_library(chosen)
    is_led = isinstance(chosen.motion, PrescribedMotion)
    unseen = {"command", *(("angle", "angular_velocity") if is_led else ())}
    return Interface(
        name=chosen.name,
        library=library,
        template="plant.c",
        time=TIME.format(motion=LED if is_led else FREE),
        tuning=TUNING,
        step=chosen.time_step,
        duration=scenario.duration,
        outputs=tuple(name for name in library.program.outputs if name not in unseen),
        shows_metrics=False,
        is_step_fixed=True,
        clock=None,
        hidden=_hidden(library),
        inputs=_inputs(chosen),
        words={
            "steps": steps_source(library),
            "highest": "1.0",
            "follow": _FOLLOW_ANGLE if is_led else "    settings->motion_external_torque = inputs[1];",
            "lead": _LEAD_ANGLE if is_led else "    rows[PARAMETER_PLANT_EXTERNAL_TORQUE] = inputs[1];",
        },
    )


def _walk_of_plant(configuration: Scenario) -> Scenario:
    """The walk with a command that is handed in at every step, and sensors that nobody looks at."""
    step = step_counts(1.0, configuration.time_step, 1.0, configuration.control.period).step
    motion = walk_of(configuration)
    # The forces under the foot are among the outputs.
    forces = dict.fromkeys(FORCES, 0.0) | {"force_bandwidth": motion.forces["force_bandwidth"]}
    return replace(
        configuration,
        name=f"{configuration.name}-plant",
        description=f"The plant alone of this walk, on its leg: {configuration.description}",
        control=Control(switching.CONSTANT.name, {"command": 0.0}, step),
        time_step=step,
        sensors=Sensors(),
        motion=replace(motion, forces=forces, faults={sensor: FaultSettings() for sensor in motion.faults}),
    )


def _inputs(scenario: Scenario) -> tuple[Input, ...]:
    motion = vane_motion(scenario)
    if isinstance(motion, FreeMotion):
        said = "torque T_ex on the joint, above 0 works against plantarflexion"
        return (COMMAND, Input("external_torque", "N m", said, motion.external_torque))
    angle = motion.profile.settings["start_level"]
    return (
        COMMAND,
        Input("angle", "rad", "angle of the ankle, 90 deg neutral, growing in plantarflexion", angle),
        Input("angular_velocity", "rad/s", "its rate", 0.0),
    )
