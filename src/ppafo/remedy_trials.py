"""Trials of the remedies that a tracking verdict names: further runs, of which the first that follows is reported."""

import contextlib
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ppafo.errors import PpafoError
from ppafo.loading import reloaded
from ppafo.model.controlled import TORQUE
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from ppafo.simulation.simulate import Result
    from ppafo.simulation.tracking import Tracking
    from ppafo.simulation.tracking.remedies import Remedy
    from ppafo.walking.result import WalkResult

MOST_TRIED = 18
"""Largest number of remedies simulated for a verdict."""
_STRIDES_TRIED = 8.0
"""Number of strides in which the remedies of a walk are compared; one that suffices there is simulated to the end."""
_LESS_ERROR = 0.5
"""Remaining error divided by the original one, below which a remedy that does not suffice is reported [-]."""


def verdict_of(result: "Result | WalkResult") -> "Tracking":
    """Return the tracking verdict on a run, with the first remedy that succeeds in a simulation.

    Remedies are the overrides named in the verdict. If only a remedy of a less certain cause succeeds, that cause
    becomes the cause of the verdict. If none succeeds, the verdict gets the remedy with the smallest remaining error
    (of a walk: in its first strides), provided that this is less than half of the original one.
    """
    scenario = result.scenario
    verdict = result.tracking
    if not verdict.is_useless:
        return verdict
    # Changes made in Python would be lost with overrides.
    is_of_file = replace(reloaded(scenario, ()), run=scenario.run) == scenario
    trials = _trials(scenario, verdict, is_of_file)
    errors: list[tuple[Remedy, float]] = []
    if not trials:
        return verdict
    try:
        results = simulate_many([_first_strides(changed) for _, _, changed in trials])
        for (cause, remedy, changed), early in zip(trials, results, strict=True):
            left = early.tracking
            # A loop that follows in the first strides of a walk need not follow in the later ones.
            if left.passes and early.scenario.run.duration < changed.run.duration:
                left = simulate_many([changed])[0].tracking
            if left.follows is not None and left.passes:
                # A number that was tried is one of many; a kind is none.
                example = "for example, " * any(".kind=" not in text for text in remedy.overrides)
                # Pressures are computed for more torque than is requested, but not for more angle.
                is_pressure = any(text.startswith("supply.") for text in remedy.overrides)
                margin = ", with a margin" * (is_pressure and scenario.controlled == TORQUE)
                does = "it follows" if left.follows else "it gives what the actuator can give"
                text = f"{example}with {remedy.text} {does}, as a further run shows{margin}"
                return replace(verdict, cause=cause, tried=text, mended=remedy.overrides if is_of_file else ())
            if left.fails and cause == verdict.cause:
                errors.append((remedy, left.error))
    except PpafoError:
        return verdict
    strides = "" if _first_strides(scenario) is scenario else f" in the first {_STRIDES_TRIED:.0f} strides"
    return replace(verdict, tried=_remainder_text(verdict, errors, strides, scenario.device.shown))


def _first_strides(scenario: Scenario) -> Scenario:
    """Return a walk that ends after its first strides, a whole number of output intervals; other runs unchanged."""
    run, duration = scenario.run, _STRIDES_TRIED * scenario.motion.stride_time
    if scenario.follows_reference or not 0.0 < duration < run.duration:
        return scenario
    return replace(scenario, run=replace(run, duration=round(duration / run.output_interval) * run.output_interval))


def _trials(scenario: Scenario, verdict: "Tracking", is_of_file: bool) -> "list[tuple[str, Remedy, Scenario]]":
    """Return cause, remedy and changed scenario for each remedy that can be applied, the most certain cause first."""
    from ppafo.simulation.tracking.remedies import rank

    causes = [(verdict.cause, remedy) for remedy in verdict.remedies]
    causes += [(other.text, remedy) for other in verdict.others for remedy in sorted(other.remedies, key=rank)]
    # The task is changed last, whichever cause asks for it; before it each cause has the loop before the device.
    causes.sort(key=lambda each: rank(each[1]) > 1)
    # Without its file a scenario takes numbers alone, no other kinds.
    causes = [(cause, remedy) for cause, remedy in causes if is_of_file or remedy.numbers]
    trials = []
    for cause, remedy in causes[:MOST_TRIED]:
        with contextlib.suppress(PpafoError):
            again = reloaded(scenario, remedy.overrides) if is_of_file else with_numbers(scenario, remedy.numbers)
            if not again.follows_reference:
                # The minutes of a walk may be an argument beside its file.
                run = replace(again.run, duration=scenario.run.duration, output_interval=scenario.run.output_interval)
                again = replace(again, run=run)
            trials.append((cause, remedy, again))
    return trials


def _remainder_text(
    verdict: "Tracking", errors: "list[tuple[Remedy, float]]", strides: str, shown: Mapping[str, str]
) -> str:
    """Return a sentence on the remedy with the smallest remaining error, or on remedies that do not help.

    ``strides`` are words for the part of a walk over which the errors are taken.
    """
    from ppafo.simulation.tracking.remedies import change_text

    best, error = min(errors, key=lambda pair: pair[1], default=(None, verdict.error))
    if best is not None and error < _LESS_ERROR * verdict.error:
        with shown_in(shown):
            left = f"an RMS error of {change_text(verdict.controlled, error)} is left{verdict.when}"
        return f"with {best.text} {left}{strides}, as a further run shows"
    names = ", ".join(dict.fromkeys(each.partition("=")[0] for remedy in verdict.remedies for each in remedy.overrides))
    if not names:
        return verdict.tried
    advice = f"{verdict.advice}; " if verdict.advice else ""
    return f"{advice}none of the tried values of {names} alone sufficed"
