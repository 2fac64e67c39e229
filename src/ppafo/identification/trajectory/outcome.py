"""A trajectory fit with all that a problem file asks of it: prospects before the search, profiles, checks after it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.bench.result import count_of
from ppafo.identification.estimate import Check, Estimate, Prospect, interval_factor
from ppafo.identification.trajectory.document import candidates_of, trajectory_problem
from ppafo.identification.trajectory.experiment import broken_rule, full_path
from ppafo.identification.trajectory.fitting import fit, noise_in, residuals_of
from ppafo.identification.trajectory.follow_up import Expected, Profile, expected_information, profile
from ppafo.identification.trajectory.information import correlation, covariance, directions_for, precision
from ppafo.identification.trajectory.preparation import Floats, Measured, PreparedExperiment
from ppafo.identification.trajectory.problem import Range, Search, TrajectoryProblem, ranges_of
from ppafo.identification.trajectory.residuals import FIRST_STEP, Residuals, prior_coordinates
from ppafo.identification.trajectory.result import TrajectoryFit
from ppafo.identification.trajectory.search import is_at_bound
from ppafo.identification.trajectory.section import Setting, TrajectorySection, name_in_refusals
from ppafo.identification.trajectory.uncertainty import FROM_PRIOR, STRONG, relative_to_number
from ppafo.progress import Progress, Report
from ppafo.units import percentage

EXCITED = 5.0
"""Range of a channel over its noise below which nothing happens in it."""

_HELD_SAMPLES = 20
_GAP = 1.5


def prospects_of(residuals: Residuals, search: Search) -> tuple[Prospect, ...]:
    """Return what the recordings can give and what not, from the samples and the slopes at the start of the search."""
    quality = [
        prospect
        for prepared in residuals.experiments
        for prospect in (*_clocks(prepared), *(_channel(prepared, channel) for channel in prepared.channels))
    ]
    return (*quality, *_numbers(residuals, search))


def _clocks(prepared: PreparedExperiment) -> list[Prospect]:
    gaps = np.diff(prepared.time)
    usual = float(np.median(gaps))
    longest = float(gaps.max())
    if longest <= _GAP * usual:
        return []
    at = float(prepared.time[int(np.argmax(gaps))])
    description = (
        f"a gap of {longest:.3g} s at {at:.3g} s, where samples are {usual:.3g} s apart; what lies in it is not used"
    )
    return [Prospect(f"clock of {prepared.label}", True, description)]


def _channel(prepared: PreparedExperiment, channel: Measured) -> Prospect:
    """Return whether a channel moves, and is not cut off at the limit of its sensor."""
    name, size = f"{channel.name} of {prepared.label}", float(np.ptp(channel.values)) / channel.noise
    held = _samples_at_limit(channel.values)
    if held > _HELD_SAMPLES:
        description = (
            f"{held} consecutive samples are exactly its maximum or minimum: the sensor is at its limit or stuck"
        )
        return Prospect(name, False, description)
    if size < EXCITED:
        return Prospect(name, False, f"its range is {size:.2g} times its noise: nothing happens in it")
    return Prospect(name, True, f"its range is {size:.3g} times its noise")


def _samples_at_limit(values: Floats) -> int:
    """Return the longest run of samples that all have the greatest or all have the least value."""
    longest = 0
    for limit in (float(values.max()), float(values.min())):
        is_there = np.concatenate([[False], values == limit, [False]])
        changes = np.flatnonzero(np.diff(is_there.astype(np.int8)))
        longest = max(longest, int(np.max(changes[1::2] - changes[::2], initial=0)))
    return longest


def _numbers(residuals: Residuals, search: Search) -> list[Prospect]:
    """Return for each number how well white noise of the estimated size would let it be known, at the start values."""
    ranges = residuals.ranges
    point = np.array([item.coordinate(item.start) for item in ranges])
    fixed = is_at_bound(point, ranges)
    if not np.isfinite(residuals.of_data(point[None, :])).all():
        return [Prospect("numbers", False, "the model diverges at the start values, so nothing can be predicted")]
    known = precision(residuals.around(point, np.diag(np.full(len(point), FIRST_STEP))), "linear")
    known = precision(residuals.around(point, directions_for(known, fixed)), "linear")
    errors, together = np.sqrt(np.diag(covariance(known))), correlation(covariance(known))
    _, prior, _ = prior_coordinates(ranges)
    return [
        _number(item, float(errors[index]), float(prior[index]), _partners(ranges, together, index), search)
        for index, item in enumerate(ranges)
    ]


def _number(item: Range, error: float, prior: float, partners: str, search: Search) -> Prospect:
    fraction = relative_to_number(item, item.coordinate(item.start), interval_factor(search.confidence) * error)
    if error > FROM_PRIOR * prior:
        return Prospect(item.name, False, "the recordings add little to its prior")
    if fraction <= search.weak:
        return Prospect(item.name, True, f"with white noise alone it would be known to {percentage(fraction, 2)}")
    against = f"it trades off against {partners}" if partners else "the recordings are hardly sensitive to it"
    return Prospect(item.name, False, f"{against}; fix it, give it a prior, or record something else")


def _partners(ranges: tuple[Range, ...], together: Floats, index: int) -> str:
    row = together[index]
    return ", ".join(ranges[other].name for other in range(len(ranges)) if other != index and abs(row[other]) >= STRONG)


ACCEPTABLE_FRACTION = 0.10
"""RMS of what is left, over the range of the samples, that the paper calls acceptable (page with figure 7)."""


@dataclass(frozen=True, slots=True)
class TrajectoryOutcome:
    """The fit, the requested profiles, candidates by what they would bring, the best first, and checks.

    ``beforehand`` is what the recordings could give and what not, known before the search. ``remarks`` are sentences
    about the fit as a whole, also about where it contradicts a bench procedure.
    """

    fit: TrajectoryFit
    profiles: tuple[Profile, ...]
    expected: tuple[Expected, ...]
    checks: tuple[Check, ...]
    remarks: tuple[str, ...]
    beforehand: tuple[Prospect, ...] = ()

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that did not hold."""
        return tuple(check for check in self.checks if not check.holds)


def solve_section(section: TrajectorySection, setting: Setting, report: Report) -> TrajectoryOutcome:
    """Return the outcome of a section; everything that can be refused is refused before the search begins."""
    with name_in_refusals(setting.file):
        problem = trajectory_problem(section, setting)
        paths = _profile_paths(section, problem, setting)
        candidates = candidates_of(section, setting, noise_in(problem))
        beforehand = prospects_of(residuals_of(problem), problem.search)
        for one in beforehand:
            if not one.can_be_had:
                report(Progress(f"trajectory: insufficient data: {one.name}: {one.statement}"))
        found = fit(problem, report)
        profiles = tuple(_profiles(found, paths, report))
        if candidates:
            report(Progress(f"expected information of {count_of(len(candidates), 'further experiment')}"))
        expected = expected_information(found, candidates)
    remarks = (*found.remarks, *_contradictions(found, setting.bench))
    return TrajectoryOutcome(found, profiles, expected, _checks(found), remarks, beforehand)


def _profiles(found: TrajectoryFit, paths: Sequence[str], report: Report) -> Iterator[Profile]:
    for number, path in enumerate(paths, start=1):
        report(Progress(f"profile likelihood {number} of {len(paths)}: {path}"))
        yield profile(found, path)


def _profile_paths(section: TrajectorySection, problem: TrajectoryProblem, setting: Setting) -> tuple[str, ...]:
    names = [item.name for item in ranges_of(problem)]
    paths = tuple(full_path(path, problem.experiments[0].scenario) for path in section.profiles)
    for typed, path in zip(section.profiles, paths, strict=True):
        if path not in names:
            raise IdentificationError(
                f"{setting.file}: profiles: '{typed}' is not fitted{nearest_name(path, names)}; fitted: "
                f"{', '.join(names)}"
            )
    return paths


def _contradictions(found: TrajectoryFit, bench: Mapping[str, Estimate]) -> list[str]:
    """Return a sentence for each number whose interval does not meet that of a bench procedure."""
    remarks = []
    for fitted in found.estimates:
        other = bench.get(fitted.path)
        if other is None or not (other.is_usable and fitted.is_usable):
            continue
        if fitted.low > other.high or fitted.high < other.low:
            remarks.append(
                f"{fitted.path}: fitted to {fitted.low:.4g} to {fitted.high:.4g} {fitted.unit}, but a bench procedure "
                f"gave {other.low:.4g} to {other.high:.4g}: one of the two models is incomplete"
            )
    return remarks


def _checks(found: TrajectoryFit) -> tuple[Check, ...]:
    worst = max(found.channels, key=lambda channel: channel.fraction)
    left, good = percentage(worst.fraction, 2), f"{100.0 * ACCEPTABLE_FRACTION:g} %"
    description = f"RMS at most {left} of the range in {worst.channel} of {worst.experiment}; {good} is good"
    broken = next((text for text in (broken_rule(item.device) for item in found.scenarios) if text), "")
    settled = found.optimum.has_converged
    wrong = found.misfit
    return (
        Check(
            "search",
            settled,
            f"{found.evaluations} evaluations, {'converged' if settled else 'stopped before it converged'}",
        ),
        Check("what is left", worst.fraction <= ACCEPTABLE_FRACTION, description),
        Check("one model for all", not wrong, wrong or found.uncertainty.misfit.in_words),
        Check("numbers agree", not broken, broken or "no rule of a device is broken"),
    )
