"""The rows of the engine for many wearers: the column of one run repeated, and what differs written over it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.control.fixed.walking_law import STRIDE_SHARE
from ppafo.control.fixed.walking_numbers import WalkRows
from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.rows import leaf_paths, leaves, row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.gait.gait import KNEE
from ppafo.model.chambers import chamber_mass
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import GaitTiming
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, torque_of_shank
from ppafo.model.plant import chamber_volumes
from ppafo.simulation.scenario import Scenario
from ppafo.walking.anthropometry import Build, draw_bounded_normal, segment_values
from ppafo.walking.course_planning import PlannedCourse, plan_course, standing_gait
from ppafo.walking.declaration import LARGEST_SEED
from ppafo.walking.motion import walk_of
from ppafo.walking.person import START_VARIATION, THRESHOLD_VARIATION
from ppafo.walking.planning import converter_of_walk
from ppafo.walking.varied_gait import VariedGaits


def batch_of_many(
    configuration: Scenario,
    run: Run,
    build: Build,
    gaits: VariedGaits,
    generator: np.random.Generator,
    planned: PlannedCourse | None = None,
) -> Batch:
    """The run's column for every wearer, with what differs written over it; nothing is recorded on the way.

    ``planned`` is the course of each, where they walk one.
    """
    single = batch_of(run)
    count = build.mass.size
    assert run.walk is not None, "a population walks"
    # How the heel rolls is its shape, which is that of the one leg at the size of the other.
    leg, segments = run.walk.leg, segment_values(walk_of(configuration).wearer, build)
    segments |= {name: getattr(leg, name) * build.stature for name in ("heel_lever", "flat_heel_lever")}
    parameters, states = (np.repeat(column, count, axis=1) for column in (single.parameters, single.states))
    varied = _parameter_rows(run, segments, gaits) | _thresholds(configuration, run, count, generator)
    _overwrite(parameters, row_numbers(single.program.parameter_rows()), varied)
    _overwrite(states, row_numbers(single.program.state_rows()), _state_rows(run, segments, gaits, planned))
    if planned is not None:
        _overwrite(parameters, row_numbers(single.program.parameter_rows()), _course_rows(planned))
    still = replace(single.clock, record_every=0)
    return Batch(single.program, still, parameters, states)


def course_of_many(configuration: Scenario, gaits: VariedGaits) -> PlannedCourse | None:
    """The course of each wearer, with strides of his or her own time; None where they walk none."""
    course = walk_of(configuration).course
    if course is None:
        return None
    timing: Any = GaitTiming(start=0.0, **gaits.timing)  # type: ignore[arg-type]
    foot = gaits.series["shank"].at_heel_strike(timing.frequency)[0]
    foot = foot - gaits.series["ankle"].at_heel_strike(timing.frequency)[0] + 0.5 * np.pi
    return plan_course(course, walk_of(configuration).gait, timing.frequency, timing, foot - timing.ground_angle)


def _course_rows(planned: PlannedCourse) -> dict[str, Floats]:
    paths = leaf_paths(type(planned.course), "walk_course")
    return dict(zip(paths, leaves(planned.course), strict=True))


def _overwrite(table: Floats, rows: Mapping[str, int], values: Mapping[str, Floats]) -> None:
    for path, row in values.items():
        table[rows[path]] = row


def _parameter_rows(run: Run, segments: Mapping[str, Floats], gaits: VariedGaits) -> dict[str, Floats]:
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
    return found


def _thresholds(configuration: Scenario, run: Run, count: int, generator: np.random.Generator) -> dict[str, Floats]:
    """Thresholds of an event-based controller about its settings; both of a sensor move together and stay apart."""
    is_whole = isinstance(run.controller, WalkRows)
    if not is_whole and not hasattr(run.controller, "phases"):
        return {}
    names = ("load_threshold", "unload_threshold", "push_off_start")
    rules = configuration.control.settings if is_whole else run.controller.phases._asdict()
    load, unload, usual = (rules[name] for name in names)
    scale = 1.0 + THRESHOLD_VARIATION * draw_bounded_normal(generator, (count,))
    start = usual + START_VARIATION * draw_bounded_normal(generator, (count,))
    scale[0], start[0] = 1.0, usual
    drawn = (load * scale, unload * scale, np.clip(start, 0.0, 1.0))
    if not is_whole:
        return {f"controller.phases.{name}": values for name, values in zip(names, drawn, strict=True)}
    own = converter_of_walk(configuration)
    counts = (own.scale * (force - own.force_zero) / own.force_step for force in drawn[:2])
    loaded, unloaded = (np.floor(np.clip(count, 0.0, own.scale * own.top) + 0.5) for count in counts)
    return {
        "controller.numbers.phase.load": loaded,
        "controller.numbers.phase.unload": unloaded,
        "controller.numbers.phase.push_off_start": np.floor(drawn[2] * STRIDE_SHARE + 0.5),
    }


def _state_rows(
    run: Run, segments: Mapping[str, Floats], gaits: VariedGaits, planned: PlannedCourse | None
) -> dict[str, Floats]:
    """The start at a heel strike, or standing, with the wearer's own angles and vented chambers."""
    standing = planned is not None
    now = _gait_in_standing(run, segments, gaits, planned) if planned else _gait_at_heel_strike(run, segments, gaits)
    shown = {f"walk.{name}_force": 0.5 * now["force"] for name in ("heel", "toe")} if standing else {}
    plant = run.plant
    volumes = chamber_volumes(plant, now["ankle"])
    masses = [chamber_mass(plant.atmospheric_pressure, volume, plant.gas_product) for volume in volumes]
    sine_foot, cosine_foot = sine_and_cosine((now["shank"] - now["ankle"]) / (2.0 * np.pi) + 0.25)
    return (
        {f"walk.now.{name}": values for name, values in now.items()}
        | shown
        | {
            "walk.foot.sine": sine_foot,
            "walk.foot.cosine": cosine_foot,
            "state.angle": now["ankle"],
            "state.angular_velocity": now["ankle_rate"],
            "state.mass_1": np.asarray(masses[0]),
            "state.mass_2": np.asarray(masses[1]),
        }
    )


def _gait_in_standing(
    run: Run, segments: Mapping[str, Floats], gaits: VariedGaits, planned: PlannedCourse
) -> dict[str, Floats]:
    """The fields of ``GaitNow`` (wearers,) where a course begins."""
    assert run.walk is not None, "a population walks"
    own = {name: row for name, row in segments.items() if name in LegParameters._fields}
    leg: Any = run.walk.leg._replace(**own)  # type: ignore[arg-type]
    timing: Any = run.walk.timing._replace(ground_angle=gaits.timing["ground_angle"])  # type: ignore[arg-type]
    now = standing_gait(leg, timing, planned.course)
    return {name: np.asarray(value, dtype=np.float64) for name, value in now._asdict().items()}


def _gait_at_heel_strike(run: Run, segments: Mapping[str, Floats], gaits: VariedGaits) -> dict[str, Floats]:
    """The fields of ``GaitNow`` (wearers,) at phase 0."""
    assert run.walk is not None, "a population walks"
    frequency = gaits.timing["frequency"]
    shank, shank_rate, shank_acceleration = gaits.series["shank"].at_heel_strike(frequency)
    ankle, ankle_rate, ankle_acceleration = gaits.series["ankle"].at_heel_strike(frequency)
    moment, force = (gaits.series[name].at_heel_strike(frequency)[0] for name in ("moment", "force"))
    knee = {name: gaits.series[name].at_heel_strike(frequency)[0] for name in KNEE}
    # A leg of arrays: the functions of the leg are plain arithmetic.
    own = {name: row for name, row in segments.items() if name in LegParameters._fields}
    leg: Any = run.walk.leg
    leg = leg._replace(**own)
    torque: Any = torque_of_shank
    turn = 2.0 * np.pi
    directions = *sine_and_cosine(shank / turn), *sine_and_cosine((shank - ankle) / turn + 0.25)
    carried = torque(leg, *directions, shank_rate, shank_acceleration, knee["knee_forward"], knee["knee_up"])
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
        **knee,
    }
