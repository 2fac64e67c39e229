"""The league's torque task, as every entrant plays it, and how its league is presented."""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from ppafo.answers import Column
from ppafo.answers.display_units import display_value, quantity_text, title_with_unit
from ppafo.errors import ScenarioError, SimulationError
from ppafo.metrics import METRICS
from ppafo.parameters.overrides import over, split_override
from ppafo.progress import Report
from ppafo.questions.league.answer import League, Look, Presentation, TableColumn, measure, of_draws
from ppafo.questions.league.bound import LowerBound, lower_bound, play_optimum
from ppafo.questions.league.sampled_bound import SampledBound, sampled_bound, sampled_problem
from ppafo.questions.league.standing import (
    ENTRANTS,
    FORESEEN,
    NOISE_DRAWS,
    Bounded,
    Entrant,
    Measures,
    Robustness,
    Standing,
    draw_devices,
    draw_factors,
    draw_seeds,
    learn,
    relaxed_by,
    table_of,
    with_noise,
)
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate, simulate_many
from ppafo.studies.sampling import is_noisy, other_noise

_ERROR, _GAS = "rms_error", "gas_supplied"


@dataclass(frozen=True, slots=True)
class TorqueBound(Bounded[LowerBound]):
    """The lower bound of a valve; for a solenoid pair at a fixed ankle also that at its own sample rate."""

    sampled: SampledBound | None = None


def bound_sentence(valve: str, bounded: Bounded[LowerBound]) -> str:
    """Return the minimum error of a valve in one sentence, and how well the engine agrees."""
    bound = bounded.bound
    least = quantity_text(bound.least_error.rms_error, "torque", ".4g")
    gas = quantity_text(bound.least_error.gas, "gas mass", ".4g")
    finding = (
        f"an RMS error of {least}, which counts as zero, takes at least {gas}"
        if bound.is_attainable
        else f"no control reaches an RMS error below {least}, and that takes {gas}"
    )
    text = (
        f"lower bound, {valve}: {finding}; {bound.intervals} intervals, changed by "
        f"{quantity_text(bound.moved, 'fraction', '.2g')} in the last refinement"
    )
    if not bounded.played:
        text = f"{text}; for a valve that may switch at any rate, so no run can confirm it"
        sampled = bounded.sampled if isinstance(bounded, TorqueBound) else None
        if sampled is None:
            return text
        found, certified = (quantity_text(error, "torque", ".4f") for error in (sampled.found, sampled.certified))
        return f"{text}; at its own sample rate the best decisions found reach {found}, and none is below {certified}"
    error, gas = (quantity_text(fraction, "fraction", ".2g") for fraction in disagreement(bounded))
    return f"{text}; in the simulation the error agrees within {error}, the gas within {gas}"


def disagreement(bounded: Bounded[LowerBound]) -> tuple[float, float]:
    """Return the largest fractions by which error and gas of a played optimal command differ from the optimiser's."""
    pairs = list(zip(bounded.points, bounded.played, strict=True))
    error = max(abs(run.rms_error / optimum.rms_error - 1.0) for optimum, run in pairs)
    return error, max(abs(run.gas / optimum.gas - 1.0) for optimum, run in pairs)


def _task_data(league: League) -> dict[str, Any]:
    return {"scenario": league.contest.name, "overrides": list(league.contest.overrides)}


def _task_remarks(league: League) -> Sequence[str]:
    assert isinstance(league.contest, TorqueContest), "a league of the torque task"
    return (f"device: {league.contest.device}",)


def _bound_data(bounded: Bounded[LowerBound]) -> dict[str, Any]:
    bound = bounded.bound
    optima = (bound.least_error, *bound.curve)
    sampled = bounded.sampled if isinstance(bounded, TorqueBound) else None
    return {
        "intervals": bound.intervals,
        "moved": bound.moved,
        "unmeasurable_error": bound.unmeasurable,
        "relaxes": list(bounded.relaxes),
        "sampled": None if sampled is None else {"found": sampled.found, "certified": sampled.certified},
        "least_error_first": [
            {"rms_error": item.rms_error, "gas": item.gas, "overlap": item.overlap} for item in optima
        ],
        "played": [{"rms_error": run.rms_error, "gas": run.gas} for run in bounded.played],
    }


def _standing_data(_league: League, standing: Standing) -> dict[str, Any]:
    learning = standing.learning
    return {
        "status": standing.status,
        "metrics": {name: {"value": value, "unit": METRICS[name].unit} for name, value in standing.measures.items()},
        "learning": None
        if learning is None
        else {"errors": list(learning.errors), "best": learning.best, "is_converged": learning.is_converged},
    }


def _robustness_data(robust: Robustness) -> dict[str, Any]:
    return {
        "median": _finite(robust.not_exceeded(_ERROR, 0.5)),
        "quantile_95": _finite(robust.not_exceeded(_ERROR, 0.95)),
        "errors": [_finite(value) for value in robust.values(_ERROR, math.inf)],
    }


def _learning_remarks(_league: League, standing: Standing) -> Sequence[str]:
    learning = standing.learning
    if learning is None:
        return ()
    ended = "stopped improving" if learning.is_converged else "was still improving"
    first, best = (display_value(learning.errors[place], "torque") for place in (0, learning.best))
    unit = title_with_unit("", "torque").strip(" ()")
    return (
        f"{standing.entrant.name}: RMS error {first:.4f} {unit} in the first repetition, {best:.4f} {unit} in "
        f"repetition {learning.best + 1}; after {len(learning.errors)} it {ended}",
    )


def _finite(value: float) -> float | None:
    return value if value < math.inf else None


TORQUE = Presentation(
    format="ppafo league",
    introduction=(
        "Every controller was simulated on the device. 'Above minimum' is the distance to the lower bound of the "
        "controller's own valve: to the minimum error of any control, and to the minimum gas for its own error. The "
        "heads of these columns list what the bound relaxes; a cell is empty where the bound makes use of that, as "
        "the distance then says nothing about the controller."
    ),
    caption=(
        "A mark for each controller; thin lines: 5 to 95 % of its error on drawn devices. Lines: lower bounds for "
        "each valve, for the nominal device; drawn devices may lie beyond them."
    ),
    draws_remark="median and 95 %: RMS errors on {draws} random devices, each value varied either way within: {spread}",
    look=Look(
        size=(8.0, 5.4),
        right=0.66,
        error=_ERROR,
        error_label=title_with_unit("RMS torque error", "torque"),
        gas_label=title_with_unit("Gas taken from the supply", "gas mass"),
        title="Error against gas: nothing below and left of a line is possible",
        is_logarithmic=True,
    ),
    columns=(
        measure("RMS", _ERROR, "torque", ".4f"),
        measure("ramp", "rms_error_ramp", "torque", ".4f"),
        measure("hold", "rms_error_hold", "torque", ".4f"),
        measure("peak", "peak_error", "torque", ".4f"),
        TableColumn(Column("error above minimum", "torque", ".4f"), League.error_above_least),
        measure("gas", _GAS, "gas mass", ".3f"),
        TableColumn(Column("gas above minimum", "gas mass", "z.3f"), League.gas_above_least),
        measure("switchings", "switchings", "", ".0f"),
        of_draws("median", "torque", ".4f", lambda robust: robust.not_exceeded(_ERROR, 0.5)),
        of_draws("95 %", "torque", ".4f", lambda robust: robust.not_exceeded(_ERROR, 0.95)),
    ),
    task_data=_task_data,
    task_remarks=_task_remarks,
    bound_sentence=bound_sentence,
    bound_data=_bound_data,
    standing_data=_standing_data,
    standing_remarks=_learning_remarks,
    robustness_data=_robustness_data,
)
TASK = "torque-task-proportional"
SPECIAL = ("controller.", "device.valve")
_OF_DRAWS = ("rms_error", "gas_supplied")


@dataclass(frozen=True, slots=True)
class TorqueContest:
    """A torque to follow: a scenario by name or path with overrides, none of controller or valve, and its device."""

    name: str
    overrides: tuple[str, ...]
    device: str
    error: ClassVar[str] = "rms_error"
    gas: ClassVar[str] = "gas_supplied"
    shown_as: ClassVar[Presentation] = TORQUE

    @property
    def entrants(self) -> tuple[Entrant, ...]:
        """Who plays by default."""
        return ENTRANTS

    def scenario_of(self, entrant: Entrant) -> Scenario:
        """Return the scenario as an entrant plays it; ScenarioError or ParameterError where it cannot."""
        return load_scenario(self.name, over(entrant.overrides, self.overrides, ScenarioError))

    def evaluate(self, entrant: Entrant, draws: int, seed: int, _progress: Report) -> Standing:
        """Return how an entrant does, over draws too unless 0; a PpafoError states why it cannot play."""
        task = self.scenario_of(entrant)
        learning = learn(task) if entrant.learns else None
        final = task if learning is None else learning.scenario
        learnt = [] if learning is None else [f"controller.{name}={value!r}" for name, value in table_of(final).items()]
        every = over(over(entrant.overrides, learnt, ScenarioError), self.overrides, ScenarioError)
        words = [word for override in every for word in ("--set", override)]
        result = simulate(final)
        if not result.status.is_completed:
            raise SimulationError(result.status.message)
        return Standing(
            entrant=entrant,
            settings=dict(final.control.settings),
            period=final.control.period,
            measures={name: metric.value for name, metric in result.metrics.items()},
            robustness=_robustness(final, draws, seed) if draws else None,
            command=shlex.join(["ppafo", "simulate", self.name, *words]),
            status=result.status.kind,
            learning=learning,
        )

    def bound(self, valve: str, standings: Sequence[Standing], progress: Report) -> TorqueBound:
        """Return the bound of a valve, simulated where a valve can follow it; SimulationError where there is none."""
        task = self.scenario_of(standings[0].entrant)
        reached = {item.entrant.name: item.measures[self.error] for item in standings if self.error in item.measures}
        bound = lower_bound(task, list(reached.values()), progress)
        if valve == "solenoid":
            # Held openings between 0 and 1 are what the bound lives on here, and this pair has none.
            sampled = None if sampled_problem(task) else sampled_bound(task, progress=progress)
            least_error = None if sampled is None else sampled.certified
            return TorqueBound(bound, (), {}, least_error, (FORESEEN,), sampled)
        least = {name: bound.gas_at(error) for name, error in reached.items()}
        played = tuple(play_optimum(task, optimum) for optimum in (bound.least_error, *bound.curve))
        relaxes = relaxed_by(task.device.valve)
        if task.control.period > task.duration / bound.intervals:
            relaxes = (*relaxes, "sample rate")
        return TorqueBound(bound, played, least, bound.least_error.rms_error, relaxes)


def torque_contest(scenario: str | Path = TASK, overrides: Sequence[str] = ()) -> TorqueContest:
    """Return the contest of a scenario by name or file; ScenarioError or ParameterError for one that is none."""
    for override in overrides:
        path, _ = split_override(override, ScenarioError)
        if path.startswith(SPECIAL):
            raise ScenarioError(f"override '{override}': every controller of the league has its own settings and valve")
    task = load_scenario(scenario, overrides)
    if "reference" not in task.origin.content:
        raise ScenarioError(f"{scenario}: has no [reference], so the controllers have nothing to follow")
    return TorqueContest(str(scenario), tuple(overrides), task.device.name)


def _robustness(task: Scenario, draws: int, seed: int) -> Robustness:
    """Return what the entrant makes of the drawn devices, each with its own noise where it receives any."""
    devices = draw_devices(task, draw_factors(draws, seed))
    if not is_noisy([task]):
        return Robustness(_play_on(devices))
    seeds = draw_seeds(draws, seed)
    again = with_noise(devices[:NOISE_DRAWS], other_noise(seeds)[:NOISE_DRAWS])
    return Robustness(_play_on(with_noise(devices, seeds)), _play_on(again))


def _play_on(devices: Sequence[Scenario]) -> tuple[Measures | None, ...]:
    """Return RMS error [N m] and gas [kg] of scenarios; None where a run diverged."""
    return tuple(
        {name: result.metrics[name].value for name in _OF_DRAWS} if result.status.is_completed else None
        for result in simulate_many(devices)
    )
