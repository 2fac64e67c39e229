"""The suggestion of a sizing study with the other readings of the paper's chambers: does it still suffice?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.answers.display_units import quantity_text
from ppafo.parameters.chamber_volumes import ChamberVolumes, other_readings
from ppafo.parameters.device import Actuator
from ppafo.parameters.parts import Part
from ppafo.questions.size.file import SizingProblem
from ppafo.questions.size.search import Trials


@dataclass(frozen=True, slots=True)
class OtherChambers:
    """A valve at a pressure with other chambers: RMS error [N m], gas per repetition [kg], total with the reserve [kg].

    ``keeps`` tells whether the error limit is kept with the best gains.
    """

    name: str
    keeps: bool
    error: float
    gas: float
    gas_in_all: float


def with_other_chambers(
    problem: SizingProblem, valve: Part, pressure: float, threads: int | None
) -> tuple[OtherChambers, ...]:
    """Return a valve at a supply pressure [Pa absolute] with each other reading; none for chambers of its own."""
    return tuple(
        _tried(problem, valve, pressure, chambers, threads) for chambers in other_readings(_actuator_of(problem))
    )


def other_sentences(others: Sequence[OtherChambers]) -> list[str]:
    """Return a sentence for each reading."""
    return [
        f"with {one.name}: RMS error {quantity_text(one.error, 'torque')}"
        f"{'' if one.keeps else ', above the limit'}, {quantity_text(one.gas, 'gas mass')} per repetition, "
        f"{quantity_text(one.gas_in_all, 'gas mass')} in total"
        for one in others
    ]


def _actuator_of(problem: SizingProblem) -> Actuator:
    """Return the actuator that was sized: that of the scenario with the figures of the part."""
    own = problem.scenario.device.actuator
    if problem.actuator is None:
        return own
    values = problem.actuator.values
    return replace(own, torque_constant=values["torque_constant"], volume_per_angle=values["volume_per_angle"])


def _tried(
    problem: SizingProblem, valve: Part, pressure: float, chambers: ChamberVolumes, threads: int | None
) -> OtherChambers:
    scenario = replace(problem.scenario, device=chambers.of(problem.scenario.device))
    # Without the part, whose printed volume per angle would stand in for that of the reading.
    trial = Trials(replace(problem, scenario=scenario, actuator=None), threads).best(valve, np.array([pressure]))
    error, gas = float(trial.error[0]), float(trial.gas[0])
    keeps = error <= problem.largest_error
    return OtherChambers(chambers.name, keeps, error, gas, gas * problem.repetitions * (1.0 + problem.reserve))
