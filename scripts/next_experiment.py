"""Proposes experiments once, then plants effects in what is recorded with them, and compares promised with reached.

    python scripts/next_experiment.py --draws 30 --seed 61
    python scripts/next_experiment.py --draws 30 --seed 61 --bench --out truths.jsonl

Two step responses are fitted and three further experiments proposed: that design is frozen. Then, for each effect,
truths are drawn (five numbers up to 15 % off) with the effect at the size for which its visibility was promised. The
two step responses are recorded on the model with it, with white noise of known size and, with --bench, errors of the
bench (1 psi, 2 %, 0.3 deg, 0.15 psi, 0.3 %), and fitted: what the frozen experiments promise to this device is written
down. Then these are recorded too, the numbers are fitted with the effect to all five, and one further step is taken
along numbers and all effects together. Printed: promised over reached, as the median over the truths (and the
furthest), of the half widths and of the standard errors of the planted effect, the same with the promise of the frozen
design in the place of the device's own, and the percentage of the 95 % intervals that hold. Truths at which one of the
frozen experiments cannot be run are counted as left out. Effects take turns, and heat, of which the smallest size shows
in two step responses, has none. With --out each truth is kept as a line of a file, and a stopped study goes on.
"""

import argparse
import json
import math
import os
import statistics
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

# Products are small: threads that wait for each other take five times as long as one.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.intervals.made_by import check_code, code_now, whole_lines
from benchmarks.intervals.planted import NOISE
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.identification.trajectory import Experiment, FreeParameter, Search, TrajectoryFit, TrajectoryProblem, fit
from ppafo.identification.trajectory.directions.heat import HEAT
from ppafo.identification.trajectory.fitting import residuals_of
from ppafo.identification.trajectory.next_experiment import (
    NextExperiments,
    Sized,
    effect_changes,
    harmful_sizes,
    promised_by,
    propose,
    step_of,
)
from ppafo.identification.trajectory.problem import number_at, with_numbers
from ppafo.identification.trajectory.residuals import numbers_in, prior_coordinates
from ppafo.identification.trajectory.search import descend
from ppafo.identification.trajectory.tolerances import Ability, Tolerances, tolerance_parameters
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from scripts.bench_tolerances import PARAMETERS, TOLERANCES, planned, recorded

PRESSURES = (STANDARD_ATMOSPHERE + 20.0 * PASCALS_PER_PSI, STANDARD_ATMOSPHERE + 80.0 * PASCALS_PER_PSI)
FACTOR = 1.96
_NEAR = 1.0e-4


def ability(candidates: int) -> Ability:
    """What the bench can do."""
    return Ability(
        supply_pressure=PRESSURES,
        load=(-3.0, 3.0),
        command=(-1.0, 1.0),
        torque=(0.5, 4.0),
        frequency=(0.5, 5.0),
        angle=(math.radians(30.0), math.radians(120.0)),
        duration=(0.4, 0.7),
        interval=1.0e-3,
        candidates=candidates,
    )


def problem_of(
    scenarios: dict[str, Scenario], tolerances: Tolerances, random: np.random.Generator, truth: dict[str, float]
) -> TrajectoryProblem:
    """The fit of five numbers to what is recorded of the scenarios on a device with the true numbers [SI]."""
    recordings = recorded(scenarios, tolerances, random, truth)
    experiments = tuple(
        Experiment(
            label, one, recordings[label], noise=NOISE, inputs=() if one.control.kind == "constant" else ("command",)
        )
        for label, one in scenarios.items()
    )
    free = tuple(FreeParameter(path) for path in PARAMETERS)
    return TrajectoryProblem(
        (*free, *tolerance_parameters(tolerances, experiments, free)), experiments, Search(directions=True)
    )


def with_effect(scenario: Scenario, effect: Sized) -> dict[str, float]:
    """Numbers [SI] by path of an effect of its size, in the form that a promise takes it to have."""
    return {**effect.direction.neutral, **effect.direction.settings(effect.size, scenario)}


def reached(
    problem: TrajectoryProblem, first: TrajectoryFit, effects: tuple[Sized, ...], planted: int
) -> tuple[dict[str, tuple[float, float]], float]:
    """Estimate and half width of each number in coordinates, and the standard errors of the planted effect.

    The search begins where the fit of the first recordings ended.
    """
    on = with_effect(problem.experiments[0].scenario, effects[planted])
    with_it = [replace(one, scenario=with_numbers(one.scenario, on)) for one in problem.experiments]
    residuals = residuals_of(replace(problem, experiments=tuple(with_it)))
    ranges, point = residuals.ranges, residuals.start
    known = {
        (item.name, item.recordings): at
        for item, at in zip(first.optimum.residuals.ranges, first.optimum.point, strict=True)
    }
    point = np.array([known.get((item.name, item.recordings), at) for item, at in zip(ranges, point, strict=True)])
    steps = np.diag([step_of(item) for item in ranges])
    point = descend(residuals.quick(), point, steps, problem.search, _NEAR).point
    point = descend(residuals, point, steps, problem.search).point
    near = residuals.around(point, steps)
    changes = []
    for one in residuals_of(problem).experiments:
        fitted = with_numbers(one.scenario, numbers_in(one.label, ranges, point))
        changes.append(effect_changes(replace(one, scenario=fitted), effects, (1.0,))[0])
    rows = np.hstack([near.jacobian_of_data(), np.concatenate(changes)])
    mean, deviation, has = prior_coordinates(ranges)
    prior = np.zeros(rows.shape[1])
    prior[: len(ranges)] = 1.0 / np.square(deviation)
    prior[len(ranges) :] = [np.square(one.size / one.direction.largest) for one in effects]
    product = rows.T @ near.of_data
    product[: len(ranges)][has] += ((point - mean) / np.square(deviation))[has]
    product[len(ranges) + planted] += prior[len(ranges) + planted]
    inverse = np.linalg.inv(rows.T @ rows + np.diag(prior))
    step = -inverse @ product
    widths = FACTOR * np.sqrt(np.diag(inverse))
    numbers_found = {
        item.path: (float(point[index] + step[index]), float(widths[index]))
        for index, item in enumerate(ranges)
        if not item.is_tolerance
    }
    place = len(ranges) + planted
    precision = 1.0 / float(inverse[place, place]) - prior[place]
    # The prior of an effect pulls it to 0: what the recordings alone would say.
    score = (1.0 + float(step[place])) * (precision + prior[place]) / math.sqrt(max(precision, 1.0e-12))
    return numbers_found, score


def design_of(tolerances: Tolerances, candidates: int, seed: int) -> tuple[TrajectoryFit, NextExperiments]:
    """The fit of two step responses, and what it proposes."""
    two = {label: one for label, one in planned().items() if label in FIRST}
    present = fit(problem_of(two, tolerances, np.random.default_rng(seed), {}))
    return present, propose(present, ability(candidates), tolerances, 3, load_scenario)


FIRST = ("there", "back")


@dataclass(frozen=True, slots=True)
class Truth:
    """One planted truth: promised over reached half widths, visibility promised and reached, which intervals hold."""

    widths: tuple[float, ...]
    promised: float
    reached: float
    held: tuple[bool, ...]


def truth_of(
    draw: int,
    planted: int,
    seed: int,
    scenarios: dict[str, Scenario],
    tolerances: Tolerances,
    present: TrajectoryFit,
    design: NextExperiments,
) -> Truth | None:
    """What is promised to one drawn device with an effect, and reached; None where nothing can be promised to it."""
    random = np.random.default_rng([seed, planted, draw])
    effects = harmful_sizes(present)
    base = scenarios["there"]
    truth = {path: number_at(base, path) * math.exp(random.uniform(-0.15, 0.15)) for path in PARAMETERS}
    problem = problem_of(scenarios, tolerances, random, {**truth, **with_effect(base, effects[planted])})
    first = fit(_of_first(problem, tolerances))
    promises = promised_by(first, tolerances, design.chosen, effects, load_scenario)
    if promises is None:
        return None
    found, score = reached(problem, first, effects, planted)
    ranges = {item.path: item for item in present.optimum.residuals.ranges}
    ratios, held = [], []
    for promised, (path, (at, half)) in zip(promises[0], found.items(), strict=True):
        item = ranges[path]
        # On a linear scale half widths are in units of the start; those of the promise are of the number.
        ratios.append(float(promised) / (half if item.scale == "log" else half * item.size / item.number(at)))
        held.append(abs(item.coordinate(truth.get(path, truth.get(_short(path), math.nan))) - at) <= half)
    return Truth(tuple(ratios), float(promises[1][planted]), float(score), tuple(held))


def _of_first(problem: TrajectoryProblem, tolerances: Tolerances) -> TrajectoryProblem:
    """The fit of the step responses that there are before anything is proposed, without a search for effects."""
    experiments = tuple(one for one in problem.experiments if one.label in FIRST)
    free = tuple(FreeParameter(path) for path in PARAMETERS)
    parameters = (*free, *tolerance_parameters(tolerances, experiments, free))
    return TrajectoryProblem(parameters, experiments, Search())


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=30)
    parser.add_argument("--seed", type=int, default=51)
    parser.add_argument("--candidates", type=int, default=40)
    parser.add_argument("--bench", action="store_true", help="with errors of the bench, stated in the fit")
    parser.add_argument("--out", type=Path, help="file to keep the truths in, one a line")
    parser.add_argument("--effects", default="", help="names of the effects that are planted, by commas; all of them")
    words = parser.parse_args()
    tolerances = TOLERANCES if words.bench else Tolerances()
    begun = time.process_time()
    present, design = design_of(tolerances, words.candidates, words.seed)
    print(f"{design.candidates} candidates, {design.dropped} left out, {time.process_time() - begun:.0f} CPU s")
    for promise in (*design.widths, *design.visibility):
        print(f"  {promise.name} {promise.size}: {promise.now:.3g}, chosen {promise.after:.3g}", end="")
        print(f", at random {promise.at_random:.3g}", flush=True)
    scenarios = {label: one for label, one in planned().items() if label in FIRST}
    for one in design.chosen:
        scenarios[one.label] = load_scenario(one.scenario, (*one.overrides, f"name={one.label}"))
    effects = harmful_sizes(present)
    names = [effect.direction.name for effect in effects]
    wanted = words.effects.split(",") if words.effects else [name for name in names if name != HEAT.name]
    planted = [number for number, name in enumerate(names) if name in wanted]
    study = {"seed": words.seed, "candidates": words.candidates, "bench": words.bench}
    kept = _kept(words.out, study)
    missing = sum((number, draw) not in kept for draw in range(words.draws) for number in planted)
    if kept:
        check_code(words.out, [line["code"] for line in kept.values()], missing, print)
    found: dict[int, list[Truth | None]] = {number: [] for number in planted}
    for draw in range(words.draws):
        for number in planted:
            if (number, draw) in kept:
                truth = kept[number, draw]["truth"]
                found[number].append(None if truth is None else Truth(**truth))
                continue
            made = truth_of(draw, number, words.seed, scenarios, tolerances, present, design)
            found[number].append(made)
            if words.out is not None:
                line = {**study, "code": code_now(), "planted": number, "draw": draw, "truth": made and asdict(made)}
                with words.out.open("a") as file:
                    file.write(f"{json.dumps(line)}\n")
    print(
        "| planted | truths | left out | widths | within 1.3 | visibility promised | reached | promised over reached | "
        "within 1.5 | by the frozen promise | intervals that hold |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for number in planted:
        known = [one for one in found[number] if one is not None]
        if known:
            promise = design.visibility[number]
            print(_row(f"{promise.name}, {promise.size}", known, len(found[number]), promise.after), flush=True)


def _kept(file: Path | None, study: dict[str, object]) -> dict[tuple[int, int], dict[str, Any]]:
    """Return the truths of a study that a file has, by planted effect and number; none of a line that was cut off."""
    if file is None:
        return {}
    own = [line for line in map(json.loads, whole_lines(file)) if study.items() <= line.items()]
    return {(line["planted"], line["draw"]): line for line in own}


def _share(ratios: list[float], most: float) -> str:
    return f"{100.0 * statistics.mean(1.0 / most <= ratio <= most for ratio in ratios):.0f} %"


def _row(name: str, known: list[Truth], drawn: int, frozen: float) -> str:
    ratios = [ratio for one in known for ratio in one.widths]
    furthest = max(ratios, key=lambda ratio: abs(math.log(ratio)))
    promised, reached = ([getattr(one, field) for one in known] for field in ("promised", "reached"))
    own = [one / other for one, other in zip(promised, reached, strict=True)]
    held = statistics.mean(hit for one in known for hit in one.held)
    return (
        f"| {name} | {len(known)} | {drawn - len(known)} | {statistics.median(ratios):.2f} ({furthest:.2f}) | "
        f"{_share(ratios, 1.3)} | {statistics.median(promised):.1f} | {statistics.median(reached):.1f} "
        f"({min(reached):.1f} to {max(reached):.1f}) | {statistics.median(own):.2f} ({min(own):.2f} to {max(own):.2f}) "
        f"| {_share(own, 1.5)} | {frozen / statistics.median(reached):.2f} | {100.0 * held:.0f} % |"
    )


def _short(path: str) -> str:
    return f"valve.{path.rpartition('.')[2]}"


if __name__ == "__main__":
    main()
