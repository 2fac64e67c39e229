"""A trajectory fit with all that a problem file asks of it: profiles, further experiments, checks."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.bench.result import counted
from ppafo.identification.check import Check, Prospect
from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory.beforehand import prospects_of
from ppafo.identification.trajectory.document import candidates_of, trajectory_problem
from ppafo.identification.trajectory.expected import Expected, expected_information
from ppafo.identification.trajectory.fitting import fit, noise_in, residuals_of
from ppafo.identification.trajectory.paths import broken_order, full_path
from ppafo.identification.trajectory.problem import TrajectoryProblem, ranges_of
from ppafo.identification.trajectory.profiles import Profile, profile
from ppafo.identification.trajectory.result import TrajectoryFit
from ppafo.identification.trajectory.section import TrajectorySection
from ppafo.identification.trajectory.setting import Setting, told_of

ACCEPTABLE_SHARE = 0.10
"""RMS of what is left, over the range of the samples, that the paper calls acceptable (page with figure 7)."""


@dataclass(frozen=True, slots=True)
class TrajectoryOutcome:
    """The fit, the profiles that were asked for, candidates by what they would bring, the best first, and checks.

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


def solve_section(section: TrajectorySection, setting: Setting, tell: Callable[[str], None]) -> TrajectoryOutcome:
    """Return the outcome of a section; everything that can be refused is refused before the search begins."""
    with told_of(setting.file):
        problem = trajectory_problem(section, setting)
        paths = _profiled(section, problem, setting)
        candidates = candidates_of(section, setting, noise_in(problem))
        beforehand = prospects_of(residuals_of(problem), problem.search)
        for one in beforehand:
            if not one.can_be_had:
                tell(f"trajectory: cannot be had: {one.name}: {one.statement}")
        found = fit(problem, tell)
        profiles = tuple(_told_profiles(found, paths, tell))
        if candidates:
            tell(f"expected information of {counted(len(candidates), 'further experiment')}")
        expected = expected_information(found, candidates)
    remarks = (*found.remarks, *_contradictions(found, setting.bench))
    return TrajectoryOutcome(found, profiles, expected, _checks(found), remarks, beforehand)


def _told_profiles(found: TrajectoryFit, paths: Sequence[str], tell: Callable[[str], None]) -> Iterator[Profile]:
    for number, path in enumerate(paths, start=1):
        tell(f"profile likelihood {number} of {len(paths)}: {path}")
        yield profile(found, path)


def _profiled(section: TrajectorySection, problem: TrajectoryProblem, setting: Setting) -> tuple[str, ...]:
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
                f"had {other.low:.4g} to {other.high:.4g}: one of the two models lacks something"
            )
    return remarks


def _checks(found: TrajectoryFit) -> tuple[Check, ...]:
    worst = max(found.channels, key=lambda channel: channel.share)
    left, good = f"{100.0 * worst.share:.2g} %", f"{100.0 * ACCEPTABLE_SHARE:g} %"
    told = f"RMS at most {left} of the range in {worst.channel} of {worst.experiment}; {good} is good"
    broken = next((text for text in (broken_order(item.device) for item in found.scenarios) if text), "")
    settled = found.optimum.has_converged
    wrong = found.misfit
    return (
        Check("search", settled, f"{found.evaluations} evaluations, {'settled' if settled else 'stopped before it'}"),
        Check("what is left", worst.share <= ACCEPTABLE_SHARE, told),
        Check("one model for all", not wrong, wrong or found.uncertainty.misfit.in_words),
        Check("numbers agree", not broken, broken or "no rule of a device is broken"),
    )
