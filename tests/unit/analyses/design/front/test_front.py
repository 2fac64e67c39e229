"""Sorting, hypervolume and search, against brute force and against fronts that are known."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from ppafo.analyses.design.front.search import (
    Candidates,
    Front,
    SearchTable,
    Worth,
    crowding,
    dominance,
    evenly_spread,
    fractions,
    hypervolume,
    knee,
    non_dominated,
    reflect,
    representatives,
    search_front,
    survivors,
)
from ppafo.signals.recording import Floats

pytestmark = pytest.mark.thorough


def random_worth(seed: int, count: int, whole: bool = False) -> Worth:
    """Points with three objectives, some of which break constraints; whole numbers make many equal ones."""
    random = np.random.default_rng(seed)
    objectives = random.integers(0, 5, (count, 3)).astype(float) if whole else random.random((count, 3))
    violation = np.where(random.random(count) < 0.7, 0.0, random.integers(1, 4, count).astype(float))
    return Worth(objectives, violation)


def beats(worth: Worth, first: int, second: int) -> bool:
    """Dominance with constraints, spelt out for two points."""
    a, b = worth.violation[first], worth.violation[second]
    if a > 0.0 or b > 0.0:
        return bool(a < b)
    left, right = worth.objectives[first].tolist(), worth.objectives[second].tolist()
    pairs = list(zip(left, right, strict=True))
    return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)


def naive_ranks(worth: Worth) -> list[int]:
    """Ranks by taking away one front after the other."""
    left, found, rank = set(range(worth.violation.size)), [0] * worth.violation.size, 0
    while left:
        front = {point for point in left if not any(beats(worth, other, point) for other in left)}
        for point in front:
            found[point] = rank
        left -= front
        rank += 1
    return found


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_non_dominated_sorting_agrees_with_brute_force(seed: int, whole: bool) -> None:
    worth = random_worth(seed, 90, whole)
    expected = naive_ranks(worth)
    assert [expected[point] for point in survivors(worth, 90).tolist()] == sorted(expected)
    assert non_dominated(worth).tolist() == [rank == 0 for rank in expected]
    pairs = dominance(worth, worth)
    assert all(pairs[a, b] == beats(worth, a, b) for a in range(90) for b in range(90))


def test_large_sets_are_sorted_as_small_ones() -> None:
    worth = random_worth(11, 1700)
    best = ~dominance(worth, worth).any(axis=0)
    assert non_dominated(worth).tolist() == best.tolist()
    count = int(best.sum())
    assert sorted(survivors(worth, count)) == np.flatnonzero(best).tolist()
    assert set(survivors(worth, count + 9).tolist()) > set(np.flatnonzero(best).tolist())


def test_a_failed_candidate_beats_nobody() -> None:
    worth = Worth(np.array([[np.nan, np.nan, np.nan], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]), np.array([np.inf, 0.0, 3.0]))
    assert survivors(worth, 3).tolist() == [1, 2, 0]


def test_the_ends_of_a_front_are_the_least_crowded() -> None:
    objectives = np.array([[0.0, 4.0], [1.0, 2.0], [1.1, 1.9], [4.0, 0.0]])
    apart = crowding(objectives)
    assert np.isinf(apart[[0, 3]]).all()
    assert apart[1] == pytest.approx(1.1 / 4.0 + 2.1 / 4.0)


def union_by_inclusion_and_exclusion(points: Floats, reference: Floats) -> float:
    """Volume of a union of boxes, by all subsets."""
    volume = 0.0
    for size in range(1, len(points) + 1):
        for chosen in combinations(points, size):
            corner = np.max(chosen, axis=0)
            volume += (-1.0) ** (size + 1) * float(np.prod(np.maximum(reference - corner, 0.0)))
    return volume


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_the_hypervolume_is_that_of_the_union_of_boxes(seed: int, whole: bool) -> None:
    random = np.random.default_rng(seed)
    points = random.integers(0, 4, (9, 3)).astype(float) if whole else random.random((9, 3)) * 3.5
    reference = np.array([3.0, 3.0, 3.0])
    assert hypervolume(points, reference) == pytest.approx(union_by_inclusion_and_exclusion(points, reference))


def sphere(candidates: Candidates) -> Worth:
    """DTLZ2 with three objectives: the front is the unit sphere; a choice other than 2 is worse by a tenth."""
    angle_1, angle_2 = 0.5 * np.pi * candidates.places[:, 0], 0.5 * np.pi * candidates.places[:, 1]
    away = 1.0 + np.sum((candidates.places[:, 2:] - 0.5) ** 2, axis=1) + 0.1 * (candidates.choice != 2)
    unit = [np.cos(angle_1) * np.cos(angle_2), np.cos(angle_1) * np.sin(angle_2), np.sin(angle_1)]
    return Worth(away[:, None] * np.stack(unit, axis=1), np.zeros(len(candidates)))


SETTINGS = SearchTable(screening=512, population=128, generations=60, tolerance=0.0, seed=3)


@pytest.fixture(scope="module")
def front() -> Front:
    """What is found of the sphere."""
    return search_front(sphere, 4, 7, SETTINGS)


def test_a_known_front_is_found_and_its_choice_of_parts_too(front: Front) -> None:
    radius = np.linalg.norm(front.worth.objectives, axis=1)
    assert len(front.candidates) > 200
    assert float(np.median(radius)) < 1.01
    assert np.mean(front.candidates.choice == 2) > 0.97
    volume = hypervolume(front.worth.objectives, np.full(3, 1.1))
    assert volume == pytest.approx(1.1**3 - np.pi / 6.0, rel=0.03)


def test_generations_find_more_than_as_many_evenly_spread_designs(front: Front) -> None:
    even = sphere(evenly_spread(front.growth[-1][0], 4, 7, seed=3))
    reference = np.full(3, 1.1)
    assert hypervolume(front.worth.objectives, reference) > 1.3 * hypervolume(even.objectives, reference)


def test_the_hypervolume_of_the_search_only_grows(front: Front) -> None:
    shares_found = [share for _, share in front.growth]
    assert len(shares_found) == SETTINGS.generations + 1
    assert all(later >= earlier - 1e-12 for earlier, later in pairwise(shares_found))


def test_the_same_seed_gives_the_same_front_and_another_seed_another(front: Front) -> None:
    again, other = (search_front(sphere, 4, 7, SETTINGS.model_copy(update={"seed": seed})) for seed in (3, 4))
    assert np.array_equal(front.worth.objectives, again.worth.objectives)
    assert not np.array_equal(front.worth.objectives[:20], other.worth.objectives[:20])


def test_a_search_that_no_longer_grows_stops() -> None:
    front = search_front(sphere, 4, 7, SETTINGS.model_copy(update={"generations": 500, "tolerance": 5e-3}))
    assert front.settled
    assert len(front.growth) < 500


def test_constraints_are_kept_even_where_few_candidates_keep_them() -> None:
    def narrow(candidates: Candidates) -> Worth:
        value = sphere(candidates)
        return Worth(value.objectives, np.maximum(0.0, np.abs(candidates.places[:, 2] - 0.9) - 0.01))

    front = search_front(narrow, 4, 7, SETTINGS)
    assert len(front.candidates) > 50
    assert np.all(np.abs(front.candidates.places[:, 2] - 0.9) <= 0.01)


def test_a_problem_without_any_candidate_that_keeps_the_constraints_has_an_empty_front() -> None:
    def never(candidates: Candidates) -> Worth:
        return Worth(sphere(candidates).objectives, np.ones(len(candidates)))

    front = search_front(never, 1, 3, SearchTable(screening=64, population=16, generations=3, tolerance=0.0, seed=1))
    assert len(front.candidates) == 0
    assert front.growth[-1][1] == 0.0


def test_places_beyond_the_ends_are_thrown_back() -> None:
    assert reflect(np.array([-0.2, 0.3, 1.4, 2.3])).tolist() == pytest.approx([0.2, 0.3, 0.6, 0.3])


def test_each_choice_is_met_as_often_by_an_even_spread() -> None:
    spread = evenly_spread(1024, 4, 3, seed=5)
    assert np.bincount(spread.choice).tolist() == [256] * 4
    assert np.all((spread.places >= 0.0) & (spread.places <= 1.0))


def test_the_knee_has_the_smallest_sum_of_shares_and_is_shown_with_the_best_of_each() -> None:
    objectives = np.array([[0.0, 10.0, 5.0], [1.0, 1.0, 5.0], [10.0, 0.0, 5.0], [4.0, 0.9, 5.0]])
    assert fractions(objectives)[:, 2].tolist() == [0.0] * 4
    assert knee(objectives) == 1
    assert representatives(objectives, most=3) == (0, 1, 2)
