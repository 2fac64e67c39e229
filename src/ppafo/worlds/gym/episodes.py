"""Where episodes begin: the scenario or walk as it stands, or one that is drawn from what is not known about it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ppafo.control.walking.assistance import TorqueProfile
from ppafo.engine.lanes import Batch, Clock, Floats
from ppafo.engine.program import Program
from ppafo.engine.rows import numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError, UnitError
from ppafo.model.sensors import Measurement
from ppafo.parameters import load_parameter_set
from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, gauge_link
from ppafo.parameters.parameter_set import atmospheric_pressure, entry_in_si
from ppafo.simulation.building import set_name
from ppafo.simulation.declaration import LARGEST_SEED
from ppafo.simulation.ensemble.planning import plan_ensemble
from ppafo.simulation.numbers import absolute, check_columns, chosen_path, declared_numbers, number_at, with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.studies.varying import VariedPath, in_its_unit, varied_path
from ppafo.units import parse_quantity
from ppafo.walking.motion import walk_of
from ppafo.walking.person import draw_gaits
from ppafo.walking.planning import batch_of_many, plan_walk
from ppafo.walking.varying import with_duration
from ppafo.walking.wearer import draw_builds
from ppafo.worlds.gym.kernel import Columns, episode_program
from ppafo.worlds.gym.tasks import Goal

Generators = Sequence[np.random.Generator]
Ranges = Mapping[str, tuple[str | float, str | float]]
"""Lowest and highest value by dotted path, as texts with units."""

NO_PROFILE = TorqueProfile(peak_torque=0.0, peak_time=0.5, rise_time=1.0, fall_time=1.0)
MOST_DRAWS = 100
"""Draws of one episode until one is a run of the program; where none is, too much varies."""
_SEED = "sensors.seed"


class Episodes(Protocol):
    """Starts of episodes of one program and clock."""

    @property
    def program(self) -> Program:
        """What all episodes are run by."""

    @property
    def clock(self) -> Clock:
        """Their clock."""

    @property
    def device(self) -> Device:
        """The device before anything is drawn."""

    def draw(self, generators: Generators) -> tuple[Columns, Floats]:
        """Return an episode for each generator: its columns, and what was drawn of it (numbers, episodes)."""

    def shown(self, drawn: Floats) -> Any:
        """Return the scenario or walk of what was drawn of one episode (numbers,)."""


class FromOutside:
    """Stands for the controller of a scenario whose commands come from an agent."""

    def reset(self) -> None:
        """Do nothing."""

    def update(self, time: float, reference: float, measurement: Measurement) -> float:  # noqa: ARG002 - a protocol
        """Refuse: an agent is asked through its environment."""
        raise ScenarioError("the commands of an environment come from its agent; give the scenario a controller")


@dataclass(frozen=True, slots=True)
class ScenarioEpisodes:
    """Episodes of a scenario; ``ranges`` in SI by path are drawn evenly, and so is the angle to turn to, ``targets``.

    Without ``ranges`` each is the scenario as it stands, noise included, and turns to the middle of ``targets``. Values
    of the paths in ``gauge`` count from the atmosphere of their episode.
    """

    base: Scenario
    program: Program
    clock: Clock
    ranges: Mapping[str, tuple[float, float]]
    targets: tuple[float, float]
    plain: Columns
    gauge: frozenset[str] = frozenset()

    @property
    def device(self) -> Device:
        """The device before anything is drawn."""
        return self.base.device

    def draw(self, generators: Generators) -> tuple[Columns, Floats]:
        """Return an episode for each generator, and what was drawn of each (numbers, episodes) in SI.

        Drawn again where a draw breaks a rule of scenarios, or asks for another program, as a chamber that is too quick
        does. ScenarioError where nothing fits.
        """
        count = len(generators)
        columns, values = _repeated(self.plain, count), np.zeros((len(self.ranges), count))
        if not self.ranges:
            return columns, values
        left, reason = np.arange(count), ""
        for _ in range(MOST_DRAWS):
            for place in left.tolist():
                values[:, place], columns.goals[0, place] = self._one(generators[place])
            left, reason = self._plan(columns, values, left)
            if not left.size:
                return columns, values
        raise ScenarioError(f"{self.base.name}: {MOST_DRAWS} draws of an episode do not fit it: {reason}; vary less")

    def shown(self, drawn: Floats) -> Scenario:
        """Return the scenario of what was drawn of one episode (numbers,) in SI."""
        given = dict(zip(self.ranges, drawn.tolist(), strict=True))
        return with_numbers(self.base, absolute(self.base, given, self.gauge))

    def _one(self, generator: np.random.Generator) -> tuple[list[float], float]:
        drawn = [
            float(np.floor(generator.uniform(*ends))) if path == _SEED else generator.uniform(*ends)
            for path, ends in self.ranges.items()
        ]
        return drawn, generator.uniform(*self.targets)

    def _plan(self, columns: Columns, values: Floats, left: Any) -> tuple[Any, str]:
        """Write the columns of some episodes; return the places of those that do not fit, and why one does not."""
        given = dict(zip(self.ranges, values[:, left], strict=True))
        plan = plan_ensemble(check_columns(self.base, given, self.gauge))
        reason = next(iter(plan.reasons.values()), "another program, step or delay")
        for members, batch in plan.batches:
            if episode_program(batch) == (self.program, self.clock):
                columns.parameters[:, left[members]] = batch.parameters
                columns.states[:, left[members]] = batch.states
                left = np.where(np.isin(np.arange(left.size), members), -1, left) if members.size else left
        return left[left >= 0], reason


def scenario_episodes(base: Scenario, randomise: bool, vary: Ranges, targets: tuple[str, str]) -> ScenarioEpisodes:
    """Return the episodes of a scenario: what its parameter set has an interval for, ``vary`` and the seed are drawn.

    ScenarioError for a path or range that cannot be.
    """
    base = base.controlled_by(FromOutside())
    lowest, highest = (parse_quantity(text, "rad", base.device.supply.atmospheric_pressure) for text in targets)
    ranges: dict[str, tuple[float, float]] = {}
    gauge: set[str] = set()
    if randomise:
        ranges, gauge = intervals_of(base)
        varies = ATMOSPHERE_PATH in {*ranges, *vary}
        atmosphere = base.device.supply.atmospheric_pressure
        gauge = gauge - set(vary) if varies else set()
        ranges |= {path: (ranges[path][0] - atmosphere, ranges[path][1] - atmosphere) for path in gauge}
        for path, ends in vary.items():
            place, ranges[path] = _range(base, path, ends, varies)
            gauge |= {path} if place.is_gauge else set()
        ranges.setdefault(_SEED, (0.0, float(LARGEST_SEED)))
    batch = batch_of(plan_run(base))
    program, clock = episode_program(batch)
    middle = Goal(angle=0.5 * (lowest + highest), profile=NO_PROFILE)
    plain = Columns(batch.parameters, batch.states, np.array([numbers(middle)]).T)
    return ScenarioEpisodes(base, program, clock, ranges, (lowest, highest), plain, frozenset(gauge))


def intervals_of(base: Scenario) -> tuple[dict[str, tuple[float, float]], set[str]]:
    """Return the ends of each interval of the scenario's parameter set, about the scenario's value, in SI by path.

    And the paths of those that are given in gauge.
    """
    origin = base.origin
    folder = Path() if origin.file is None else Path(origin.file).parent
    parameter_set = load_parameter_set(set_name(origin.parameter_set, folder))
    atmosphere, declared = atmospheric_pressure(parameter_set), parameter_set.declarations()
    known, found, gauge = declared_numbers(base), {}, set()
    for path, entry in parameter_set.numbers.items():
        own = chosen_path(path, base)
        if entry.uncertainty and own in known:
            above = entry.model_copy(update={"value": entry.value + entry.uncertainty})
            ends = [entry_in_si(item, declared[path], atmosphere) for item in (entry, above)]
            value, half = number_at(base, own), ends[1] - ends[0]
            found[own] = (value - half, value + half)
            gauge |= {own} if gauge_link(own, entry.value, entry.unit) else set()
    return found, gauge


def _range(
    base: Scenario, path: str, ends: tuple[str | float, str | float], atmosphere_varies: bool
) -> tuple[VariedPath, tuple[float, float]]:
    place = varied_path(path, base)
    try:
        place = in_its_unit(place, ends) if atmosphere_varies else place
        lowest, highest = (place.level(end) for end in ends)
    except (UnitError, ValueError) as error:
        raise ScenarioError(f"vary: {path} = {ends!r}: {error}; give the lowest and the highest value") from error
    if lowest > highest:
        raise ScenarioError(f"vary: {path} = {ends!r}: give the lowest value before the highest")
    return place, (lowest, highest)


def _repeated(columns: Columns, count: int) -> Columns:
    rows = (columns.parameters, columns.states, columns.goals)
    return Columns(*(np.repeat(values, count, axis=1) for values in rows))


@dataclass(frozen=True, slots=True)
class WalkEpisodes:
    """Episodes of a walk, ``commanded`` from outside; ``randomise`` draws another wearer with another gait for each."""

    configuration: Scenario
    commanded: Scenario
    program: Program
    clock: Clock
    randomise: bool
    plain: Columns

    @property
    def device(self) -> Device:
        """The device, which is not drawn."""
        return self.configuration.device

    def draw(self, generators: Generators) -> tuple[Columns, Floats]:
        """Return an episode for each generator; a wearer is no list of numbers, so that nothing more is told."""
        columns = _repeated(self.plain, len(generators))
        for place, generator in enumerate(generators if self.randomise else ()):
            batch = self._wearer(generator)
            columns.parameters[:, place], columns.states[:, place] = batch.parameters[:, 1], batch.states[:, 1]
        return columns, np.zeros((0, len(generators)))

    def shown(self, drawn: Floats) -> Scenario:  # noqa: ARG002 - a wearer is no list of numbers
        """Return the walk before anything is drawn."""
        return self.configuration

    def _wearer(self, generator: np.random.Generator) -> Batch:
        """Two wearers: that of the configuration, and one who is drawn, with noise of his or her own."""
        seed = float(generator.integers(0, LARGEST_SEED))
        drawn = replace(self.commanded, sensors=replace(self.commanded.sensors, seed=int(seed)))
        build = draw_builds(2, generator)
        gaits = draw_gaits(walk_of(self.configuration).gait, build.stature, generator)
        return batch_of_many(drawn, build, gaits, generator)


def walk_episodes(configuration: Scenario, randomise: bool, seconds: float) -> WalkEpisodes:
    """Return the episodes of a walk of some length [s]; the profile of its controller is the torque that is asked for.

    ScenarioError for a walk with a course or a bottle, or whose controller has no profile.
    """
    for name in ("course", "bottle"):
        if getattr(walk_of(configuration), name) is not None:
            raise ScenarioError(
                f"{configuration.origin.file}: {name}: an environment does not support it; leave it out"
            )
    settings = configuration.control.settings
    if not set(TorqueProfile._fields) <= set(settings):
        kind = configuration.control.kind
        raise ScenarioError(
            f"{configuration.origin.file}: controller.kind = '{kind}' has no torque profile; event_pid has one"
        )
    goal = Goal(angle=0.0, profile=TorqueProfile(**{name: settings[name] for name in TorqueProfile._fields}))
    commanded = with_duration(configuration, seconds).controlled_by(FromOutside())
    batch = batch_of(plan_walk(commanded))
    program, clock = episode_program(batch)
    plain = Columns(batch.parameters, batch.states, np.array([numbers(goal)]).T)
    return WalkEpisodes(configuration, commanded, program, replace(clock, record_every=0), randomise, plain)
