"""The next experiment: of many that a bench can do, the one, or the batch, after which most is known.

Each candidate is run once at the fitted numbers with a little of everything: parameters, effects that the model lacks,
tolerances of the bench. The products of these whitened changes are one Gram matrix a candidate; choosing is algebra
from there. The supplies and the load of a candidate are its own and are projected out at once, with their priors.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import PpafoError
from ppafo.identification.estimate import interval_factor
from ppafo.identification.trajectory.directions.catalogue import EFFECT_DIRECTIONS
from ppafo.identification.trajectory.directions.changes import as_it_is, can_have, changes_with, with_heat
from ppafo.identification.trajectory.directions.heat import HEAT
from ppafo.identification.trajectory.directions.kind import Direction
from ppafo.identification.trajectory.fitting import TrajectoryFit
from ppafo.identification.trajectory.information import covariance
from ppafo.identification.trajectory.problem import (
    FITTED_CHANNELS,
    Experiment,
    Range,
    is_nuisance,
    is_of_sensor,
    range_of,
    scenario_of,
    with_numbers,
)
from ppafo.identification.trajectory.residuals import (
    Floats,
    PreparedExperiment,
    Residuals,
    numbers_in,
    prepare,
    prior_coordinates,
)
from ppafo.identification.trajectory.search import Sensor
from ppafo.identification.trajectory.tolerances import Ability, Tolerances, tolerance_parameters
from ppafo.identification.trajectory.uncertainty import relative_to_number
from ppafo.model.catalog import find_effects
from ppafo.progress import Progress, Report, report_nothing
from ppafo.simulation.recorded import COMMAND
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate

STEP = 6.0e-4
"""Step of a difference in coordinates: impacts make runs bend, so that one of a percent would be another experiment."""
_OF_DEVIATION = 0.2
"""The same of a tolerance, in standard deviations of its prior."""
QUARTER = 0.25
BENT = 0.5
"""Change of an effect from a straight line, and of a parameter from one side to the other, from which a candidate is
left out: what it promises would not be reached."""
_CLEAR = 3.0
"""Length of a change in standard errors below which nobody minds how it bends."""
ENOUGH = 8.0
"""Standard errors of an effect above which more brings nothing."""
_LEAST_SCORE = 0.05
DRAWS = 3
"""Draws of the numbers over which a batch is averaged."""
RANDOM_BATCHES = 9
"""Batches of three at random, of which the middle is shown beside."""
AT_RANDOM = 3

STEP_RESPONSE, TORQUE_TASK = "step-response", "torque-task-proportional"


@dataclass(frozen=True, slots=True)
class Proposal:
    """An experiment that a bench can do: name, scenario, changes to it as texts, whether its command is followed."""

    label: str
    scenario: str
    overrides: tuple[str, ...]
    follows_command: bool

    @property
    def rig_experiment(self) -> str:
        """Name of the experiment of the virtual rig that records it."""
        return STEP_RESPONSE if self.scenario == STEP_RESPONSE else "torque-task"


@dataclass(frozen=True, slots=True)
class Promise:
    """What is promised: of each parameter the relative half width of its interval, of each effect its visibility.

    ``now``, ``after`` what was chosen, and the middle of batches ``at_random``. Half widths are fractions [-],
    visibilities standard errors [-] of an effect of ``size``, apart from all else that is unknown.
    """

    name: str
    size: str
    now: float
    after: float
    at_random: float


@dataclass(frozen=True, slots=True)
class NextExperiments:
    """Experiments that were chosen, in order, and what they promise together; how many there were to choose from."""

    chosen: tuple[Proposal, ...]
    widths: tuple[Promise, ...]
    visibility: tuple[Promise, ...]
    candidates: int
    dropped: int


@dataclass(frozen=True, slots=True)
class Sized:
    """An effect of the device and the smallest size of it that would do harm."""

    direction: Direction
    size: float

    @property
    def quarter(self) -> float:
        """What a quarter of the size changes over what the whole does [-], if nothing bends."""
        return float(QUARTER**self.direction.growth)

    @property
    def in_words(self) -> str:
        """The size in words."""
        return self.direction.size_in_words(self.size)


def draw_proposals(ability: Ability, count: int, random: np.random.Generator) -> tuple[Proposal, ...]:
    """Return experiments drawn evenly from what a bench can do: full openings, half ones, and sines of torque."""

    def between(ends: tuple[float, float]) -> float:
        return float(random.uniform(*ends))

    found = []
    for number in range(1, count + 1):
        is_wave = ability.torque is not None and bool(random.random() < 0.5)
        load, command = between(ability.load), between(ability.command)
        first, second = between(ability.supply_pressure), between(ability.supply_pressure)
        changes = [
            "motion.kind=free",
            f"supply.pressure={first:.0f} Pa_a",
            f"supply.dorsiflexion_pressure={second:.0f} Pa_a",
            f"motion.external_torque={load:.3g} N m",
            f"run.duration={_whole(between(ability.duration), ability.interval)!r} s",
            f"run.output_interval={ability.interval!r} s",
        ]
        if ability.angle is not None:
            changes.append(f"motion.angle={math.degrees(between(ability.angle)):.3g} deg")
        elif is_wave:
            changes.append("motion.angle=75 deg")
        else:
            changes.append(f"motion.angle={'20' if command >= 0.0 else '130'} deg")
        if is_wave and ability.torque is not None:
            changes += [
                "reference.kind=sine",
                f"reference.level={load:.3g} N m",
                f"reference.amplitude={between(ability.torque):.3g} N m",
                f"reference.frequency={between(ability.frequency):.3g} Hz",
            ]
        else:
            changes.append(f"controller.command={command:.3g}")
            filled = ("supply", "atmosphere") if command < 0.0 else ("atmosphere", "dorsiflexion_supply")
            changes += [f"initial.pressure_{place}={word}" for place, word in zip((1, 2), filled, strict=True)]
        scenario = TORQUE_TASK if is_wave else STEP_RESPONSE
        found.append(Proposal(f"candidate-{number}", scenario, tuple(changes), is_wave))
    return tuple(found)


def _whole(duration: float, interval: float) -> float:
    return round(round(duration / interval) * interval, 9)


@dataclass(frozen=True, slots=True)
class _Design:
    """Everything that the algebra of a choice rests on.

    ``parameters`` and ``common`` are the numbers of the device and those of sensors, in that order with the effects
    between them in every matrix.
    """

    fit: TrajectoryFit
    tolerances: Tolerances
    parameters: tuple[Range, ...]
    common: tuple[Range, ...]
    effects: tuple[Sized, ...]
    noise: Mapping[str, float]
    load: Callable[[str, tuple[str, ...]], Scenario]

    @property
    def prior(self) -> Floats:
        """Precision of what is known of effects and sensors without any recording."""
        most = [np.square(one.size / one.direction.largest) for one in self.effects]
        return np.diag([*np.zeros(len(self.parameters)), *most, *np.square(1.0 / prior_coordinates(self.common)[1])])


def propose(
    fit: TrajectoryFit,
    ability: Ability,
    tolerances: Tolerances,
    count: int,
    load: Callable[[str, tuple[str, ...]], Scenario],
    report: Report = report_nothing,
) -> NextExperiments:
    """Return the ``count`` experiments that together bring most, each chosen with those before it.

    ``load`` gives the scenario of a name with changes, on the device of the problem.
    """
    design = _design_of(fit, tolerances, harmful_sizes(fit), load)
    present = _present(design)
    points = _points(fit, DRAWS if count > 1 else 1)
    proposals = draw_proposals(ability, ability.candidates, np.random.default_rng(ability.seed))
    grams: list[list[Floats]] = []
    usable: list[Proposal] = []
    for number, proposal in enumerate(proposals, start=1):
        report(Progress("next experiment: candidates", number - 1, len(proposals), noun="candidates"))
        own = [_gram(design, proposal, point) for point in points]
        if all(one is not None for one in own):
            grams.append([one for one in own if one is not None])
            usable.append(proposal)
    chosen: list[int] = []
    for _ in range(min(count, len(usable))):
        rest = [place for place in range(len(usable)) if place not in chosen]
        values = [_value(design, present, [grams[place] for place in (*chosen, one)]) for one in rest]
        chosen.append(rest[int(np.argmax(values))])
    random = np.random.default_rng([ability.seed, 1])
    batches = [
        [grams[int(place)] for place in random.choice(len(usable), min(AT_RANDOM, len(usable)), replace=False)]
        for _ in range(RANDOM_BATCHES if usable else 0)
    ]
    now_widths, now_seen = _promised(design, present, [])
    after_widths, after_seen = _promised(design, present, [grams[place] for place in chosen])
    beside = [_promised(design, present, batch) for batch in batches] or [(now_widths, now_seen)]
    random_widths, random_seen = (np.median([one[place] for one in beside], axis=0) for place in (0, 1))
    return NextExperiments(
        tuple(replace(usable[place], label=f"next-{number}") for number, place in enumerate(chosen, start=1)),
        tuple(
            Promise(item.name, "", float(a), float(b), float(c))
            for item, a, b, c in zip(design.parameters, now_widths, after_widths, random_widths, strict=True)
        ),
        tuple(
            Promise(one.direction.name, one.in_words, float(a), float(b), float(c))
            for one, a, b, c in zip(design.effects, now_seen, after_seen, random_seen, strict=True)
        ),
        len(proposals),
        len(proposals) - len(usable),
    )


def promised_by(
    fit: TrajectoryFit,
    tolerances: Tolerances,
    proposals: Sequence[Proposal],
    effects: Sequence[Sized],
    load: Callable[[str, tuple[str, ...]], Scenario],
) -> tuple[Floats, Floats] | None:
    """Return what given experiments promise to a fit: half widths and visibilities of the effects, as in a ``Promise``.

    They are not left out for being rough or bent at the numbers of this fit. None where one cannot be run.
    """
    design = _design_of(fit, tolerances, tuple(effects), load)
    points = _points(fit, DRAWS if len(proposals) > 1 else 1)
    grams = [[_gram(design, one, point, is_bent_left_out=False) for point in points] for one in proposals]
    known = [[one for one in own if one is not None] for own in grams]
    if any(len(own) < len(points) for own in known):
        return None
    return _promised(design, _present(design), known)


def _design_of(
    fit: TrajectoryFit,
    tolerances: Tolerances,
    effects: tuple[Sized, ...],
    load: Callable[[str, tuple[str, ...]], Scenario],
) -> _Design:
    ranges = fit.optimum.residuals.ranges
    find_effects(path for one in EFFECT_DIRECTIONS for path in one.neutral)
    parameters = tuple(item for item in ranges if not is_nuisance(item) and not item.recordings)
    common = tuple(item for item in ranges if is_of_sensor(item) and not item.recordings)
    noise: dict[str, float] = {}
    for one in fit.optimum.residuals.experiments:
        noise = {channel.name: channel.noise for channel in one.channels} | noise
    return _Design(fit, tolerances, parameters, common, effects, noise, load)


def harmful_sizes(fit: TrajectoryFit) -> tuple[Sized, ...]:
    """Return the effects with the smallest size of each that moves a number by half its interval.

    It is never below the first size of its direction, which is that of an effect that moves none yet.
    """
    ranges = fit.optimum.residuals.ranges
    half = 0.5 * (fit.uncertainty.high - fit.uncertainty.low)
    kept = [index for index, item in enumerate(ranges) if not is_nuisance(item)]
    findings = {} if fit.doubt is None else {one.column.name: one for one in fit.doubt.findings}
    scenarios = [one.scenario for one in fit.optimum.residuals.experiments]
    found = []
    for direction in (*EFFECT_DIRECTIONS, HEAT):
        if direction is not HEAT and not any(can_have(one, direction) for one in scenarios):
            continue
        if direction is HEAT and all(one.thermal is not None for one in scenarios):
            continue
        finding, size = findings.get(direction.name), direction.sizes[0]
        if finding is not None:
            moved = max(abs(float(finding.shifts[index])) / float(half[index]) for index in kept)
            size = max(size, min(1.0 / max(moved, 1.0e-300), QUARTER * direction.largest))
        found.append(Sized(direction, size))
    return tuple(found)


def _points(fit: TrajectoryFit, count: int) -> list[Floats]:
    """Return the fitted coordinates, and draws of them where a batch is averaged."""
    draws = fit.uncertainty.mixture.draws
    some = [draws[int(place)] for place in np.linspace(0, len(draws) - 1, count - 1)] if count > 1 else []
    return [fit.optimum.point, *(fit.optimum.point + one for one in some)]


def _present(design: _Design) -> Floats:
    """Return the Gram matrix of the recordings that there are, over parameters, effects and sensors."""
    found = design.fit.optimum
    residuals, ranges = found.residuals, found.residuals.ranges
    directions = np.diag([step_of(item) for item in ranges])
    slopes = residuals.around(found.point, directions).jacobian_of_data()
    changes = []
    for one in residuals.experiments:
        numbers = numbers_in(one.label, ranges, found.point)
        fitted = replace(one, scenario=with_numbers(one.scenario, numbers))
        changes.append(effect_changes(fitted, design.effects, (1.0,))[0])
    whitened = np.concatenate(changes)
    if residuals.whitening is not None:
        whitened = residuals.whitening.of(whitened)
    return _over_kept(design, ranges, slopes, whitened)


def _over_kept(design: _Design, ranges: Sequence[Range], slopes: Floats, effects: Floats) -> Floats:
    """Return the Gram matrix over parameters, effects and sensors, with all other numbers projected out."""
    names = [item.name for item in ranges]
    first = [names.index(item.name) for item in design.parameters]
    last = [names.index(item.name) for item in design.common]
    others = [index for index in range(len(names)) if index not in (*first, *last)]
    rows = np.hstack([slopes[:, first], effects, slopes[:, last], slopes[:, others]])
    gram, kept = rows.T @ rows, rows.shape[1] - len(others)
    if not others:
        return gram
    deviations = prior_coordinates([ranges[index] for index in others])[1]
    inner = gram[kept:, kept:] + np.diag(1.0 / np.square(deviations))
    return np.asarray(gram[:kept, :kept] - gram[:kept, kept:] @ covariance(inner) @ gram[kept:, :kept])


def step_of(item: Range) -> float:
    """Return the step of a difference in coordinates, that of a tolerance by its prior."""
    if item.prior is None or not item.is_tolerance:
        return STEP
    return _OF_DEVIATION * item.prior.standard_deviation / abs(item.slope(item.coordinate(item.prior.mean)))


def effect_changes(prepared: PreparedExperiment, effects: Sequence[Sized], shares: Sequence[float]) -> list[Floats]:
    """Return, for each share of their sizes, the changes of the channels over their noise (samples, effects)."""
    found = [np.zeros((sum(len(one.values) for one in prepared.channels), len(effects))) for _ in shares]
    for is_heat, change in ((False, as_it_is), (True, with_heat)):
        places = [place for place, one in enumerate(effects) if (one.direction is HEAT) == is_heat]
        sizes = [(effects[place].direction, share * effects[place].size) for share in shares for place in places]
        if not sizes:
            continue
        values = changes_with(prepared, sizes, change)
        for number, matrix in enumerate(found):
            matrix[:, places] = values[:, number * len(places) : (number + 1) * len(places)]
    return found


def _gram(design: _Design, proposal: Proposal, point: Floats, is_bent_left_out: bool = True) -> Floats | None:
    """Return the Gram matrix of a candidate, None where it cannot be run, is rough, or bends too much."""
    ranges = design.fit.optimum.residuals.ranges
    numbers = numbers_in("", ranges, point)
    try:
        experiment = planned_experiment(proposal, design.load, numbers, design.noise)
        prepared = prepare(experiment, {})
    except PpafoError:
        return None
    own = tuple(
        range_of(item, (experiment,)) for item in tolerance_parameters(_of_runs(design.tolerances), (experiment,), ())
    )
    kept = (*design.parameters, *design.common)
    places = [index for index, item in enumerate(ranges) if item in kept]
    order = [ranges[index] for index in places]
    acting = (*order, *own)
    here = np.array([*point[places], *(item.coordinate(item.start) for item in own)])
    residuals = Residuals((prepared,), acting)
    near = residuals.around(here, np.diag([step_of(item) for item in acting]))
    if not np.isfinite(near.values).all():
        return None
    whiten = _whitener(design.fit.uncertainty.sensors, prepared)
    count = len(acting)
    above, below, centre = near.values[:, :count], near.values[:, count:-1], near.values[:, -1:]
    counts = np.array([is_bent_left_out and not item.is_tolerance for item in acting])
    if _bends(whiten(above - centre), whiten(centre - below), counts):
        return None
    little, whole = effect_changes(prepared, design.effects, (QUARTER, 1.0))
    if not (np.isfinite(little).all() and np.isfinite(whole).all()):
        return None
    shares = np.array([one.quarter for one in design.effects])
    if _bends(whiten(little) / shares, whiten(whole), np.full(len(design.effects), is_bent_left_out)):
        return None
    return _over_kept(design, acting, whiten(near.jacobian_of_data()), whiten(whole))


def _bends(one: Floats, other: Floats, counts: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> bool:
    """Return whether two changes that a straight line would make alike differ by too much where they are seen."""
    away, size = np.linalg.norm(one - other, axis=0), np.linalg.norm(other, axis=0)
    return bool(np.any(counts & (size > _CLEAR) & (away > BENT * size)))


def _of_runs(tolerances: Tolerances) -> Tolerances:
    """Return the tolerances of a run alone, without those of sensors that all recordings share."""
    return replace(
        tolerances,
        zero_of_angle=tolerances.zero_of_angle if "zero" in tolerances.each_recording else 0.0,
        zero_of_pressure=tolerances.zero_of_pressure if "zero" in tolerances.each_recording else 0.0,
        gain=tolerances.gain if "gain" in tolerances.each_recording else 0.0,
    )


def planned_experiment(
    proposal: Proposal,
    load: Callable[[str, tuple[str, ...]], Scenario],
    numbers: Mapping[str, float],
    noise: Mapping[str, float],
) -> Experiment:
    """Return a proposal as an experiment whose samples are those of its own run, at ``numbers`` [SI] by path."""
    scenario = with_numbers(load(proposal.scenario, proposal.overrides), numbers)
    recording = simulate(scenario).recording
    inputs = (COMMAND,) if proposal.follows_command else ()
    channels = tuple(name for name in FITTED_CHANNELS if name in noise)
    made = Experiment(proposal.label, scenario, recording, channels=channels, noise=noise, inputs=inputs)
    return replace(made, scenario=scenario_of(made)) if inputs else made


def _whitener(sensors: Sequence[Sensor], prepared: PreparedExperiment) -> Callable[[Floats], Floats]:
    """Return what whitens columns of changes over the noise, as the noise of the sensors was found to be."""
    known = {sensor.channel: sensor for sensor in reversed(sensors)}

    def whiten(columns: Floats) -> Floats:
        parts, first = [], 0
        for channel in prepared.channels:
            own = columns[first : first + len(channel.values)]
            first += len(channel.values)
            sensor = known.get(channel.name)
            if sensor is not None:
                rows = sensor.noise.shape.rows(np.ascontiguousarray(own), np.ones(len(own)))[0]
                own = rows / float(sensor.noise.levels[0])
            parts.append(own)
        return np.concatenate(parts)

    return whiten


def _promised(design: _Design, present: Floats, batch: Sequence[Sequence[Floats]]) -> tuple[Floats, Floats]:
    """Return half widths and visibilities after a batch: the median over the draws of each.

    A mean of the Gram matrices would promise what the one draw shows at which an experiment happens to show most.
    """
    after = [present + sum(draw, start=np.zeros_like(present)) for draw in zip(*batch, strict=True)] or [present]
    widths, seen = (np.median([quantity(design, one) for one in after], axis=0) for quantity in (_widths, _visibility))
    return widths, seen


def _value(design: _Design, present: Floats, batch: Sequence[Sequence[Floats]]) -> float:
    """Return what a batch is worth: D over the parameters, and each effect up to where it is clear; mean over draws."""
    found = []
    for draw in zip(*batch, strict=True):
        whole = present + sum(draw, start=np.zeros_like(present))
        count = len(design.parameters)
        spread = covariance(whole + design.prior)[:count, :count]
        seen = np.log(np.maximum(_visibility(design, whole), _LEAST_SCORE))
        found.append(-0.5 * float(np.linalg.slogdet(spread)[1]) + float(np.minimum(seen, math.log(ENOUGH)).sum()))
    return float(np.mean(found))


def _widths(design: _Design, gram: Floats) -> Floats:
    """Return the relative half widths of the intervals [-], with effects and sensors as unknown as they are."""
    spread = covariance(gram + design.prior)
    factor = interval_factor(design.fit.problem.search.confidence)
    ranges = design.fit.optimum.residuals.ranges
    point = {item.name: float(at) for item, at in zip(ranges, design.fit.optimum.point, strict=True)}
    return np.array(
        [
            relative_to_number(item, point[item.name], factor * math.sqrt(float(spread[index, index])))
            for index, item in enumerate(design.parameters)
        ]
    )


def _visibility(design: _Design, gram: Floats) -> Floats:
    """Return the standard errors [-] that each effect of its harmful size has, apart from all else."""
    prior, first = design.prior, len(design.parameters)
    found = []
    for place in range(first, first + len(design.effects)):
        # Every other effect is as unknown as it may be, this one is free.
        inverse = covariance(gram + prior)
        found.append(math.sqrt(max(0.0, 1.0 / float(inverse[place, place]) - float(prior[place, place]))))
    return np.array(found)
