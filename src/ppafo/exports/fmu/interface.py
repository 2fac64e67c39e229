"""Interface of an FMU, closed loop or plant driven by the importing tool, and its variables."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import OUTPUTS, expected_csv
from ppafo.exports.c_library.law import law_of, samples_csv
from ppafo.exports.c_library.library import ExportParameter, Library
from ppafo.exports.c_library.plant import Input, PlantAlone, half_open, plant_of
from ppafo.model.controlled import CONTROLLED
from ppafo.simulation.scenario import Scenario

Tuning = Literal["hidden", "tunable", "fixed"]
"""Access to a setting: not a variable, a parameter tunable during the run, or a fixed one."""
Variability = Literal["discrete", "continuous"]
"""Variability of an output in terms of FMI: discrete between samples, or continuous."""

FIXED_SECTIONS = ("run", "initial", "gas", "actuator", "foot_plate", "wearer", "motion", "motion.profile")
"""Sections of settings used only at the start of a run, which cannot change during the run."""
FIXED_NAMES = ("period", "delay", "seed")
"""Names of further settings that cannot change during a run: they determine step counts or seed the noise."""
TUNABLE_OF_WEARER = ("residual_share", "ankle_stiffness", "ankle_rest_angle", "ankle_damping")
"""Settings of the wearer that may change during a run, unlike the weight of a leg."""
STEPPED = (
    "command",
    *(kind.reference for kind in CONTROLLED.values()),
    "strides",
    "contact",
    "controller_phase",
)
"""Outputs that change only at samples."""
_LARGEST_LIMIT = 1.0e308
"""Magnitude above which a limit counts as no limit, since XML would contain the largest floats."""


@dataclass(frozen=True, slots=True)
class Interface:
    """Interface of an FMU: its library, whose settings, outputs and metrics are variables, and its plant, if alone.

    ``table`` returns samples of a run for comparison as CSV, inputs among them, under the command ``EXAMPLE`` for a
    plant. ``step`` [s] is the usual communication step, of which those of a plant or a law must be multiples;
    ``duration`` [s] is the length of the default experiment. A closed loop has a clock of its controller.
    """

    library: Library
    table: Callable[[], bytes]
    step: float
    duration: float
    plant: PlantAlone | None = None

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Inputs at each communication step."""
        return () if self.plant is None else self.plant.inputs


def closed_loop(scenario: Scenario) -> Interface:
    """Return the interface of a complete scenario or walk with its controller, without inputs."""
    library = library_of(scenario)
    times = {setting.path: setting.value for setting in library.settings}
    table = partial(expected_csv, scenario, library.program.outputs)
    return Interface(library, table, times["run.output_interval"], times["run.duration"])


def plant_alone(scenario: Scenario) -> Interface:
    """Return the interface of the plant; inputs are a torque for a free joint, angle and rate for a locked one.

    The command is always an input, in all other cases the only one. ``export c`` writes the same plant.
    """
    plant = plant_of(scenario)
    table = partial(expected_csv, half_open(scenario), plant.library.program.outputs)
    return Interface(plant.library, table, plant.step, scenario.run.duration, plant)


def law_alone(scenario: Scenario) -> Interface:
    """Return the interface of the law; inputs are reference and measurement, the output is the command.

    A step gives the command of the sample at its beginning. ``export c`` writes the same law.
    """
    law = law_of(scenario)
    return Interface(law.library, partial(samples_csv, scenario, 1), law.step, scenario.run.duration, law)


@dataclass(frozen=True, slots=True)
class FmuVariable:
    """Variable of an FMU: name, number, unit and meaning; ``causality`` and ``variability`` in terms of FMI.

    ``start`` is None for a calculated variable, ``minimum`` and ``maximum`` None for no limit; all three are in
    ``unit``.
    """

    name: str
    number: int
    unit: str
    summary: str
    causality: str
    variability: str
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None


def tuning_of(interface: Interface, setting: ExportParameter) -> Tuning:
    """Return the access to a setting: hidden if no variable, tunable if changeable during the run, else fixed."""
    if interface.plant is not None and setting.path in interface.plant.hidden:
        return "hidden"
    section, _, name = setting.path.rpartition(".")
    if section == "wearer" and name in TUNABLE_OF_WEARER:
        return "tunable"
    return "fixed" if section in FIXED_SECTIONS or name in FIXED_NAMES else "tunable"


def variability_of(output: str) -> Variability:
    """Return ``discrete`` for an output that changes only at samples, ``continuous`` for any other."""
    return "discrete" if output in STEPPED else "continuous"


def variables_of(interface: Interface) -> tuple[FmuVariable, ...]:
    """Return all variables in the order of their numbers: settings, outputs, metrics, inputs.

    The C code uses the same numbers; these also count hidden settings.
    """
    library = interface.library
    program = interface.library.program
    rows: list[tuple[Any, ...]] = []
    for setting in library.settings:
        quantity = setting.quantity
        tuning = tuning_of(interface, setting)
        limits = (end if abs(end) < _LARGEST_LIMIT else None for end in (quantity.minimum, quantity.maximum))
        meaning = quantity.summary or quantity.name
        rows.append((setting.path, quantity.unit, meaning, "parameter", tuning, setting.value, *limits))
    rows += ((name, *OUTPUTS[name], "output", variability_of(name)) for name in program.outputs)
    rows += ((f"metrics.{one.name}", one.unit, one.summary, "local", "continuous") for one in program.metrics)
    for item in interface.inputs:
        rows.append((item.name, item.unit, item.summary, "input", "continuous", item.start, item.minimum, item.maximum))
    return tuple(
        FmuVariable(name, number, unit, library.worded(summary), *rest)
        for number, (name, unit, summary, *rest) in enumerate(rows)
        if "hidden" not in rest
    )
