"""Drawn wearers with drawn devices: the same for every controller, none of them the one it believes in."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run
from ppafo.model.gait import GaitTiming
from ppafo.model.plant import PlantParameters
from ppafo.parameters.plant import plant_parameters
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.league.standing import NOISE_DRAWS, SEED, Robustness, draw_factors, draw_seeds, scale_device
from ppafo.questions.league.walking.measures import Toes, course_of, last_strides, measures, toes_of
from ppafo.questions.league.walking.task import WalkingTask
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sampling import other_noise
from ppafo.walking.anthropometry import Build, draw_builds
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import has_ideal_sensors, plan_walk
from ppafo.walking.preparation import vented_state, with_leg
from ppafo.walking.varied_gait import VariedGaits, draw_gaits
from ppafo.walking.varying import with_duration
from ppafo.walking.wearers_rows import batch_of_many

NUMBERS_AT_ONCE = 4.0e7
"""Recorded numbers of one group of draws, some 300 MB."""
CHANGED = (
    "supply_pressure",
    "dorsiflexion_pressure",
    "valve_conductance",
    "leak_conductance",
    "dead_volume_1",
    "dead_volume_2",
    "static_torque",
    "dynamic_torque",
    "viscous_damping",
)
"""What the uncertainties of ``questions.league.draws`` change of the plant."""
_WEARERS = 2
"""The stream of random numbers of the wearers beside those of devices and of noise."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnWearers:
    """Wearers who are about to walk: how they are built, how they walk, and the batch (rows, wearers) of the engine."""

    build: Build
    gaits: VariedGaits
    batch: Batch


def draw_wearers(configuration: Scenario, run: Run, count: int, seed: int = SEED) -> DrawnWearers:
    """Wearers drawn around that of a configuration, who is the first; for every controller the same."""
    # Not the stream of their devices, with which wearers would go hand in hand.
    generator = np.random.default_rng([seed, _WEARERS])
    build = draw_builds(count, generator)
    gaits = draw_gaits(walk_of(configuration).gait, build.stature, generator)
    return DrawnWearers(build, gaits, batch_of_many(configuration, run, build, gaits, generator))


def draw_measures(
    task: WalkingTask,
    configuration: Scenario,
    draws: int,
    seed: int = SEED,
    progress: Report = report_nothing,
) -> Robustness:
    """The measures of a walk on so many drawn wearers and devices, of the first of them with other noise too.

    Each walk has its own noise where the sensors are noisy.
    """
    run = plan_walk(with_duration(configuration, task.seconds))
    wearers = draw_wearers(configuration, run, draws, seed)
    plants = draw_plants(configuration, run, draw_factors(draws, seed))
    batch = _with_devices(run, wearers.batch, plants)
    is_noisy = not has_ideal_sensors(configuration)
    if is_noisy:
        batch = _with_noise(batch, draw_seeds(draws, seed))
    toes = toes_of(walk_of(configuration).gait, walk_of(configuration).wearer)
    found: list[dict[str, float] | None] = []
    for part in _groups(batch):
        progress(Progress(configuration.control.kind, part.start, draws, noun="draws"))
        found += _measure_draws(task, run, wearers, plants, toes, batch, part)
    again: list[dict[str, float] | None] = []
    if is_noisy:
        other = _with_noise(batch, other_noise(draw_seeds(draws, seed)[:NOISE_DRAWS]))
        for part in _groups(other):
            again += _measure_draws(task, run, wearers, plants, toes, other, part)
    return Robustness(tuple(found), tuple(again))


def _with_noise(batch: Batch, seeds: Floats) -> Batch:
    """The first walks of a batch, each with the noise stream of its seed."""
    parameters = batch.parameters[:, : seeds.size].copy()
    parameters[row_numbers(batch.program.parameter_rows())["sensors.seed"]] = seeds
    return Batch(batch.program, batch.clock, parameters, batch.states[:, : seeds.size])


def draw_plants(configuration: Scenario, run: Run, factors: Floats) -> list[PlantParameters]:
    """The plant of a configuration with each of the devices that rows of ``factors`` (draws, uncertainties) make."""
    assert run.walk is not None, "a league walks"
    devices = [scale_device(configuration.device, row.tolist()) for row in factors]
    fed = run.plant.relieving
    return [with_leg(plant_parameters(device)._replace(relieving=fed), run.walk.leg) for device in devices]


def _with_devices(run: Run, batch: Batch, plants: list[PlantParameters]) -> Batch:
    """The batch with the drawn devices in it, its chambers vented at the start, every sample recorded."""
    assert run.walk is not None, "a league walks"
    parameters, states = batch.parameters.copy(), batch.states.copy()
    rows, state_rows = row_numbers(batch.program.parameter_rows()), row_numbers(batch.program.state_rows())
    for name in CHANGED:
        parameters[rows[f"plant.{name}"]] = [getattr(plant, name) for plant in plants]
    damping = parameters[rows["plant.viscous_damping"]] - run.walk.leg.ankle_damping
    parameters[rows["share.viscous_damping"]] = damping
    for draw, plant in enumerate(plants):
        begin = vented_state(plant, states[state_rows["state.angle"], draw], 0.0)
        states[state_rows["state.mass_1"], draw], states[state_rows["state.mass_2"], draw] = begin.mass_1, begin.mass_2
    return Batch(batch.program, replace(batch.clock, record_every=run.record_every), parameters, states)


def _groups(batch: Batch) -> Iterator[slice]:
    """Draws that are recorded together."""
    samples = batch.clock.samples
    draws = batch.states.shape[1]
    size = max(1, int(NUMBERS_AT_ONCE / samples / batch.states.shape[0]))
    for first in range(0, draws, size):
        yield slice(first, min(first + size, draws))


def _measure_draws(
    task: WalkingTask,
    run: Run,
    wearers: DrawnWearers,
    plants: list[PlantParameters],
    toes: Toes,
    batch: Batch,
    part: slice,
) -> list[dict[str, float] | None]:
    assert run.walk is not None, "a league walks"
    outcome = run_batch(Batch(batch.program, batch.clock, batch.parameters[:, part], batch.states[:, part]))
    rows = row_numbers(batch.program.state_rows())
    found: list[dict[str, float] | None] = []
    for place, draw in enumerate(range(part.start, part.stop)):
        final = outcome.states[:, place]
        if final[rows["result.failure_time"]] < NEVER_FAILED or not np.isfinite(final).all():
            found.append(None)
            continue
        record = {name: outcome.record[:, row, place] for name, row in rows.items()}
        timing = _timing(run.walk.timing, wearers, draw)
        course = course_of(record, plants[draw], timing, toes, float(wearers.build.stature[draw]))
        found.append(measures(course, task.profile, timing, last_strides(course.phase)))
    return found


def _timing(timing: GaitTiming, wearers: DrawnWearers, draw: int) -> GaitTiming:
    return timing._replace(**{name: float(values[draw]) for name, values in wearers.gaits.timing.items()})
