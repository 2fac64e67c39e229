"""Episodes of a walk: of its own wearer, or of another one with another gait for each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.control.walking.assistance import TorqueProfile
from ppafo.engine.lanes import Clock, Floats
from ppafo.engine.program import Program
from ppafo.engine.rows import numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError
from ppafo.gym.lanes import Columns, FromOutside, episode_program
from ppafo.gym.tasks import Goal
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import draw_gaits
from ppafo.walking.planning import batch_of_many, plan_walk
from ppafo.walking.wearer import draw_builds


@dataclass(frozen=True, slots=True)
class WalkEpisodes:
    """Episodes of a walk, ``commanded`` from outside; ``randomise`` draws another wearer with another gait for each."""

    base: Scenario
    commanded: Scenario
    program: Program
    clock: Clock
    randomise: bool
    plain: Columns

    def draw(self, generators: Sequence[np.random.Generator]) -> tuple[Columns, Floats]:
        """Return an episode for each generator, and no drawn numbers: a wearer is not a list of numbers."""
        columns = self.plain.repeated(len(generators))
        for number, generator in enumerate(generators if self.randomise else ()):
            # Person 0 of a population is always the one of the configuration; the second one is drawn.
            seed = float(generator.integers(0, LARGEST_SEED))
            drawn = replace(self.commanded, sensors=replace(self.commanded.sensors, seed=int(seed)))
            build = draw_builds(2, generator)
            gaits = draw_gaits(walk_of(self.base).gait, build.stature, generator)
            batch = batch_of_many(drawn, build, gaits, generator)
            columns.parameters[:, number], columns.states[:, number] = batch.parameters[:, 1], batch.states[:, 1]
        return columns, np.zeros((0, len(generators)))

    def shown(self, drawn: Floats) -> Scenario:  # noqa: ARG002 - a wearer is no list of numbers
        """Return the walk before anything is drawn."""
        return self.base


def walk_episodes(configuration: Scenario, randomise: bool, seconds: float) -> WalkEpisodes:
    """Return the episodes of a walk of some length [s]; the profile of its controller is the requested torque.

    ScenarioError for a walk with a task sequence or a bottle, or whose controller has no profile.
    """
    for name in ("task_sequence", "bottle"):
        if getattr(walk_of(configuration), name) is not None:
            raise ScenarioError(
                f"{configuration.origin.file}: {name}: an environment does not support it; leave it out"
            )
    settings = configuration.controller.settings
    if not set(TorqueProfile._fields) <= set(settings):
        kind = configuration.controller.kind
        raise ScenarioError(
            f"{configuration.origin.file}: controller.kind = '{kind}' has no torque profile; event_pid has one"
        )
    goal = Goal(angle=0.0, profile=TorqueProfile(**{name: settings[name] for name in TorqueProfile._fields}))
    commanded = with_duration(configuration, seconds).controlled_by(FromOutside())
    batch = batch_of(plan_walk(commanded))
    program, clock = episode_program(batch)
    plain = Columns(batch.parameters, batch.states, np.array([numbers(goal)]).T)
    # Nothing is recorded between two samples: an agent sees what is observed.
    return WalkEpisodes(configuration, commanded, program, replace(clock, record_every=0), randomise, plain)
