"""Many wearers at once: one column of the engine repeated, rows overwritten, no loop over people."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.engine.lane_rows import LANES
from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.engine.rows import leaf_paths
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.model.chambers import chamber_mass
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, torque_of_shank
from ppafo.model.plant import chamber_volumes
from ppafo.walking.anthropometry import Build, bounded_normal, drawn_builds, scaled_segments
from ppafo.walking.configuration import Configuration
from ppafo.walking.declaration import LARGEST_SEED
from ppafo.walking.planning import plan_walk
from ppafo.walking.varied_gait import VariedGaits, varied_gaits
from ppafo.walking.walk import REMEDY, Progress, checked_seconds, plan_of, silent

MOST_WEARERS = 1_000_000

STEPS_AT_ONCE = 1.0e8
"""Steps of all wearers of one group together, a few seconds."""

THRESHOLD_VARIATION = 0.15
"""Standard deviation of thresholds over their values: how a fitter sets them, and how a sensor sits. Assumed."""

START_VARIATION = 0.03
"""Standard deviation of the share of the stride at which the push-off begins. Assumed."""


@dataclass(frozen=True, slots=True)
class Number:
    """What is known of every wearer: unit and meaning."""

    unit: str
    summary: str


OUTCOMES: dict[str, Number] = {
    "gas": Number("kg", "gas taken from the supply in one stride"),
    "push_off_work": Number("J", "work of T_ex while the foot rolls over the toes, in one stride"),
    "slap_rate": Number(
        "rad/s", "rate of the toes as they come down after the heel, below 0; 0 where they always came first"
    ),
    "toe_clearance": Number("m", "lowest toes in mid-swing against the wearer's healthy gait"),
    "toe_landing": Number("-", "share of the strides in which the toes met the ground before the heel"),
}
TRAITS: dict[str, Number] = {
    "body_mass": Number("kg", "mass of the body"),
    "shank_length": Number("m", "knee to ankle"),
    "stride_time": Number("s", "from one heel strike to the next"),
    "stance_share": Number("-", "share of the stride until toe-off"),
}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Population:
    """Wearers and what came of their walks, each an array (wearers,) by name, in SI units.

    ``diverged`` counts the wearers whose walk left what is possible; they are not in ``outcomes`` nor in ``traits``.
    """

    configuration: Configuration
    minutes: float
    seed: int
    traits: Mapping[str, Floats]
    outcomes: Mapping[str, Floats]
    diverged: int

    @property
    def count(self) -> int:
        """Number of wearers that walked to the end."""
        return int(self.outcomes["gas"].size)

    @property
    def message(self) -> str:
        """How the walks ended."""
        if not self.diverged:
            return "completed"
        return f"{self.diverged} of {self.diverged + self.count} wearers diverged and are left out; {REMEDY}"

    def __repr__(self) -> str:
        return f"Population of {self.count} wearers, {self.configuration.name}, {self.minutes:g} min: {self.message}"


def walk_population(
    configuration: Configuration, minutes: float, wearers: int, seed: int = 1, progress: Progress = silent
) -> Population:
    """Let many wearers walk; the first is that of the configuration. ScenarioError for bad input.

    ``progress`` is told how many of how many wearers have walked.
    """
    if not 1 <= wearers <= MOST_WEARERS:
        raise ScenarioError(f"{wearers} wearers cannot walk; choose 1 to {MOST_WEARERS}")
    run = plan_walk(plan_of(configuration, checked_seconds(configuration, minutes)))
    generator = np.random.default_rng(seed)
    build = drawn_builds(wearers, generator)
    gaits = varied_gaits(configuration.gait, wearers, generator)
    batch = _batch(configuration, run, build, gaits, generator)
    states = _walked(batch, progress)
    rows = {path: states[row] for path, row in _rows(batch.program.state_rows()).items()}
    good = (rows["result.failure_time"] >= NEVER_FAILED) & np.isfinite(states).all(axis=0)
    outcomes = _outcomes(rows, run.step * run.step_count * gaits.timing["frequency"])
    traits = {
        "body_mass": configuration.wearer.body_mass * build.mass,
        "shank_length": configuration.wearer.shank_length * build.stature,
        "stride_time": gaits.stride_time,
        "stance_share": gaits.timing["toe_off"],
    }
    kept = [{name: values[good] for name, values in table.items()} for table in (traits, outcomes)]
    return Population(configuration, minutes, seed, kept[0], kept[1], int(wearers - good.sum()))


def _walked(batch: Batch, progress: Progress) -> Floats:
    """Final states, in groups small enough for an interrupt to be seen and for progress to be told."""
    count = batch.states.shape[1]
    group = max(1, int(STEPS_AT_ONCE / batch.clock.step_count / LANES)) * LANES
    found = []
    for first in range(0, count, group):
        part = slice(first, first + group)
        one = Batch(batch.program, batch.clock, batch.parameters[:, part], batch.states[:, part])
        found.append(run_batch(one).states)
        progress(float(min(first + group, count)), float(count))
    return np.concatenate(found, axis=1)


def _outcomes(rows: Mapping[str, Floats], strides: Floats) -> dict[str, Floats]:
    """Numbers of each wearer from the totals; ``strides`` walked, parts of one included."""
    strikes, landings = np.maximum(rows["walk.strides"], 1.0), np.maximum(rows["walk.landings"], 1.0)
    return {
        "gas": rows["state.supplied_mass"] / strides,
        "push_off_work": rows["walk.push_off_work"] / strides,
        "slap_rate": rows["walk.slap_rates"] / landings,
        "toe_clearance": rows["walk.clearances"] / strikes,
        "toe_landing": rows["walk.toe_landings"] / strikes,
    }


def _batch(
    configuration: Configuration, run: Run, build: Build, gaits: VariedGaits, generator: np.random.Generator
) -> Batch:
    """The run's column for every wearer, with what differs written over it; nothing is recorded on the way."""
    single = batch_of(run)
    count = build.mass.size
    assert run.walk is not None, "a population walks"
    segments = scaled_segments(replace(configuration.wearer, heel_lever=run.walk.leg.heel_lever), build)
    parameters, states = (np.repeat(column, count, axis=1) for column in (single.parameters, single.states))
    _overwrite(parameters, _rows(single.program.parameter_rows()), _parameter_rows(run, segments, gaits, generator))
    _overwrite(states, _rows(single.program.state_rows()), _state_rows(run, segments, gaits))
    still = replace(single.clock, record_every=0)
    return Batch(single.program, still, parameters, states)


def _rows(groups: Mapping[str, type]) -> dict[str, int]:
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths)}


def _overwrite(table: Floats, rows: Mapping[str, int], values: Mapping[str, Floats]) -> None:
    for path, row in values.items():
        table[rows[path]] = row


def _parameter_rows(
    run: Run, segments: Mapping[str, Floats], gaits: VariedGaits, generator: np.random.Generator
) -> dict[str, Floats]:
    found = {f"leg.{name}": values for name, values in segments.items() if name in LegParameters._fields}
    assert run.walk is not None, "a population walks"
    foot = segments["foot_inertia"] + segments["foot_mass"] * segments["foot_mass_centre"] ** 2
    found["plant.inertia"] = run.walk.share.inertia + foot
    # Everybody has noise of their own, where there is any.
    found["sensors.seed"] = np.arange(run.sensors.seed, run.sensors.seed + foot.size, dtype=np.float64) % LARGEST_SEED
    found |= {
        f"gait.{field}.{name}": values
        for field, series in gaits.series.items()
        for name, values in series.rows().items()
    }
    found |= {f"gait_timing.{name}": values for name, values in gaits.timing.items()}
    return found | _thresholds(run, segments["body_mass"].size, generator)


def _thresholds(run: Run, count: int, generator: np.random.Generator) -> dict[str, Floats]:
    """Thresholds of an event-based controller about its settings; both of a sensor move together and stay apart."""
    rules = getattr(run.controller, "phases", None)
    if rules is None:
        return {}
    scale = 1.0 + THRESHOLD_VARIATION * bounded_normal(generator, (count,))
    start = rules.push_off_start + START_VARIATION * bounded_normal(generator, (count,))
    scale[0], start[0] = 1.0, rules.push_off_start
    return {
        "controller.phases.load_threshold": rules.load_threshold * scale,
        "controller.phases.unload_threshold": rules.unload_threshold * scale,
        "controller.phases.push_off_start": np.clip(start, 0.0, 1.0),
    }


def _state_rows(run: Run, segments: Mapping[str, Floats], gaits: VariedGaits) -> dict[str, Floats]:
    """The start at a heel strike with the wearer's own angles and vented chambers."""
    now = _gait_at_heel_strike(run, segments, gaits)
    plant = run.plant
    volumes = chamber_volumes(plant, now["ankle"])  # type: ignore[arg-type]
    masses = [chamber_mass(plant.atmospheric_pressure, volume, plant.gas_product) for volume in volumes]
    return {f"walk.now.{name}": values for name, values in now.items()} | {
        "state.angle": now["ankle"],
        "state.angular_velocity": now["ankle_rate"],
        "state.mass_1": np.asarray(masses[0]),
        "state.mass_2": np.asarray(masses[1]),
    }


def _gait_at_heel_strike(run: Run, segments: Mapping[str, Floats], gaits: VariedGaits) -> dict[str, Floats]:
    """The fields of ``GaitNow`` (wearers,) at phase 0."""
    assert run.walk is not None, "a population walks"
    frequency = gaits.timing["frequency"]
    shank, shank_rate, shank_acceleration = gaits.series["shank"].at_heel_strike(frequency)
    ankle, ankle_rate, ankle_acceleration = gaits.series["ankle"].at_heel_strike(frequency)
    moment, force = (gaits.series[name].at_heel_strike(frequency)[0] for name in ("moment", "force"))
    # A leg of arrays: the functions of the leg are plain arithmetic.
    lengths = {name: row for name, row in segments.items() if name in LegParameters._fields}
    leg: Any = run.walk.leg._replace(**lengths)  # type: ignore[arg-type]
    torque: Any = torque_of_shank
    foot = shank - ankle + 0.5 * np.pi
    directions = np.sin(shank), np.cos(shank), np.sin(foot), np.cos(foot)
    carried = torque(leg, *directions, shank_rate, shank_acceleration, 0.0, 0.0)
    return {
        "shank": shank,
        "shank_rate": shank_rate,
        "shank_acceleration": shank_acceleration,
        "ankle": ankle,
        "ankle_rate": ankle_rate,
        "ankle_acceleration": ankle_acceleration,
        "moment": leg.body_mass * moment,
        "force": np.maximum(leg.body_mass * leg.gravity * force, 0.0),
        "sine_shank": directions[0],
        "cosine_shank": directions[1],
        "sine_healthy_foot": directions[2],
        "healthy_torque": carried + foot_inertia_about_ankle(leg) * ankle_acceleration + leg.ankle_damping * ankle_rate,
    }
