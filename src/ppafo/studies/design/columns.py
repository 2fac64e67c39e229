"""From candidates to columns for the lanes: the figures of the chosen parts and the chosen numbers, in SI."""

import numpy as np

from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.declaration import ORIFICE
from ppafo.parameters.parts import Part
from ppafo.simulation.numbers import TIMES, declared_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.studies.design.candidates import Candidates, Floats
from ppafo.studies.design.problem import DesignProblem
from ppafo.studies.design.variables import DEAD_VOLUME, OWN, SIZE


def values_of(problem: DesignProblem, candidates: Candidates) -> dict[str, Floats]:
    """Return the chosen numbers (candidates,) in SI, by path."""
    return {item.path: item.value(candidates.places[:, index]) for index, item in enumerate(problem.variables)}


def design_columns(problem: DesignProblem, scenario: Scenario, candidates: Candidates) -> dict[str, Floats]:
    """Return the columns of candidates that have one valve and run in one scenario."""
    chosen = values_of(problem, candidates)
    combinations = [problem.combinations[choice] for choice in candidates.choice.tolist()]
    count = len(candidates)
    columns = {path: np.full(count, number) for path, number in valve_numbers(combinations[0].valve).items()}
    size = chosen.get(SIZE, np.ones(count))
    for name in ("torque_constant", "volume_per_angle"):
        columns[f"actuator.{name}"] = size * np.array([item.actuator.values[name] for item in combinations])
    if DEAD_VOLUME in chosen:
        columns |= {f"{DEAD_VOLUME}_{chamber}": chosen[DEAD_VOLUME] for chamber in (1, 2)}
    known = declared_numbers(scenario)
    columns |= {path: values for path, values in chosen.items() if path not in OWN and (path in known or path in TIMES)}
    return columns


def valve_numbers(valve: Part) -> dict[str, float]:
    """Return the numbers of a valve by path; what its maker does not say is ideal, as the declarations have it."""
    settings = {item.name: item.default for item in VALVES[valve.kind].quantities if item.default is not None}
    orifice = {item.name: valve.values[item.name] for item in ORIFICE if item.name in valve.values}
    own = {name: valve.values[name] for name in settings if name in valve.values}
    return {f"valve.{name}": number for name, number in (orifice | settings | own).items()}
