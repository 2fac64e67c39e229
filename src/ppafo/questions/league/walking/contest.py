"""The league's walking task, as every entrant walks it, and how its league is presented."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ppafo.answers import Column
from ppafo.answers.display_units import quantity_text, title_with_unit
from ppafo.progress import Progress, Report
from ppafo.questions.league.answer import League, Look, Presentation, TableColumn, measure, of_draws
from ppafo.questions.league.standing import (
    WALKING_ENTRANTS,
    Bounded,
    Entrant,
    Measures,
    Robustness,
    Standing,
    relaxed_by,
)
from ppafo.questions.league.walking.bound import PlayedStride, Reached, WalkingBound, play_stride, walking_bound
from ppafo.questions.league.walking.measures import MEASURES, draw_measures, walk_measures
from ppafo.questions.league.walking.solver import StrideOptimum
from ppafo.questions.league.walking.task import WalkingTask

_ERROR = "torque_error"


def clear_fraction(robust: Robustness) -> float:
    """Return the fraction of the draws in which the toes cleared the ground on every stride."""
    return float(np.mean([value == 1.0 for value in robust.values("toes_clear", 0.0)]))


def safe_states(robust: Robustness) -> int:
    """Return the number of draws on which the controller paused or stopped, with sensors that work."""
    return sum(1 for value in robust.values("safe_state", 0.0) if value > 0.0)


def bound_sentence(valve: str, bounded: Bounded[WalkingBound]) -> str:
    """Return the minimum error of a valve in one sentence, and how well the engine agrees."""
    bound, (error, gas, toes) = bounded.bound, disagreement(bounded)
    landing = quantity_text(bound.landing, "fraction", ".2g")
    return (
        f"lower bound, {valve}: with toes above the ground the minimum error is "
        f"{quantity_text(bound.least_error.rms_error, 'torque')}, with "
        f"{quantity_text(bound.least_error.gas, 'gas mass')}; flat at {landing} of the stride, {bound.intervals} "
        f"intervals, changed by {quantity_text(bound.moved, 'fraction', '.2g')} in the last refinement; in the "
        f"simulation the error agrees within {quantity_text(error, 'torque', '.2g')}, the gas within "
        f"{quantity_text(gas, 'fraction', '.2g')}, the toes within {quantity_text(toes, 'length', '.2g')}"
    )


def disagreement(bounded: Bounded[WalkingBound]) -> tuple[float, float, float]:
    """Return by how much played optima fall short at most: error [N m], fraction of gas, height of the toes [m]."""
    pairs = list(zip((bounded.bound.least_error, *bounded.bound.curve), bounded.played, strict=True))
    return (
        max(abs(run.rms_error - optimum.rms_error) for optimum, run in pairs),
        max(abs(run.gas / optimum.gas - 1.0) for optimum, run in pairs),
        max(0.0, *(optimum.height - _height(run) for optimum, run in pairs)),
    )


def _height(run: object) -> float:
    assert isinstance(run, PlayedStride), "a stride is played"
    return run.height


def _task(league: League) -> WalkingTask:
    assert isinstance(league.contest, WalkingContest), "a league that walks"
    return league.contest.task


def _task_data(league: League) -> dict[str, Any]:
    task = _task(league)
    return {
        "walk": task.file,
        "gait": task.gait,
        "overrides": list(task.overrides),
        "profile": task.profile._asdict(),
        "seconds": task.seconds,
        "measures": {name: {"unit": unit, "summary": summary} for name, (unit, summary) in MEASURES.items()},
    }


def _task_remarks(league: League) -> Sequence[str]:
    task = _task(league)
    profile = task.profile
    return (
        f"desired: in push-off {quantity_text(profile.peak_torque, 'torque', 'g')} at {profile.peak_time:g} of the "
        f"stride, rise {profile.rise_time:g}, fall {profile.fall_time:g}; mid-stance free; in mid-swing toes above the "
        f"ground; the second half of {task.seconds:g} s is evaluated",
    )


def _bound_data(bounded: Bounded[WalkingBound]) -> dict[str, Any]:
    bound = bounded.bound
    return {
        "intervals": bound.intervals,
        "moved": bound.moved,
        "relaxes": list(bounded.relaxes),
        "landing": bound.landing,
        "unmeasurable_error": bound.unmeasurable,
        "error_of_no_torque": bound.idle_error,
        "least_error_first": [_point(optimum) for optimum in (bound.least_error, *bound.curve)],
        "played": [{"rms_error": run.rms_error, "gas": run.gas, "toe_height": _height(run)} for run in bounded.played],
        "own": {name: None if item is None else _point(item) for name, item in bound.own.items()},
    }


def _point(optimum: StrideOptimum) -> dict[str, float]:
    return {"rms_error": optimum.rms_error, "gas": optimum.gas, "toe_height": optimum.height}


def _standing_data(league: League, standing: Standing) -> dict[str, Any]:
    return {"measures": dict(standing.measures), "least_gas": league.least_gas(standing)}


def _robustness_data(robust: Robustness) -> dict[str, Any]:
    return {
        "toes_clear": clear_fraction(robust),
        "safe_states": safe_states(robust),
        "drawn": [None if item is None else dict(item) for item in robust.drawn],
    }


def _standing_remarks(league: League, standing: Standing) -> Sequence[str]:
    """Return what went wrong: the safe state with good sensors, and strides that no stride of the bound is like."""
    name, robust, measures = standing.entrant.name, standing.robustness, standing.measures
    found = [f"{name} paused or stopped on the nominal task"] if measures["safe_state"] > 0.0 else []
    vented = 0 if robust is None else safe_states(robust)
    found += [f"{name} paused or stopped in {vented} of the draws, although the sensors work"] if vented else []
    if league.bounds and measures["toe_strikes"] > 0.0:
        fraction = quantity_text(measures["toe_strikes"], "fraction", ".0f")
        found.append(f"{name} begins {fraction} of its strides on the toes, unlike any stride of the bound")
    return found


WALKING = Presentation(
    format="ppafo walking league",
    introduction=(
        "Every controller was simulated on the same device and wearer, with a torque to follow in push-off and toes "
        "to lift in the swing. Slap, work, gas and switchings are per stride. The desired torque lies at the true "
        "events of the gait, whatever a controller detects. 'Lag' is the delay of the torque, 'error at lag' the "
        "error that remains without it, 'events' the RMS error of the times at which the controller knows of heel "
        "strike, toes on, heel off and toes off. 'Above minimum' is the distance to the lower bound of the "
        "controller's own valve: to the minimum error of any control with toes above the ground, and to the minimum "
        "gas of a stride with its own lag, error at lag and toe clearance. The heads of these columns list what the "
        "bound relaxes; for a solenoid pair they are empty, because its bound switches at any rate."
    ),
    caption=(
        "A mark for each controller; thin lines across: 5 to 95 % of its error on drawn wearers and devices; "
        "dotted lines down: the minimum gas with its own lag, error and toe clearance. Lines: the minimum gas "
        "without lag and with toes above the ground, for each valve, for the nominal wearer and device."
    ),
    draws_remark=(
        "error 95 % and clear (fraction of draws with toes above the ground on every stride): {draws} random "
        "wearers, each with a device whose values vary either way within: {spread}"
    ),
    look=Look(
        size=(8.4, 5.6),
        right=0.62,
        error="lagged_error",
        error_label=title_with_unit("RMS torque error in push-off, lag removed", "torque"),
        gas_label=title_with_unit("Gas taken from the supply per stride", "gas mass"),
        title="Error against gas; lines: minimum gas with toes above the ground and no lag",
        is_logarithmic=False,
    ),
    columns=(
        measure("error", _ERROR, "torque", ".3f"),
        TableColumn(Column("above minimum", "torque", ".3f"), League.error_above_least),
        measure("lag", "torque_lag", "time", ".3f"),
        measure("error at lag", "lagged_error", "torque", ".3f"),
        measure("events", "event_error", "time", ".4f"),
        measure("toes", "toe_height", "length", "z.0f"),
        measure("slap", "slap_rate", "angular velocity", "z.0f"),
        measure("work", "push_off_work", "energy", "z.2f"),
        measure("gas", "gas", "gas mass", "z.3f"),
        TableColumn(Column("above minimum", "gas mass", "z.3f"), League.gas_above_least),
        measure("switchings", "switchings", "", ".0f"),
        of_draws("error 95 %", "torque", ".3f", lambda robust: robust.not_exceeded(_ERROR, 0.95)),
        of_draws("clear", "fraction", ".0f", clear_fraction),
    ),
    task_data=_task_data,
    task_remarks=_task_remarks,
    bound_sentence=bound_sentence,
    bound_data=_bound_data,
    standing_data=_standing_data,
    standing_remarks=_standing_remarks,
    robustness_data=_robustness_data,
)


@dataclass(frozen=True, slots=True)
class WalkingContest:
    """A leg that walks with every walking controller."""

    task: WalkingTask
    error: ClassVar[str] = "torque_error"
    gas: ClassVar[str] = "gas"
    shown_as: ClassVar[Presentation] = WALKING

    @property
    def name(self) -> str:
        """What the task is, in words."""
        return f"walking, {self.task.file}"

    @property
    def overrides(self) -> tuple[str, ...]:
        """What is changed for all."""
        return self.task.overrides

    @property
    def entrants(self) -> tuple[Entrant, ...]:
        """Who walks by default."""
        return WALKING_ENTRANTS

    def evaluate(self, entrant: Entrant, draws: int, seed: int, progress: Report) -> Standing:
        """Return how an entrant walks, over drawn wearers and devices too; a PpafoError states why it cannot."""
        task = self.task
        configuration = task.configuration(entrant.kind, entrant.valve, entrant.overrides)
        return Standing(
            entrant=entrant,
            settings=dict(configuration.control.settings),
            period=configuration.control.period,
            measures=walk_measures(task, configuration),
            robustness=draw_measures(task, configuration, draws, seed, progress) if draws else None,
            command=self._command(entrant),
        )

    def bound(self, valve: str, standings: Sequence[Standing], progress: Report) -> Bounded[WalkingBound]:
        """Return the bound of a valve, also simulated; SimulationError or ScenarioError where there is none."""
        reached = {item.entrant.name: _reach(item.measures) for item in standings if _is_bounded(item.measures)}
        bound = walking_bound(self.task, valve, reached, progress)
        progress(Progress(f"lower bound, {valve}: simulating the optimum"))
        played = tuple(play_stride(self.task, valve, optimum) for optimum in (bound.least_error, *bound.curve))
        relaxes = (*relaxed_by(self.task.configuration(standings[0].entrant.kind, valve).device.valve), "sample rate")
        if valve == "solenoid":
            # The optimum switches within a sample, which the controllers of this pair cannot.
            return Bounded(bound, played, {}, None, relaxes)
        least = {name: optimum.gas for name, optimum in bound.own.items() if optimum is not None}
        return Bounded(bound, played, least, bound.least_error.rms_error, relaxes)

    def _command(self, entrant: Entrant) -> str:
        """Return the command that walks this entrant again."""
        task = self.task
        words = ["ppafo", "walk", task.file, *(() if task.gait is None else ("--gait", task.gait))]
        words += ["--minutes", f"{task.seconds / 60.0:g}"]
        overrides = task.overrides_for(entrant.kind, entrant.valve, entrant.overrides)
        return shlex.join([*words, *(word for override in overrides for word in ("--set", override))])


def _reach(measures: Measures) -> Reached:
    return Reached(
        rms_error=measures["lagged_error"],
        height=measures["toe_height"],
        lag=measures["torque_lag"],
        resistance=measures["mid_stance_torque"],
    )


def _is_bounded(measures: Measures) -> bool:
    """Tell whether a walk has a bound: its strides strike with the heel; one that takes no gas has none to save."""
    return measures["toe_strikes"] == 0.0 and measures["gas"] > 0.0
