"""Iterative learning of the feed-forward table of ``damped_proportional`` by repeating a task.

The law of Zhang, Cheah and Collins (2015) from one repetition n to the next, for every place i of the table:

    filtered_n = (1 - m) filtered_{n-1} + m e_n
    table_{n+1}(i) = b table_n(i) + k filtered_n(i)

with the table used a little earlier than it was learnt, by the lead. The error e at a knot is the mean over the time
that belongs to the knot, weighted as the table is read: straight to its neighbours.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ppafo.control.controllers.feedback import KNOTS
from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError, SimulationError
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate

LEARNER = "damped_proportional"
WITHOUT_PROGRESS = 5
"""Repetitions without a better one after which learning stops."""


@dataclass(frozen=True, slots=True)
class LearningLaw:
    """Gain k [1/(N m)], what is remembered b [-], fraction of the new error in the filter m [-], lead [s].

    At most ``repetitions`` are made; one that is less than the fraction ``progress`` better than the best so far is
    none.
    """

    gain: float = 0.8
    memory: float = 0.999
    filter_share: float = 0.7
    lead: float = 0.02
    repetitions: int = 60
    progress: float = 0.01


@dataclass(frozen=True, slots=True)
class Learning:
    """What was learnt: the scenario with the best table in it, and the RMS error [N m] of every repetition."""

    scenario: Scenario
    errors: tuple[float, ...]
    best: int
    is_converged: bool


def learn(scenario: Scenario, law: LearningLaw | None = None) -> Learning:
    """Repeat a task, learn, and stop where it becomes no better; the table starts as the scenario has it.

    ScenarioError for another controller than ``damped_proportional``, or a task longer than its table;
    SimulationError where a repetition diverges.
    """
    chosen = law or LearningLaw()
    _check(scenario, chosen)
    table = np.array(list(table_of(scenario).values()))
    filtered = np.zeros(KNOTS)
    errors: list[float] = []
    best, last_progress = scenario, 0
    while len(errors) < chosen.repetitions and len(errors) - last_progress <= WITHOUT_PROGRESS:
        trial = with_table(scenario, table)
        recording, error = _repetition(trial)
        before = min(errors, default=math.inf)
        best = trial if error < before else best
        last_progress = len(errors) if error < (1.0 - chosen.progress) * before else last_progress
        errors.append(error)
        met = knot_errors(recording, scenario.control.settings["knot_spacing"], chosen.lead)
        filtered = (1.0 - chosen.filter_share) * filtered + chosen.filter_share * met
        table = np.clip(chosen.memory * table + chosen.gain * filtered, -1.0, 1.0)
    return Learning(best, tuple(errors), int(np.argmin(errors)), len(errors) - last_progress > WITHOUT_PROGRESS)


def knot_errors(recording: Recording, spacing: float, lead: float) -> Floats:
    """Mean torque error [N m] around each knot, a lead [s] after it; knots that the recording does not reach have 0."""
    error = recording["reference"] - recording["torque"]
    position = (recording.time - lead) / spacing
    weights = np.maximum(0.0, 1.0 - np.abs(position[None, :] - np.arange(KNOTS)[:, None]))
    total = weights.sum(axis=1)
    means: Floats = weights @ error / np.where(total > 0.0, total, 1.0)
    return means


def table_of(scenario: Scenario) -> dict[str, float]:
    """The learnt commands [-] of a scenario by the names of their knots."""
    names = [f"knot_{number}" for number in range(KNOTS)]
    return {name: scenario.control.settings[name] for name in names}


def with_table(scenario: Scenario, table: Floats) -> Scenario:
    """The scenario with other learnt commands [-] at the knots."""
    knots = {f"knot_{number}": float(value) for number, value in enumerate(table)}
    control = replace(scenario.control, settings={**scenario.control.settings, **knots})
    return replace(scenario, control=control)


def _repetition(scenario: Scenario) -> tuple[Recording, float]:
    result = simulate(scenario)
    if not result.status.is_completed:
        raise SimulationError(f"{scenario.name}: a repetition of the task failed: {result.status.message}")
    return result.recording, result.metrics["rms_error"].value


def _check(scenario: Scenario, law: LearningLaw) -> None:
    control = scenario.control
    if control.kind != LEARNER:
        raise ScenarioError(
            f"{scenario.name}: only the controller '{LEARNER}' has a table to learn, not {control.kind}"
        )
    reach = (KNOTS - 1) * control.settings["knot_spacing"]
    if reach < scenario.duration * (1.0 - 1.0e-9):
        raise ScenarioError(
            f"{scenario.name}: the table of {KNOTS} knots reaches to {reach:g} s, the task lasts "
            f"{scenario.duration:g} s: make controller.knot_spacing at least {scenario.duration / (KNOTS - 1):.4g} s"
        )
    if law.repetitions < 1 or not 0.0 < law.filter_share <= 1.0 or not 0.0 <= law.memory <= 1.0 or law.gain <= 0.0:
        raise ScenarioError("learning needs at least one repetition, a gain above 0, and fractions from 0 to 1")
