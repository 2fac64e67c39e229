"""Statistics of a column read in parts: those of NumPy on the whole of it, sorted in memory or not."""

from collections.abc import Iterator

import numpy as np
import pytest

from ppafo.questions.sweep import summary as statistics
from ppafo.questions.sweep.summary import describe, order_statistics

SHARES = (0.0, 0.05, 0.25, 0.5, 0.777, 0.95, 1.0)
RANDOM = np.random.default_rng(6)
COLUMNS = {
    "normal": RANDOM.normal(1e5, 3.0, 5001),
    "both signs": RANDOM.normal(0.0, 1e-9, 4000),
    "counts": RANDOM.integers(-2, 3, 3000).astype(np.float64),
    "wide": np.sign(RANDOM.normal(size=999)) * 10.0 ** RANDOM.uniform(-100, 100, 999),
    "constant": np.full(77, -0.1),
    "one": np.array([4.0]),
}


@pytest.mark.parametrize("name", COLUMNS)
@pytest.mark.parametrize("in_memory", [0, 16_000_000])
def test_statistics_are_those_of_numpy(name: str, in_memory: int, monkeypatch: pytest.MonkeyPatch) -> None:
    values = COLUMNS[name]
    monkeypatch.setattr(statistics, "MAXIMUM_IN_MEMORY", in_memory)
    said = describe(lambda: iter(np.array_split(values, 7)), SHARES)
    assert said["count"] == values.size
    assert said["mean"] == pytest.approx(values.mean(), rel=1e-12)
    assert said["minimum"] == values.min()
    assert said["maximum"] == values.max()
    if name not in ("one", "wide"):
        assert said["sd"] == pytest.approx(values.std(ddof=1), rel=1e-9, abs=1e-15)
    for share in SHARES:
        assert said["quantiles"][f"{share:g}"] == pytest.approx(np.quantile(values, share), rel=1e-9)


def test_every_rank_is_found() -> None:
    values = COLUMNS["both signs"][:300]
    found = order_statistics(lambda: iter(np.array_split(values, 3)), range(300))
    assert list(found.values()) == np.sort(values).tolist()


def test_nothing_has_a_count_only() -> None:
    def parts() -> Iterator[np.ndarray]:
        yield np.array([])

    assert describe(parts, SHARES) == {"count": 0}
