"""Proposes experiments once, then plants effects in what is recorded with them, and compares promised with reached.

    python scripts/next_experiment.py --draws 3 --seed 51
    python scripts/next_experiment.py --draws 3 --seed 51 --bench

Two step responses are fitted and three further experiments proposed: that design is frozen. Then, for each effect,
truths are drawn (five numbers up to 15 % off) with the effect at the size for which its visibility was promised; all
five experiments are recorded on the model with it, with white noise of known size and, with --bench, errors of the
bench (1 psi, 2 %, 0.3 deg, 0.15 psi, 0.3 %). The numbers are fitted with the effect, and one further step is taken
along numbers and all effects together. Printed: promised over reached, as the median over the truths (and the
furthest), of the half widths and of the standard errors of the planted effect, and the percentage of the 95 % intervals
that hold.
"""

import argparse
import math
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.intervals.planted import NOISE
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.identification.trajectory import Experiment, FreeParameter, Search, TrajectoryFit, TrajectoryProblem, fit
from ppafo.identification.trajectory.directions import HEAT
from ppafo.identification.trajectory.fitting import residuals_of
from ppafo.identification.trajectory.next_experiment import (
    NextExperiments,
    effect_changes,
    harmful_sizes,
    propose,
    step_of,
)
from ppafo.identification.trajectory.problem import number_at, with_numbers
from ppafo.identification.trajectory.residuals import numbers_in, prior_coordinates
from ppafo.identification.trajectory.search import optimum
from ppafo.identification.trajectory.tolerances import Ability, Tolerances, tolerance_parameters
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from scripts.bench_tolerances import PARAMETERS, TOLERANCES, planned, recorded

PRESSURES = (STANDARD_ATMOSPHERE + 20.0 * PASCALS_PER_PSI, STANDARD_ATMOSPHERE + 80.0 * PASCALS_PER_PSI)
FACTOR = 1.96


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


def reached(
    problem: TrajectoryProblem, present: TrajectoryFit, planted: int
) -> tuple[dict[str, tuple[float, float]], float]:
    """Estimate and half width of each number in coordinates, and the standard errors of the planted effect."""
    effects = harmful_sizes(present)
    on = effects[planted].direction.settings(effects[planted].size)
    with_it = [replace(one, scenario=with_numbers(one.scenario, on)) for one in problem.experiments]
    found = optimum(residuals_of(replace(problem, experiments=tuple(with_it))), problem.search)
    residuals, ranges, point = found.residuals, found.residuals.ranges, found.point
    near = residuals.around(point, np.diag([step_of(item) for item in ranges]))
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
    known = 1.0 / float(inverse[place, place]) - prior[place]
    # The prior of an effect pulls it to 0: what the recordings alone would say.
    return numbers_found, (1.0 + float(step[place])) * (known + prior[place]) / math.sqrt(max(known, 1.0e-12))


def design_of(tolerances: Tolerances, candidates: int, seed: int) -> tuple[TrajectoryFit, NextExperiments]:
    """The fit of two step responses, and what it proposes."""
    two = {label: one for label, one in planned().items() if label in ("there", "back")}
    present = fit(problem_of(two, tolerances, np.random.default_rng(seed), {}))
    return present, propose(present, ability(candidates), tolerances, 3, load_scenario)


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=30)
    parser.add_argument("--seed", type=int, default=51)
    parser.add_argument("--candidates", type=int, default=40)
    parser.add_argument("--bench", action="store_true", help="with errors of the bench, stated in the fit")
    words = parser.parse_args()
    tolerances = TOLERANCES if words.bench else Tolerances()
    begun = time.process_time()
    present, design = design_of(tolerances, words.candidates, words.seed)
    print(f"{design.candidates} candidates, {design.dropped} left out, {time.process_time() - begun:.0f} CPU s")
    for promise in (*design.widths, *design.visibility):
        print(f"  {promise.name} {promise.size}: {promise.now:.3g}, chosen {promise.after:.3g}", end="")
        print(f", at random {promise.at_random:.3g}", flush=True)
    scenarios = {label: one for label, one in planned().items() if label in ("there", "back")}
    for one in design.chosen:
        scenarios[one.label] = load_scenario(one.scenario, (*one.overrides, f"name={one.label}"))
    print("| planted | truths | widths | visibility promised | reached | promised over reached | intervals that hold |")
    print("|---|---|---|---|---|---|---|")
    names = [promise.name for promise in design.visibility]
    for number, effect in enumerate(harmful_sizes(present)):
        if effect.direction is HEAT:
            continue
        promise = design.visibility[names.index(effect.direction.name)]
        ratios, seen, held = [], [], []
        for draw in range(words.draws):
            random = np.random.default_rng([words.seed, number, draw])
            base = scenarios["there"]
            truth = {path: number_at(base, path) * math.exp(random.uniform(-0.15, 0.15)) for path in PARAMETERS}
            problem = problem_of(scenarios, tolerances, random, {**truth, **effect.direction.settings(effect.size)})
            found, score = reached(problem, present, number)
            ranges = {item.path: item for item in present.optimum.residuals.ranges}
            seen.append(score)
            for width, (path, (at, half)) in zip(design.widths, found.items(), strict=True):
                item = ranges[path]
                # On a linear scale half widths are in units of the start; those of the promise are of the number.
                relative = half if item.scale == "log" else half * item.size / item.number(at)
                ratios.append(width.after / relative)
                held.append(abs(item.coordinate(truth.get(path, truth.get(_short(path), math.nan))) - at) <= half)
        furthest = max(ratios, key=lambda ratio: abs(math.log(ratio)))
        middle = statistics.median(seen)
        print(
            f"| {promise.name}, {promise.size} | {words.draws} | {statistics.median(ratios):.2f} ({furthest:.2f}) | "
            f"{promise.after:.1f} | {middle:.1f} ({min(seen):.1f} to {max(seen):.1f}) | {promise.after / middle:.2f} | "
            f"{100.0 * statistics.mean(held):.0f} % |",
            flush=True,
        )


def _short(path: str) -> str:
    return f"valve.{path.rpartition('.')[2]}"


if __name__ == "__main__":
    main()
