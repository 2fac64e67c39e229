"""Interface of an FMU: the closed loop without inputs, or the plant alone, driven by the importing tool."""

from dataclasses import dataclass

from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.library import Library
from ppafo.exports.c_library.plant import Input, PlantAlone, half_open, plant_of
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Interface:
    """Interface of an FMU: its library, whose settings, outputs and metrics are variables, and its plant, if alone.

    ``run`` is the Python run for comparison, under the command ``EXAMPLE`` for a plant. ``step`` [s] is the usual
    communication step, of which those of a plant must be multiples; ``duration`` [s] is the length of the default
    experiment. A closed loop has a clock of its controller.
    """

    library: Library
    run: Scenario
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
    return Interface(library, scenario, times["run.output_interval"], times["run.duration"])


def plant_alone(scenario: Scenario) -> Interface:
    """Return the interface of the plant; inputs are a torque for a free joint, angle and rate for a locked one.

    The command is always an input, in all other cases the only one. ``export c`` writes the same plant.
    """
    plant = plant_of(scenario)
    return Interface(plant.library, half_open(scenario), plant.step, scenario.run.duration, plant)
