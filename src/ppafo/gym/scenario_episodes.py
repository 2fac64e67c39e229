"""Episodes of a scenario, equal to its file or with uncertain numbers drawn at random."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.control.walking.assistance import TorqueProfile
from ppafo.engine.lanes import Clock, Floats
from ppafo.engine.program import Program
from ppafo.engine.rows import numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError, UnitError
from ppafo.gym.lanes import EpisodeStarts, FromOutside, Places, episode_program
from ppafo.gym.tasks import Goal
from ppafo.parameters import load_parameter_set
from ppafo.parameters.graph import ATMOSPHERE_PATH, gauge_link
from ppafo.parameters.parameter_set import atmospheric_pressure, entry_in_si
from ppafo.simulation.ensemble.columns import absolute, check_columns
from ppafo.simulation.ensemble.planning import plan_ensemble
from ppafo.simulation.hardware import set_name
from ppafo.simulation.numbers import chosen_path, declared_numbers, number_at, with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.studies.varying import in_its_unit, varied_path
from ppafo.units import parse_quantity

Ranges = Mapping[str, tuple[str | float, str | float]]
"""Lowest and highest value of drawn numbers by dotted path, as texts with units."""

MOST_DRAWS = 100
"""Largest number of draws for a valid episode; more mean that the ranges are too wide."""
_NO_PROFILE = TorqueProfile(peak_torque=0.0, peak_time=0.5, rise_time=1.0, fall_time=1.0)
"""Torque profile for episodes without strides."""
_SEED = "sensors.seed"


@dataclass(frozen=True, slots=True)
class ScenarioEpisodes:
    """Episodes of a scenario, with uniform draws of numbers from ``ranges`` [SI] and a target from ``targets`` [rad].

    Without ``ranges`` every episode is the scenario itself, including its noise, with the middle of ``targets`` as
    target. Paths in ``gauge`` hold gauge pressures relative to the atmosphere of each episode.
    """

    base: Scenario
    program: Program
    clock: Clock
    ranges: Mapping[str, tuple[float, float]]
    targets: tuple[float, float]
    plain: EpisodeStarts
    gauge: frozenset[str] = frozenset()

    def draw(self, generators: Sequence[np.random.Generator]) -> tuple[EpisodeStarts, Floats]:
        """Draw an episode for each generator; also return the drawn numbers (numbers, episodes) [SI].

        A draw is repeated if it breaks a rule of scenarios or needs another program, for example for a chamber too fast
        for the step. Raises ScenarioError if no draw is valid.
        """
        count = len(generators)
        columns, values = self.plain.repeated(count), np.zeros((len(self.ranges), count))
        if not self.ranges:
            return columns, values
        undrawn, reason = np.arange(count), ""
        for _ in range(MOST_DRAWS):
            for number in undrawn.tolist():
                generator = generators[number]
                drawn = (generator.uniform(*ends) for ends in self.ranges.values())
                # A seed is drawn as all numbers are, and has to be whole.
                values[:, number] = [
                    float(np.floor(value)) if path == _SEED else value
                    for path, value in zip(self.ranges, drawn, strict=True)
                ]
                columns.goals[0, number] = generator.uniform(*self.targets)
            undrawn, reason = self._plan(columns, values, undrawn)
            if not undrawn.size:
                return columns, values
        raise ScenarioError(
            f"{self.base.name}: {MOST_DRAWS} random episodes in succession are invalid: {reason}; narrow the "
            "ranges in vary"
        )

    def shown(self, drawn: Floats) -> Scenario:
        """Return the scenario of an episode with its drawn numbers (numbers,) [SI]."""
        numbers = dict(zip(self.ranges, drawn.tolist(), strict=True))
        return with_numbers(self.base, absolute(self.base, numbers, self.gauge))

    def _plan(self, columns: EpisodeStarts, values: Floats, places: Places) -> tuple[Places, str]:
        """Fill the columns of the episodes at ``places``; return the indices of invalid episodes, and a reason."""
        drawn = dict(zip(self.ranges, values[:, places], strict=True))
        plan = plan_ensemble(check_columns(self.base, drawn, self.gauge))
        is_valid = np.zeros(places.size, dtype=np.bool_)
        reason = next(iter(plan.reasons.values()), "another program, step or delay")
        for members, batch in plan.batches:
            if episode_program(batch) == (self.program, self.clock):
                columns.parameters[:, places[members]] = batch.parameters
                columns.states[:, places[members]] = batch.states
                is_valid[members] = True
        # Episodes with another program or clock cannot go with the others, and are drawn again.
        return places[~is_valid], reason


def scenario_episodes(base: Scenario, randomise: bool, vary: Ranges, targets: tuple[str, str]) -> ScenarioEpisodes:
    """Return the episodes of a scenario, drawn from intervals of its parameter set, from ``vary``, and with a seed.

    Raises ScenarioError for an unknown path or an invalid range.
    """
    base = base.controlled_by(FromOutside())
    lowest, highest = (parse_quantity(text, "rad", base.device.supply.atmospheric_pressure) for text in targets)
    ranges: dict[str, tuple[float, float]] = {}
    gauge: set[str] = set()
    if randomise:
        ranges, gauge = intervals_of(base)
        varies = ATMOSPHERE_PATH in {*ranges, *vary}
        # Where the atmosphere varies as well, a gauge pressure keeps its distance from it.
        atmosphere = base.device.supply.atmospheric_pressure
        gauge = gauge - set(vary) if varies else set()
        ranges |= {path: (ranges[path][0] - atmosphere, ranges[path][1] - atmosphere) for path in gauge}
        for path, ends in vary.items():
            varied = varied_path(path, base)
            try:
                varied = in_its_unit(varied, ends) if varies else varied
                least, most = (varied.level(end) for end in ends)
            except (UnitError, ValueError) as error:
                raise ScenarioError(
                    f"vary: {path} = {ends!r}: {error}; give the lowest and the highest value"
                ) from error
            if least > most:
                raise ScenarioError(f"vary: {path} = {ends!r}: the first value must be below the second")
            ranges[path] = (least, most)
            gauge |= {path} if varied.is_gauge else set()
        # Each episode has noise of its own, unless the caller says how the seed varies.
        ranges.setdefault(_SEED, (0.0, float(LARGEST_SEED)))
    batch = batch_of(plan_run(base))
    program, clock = episode_program(batch)
    middle = Goal(angle=0.5 * (lowest + highest), profile=_NO_PROFILE)
    plain = EpisodeStarts(batch.parameters, batch.states, np.array([numbers(middle)]).T)
    return ScenarioEpisodes(base, program, clock, ranges, (lowest, highest), plain, frozenset(gauge))


def intervals_of(base: Scenario) -> tuple[dict[str, tuple[float, float]], set[str]]:
    """Return intervals of uncertain numbers around the scenario's values, by path [SI].

    The second value are the paths of numbers given as gauge pressures.
    """
    origin = base.origin
    folder = Path() if origin.file is None else Path(origin.file).parent
    parameter_set = load_parameter_set(set_name(origin.parameter_set, folder))
    atmosphere, declared = atmospheric_pressure(parameter_set), parameter_set.declarations()
    known, ranges, gauge = declared_numbers(base), {}, set()
    for path, entry in parameter_set.numbers.items():
        own = chosen_path(path, base)
        if entry.uncertainty and own in known:
            # The upper end in the unit of the entry, so that a gauge pressure is converted as its value is.
            above = entry.model_copy(update={"value": entry.value + entry.uncertainty})
            ends = [entry_in_si(text, declared[path], atmosphere) for text in (entry, above)]
            value, half = number_at(base, own), ends[1] - ends[0]
            ranges[own] = (value - half, value + half)
            gauge |= {own} if gauge_link(own, entry.value, entry.unit) else set()
    return ranges, gauge
