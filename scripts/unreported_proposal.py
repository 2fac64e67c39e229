"""Finds the mixture from which ``ppafo unreported`` draws, and says how it does.

    python scripts/unreported_proposal.py [--go-on] [--walkers 768] [--steps 150] [--draws 40960] [--seed 2011]

A population of completions wanders through the settings (differential evolution Markov chains; ter Braak and Vrugt,
Statistics and Computing 18 (2008) 435) while the likelihood is raised from flat to full in steps. Half of it weighs by
all that is reported, the others leave out what the answers leave out. Mixtures are fitted to where it has been
(expectation maximisation). This is another method than the weighing of ``ppafo unreported``, so that the last table,
quantiles of both, is a check of either. ``--go-on`` begins with the mixture that there is, and may be
repeated. Some minutes on two quiet cores each.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ppafo.questions.unreported.answer import Family, weighted_quantiles
from ppafo.questions.unreported.proposal import Proposal, normal_scale, shipped_proposal, to_rows
from ppafo.questions.unreported.settings import (
    CELLS,
    EVIDENCE,
    GAS,
    IMPROVEMENT,
    SETTINGS,
    Draws,
    Floats,
    Metrics,
    effective,
    log_agreement,
    spread,
    values_of,
)
from ppafo.questions.unreported.solve import infer_settings, run_completions

FILE = Path("src/ppafo/questions/unreported/proposal.csv")
FIRST = 32_768
"""Even completions that the population begins with."""
BEGINNERS, MOST_ALIKE = 60.0, 100
"""Effective number of them in each group, and how many of the heaviest count alike."""
MOVES, EVERY = 4, 10
"""Steps at each power of the likelihood, and from one kept population to the next."""
LEFT_OUT: tuple[tuple[str, ...], ...] = ((), (), (), (), (IMPROVEMENT,), GAS)
"""What each sixth of the population leaves out."""
PARTS, TRIALS = 60, 60
WIDER = 1.1
"""Factor on the widths of the fitted bells."""
LEAST = 20.0
"""Points that the common covariance of a part counts for, and choices that are drawn evenly."""
NUMBERS = [column for column, cells in enumerate(CELLS) if not cells]
CHOICES = [column for column, cells in enumerate(CELLS) if cells]


def log_likelihood(points: Floats, groups: np.ndarray) -> Floats:
    """Return the logarithm of the likelihood of points (points,), each by what its group does not leave out."""
    ran = run_completions(points, all_of_it=False)
    found = np.empty(len(points))
    for group, left_out in enumerate(LEFT_OUT):
        here = groups == group
        part: Metrics = {name: {key: item[here] for key, item in of.items()} for name, of in ran.metrics.items()}
        found[here] = log_agreement(_counted(left_out), part)
    return np.where(ran.completed, found, -np.inf)


def _counted(left_out: Sequence[str]) -> list[str]:
    return [entry.id for entry in EVIDENCE if entry.id not in left_out]


def beginning(goes_on: bool, chance: np.random.Generator) -> tuple[Floats, Floats, float]:
    """Return points (points, settings), their density over the even spread, and the power that the likelihood has.

    They are evenly spread, or drawn with the mixture that there is, which may be good enough for the full likelihood.
    """
    if not goes_on:
        return spread(FIRST, int(chance.integers(2**31))), np.ones(FIRST), 0.0
    points = shipped_proposal().draw(FIRST, chance)
    return points, shipped_proposal().density(points), 1.0


def wandered(goes_on: bool, walkers: int, steps: int, chance: np.random.Generator) -> tuple[Floats, np.ndarray]:
    """Return where a population has been with the full likelihood, every tenth step, and the group of each point."""
    groups = np.arange(walkers) * len(LEFT_OUT) // walkers
    first, density, power = beginning(goes_on, chance)
    ran = run_completions(first, all_of_it=not goes_on)
    logarithms = [
        np.where(ran.completed, log_agreement(_counted(left_out), ran.metrics), -np.inf) for left_out in LEFT_OUT
    ]
    if not power:
        # As high as leaves some of the even ones in every group.
        power = next(
            height
            for height in 0.8 ** np.arange(60.0)
            if all(effective(np.exp(height * (item - item.max()))) > BEGINNERS for item in logarithms)
        )
    points, known = np.empty((walkers, len(CELLS))), np.empty(walkers)
    for group, item in enumerate(logarithms):
        here = np.flatnonzero(groups == group)
        # No point so often that the population would have to find the others again.
        of_weight = power * item - np.log(density)
        highest = np.sort(of_weight)[-MOST_ALIKE:].min()
        chosen = _resampled(np.arange(FIRST), np.minimum(of_weight, highest), here.size, chance)
        points[here], known[here] = first[chosen], item[chosen]
    archive, kept = [points.copy()], list[Floats]()
    while len(kept) < steps // EVERY:
        for _ in range(MOVES if power < 1.0 else EVERY):
            proposed = _proposed(points, np.concatenate(archive[-30:]), chance)
            found = log_likelihood(proposed, groups)
            accepted = np.log(chance.random(walkers)) < power * (found - known)
            points[accepted], known[accepted] = proposed[accepted], found[accepted]
        archive.append(points.copy())
        print(f"power {power:.3g}, mean likelihood {np.exp(known).mean():.3g}", file=sys.stderr, flush=True)
        if power == 1.0:
            kept.append(points.copy())
            continue
        raised = min(1.0, 1.5 * power)
        for group in range(len(LEFT_OUT)):
            here = np.flatnonzero(groups == group)
            chosen = _resampled(here, (raised - power) * known[here], here.size, chance)
            points[here], known[here] = points[chosen], known[chosen]
        power = raised
    return np.concatenate(kept), np.tile(groups, len(kept))


def _resampled(places: np.ndarray, logarithm: Floats, count: int, chance: np.random.Generator) -> np.ndarray:
    weights = np.exp(logarithm - logarithm.max())
    return chance.choice(places, count, p=weights / weights.sum())


def _proposed(points: Floats, archive: Floats, chance: np.random.Generator) -> Floats:
    """Move each point along the difference of two others, in some of its numbers; sometimes choose anew."""
    walkers = len(points)
    one, other = chance.integers(len(archive), size=(2, walkers))
    moved = chance.random((walkers, len(NUMBERS))) < chance.choice([0.2, 0.5, 1.0], size=(walkers, 1))
    moved[np.arange(walkers), chance.integers(len(NUMBERS), size=walkers)] = True
    factor = 2.38 / np.sqrt(2.0 * moved.sum(axis=1)) * chance.choice([0.15, 0.4, 0.8], size=walkers)
    along = (archive[one] - archive[other])[:, NUMBERS] * factor[:, None]
    along += 0.003 * chance.standard_normal(along.shape)
    numbers = np.abs(points[:, NUMBERS] + np.where(moved, along, 0.0))
    found = points.copy()
    # Reflected at the sides: a move there is as likely as the move back.
    found[:, NUMBERS] = np.clip(1.0 - np.abs(1.0 - numbers), 0.0, 1.0 - 1.0e-12)
    anew, which = chance.random(walkers) < 0.35, chance.choice(CHOICES, size=walkers)
    for column in CHOICES:
        here = anew & (which == column)
        found[here, column] = chance.random(int(here.sum()))
    return found


def fitted(points: Floats, weights: Floats, chance: np.random.Generator) -> Proposal:
    """Return a mixture that is fitted to weighted points, each part held by the common covariance."""
    at = normal_scale(np.clip(points[:, NUMBERS], 1.0e-6, 1.0 - 1.0e-6))
    chosen = [np.floor(points[:, column] * CELLS[column]).astype(np.intp) for column in CHOICES]
    weights = weights / weights.sum()
    count = effective(weights)
    away = at - weights @ at
    common = (weights[:, None] * away).T @ away
    centres = at[chance.choice(len(at), PARTS, p=weights)].copy()
    covariances, shares = np.repeat(common[None], PARTS, axis=0), np.full(PARTS, 1.0 / PARTS)
    tables = [
        np.repeat(0.5 * np.bincount(item, weights, CELLS[column])[None] + 0.5 / CELLS[column], PARTS, axis=0)
        for column, item in zip(CHOICES, chosen, strict=True)
    ]
    for _ in range(TRIALS):
        logarithm = np.empty((len(at), PARTS))
        for part in range(PARTS):
            shape = np.linalg.cholesky(covariances[part])
            squares = (np.linalg.solve(shape, (at - centres[part]).T) ** 2).sum(axis=0)
            logarithm[:, part] = np.log(shares[part]) - 0.5 * squares - np.log(np.diag(shape)).sum()
            logarithm[:, part] += sum(np.log(table[part, item]) for table, item in zip(tables, chosen, strict=True))
        belongs = np.exp(logarithm - logarithm.max(axis=1, keepdims=True))
        belongs *= (weights / belongs.sum(axis=1))[:, None]
        mass = belongs.sum(axis=0)
        shares = (mass + 1.0e-3 / PARTS) / (mass + 1.0e-3 / PARTS).sum()
        centres = (belongs.T @ at + 1.0e-9 * centres) / (mass + 1.0e-9)[:, None]
        for part in range(PARTS):
            away = at - centres[part]
            own = count * (belongs[:, part, None] * away).T @ away + LEAST * 0.15 * common
            covariances[part] = own / (count * mass[part] + LEAST) + 0.03**2 * np.eye(len(common))
        tables = [
            np.array([count * np.bincount(item, belongs[:, part], CELLS[column]) for part in range(PARTS)])
            + 0.2 * LEAST / CELLS[column]
            for column, item in zip(CHOICES, chosen, strict=True)
        ]
        tables = [table / table.sum(axis=1, keepdims=True) for table in tables]
    return Proposal(shares, centres, np.asarray(WIDER * np.linalg.cholesky(covariances)), tuple(tables), CELLS)


def main(arguments: Sequence[str] | None = None) -> None:
    """Find the mixture, write it, and print what both methods say of each setting."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--go-on", action="store_true", help="begin with the mixture that there is")
    parser.add_argument("--walkers", type=int, default=768, help="completions that wander; default 768")
    parser.add_argument("--steps", type=int, default=150, help="steps with the full likelihood; default 150")
    parser.add_argument("--draws", type=int, default=40_960, help="draws with the mixture; default 40960")
    parser.add_argument("--seed", type=int, default=2011, help="random seed; default 2011")
    chosen = parser.parse_args(arguments)
    chance = np.random.default_rng(chosen.seed)
    points, groups = wandered(chosen.go_on, chosen.walkers, chosen.steps, chance)
    np.savetxt(FILE, to_rows(fitted(points, np.ones(len(points)), chance)), fmt="%.4g", delimiter=",")
    shipped_proposal.cache_clear()
    family = infer_settings(chosen.draws)
    full = values_of(points[[not LEFT_OUT[group] for group in groups]])
    print(f"{family.drawn} draws with {FILE}: effective sample size {family.effective:.0f}")
    for setting in SETTINGS:
        if setting.choices:
            shares = [
                " ".join(f"{weight[values == choice].sum():.2f}" for choice in setting.choices)
                for values, weight in _both(setting.name, full, family)
            ]
        else:
            shares = [
                " ".join(f"{value:.3g}" for value in weighted_quantiles(values, weight, (0.05, 0.5, 0.95)))
                for values, weight in _both(setting.name, full, family)
            ]
        print(f"{setting.name:24} population {shares[0]:36} weighed {shares[1]}")


def _both(name: str, population: Draws, family: Family) -> list[tuple[Floats, Floats]]:
    """Return values of a setting with their weights, of the population and of the weighed completions."""
    values = population[name]
    return [(values, np.full(values.size, 1.0 / values.size)), (family.draws[name], family.weights)]


if __name__ == "__main__":
    main()
