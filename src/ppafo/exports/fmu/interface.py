"""Interface of an FMU: the closed loop without inputs, or the plant alone, driven by the importing tool."""

from collections.abc import Mapping
from dataclasses import dataclass

from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.library import Library
from ppafo.exports.c_library.plant import Input, follow_lines, half_open, plant_of, with_api
from ppafo.simulation.scenario import Scenario

_LOOP_TIME = (
    "Outputs are samples taken every <code>run.output_interval</code>; the latest one is shown. Any "
    "communication step is accepted. The run ends at <code>run.duration</code>; set a longer one before the start."
)
"""Time stepping of the closed loop, for the page of the unit."""
_LOOP_TUNING = (
    "The controller reads them at its next sample, the plant one engine step later. If the reference changes during "
    "the run, the metrics of ramp and hold keep the times of the initial reference."
)
"""Statement on when a changed parameter takes effect in the closed loop, for the page of the unit."""
_PLANT_TIME = (
    "Inputs are read at the beginning of a communication step. It is a multiple of <code>run.step</code>; the engine "
    "divides it further where its error asks for that. {motion} There is no stop time."
)
"""Time stepping of the plant, for the page of the unit; ``motion`` is the motion of its vane."""
_PLANT_TUNING = "They take effect at the next communication step."
"""Statement on when a changed parameter takes effect in the plant, for the page of the unit."""


@dataclass(frozen=True, slots=True)
class Interface:
    """Interface of an FMU: its library, whose settings, outputs and metrics are variables, and its inputs.

    ``templates`` are the C files that advance the unit, and ``words`` their template variables. ``hidden`` are the
    paths of settings that are no variables. ``time`` describes the time stepping and ``tuning`` when a changed
    parameter takes effect, both as HTML. ``step`` [s] is the usual communication step; if ``is_step_fixed``, others
    must be multiples of it. ``duration`` [s] is the length of the default experiment. ``clock`` describes the ticks of
    the controller clock, None for a unit without one. ``run`` is the Python run for comparison, under the command
    ``EXAMPLE`` for a plant.
    """

    library: Library
    templates: tuple[str, ...]
    time: str
    tuning: str
    step: float
    duration: float
    is_step_fixed: bool
    clock: str | None
    hidden: frozenset[str]
    inputs: tuple[Input, ...]
    words: Mapping[str, str]
    run: Scenario


def closed_loop(scenario: Scenario) -> Interface:
    """Return the interface of a complete scenario or walk with its controller, without inputs."""
    library = library_of(scenario)
    times = {setting.path: setting.value for setting in library.settings}
    return Interface(
        library=library,
        templates=("stepped.c", "closed_loop.c"),
        time=_LOOP_TIME,
        tuning=_LOOP_TUNING,
        step=times["run.output_interval"],
        duration=times["run.duration"],
        is_step_fixed=False,
        clock="clock of the controller, ticks every controller.period",
        hidden=frozenset(),
        inputs=(),
        words={},
        run=scenario,
    )


def plant_alone(scenario: Scenario) -> Interface:
    """Return the interface of the plant; inputs are a torque for a free joint, angle and rate for a locked one.

    The command is always an input, in all other cases the only one. ``export c`` writes the same plant.
    """
    alone = with_api(plant_of(scenario))
    library = alone.library
    inputs = ", ".join(f"inputs[{index}]" for index in range(len(alone.inputs)))
    numbers = {variable.name: f"inputs[{index}]" for index, variable in enumerate(alone.inputs)}
    return Interface(
        library=library,
        templates=("stepped.c", "plant_inputs.c", "plant.c"),
        time=_PLANT_TIME.format(motion=alone.drive.motion),
        tuning=_PLANT_TUNING,
        step=alone.step,
        duration=scenario.run.duration,
        is_step_fixed=True,
        clock=None,
        hidden=alone.hidden,
        inputs=alone.inputs,
        words={
            "inputs": inputs,
            "follow": follow_lines(alone, "settings", numbers),
            "checked": "the limits of the inputs, inertia, volumes and areas",
        },
        run=half_open(scenario),
    )
