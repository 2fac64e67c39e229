"""What the league measures of a walk: its stride, the measures of it, and the same over drawn wearers and devices."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.assistance import TorqueProfile, profile_torque
from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, Walk, batch_of, gas_by_path
from ppafo.errors import SimulationError
from ppafo.gait import Gait
from ppafo.model import contact as ground
from ppafo.model.contact import SWING
from ppafo.model.gait import GaitNow, GaitTiming, gait_at
from ppafo.model.plant import PlantParameters, chamber_pressures
from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.parameters.plant import plant_parameters
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.league.standing import NOISE_DRAWS, SEED, Robustness, draw_factors, draw_seeds, scale_device
from ppafo.questions.league.walking.task import WalkingTask
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sampling import other_noise
from ppafo.walking.events import (
    EVENTS,
    SAFE_ROW,
    TOO_FAR,
    Samples,
    event_errors,
    known_events,
    true_events,
    within,
)
from ppafo.walking.gait_series import AnklePath, ankle_path, gait_timing, truncate
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import VariedGaits, draw_gaits
from ppafo.walking.planning import batch_of_many, has_ideal_sensors, plan_walk
from ppafo.walking.preparation import vented_state, with_leg
from ppafo.walking.result import REMEDY
from ppafo.walking.wearer import Build, Wearer, draw_builds

DEGREE = 2
"""Collocation points in an interval; Radau's, of third order."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Intervals of a stride, shortened where something begins or ends: ``starts`` and ``lengths`` [s] after toe-off.

    ``times`` [s] and integration ``weights`` [s] are those of all collocation points, ``slopes`` (degree + 1, degree)
    differentiate within an interval of length 1. Intervals before ``free_intervals`` have a free foot.
    """

    starts: Floats
    lengths: Floats
    times: Floats
    weights: Floats
    slopes: Floats
    free_intervals: int

    @property
    def free_points(self) -> int:
        """Number of collocation points at which the foot is free."""
        return DEGREE * self.free_intervals


@dataclass(frozen=True, slots=True)
class Stride:
    """A stride whose foot comes down flat at the phase ``landing``, with the gait and what is requested at every point.

    ``wanted`` [N m], ``asks_torque`` and ``asks_freedom`` for each point; ``asks_height`` for each free point;
    ``prescribed`` are the angles [rad] and rates [rad/s] of the points on the ground; ``begin`` those at toe-off.
    ``phases`` of the points and ``middle_phases`` of the intervals count on from the heel strike before the toe-off.
    """

    grid: Grid
    landing: float
    now: tuple[GaitNow, ...]
    contacts: tuple[float, ...]
    prescribed: tuple[ground.Ankle, ...]
    begin: ground.Ankle
    wanted: Floats
    asks_torque: Floats
    asks_freedom: Floats
    asks_height: NDArray[np.bool_]
    phases: Floats
    middle_phases: Floats

    @property
    def before_landing(self) -> list[int]:
        """Free points from the heel strike on at which the foot is not flat yet."""
        on_heel = np.flatnonzero(np.array(self.contacts[: self.grid.free_points]) == ground.HEEL)
        return [int(on_heel[0]) - 1, *on_heel[:-1].tolist()]


FREE_FROM = 0.2
"""Phase from which the shank shall roll freely over the foot, until the push-off; the foot is flat long before."""


def free_window(profile: TorqueProfile) -> tuple[float, float]:
    """Phases of mid-stance between which no torque is desired; the same twice where the push-off begins before."""
    begin = max(profile.peak_time - profile.rise_time, 0.0)
    return min(FREE_FROM, begin), begin


def push_off_window(profile: TorqueProfile, timing: GaitTiming) -> tuple[float, float]:
    """Phases between which a torque is requested, up to toe-off at most."""
    begin = profile.peak_time - profile.rise_time
    return max(begin, 0.0), min(profile.peak_time + profile.fall_time, timing.toe_off)


def stride_of(walk: Walk, profile: TorqueProfile, landing: float, intervals: int, lag: float = 0.0) -> Stride:
    """The stride of a gait with about so many intervals; ``landing`` in turns after the heel strike.

    The torque of ``profile`` is desired later by a lag [s]; mid-stance is free up to where it would begin without.
    """
    timing = walk.timing
    late = profile._replace(peak_time=profile.peak_time + lag * timing.frequency)
    windows = (*push_off_window(late, timing), *free_window(profile))
    grid = _grid(timing, (late.peak_time, *windows), landing, intervals)
    now = [_gait(walk, time) for time in grid.times]
    phases = timing.toe_off + timing.frequency * grid.times
    contacts = [_contact(timing, landing, phase) for phase in phases.tolist()]
    prescribed = [
        _prescribed_ankle(walk, contact, phase) for contact, phase in zip(contacts, phases.tolist(), strict=True)
    ]
    first, last, free_first, free_last = (1.0 + phase for phase in windows)
    return Stride(
        grid,
        landing,
        tuple(now),
        tuple(contacts),
        tuple(prescribed[grid.free_points :]),
        _prescribed_ankle(walk, ground.TOE, 1.0 + timing.toe_off),
        np.array([profile_torque(late, phase - 1.0) for phase in phases.tolist()]),
        ((phases > first) & (phases < last + 1.0e-9)).astype(np.float64),
        ((phases > free_first) & (phases < free_last + 1.0e-9)).astype(np.float64),
        ((phases > timing.clearance_from) & (phases < timing.clearance_to + 1.0e-9))[: grid.free_points],
        phases,
        timing.toe_off + timing.frequency * (grid.starts + 0.5 * grid.lengths),
    )


def _grid(timing: GaitTiming, phases: tuple[float, ...], landing: float, intervals: int) -> Grid:
    """About so many intervals, with a mark wherever something begins or ends; ``phases`` of what is desired."""
    import casadi

    marks = [timing.toe_off, timing.clearance_from, timing.clearance_to, 1.0, 1.0 + landing, 1.0 + timing.heel_off]
    marks += [1.0 + min(phase, timing.toe_off) for phase in phases]
    marks = sorted({*marks, 1.0 + timing.toe_off})
    edges = [marks[0]]
    for begin, end in itertools.pairwise(marks):
        parts = max(1, round((end - begin) * intervals))
        edges += [begin + (end - begin) * (part + 1) / parts for part in range(parts)]
    starts = (np.array(edges[:-1]) - timing.toe_off) / timing.frequency
    lengths = np.diff(edges) / timing.frequency
    roots = casadi.collocation_points(DEGREE, "radau")
    slopes, _, weights = (np.array(item) for item in casadi.collocation_coeff(roots))
    times = (starts[:, None] + lengths[:, None] * np.array(roots)).ravel()
    free = int(np.count_nonzero(np.array(edges[1:]) < 1.0 + landing + 1.0e-9))
    return Grid(starts, lengths, times, (lengths[:, None] * weights.ravel()).ravel(), slopes, free)


def _gait(walk: Walk, time: float) -> GaitNow:
    """The gait at a time [s] after toe-off."""
    timing = walk.timing._replace(start=walk.timing.toe_off)
    return gait_at(walk.gait, timing, walk.leg, time)


def _contact(timing: GaitTiming, landing: float, phase: float) -> float:
    """Contact just before a phase that counts on from the last heel strike but one."""
    on_ground = ground.FLAT if phase <= 1.0 + timing.heel_off else ground.TOE
    on_ground = ground.HEEL if phase <= 1.0 + landing + 1.0e-9 else on_ground
    return ground.SWING if phase <= 1.0 else on_ground


def _prescribed_ankle(walk: Walk, contact: float, phase: float) -> ground.Ankle:
    """Where the ground leads the ankle: after the heel's rise what is left of the difference to the measured ankle."""
    timing = walk.timing
    ankle = ground.prescribed_ankle(contact, _at(walk, phase), timing.ground_angle, keeps_gait=0.0)
    if contact != ground.TOE:
        return ankle
    rise = _at(walk, timing.heel_off)
    flat = ground.prescribed_ankle(ground.FLAT, rise, timing.ground_angle, keeps_gait=0.0)
    since = (phase - 1.0 - timing.heel_off) / timing.frequency
    offset = (flat.angle - rise.ankle) * float(np.exp(-since / ground.FADING_TIME))
    return ground.Ankle(ankle.angle + offset, ankle.rate - offset / ground.FADING_TIME, ankle.acceleration)


def _at(walk: Walk, phase: float) -> GaitNow:
    return _gait(walk, (phase - walk.timing.toe_off) / walk.timing.frequency % (1.0 / walk.timing.frequency))


MEASURES = {
    "torque_error": ("N m", "RMS of actuator torque less the desired torque, in the push-off window"),
    "torque_lag": ("s", "delay of the desired torque that gives the minimum RMS error"),
    "lagged_error": ("N m", "RMS of actuator torque less the desired torque at that lag: the error of the law itself"),
    "mid_stance_torque": ("N m", "RMS of the actuator torque in mid-stance, where the shank should move freely"),
    "toe_height": ("m", "lowest toes over the ground in mid-swing, mean over the strides"),
    "toes_clear": (
        "-",
        "fraction of the strides in which the toes touched the ground neither in mid-swing nor first at landing",
    ),
    "toe_strikes": ("-", "fraction of the strides that begin on the toes"),
    "swing_error": ("rad", "RMS of the ankle angle less the healthy one in the swing"),
    "slap_rate": ("rad/s", "rate of the foot as it comes down, below 0 with the toes falling, mean over the strides"),
    "push_off_work": ("J", "work of T_ex while the foot rolls over the toes, in one stride"),
    "gas": ("kg", "gas taken from the supply in one stride"),
    "event_error": ("s", "RMS of the times at which the controller knows of the events of the stride, less the true"),
    "strike_error": ("s", "the same of the heel strikes alone"),
    "switchings": ("-", "changes of the valve's path in one stride: to chamber 1, to chamber 2, vented"),
    "safe_state": ("-", "1 if the controller paused or stopped"),
}
"""Unit and meaning of every measure."""
LAGS = np.arange(0.0, 0.0801, 0.002)
"""Lags [s] that are tried; recognising a heel strike takes some 30 ms."""
_PROFILE_PHASES = np.linspace(0.0, 1.0, 2001)
_PHASES = np.linspace(0.0, 1.0, 1001)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A walk as samples (samples,): phase in turns, contact, angles [rad], torque [N m], command, height of toes [m].

    ``known_events`` are the samples at which the controller knows of each event, {} where it knows of none.
    Running totals: gas [kg], slap rates [rad/s] and landings, strikes with the toes first, work [J]; ``vented`` 1 once
    the controller has paused or stopped.
    """

    phase: Floats
    contact: Floats
    angle: Floats
    healthy_angle: Floats
    torque: Floats
    command: Floats
    toe_height: Floats
    gas: Floats
    slap_rates: Floats
    landings: Floats
    toe_landings: Floats
    push_off_work: Floats
    vented: Floats
    true_events: Mapping[str, Samples] = field(default_factory=dict)
    known_events: Mapping[str, Samples] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Toes:
    """Where the toes of a wearer are: the path of the ankle, and the healthy toes over the ground [m] by phase."""

    path: AnklePath
    toe_off: float
    healthy: Floats

    def heights(
        self, timing: GaitTiming, stature: float, phase: Floats, shank: Floats, angles: tuple[Floats, Floats]
    ) -> Floats:
        """Toes over the ground [m] in the swing of a wearer with a gait and a stature of their own.

        The healthy toes are at the same fraction of the swing as high as those of the gait that is varied; ``angles``
        are the ankle's and the healthy one [rad].
        """
        fraction = (phase - timing.toe_off) / (1.0 - timing.toe_off)
        healthy = np.interp(self.toe_off + fraction * (1.0 - self.toe_off), _PHASES, self.healthy)
        path = replace(
            self.path,
            toe_lever=stature * self.path.toe_lever,
            height=stature * self.path.height,
            ground_angle=timing.ground_angle,
        )
        lifted, measured = (path.toe_height(phase, shank, angle) for angle in angles)
        return np.asarray(healthy + lifted - measured)


def toes_of(gait: Gait, wearer: Wearer) -> Toes:
    """The toes of a wearer with a gait."""
    timing = gait_timing(gait)
    path = ankle_path(gait, timing, wearer)
    shank, ankle = truncate(gait.shank_angle).values_at(_PHASES), truncate(gait.ankle_angle).values_at(_PHASES)
    # The path repeats: at its very end it is that of the next heel strike.
    return Toes(path, timing.toe_off, path.toe_height(np.minimum(_PHASES, 1.0 - 1.0e-9), shank, ankle))


def course_of(
    record: Mapping[str, Floats], plant: PlantParameters, timing: GaitTiming, toes: Toes, stature: float = 1.0
) -> Course:
    """The course of a walk from its rows (samples,) by path; ``stature`` over that of the wearer of ``toes``."""
    angle, healthy, phase = record["state.angle"], record["walk.now.ankle"], record["walk.now.phase"]
    pressures = chamber_pressures(plant, angle, record["state.mass_1"], record["state.mass_2"])
    return Course(
        phase=phase,
        contact=record["walk.contact"],
        angle=angle,
        healthy_angle=healthy,
        torque=plant.torque_constant * np.subtract(*pressures),
        command=record["result.command"],
        toe_height=toes.heights(timing, stature, phase, record["walk.now.shank"], (angle, healthy)),
        gas=record["state.supplied_mass"],
        slap_rates=record["walk.slap_rates"],
        landings=record["walk.landings"],
        toe_landings=record["walk.toe_landings"],
        push_off_work=record["walk.push_off_work"],
        vented=record.get(SAFE_ROW, np.zeros_like(phase)),
        true_events=true_events(record["walk.contact"]),
        known_events=known_events(record),
    )


def walk_course(task: WalkingTask, configuration: Scenario) -> Course:
    """The course of a walk, every sample of it; SimulationError where it diverges."""
    run = plan_walk(with_duration(configuration, task.seconds))
    assert run.walk is not None, "a league walks"
    outcome = run_batch(batch_of(run))
    rows = row_numbers(run.program.state_rows())
    final = outcome.states[:, 0]
    if final[rows["result.failure_time"]] < NEVER_FAILED or not np.isfinite(final).all():
        raise SimulationError(f"{configuration.control.kind} diverged; {REMEDY}")
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    return course_of(
        record, run.plant, run.walk.timing, toes_of(walk_of(configuration).gait, walk_of(configuration).wearer)
    )


def walk_measures(task: WalkingTask, configuration: Scenario) -> dict[str, float]:
    """The measures of the settled strides; SimulationError where the walk diverges."""
    run = plan_walk(with_duration(configuration, task.seconds))
    assert run.walk is not None, "a league walks"
    course = walk_course(task, configuration)
    return measures(course, task.profile, run.walk.timing, last_strides(course.phase))


def last_strides(phase: Floats) -> list[slice]:
    """Whole strides of the second half, from heel strike to heel strike; none where there is no whole stride."""
    strikes = np.flatnonzero(np.diff(phase) < -0.5) + 1
    strides = [slice(int(begin), int(end)) for begin, end in itertools.pairwise(strikes)]
    return strides[len(strides) // 2 :]


def measures(course: Course, profile: TorqueProfile, timing: GaitTiming, strides: Sequence[slice]) -> dict[str, float]:
    """The values of ``MEASURES`` over some strides, at least one."""
    part = slice(strides[0].start, strides[-1].stop)
    errors = _torque_errors(course, part, profile, timing)
    best = int(np.argmin(errors))
    swings = course.contact[part] == SWING
    lowest, clear, struck = _toes(course, timing, strides)
    landings = max(_gain(course.landings, part), 1.0)
    return _event_errors(course, part, len(strides), timing) | {
        "torque_error": errors[0],
        "torque_lag": float(LAGS[best]),
        "lagged_error": errors[best],
        "mid_stance_torque": _mid_stance(course, part, profile),
        "toe_height": lowest,
        "toes_clear": clear,
        "toe_strikes": struck,
        "swing_error": _rms((course.angle - course.healthy_angle)[part][swings]),
        "slap_rate": _gain(course.slap_rates, part) / landings,
        "push_off_work": _gain(course.push_off_work, part) / len(strides),
        "gas": _gain(course.gas, part) / len(strides),
        "switchings": switchings(course.command[part]) / len(strides),
        "safe_state": float(course.vented[part].any()),
    }


def _event_errors(course: Course, part: slice, strides: int, timing: GaitTiming) -> dict[str, float]:
    """RMS errors [s] of the event times; {} for a controller that knows of no events."""
    if not course.known_events:
        return {}
    stride_time = 1.0 / timing.frequency
    interval = strides * stride_time / (part.stop - part.start)
    true, room = within(course.true_events, part), round(TOO_FAR * stride_time / interval)
    known = within(course.known_events, slice(part.start - room, part.stop + room))
    found = {name: event_errors(true[name], known[name], interval, stride_time).errors for name in EVENTS}
    every = np.concatenate(list(found.values()))
    if not (every.size and found[EVENTS[0]].size):
        return {}
    return {"event_error": _rms(every), "strike_error": _rms(found[EVENTS[0]])}


def switchings(command: Floats) -> float:
    """How often a command changes what the valve does; a command of 0 in between does not count."""
    ways = np.where(command > VENTS_ABOVE, 2.0, np.sign(command))
    return float(np.count_nonzero(np.diff(ways[ways != 0.0])))


def _torque_errors(course: Course, part: slice, profile: TorqueProfile, timing: GaitTiming) -> list[float]:
    """RMS errors [N m] in the push-off window, both the window and what is desired later by each of ``LAGS``."""
    first, last = push_off_window(profile, timing)
    table = [profile_torque(profile, phase) for phase in _PROFILE_PHASES.tolist()]
    phase, torque = course.phase[part], course.torque[part]
    errors = []
    for late in (LAGS * timing.frequency).tolist():
        pushes = (phase >= first + late) & (phase <= min(last + late, timing.toe_off))
        missed = torque[pushes] - np.interp(phase[pushes] - late, _PROFILE_PHASES, table)
        errors.append(_rms(missed) if missed.size else float("inf"))
    return errors


def _mid_stance(course: Course, part: slice, profile: TorqueProfile) -> float:
    """RMS torque [N m] where none is desired; 0 where the push-off leaves no such time."""
    first, last = free_window(profile)
    free = (course.phase[part] >= first) & (course.phase[part] < last)
    return _rms(course.torque[part][free]) if free.any() else 0.0


def _toes(course: Course, timing: GaitTiming, strides: Sequence[slice]) -> tuple[float, float, float]:
    """Mean lowest toes in mid-swing [m], fractions of strides with clear toes and of those that begin on the toes."""
    lowest, ends, begins = [], [], []
    for stride in strides:
        phase = course.phase[stride]
        watched = (phase >= timing.clearance_from) & (phase <= timing.clearance_to)
        lowest.append(float(np.min(course.toe_height[stride][watched])))
        # A strike counts at the first sample of the stride that it begins: the landing of a swing is that after it.
        ends.append(_gain(course.toe_landings, stride) > 0.5)
        begins.append(_gain(course.toe_landings, slice(max(stride.start - 1, 0), stride.start)) > 0.5)
    clear = [height >= 0.0 and not first for height, first in zip(lowest, ends, strict=True)]
    return float(np.mean(lowest)), float(np.mean(clear)), float(np.mean(begins))


def _gain(total: Floats, part: slice) -> float:
    return float(total[min(part.stop, total.size - 1)] - total[part.start])


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


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


def draw_wearers(configuration: Scenario, count: int, seed: int = SEED) -> DrawnWearers:
    """Wearers drawn around that of a configuration, who is the first; for every controller the same."""
    # Not the stream of their devices, with which wearers would go hand in hand.
    generator = np.random.default_rng([seed, _WEARERS])
    build = draw_builds(count, generator)
    gaits = draw_gaits(walk_of(configuration).gait, build.stature, generator)
    return DrawnWearers(build, gaits, batch_of_many(configuration, build, gaits, generator))


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
    configuration = with_duration(configuration, task.seconds)
    run = plan_walk(configuration)
    wearers = draw_wearers(configuration, draws, seed)
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
        for path, number in gas_by_path(replace(run, plant=plant, initial=begin)).items():
            states[state_rows[path], draw] = number
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
