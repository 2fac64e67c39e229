"""The trajectory fit: runs as residuals of the one estimator, and what comes of it as values of the device."""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.fit import Fit
from ppafo.identification.fit import fit as estimate
from ppafo.identification.trajectory.problem import (
    Number,
    TrajectoryProblem,
    broken_rule,
    full_path,
    numbers_of,
    reach_of,
    with_numbers,
)
from ppafo.identification.trajectory.runs import (
    Floats,
    Measured,
    blocks_of,
    numbers_in,
    prepare,
    residuals_of,
    signals_of,
)
from ppafo.identification.wording import conflict_in_words, in_shown_unit, widened_by
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import CHANNELS, Channel, Recording
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """What one channel of one experiment leaves, in its SI unit.

    ``noise`` is the standard deviation that weighs it and ``order`` the order of the autoregression that makes it
    white, both of its sensor; ``rms`` and ``largest`` are of this recording, ``span`` is the range that the samples
    cover.
    """

    experiment: str
    channel: str
    unit: str
    noise: float
    order: int
    rms: float
    largest: float
    span: float

    @property
    def fraction(self) -> float:
        """RMS of what is left over the range that the samples cover [-]."""
        return self.rms / self.span if self.span > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Known:
    """A tolerance in the SI unit of its number: what it was thought to be, and what the recordings make of it.

    ``widens`` is the number that is sought whose interval it widens most, ``share`` its fraction of the variance there.
    """

    name: str
    unit: str
    before: float
    before_error: float
    after: float
    after_error: float
    widens: str
    share: float


@dataclass(frozen=True, slots=True)
class TrajectoryFit:
    """Estimates of the numbers that were sought, each with verdict and sentence, and what was not known exactly.

    ``covariance`` [SI] and ``correlation`` are in the order of ``estimates``. ``models`` are the fitted runs at the
    times of the samples, ``measurements`` the samples, both by experiment over the time of the run. ``conflict`` says
    which recordings or channels alone give other values than all together, empty where they agree; ``remarks`` are
    sentences about the fit as a whole.
    """

    problem: TrajectoryProblem
    numbers: tuple[Number, ...]
    fit: Fit
    estimates: tuple[Estimate, ...]
    covariance: Floats
    correlation: Floats
    known: tuple[Known, ...]
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    conflict: str
    remarks: tuple[str, ...]

    def estimate(self, name: str) -> Estimate:
        """Return the estimate of a number by its path; ``valve.area`` means the valve of the first experiment.

        IdentificationError where it was not sought.
        """
        full = full_path(name, self.scenarios[0])
        for one in self.estimates:
            if one.path == full:
                return one
        hint = nearest_name(full, [item.path for item in self.estimates])
        raise IdentificationError(f"'{name}' was not fitted{hint}")

    @property
    def values(self) -> dict[str, float]:
        """The estimates in SI units by path."""
        return {one.path: one.value for one in self.estimates}


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Return the numbers of a problem that explain its recordings best, each with interval [SI] and verdict.

    ``report`` hears what is being done. IdentificationError where it cannot be run.
    """
    numbers = numbers_of(problem)
    free = [item.free for item in numbers]
    start = np.array([one.start for one in free])
    prepared = tuple(
        prepare(
            item,
            numbers_in(item.label, numbers, start),
            reach_of([one for one in numbers if one.acts_in(item.label)]),
        )
        for item in problem.experiments
    )
    report(Progress(f"trajectory fit: {len(free)} numbers, {len(prepared)} recordings"))
    found = estimate(
        lambda points: residuals_of(prepared, numbers, points),
        free,
        blocks_of(prepared, numbers, start),
        problem.confidence,
        report,
        is_motion=True,
    )
    conflict = conflict_in_words(found, "the model lacks something")
    sought = [place for place, item in enumerate(numbers) if not item.is_tolerance]
    estimates = tuple(_estimate(problem, found, numbers[place], place, conflict) for place in sought)
    errors, known = np.sqrt(np.diag(found.covariance)), []
    for place in (place for place, item in enumerate(numbers) if item.is_tolerance):
        name, item = free[place].name, numbers[place]
        shares = {one.path: dict(found.shares[one.path]).get(name, 0.0) for one in estimates}
        widens = max(shares, key=lambda path: shares[path], default="")
        (before, first), (after, last) = (
            (math.exp(value), math.exp(value) * error) if item.is_logarithm else (value, error)
            for value, error in (
                (item.free.start, item.free.deviation), (float(found.values[place]), float(errors[place]))
            )
        )  # fmt: skip
        known.append(
            Known(
                name=name,
                unit=item.unit,
                before=before,
                before_error=first,
                after=after,
                after_error=last,
                widens=widens,
                share=shares.get(widens, 0.0),
            )
        )
    # Tolerances are marginalised: their rows are left out, their share of the variance stays.
    part = found.covariance[np.ix_(sought, sought)]
    signals = signals_of(prepared, numbers, found.values[:, None])
    scenarios = tuple(with_numbers(one.scenario, numbers_in(one.label, numbers, found.values)) for one in prepared)
    models, measurements, channels = [], [], []
    for experiment, one, values in zip(problem.experiments, prepared, signals, strict=True):
        fitted = {name: Channel(column[:, 0], CHANNELS[name].unit) for name, column in values.items()}
        samples = {item.name: Channel(item.values, CHANNELS[item.name].unit) for item in one.channels}
        models.append(Recording(f"model of {one.label}", one.time, fitted, kind="simulated"))
        measurements.append(Recording(experiment.label, one.time, samples, kind=experiment.recording.kind))
        channels += [_channel(found, experiment.label, item, values[item.name][:, 0]) for item in one.channels]
    remarks = [text for text in dict.fromkeys(broken_rule(item.device) for item in scenarios) if text]
    if not found.has_converged:
        starts = (f'start = "{one.value:.4g} {one.unit}"'.replace(' -"', '"') + f" of {one.path}" for one in estimates)
        remarks.append(
            f"the search stopped after {found.evaluations} runs before it converged; give the parameters "
            f"{', '.join(starts)}, where it ended"
        )
    return TrajectoryFit(
        problem=problem,
        numbers=numbers,
        fit=found,
        estimates=estimates,
        covariance=part,
        correlation=part / np.outer(errors[sought], errors[sought]),
        known=tuple(known),
        channels=tuple(channels),
        models=tuple(models),
        measurements=tuple(measurements),
        scenarios=scenarios,
        conflict=conflict,
        remarks=tuple(remarks),
    )


_OWN_SHARE = 0.2
_AT_BOUND = 1.0e-6


def _estimate(problem: TrajectoryProblem, found: Fit, item: Number, place: int, conflict: str) -> Estimate:
    """Return one estimate with its verdict and sentence."""
    value, low, high = (float(one[place]) for one in (found.values, found.low, found.high))
    name = item.free.name
    bound = next(
        (end for end in (item.free.low, item.free.high) if abs(value - end) <= _AT_BOUND * abs(end or 1.0)), None
    )
    # A number with a small weight only accompanies a combination that is open.
    combination = next((one for one in found.unidentified if abs(one.get(name, 0.0)) >= _OWN_SHARE), None)
    verdict: Verdict = "identified"
    if combination is not None:
        verdict = "not identifiable"
        # So far from where it was linearised the interval of a straight line means nothing.
        low, high = min(low, item.free.low), max(high, item.free.high)
        others = [other for other in combination if other != name]
        text = f"trades off against {' and '.join(others)}" if others else "the recordings are hardly sensitive to it"
        text += "; fix it, give a prior, or make another recording"
    elif bound is not None:
        end, unit = in_shown_unit(bound, item.unit)
        verdict, text = "at its bound", f"the recordings want a value at or beyond {end:.6g} {unit}".rstrip(" -")
    elif conflict:
        # Said of every number: which of them the missing physics moves is not known.
        verdict, text = "holds for this model only", conflict
    else:
        text = widened_by(found, name)
    recordings = tuple(one.source or one.recording.label for one in problem.experiments if item.acts_in(one.label))
    return Estimate(
        path=name, value=value, unit=item.unit, low=low, high=high, verdict=verdict, explanation=text,
        recordings=recordings, confidence=problem.confidence,
    )  # fmt: skip


def _channel(found: Fit, experiment: str, measured: Measured, model: Floats) -> ChannelFit:
    left = measured.values - model
    return ChannelFit(
        experiment=experiment,
        channel=measured.name,
        unit=CHANNELS[measured.name].unit,
        noise=found.noise[measured.name],
        order=found.correlation[measured.name],
        rms=float(np.sqrt(np.mean(left * left))),
        largest=float(np.max(np.abs(left))),
        span=float(np.ptp(measured.values)),
    )
