"""The league's walking task, as every entrant walks it."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ppafo.progress import Progress, Report
from ppafo.questions.league.entrants import WALKING_ENTRANTS, Entrant
from ppafo.questions.league.standing import Bounded, Measures, Standing
from ppafo.questions.league.walking.bound import Reached, WalkingBound, walking_bound
from ppafo.questions.league.walking.draws import draw_measures
from ppafo.questions.league.walking.measures import walk_measures
from ppafo.questions.league.walking.playing import play_stride
from ppafo.questions.league.walking.task import WalkingTask


@dataclass(frozen=True, slots=True)
class WalkingContest:
    """A leg that walks with every walking controller."""

    task: WalkingTask
    error: ClassVar[str] = "torque_error"
    gas: ClassVar[str] = "gas"

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
        least = {name: optimum.gas for name, optimum in bound.own.items() if optimum is not None}
        return Bounded(bound, played, least)

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
