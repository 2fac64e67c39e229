"""Walks of many randomly drawn wearers, and the distribution of their outcomes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ppafo.arguments import Count, Minutes, Seed, checked
from ppafo.engine.lane_rows import LANES
from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED
from ppafo.errors import ScenarioError
from ppafo.metrics.strides import PER_STRIDE
from ppafo.simulation.scenario import Scenario
from ppafo.walking.evaluation import REMEDY
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import crowd_of, draw_people
from ppafo.walking.planning import plan_walks, unrecorded
from ppafo.walking.walk import Progress, lasting, silent

MAXIMUM_WEARERS = 1_000_000
"""Largest number of wearers of a population."""
STEPS_AT_ONCE = 1.0e8
"""Steps of all wearers of a group that is simulated at once [-], a few seconds of computing time."""
SHOWN = {
    "gas": ("Gas per stride", "gas mass", 3),
    "positive_push_off_work": ("Positive work on the wearer in push-off", "energy", 2),
    "net_push_off_work": ("Net work on the wearer in push-off", "energy", 2),
    "toe_clearance": ("Lowest toe height in mid-swing, relative to healthy", "body length", 1),
    "toe_landing": ("Strides that begin on the toes", "fraction", 0),
    "body_mass": ("Body mass", "mass", 1),
    "shank_length": ("Shank", "body length", 1),
    "stride_time": ("Stride time", "time", 3),
    "stance_share": ("Stance", "fraction", 1),
}
"""Title, kind of quantity and number of decimals of the quantities shown for every wearer."""
OUTCOMES = {
    name: (quantity.unit, f"{quantity.summary}, mean over all strides of a wearer")
    for name, quantity in PER_STRIDE.items()
}
"""Unit and meaning of each outcome of a walk."""
TRAITS = {
    "body_mass": ("kg", "mass of the body"),
    "shank_length": ("m", "knee to ankle"),
    "stride_time": ("s", "from one heel strike to the next"),
    "stance_share": ("-", "fraction of the stride until toe-off"),
}
"""Unit and meaning of each trait of a wearer."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Population:
    """Wearers and the outcomes of their walks, each an array (wearers,) by name, in SI units.

    - ``scenario``: walk of the first wearer
    - ``minutes``, ``seed``: duration of each walk [min], and random seed of the wearers
    - ``traits``, ``outcomes``: of the wearers whose simulation did not diverge
    - ``diverged``: number of wearers whose simulation diverged
    """

    scenario: Scenario
    minutes: float
    seed: int
    traits: Mapping[str, Floats]
    outcomes: Mapping[str, Floats]
    diverged: int

    @property
    def count(self) -> int:
        """Number of wearers whose walk was completed."""
        return int(self.outcomes["gas"].size)

    @property
    def message(self) -> str:
        """Description of the end of the walks."""
        if not self.diverged:
            return "completed"
        return f"{self.diverged} of {self.diverged + self.count} wearers diverged and are left out; {REMEDY}"

    def __repr__(self) -> str:
        return f"Population of {self.count} wearers, {self.scenario.name}, {self.minutes:g} min: {self.message}"


@checked
def walk_population(
    scenario: Scenario | str | Path,
    *,
    wearers: Count,
    minutes: Minutes | None = None,
    seed: Seed = 1,
    progress: Progress = silent,
) -> Population:
    """Simulate the walks of many randomly drawn wearers; the first is the wearer of the configuration.

    Arguments:
        scenario: a walk, its name or its file
        wearers: number of wearers
        minutes: duration of each walk [min]; default: the length that the walk states
        seed: random seed of the wearers
        progress: called with the number of wearers that have walked and the number of all

    Returns:
        Population with one value of every outcome for each wearer [SI]

    Raises:
        ScenarioError: a walk or a number of wearers that cannot be used

    >>> import ppafo
    >>> population = ppafo.walk_population("solenoid", wearers=2, minutes=0.1)
    >>> [f"{clearance:.3f} m" for clearance in population.outcomes["toe_clearance"]]
    ['-0.035 m', '-0.033 m']
    """
    if not 1 <= wearers <= MAXIMUM_WEARERS:
        raise ScenarioError(f"wearers = {wearers}: must be from 1 to {MAXIMUM_WEARERS}")
    configuration = scenario if isinstance(scenario, Scenario) else load_walk(scenario)
    motion = walk_of(configuration)
    if motion.bottle is not None:
        raise ScenarioError(
            "walks of several wearers need a constant supply pressure: omit the bottle, or the number of wearers"
        )
    if motion.person:
        raise ScenarioError(
            "wearer.person is not allowed with several wearers, which are drawn at random; omit wearer.person, or the "
            "number of wearers"
        )
    people = draw_people(motion.gait, wearers, np.random.default_rng(seed))
    crowd = crowd_of(configuration, people)
    seconds = lasting(configuration, minutes).run.duration
    run, _ = plan_walks(with_duration(crowd, seconds))
    numbers = _final_numbers(unrecorded(run, wearers), progress)
    is_finished = np.isfinite(list(numbers.values())).all(axis=0) & (numbers["result.failure_time"] >= NEVER_FAILED)
    final = {path: values[is_finished] for path, values in numbers.items()}
    walked = run.step * run.step_count  # [s]; an unfinished stride counts by its fraction
    strides = np.asarray(walked * people.timing.frequency)
    traits = {
        "body_mass": motion.wearer.body_mass * np.asarray(people.mass),
        "shank_length": motion.wearer.shank_length * np.asarray(people.stature),
        "stride_time": np.asarray(people.stride_time),
        "stance_share": np.asarray(people.timing.toe_off),
    }
    # Totals over strides; those of the toes over heel strikes, at least 1.
    counts = dict.fromkeys(("toe_clearance", "toe_landing"), np.maximum(final["walk.strides"], 1.0))
    return Population(
        scenario=configuration,
        minutes=seconds / 60.0,
        seed=seed,
        traits={name: values[is_finished] for name, values in traits.items()},
        outcomes={
            name: final[each.total] / counts.get(name, strides[is_finished]) for name, each in PER_STRIDE.items()
        },
        diverged=int((~is_finished).sum()),
    )


def _final_numbers(batch: Batch, progress: Progress) -> dict[str, Floats]:
    """Return the final states (wearers,) by path; groups of wearers are small enough for interrupts and progress."""
    wearers = batch.states.shape[1]
    size = max(1, int(STEPS_AT_ONCE / batch.clock.step_count / LANES)) * LANES
    states = np.empty_like(batch.states)
    for start in range(0, wearers, size):
        group = slice(start, start + size)
        part = replace(batch, parameters=batch.parameters[:, group], states=batch.states[:, group])
        states[:, group] = run_batch(part).states
        progress(float(min(start + size, wearers)), float(wearers))
    return {path: states[row] for path, row in row_numbers(batch.program.state_rows()).items()}
