"""Verdict with causes and a remedy, both from one table of further runs.

A cause is a change with which the run follows; a remedy is the smallest step of one that a run of its own confirms as
printed. Where no single change suffices, pairs of the best are tried.
"""

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from ppafo.counterfactuals.changes import (
    AS_IT_IS,
    IDEAL_WORDS,
    JOINT_GAINS,
    Change,
    changes_of,
    is_of_defaults,
    is_of_given,
)
from ppafo.counterfactuals.joint_gains import joint_gains
from ppafo.counterfactuals.table import Rated, excesses
from ppafo.errors import PpafoError
from ppafo.loading import reloaded
from ppafo.simulation.numbers import present_numbers, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.simulation.tracking.case import overrides_of
from ppafo.simulation.tracking.evidence import SMALLER_REFERENCE
from ppafo.units.shown import in_units
from ppafo.wording import override_text

if TYPE_CHECKING:
    from ppafo.simulation.simulate import Result
    from ppafo.simulation.tracking import Tracking
    from ppafo.walking.result import WalkResult

_STRIDES_TRIED = 8.0
"""Number of strides in which the changes of a walk are compared; its remedy is simulated to the end."""
_POINTS = 6
"""Number of parts of the way from the present numbers to a change that suffices; their ends are smaller steps."""
_MARGIN = 0.9
"""Largest excess of a smaller step, whose text rounds to three digits [-]."""
_PAIRED = 7
"""Number of changes of which pairs are tried where none suffices alone."""
# Largest number of causes in a sentence, and of changes of which a smaller step is tried.
_CAUSES = 3
_REMEDIES = 5
_EFFORT = {"law": 0, "start": 1, "device": 2, "sensors": 3, "load": 4, "task": 5}
"""Order of remedies by what is changed with least effort."""
# Order of causes: what is not ideal before what is chosen, and what the task asks for at last.
_DEPTH = {"device": 0.0, "sensors": 0.0, "load": 0.0, "start": 0.0, "law": 1.0, "task": 2.0}
_LAST = 3.0
_CHOSEN = 2.0
"""Factor on what a better choice leaves, by which it comes after a property made ideal [-]."""
_NEARER = 0.5
"""Remaining excess over the original one, below which the best change that does not suffice is named [-]."""


@in_units(lambda result: result.scenario.device.shown)
def verdict_of(result: "Result | WalkResult") -> "Tracking":
    """Return the tracking verdict on a run; on one that does not follow with causes and a remedy that a run confirms.

    ``mended`` of the verdict are the overrides of the remedy.
    """
    verdict = result.tracking
    if not verdict.is_useless:
        return verdict
    try:
        return _with_causes(verdict, result.scenario)
    except PpafoError:
        # A walk on its bottle, for one, is no row of an ensemble.
        return verdict


def _with_causes(verdict: "Tracking", scenario: Scenario) -> "Tracking":
    """Return the verdict on a run that does not follow with causes and a remedy."""
    rated = _table(_first_strides(scenario))
    _, excess = rated[0]
    best = _best_of_words(rated[1:])
    follow = [each for each in best if each[1] <= 1.0]
    if follow:
        lowest = {change.words: math.inf for change, _ in rated}
        for change, left in rated:
            lowest[change.words] = min(lowest[change.words], left)
        evident = {words for confirming, _ in verdict.evidence for words in confirming}
        order = partial(_order, lowest, evident)
        changes = sorted((change for change, _ in follow), key=order)
    else:
        changes = _pairs_that_follow(best)
    if not changes:
        nearest, left = min(best, key=lambda each: each[1], default=rated[0])
        text = f"none of {len(rated)} changes suffices, nor does a pair of the best"
        if left < _NEARER * excess:
            text += f"; {nearest.words} its error is {left:.3g} times the allowed one, in place of {excess:.3g}"
        return replace(verdict, tried=text)
    words = [change.words for change in _named(changes)]
    clauses = [text for confirming, text in verdict.evidence if not set(confirming).isdisjoint(words)]
    tried, mended = _remedy(scenario, changes)
    return replace(
        verdict, cause="; ".join((*clauses[:1], f"it follows {', or '.join(words)}")), tried=tried, mended=mended
    )


def _named(changes: Sequence[Change]) -> list[Change]:
    """Return the likeliest causes, at most three; the last one of another part of the scenario, if any is."""
    first = list(changes[: _CAUSES - 1])
    groups = {change.group for change in first}
    rest = sorted(changes[_CAUSES - 1 :], key=lambda change: change.group in groups)
    return first + rest[:1]


def _first_strides(scenario: Scenario) -> Scenario:
    """Return a walk that ends after its first strides, a whole number of output intervals; other runs unchanged."""
    run = scenario.run
    duration = _STRIDES_TRIED * scenario.motion.stride_time
    if scenario.follows_reference or not 0.0 < duration < run.duration:
        return scenario
    return replace(scenario, run=replace(run, duration=round(duration / run.output_interval) * run.output_interval))


def _table(scenario: Scenario) -> list[Rated]:
    """Return the scenario as it is, and each change that is tried, with what it leaves."""
    rated = _rated([Change(AS_IT_IS, "task", {}, scenario), *changes_of(scenario)])
    gains = joint_gains(scenario)
    return rated if gains is None else [*rated, gains]


def _rated(changes: Sequence[Change]) -> list[Rated]:
    return list(zip(changes, excesses(changes), strict=True))


def _best_of_words(rated: Iterable[Rated]) -> list[Rated]:
    """Return of the changes with the same words the first that follows, else the nearest."""
    best: dict[str, Rated] = {}
    for change, left in rated:
        before = best.get(change.words, (change, math.inf))[1]
        if change.words not in best or left < before > 1.0:
            best[change.words] = (change, left)
    return list(best.values())


def _order(lowest: Mapping[str, float], evident: Collection[str], change: Change) -> tuple[float, float]:
    """Order of causes: settings that were given, what is not ideal, gains, the task; then what each leaves at best.

    ``evident`` are the words of changes for which the run has evidence; without it, a load is part of the task.
    """
    left = lowest[change.words] * (1.0 if change.words.startswith(IDEAL_WORDS) else _CHOSEN)
    if is_of_given(change):
        return -1.0, left
    # Everything follows a reference that is small enough, and stays without a load.
    is_of_task = change.words == SMALLER_REFERENCE or (change.group == "load" and change.words not in evident)
    return _LAST if is_of_task else _DEPTH[change.group], left


def _pairs_that_follow(best: Sequence[Rated]) -> list[Change]:
    """Return pairs of the best changes with which a run follows, the best pair first; none with a load."""
    ranked = sorted(
        (each for each in best if math.isfinite(each[1]) and each[0].group != "load"), key=lambda each: each[1]
    )
    several = [change for change, _ in ranked[:_PAIRED]]
    commands = [change for change, _ in ranked if change.is_of_command]
    if commands:
        # Runs of a Python object are slow: its best command with each other change.
        several = [commands[0], *(change for change, _ in ranked if not change.is_of_command)]
    both = [pair for pair in itertools.combinations(several, 2) if not commands or pair[0] is several[0]]
    pairs = [pair for each in both if (pair := _together(*each)) is not None]
    return [change for change, left in sorted(_rated(pairs), key=lambda each: each[1]) if left <= 1.0]


def _together(first: Change, second: Change) -> Change | None:
    """Return two changes as one; None for changes of the same numbers, or of the kind of two scenarios."""
    plain = first if not (first.overrides or first.is_of_command) else second
    special = second if plain is first else first
    if set(first.numbers) & set(second.numbers) or plain.overrides or plain.is_of_command:
        return None
    words = f"{first.words} together {second.words}"
    group = max(first.group, second.group, key=_EFFORT.__getitem__)
    return special._replace(words=words, group=group, numbers={**plain.numbers, **special.numbers})


def _remedy(scenario: Scenario, changes: Sequence[Change]) -> tuple[str, tuple[str, ...]]:
    """Return the sentence on the remedy of least effort that a run confirms as it is printed, and its overrides."""
    easiest = sorted(changes, key=lambda change: _EFFORT[change.group])[:_REMEDIES]
    # Changes made in Python would be lost with overrides.
    is_of_file = replace(reloaded(scenario, ()), run=scenario.run) == scenario
    for change in _smallest_steps(easiest):
        overrides = (*change.overrides, *overrides_of(change.base, change.numbers))
        if change.is_of_command or not (is_of_file or change.numbers):
            continue
        try:
            trial = reloaded(scenario, overrides) if is_of_file else with_numbers(scenario, change.numbers)
        except PpafoError:
            continue
        if not trial.follows_reference:
            # The minutes of a walk may be an argument beside its file.
            run = replace(trial.run, duration=scenario.run.duration, output_interval=scenario.run.output_interval)
            trial = replace(trial, run=run)
        verdict = simulate_many([trial])[0].tracking
        if verdict.follows is not None and verdict.passes:
            does = "it follows" if verdict.follows else "it gives what the actuator can give"
            text = f"for example, with {override_text(overrides)} {does}, as a further run shows"
            return text, overrides if is_of_file else ()
    return "", ()


def _smallest_steps(changes: Sequence[Change]) -> Iterator[Change]:
    """Yield for each change the smallest step towards it that suffices with a margin, then the change itself."""
    steps = {place: list(_steps(change)) for place, change in enumerate(changes)}
    flat = [step for each in steps.values() for step in each]
    left = iter(excesses(flat))
    for place, change in enumerate(changes):
        sufficient = [step for step in steps[place] if next(left) <= _MARGIN]
        yield from (*sufficient[:1], change)


def _steps(change: Change) -> Iterator[Change]:
    """Yield smaller steps of a change; none of defaults, of gains that were chosen together, and of Python objects."""
    if is_of_defaults(change) or change.words == JOINT_GAINS or change.base.controller.custom is not None:
        return
    present = present_numbers(change.base)
    for point in range(1, _POINTS):
        share = point / _POINTS
        yield change._replace(
            numbers={
                path: _between(present[path], number, share, change.group == "load")
                for path, number in change.numbers.items()
            }
        )


def _between(before: float, number: float, share: float, is_linear: bool) -> float:
    """Number at a share of the way from one number to another: geometric for numbers of one sign, else linear."""
    if is_linear or before * number <= 0.0:
        return before + share * (number - before)
    return before * math.pow(number / before, share)
