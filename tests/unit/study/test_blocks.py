"""Chunks of a study: the first ones are short, so that an interrupt loses little."""

from typing import Any

import pytest

from ppafo.studies.loading import study_of
from ppafo.study.blocks import chunks_of


@pytest.mark.parametrize(
    ("duration", "runs", "sizes"),
    [
        ("0.3 s", 200, [64, 128, 8]),
        ("0.3 s", 2000, [64, 128, 256, 512, 1024, 16]),
        # Of 30,000 steps a run, 2^22 are 140 runs; 1,024 is the largest power of two with at most 2^25 steps.
        ("30 s", 200, [64, 128, 8]),
        ("30 s", 1000, [64, 128, *[140] * 5, 108]),
        ("30 s", 20_000, [64, 128, 256, 512, *[1024] * 18, 608]),
    ],
)
def test_chunks_double_from_a_short_one_up_to_the_full_size(
    small: Any, duration: str, runs: int, sizes: list[int]
) -> None:
    del small["runs_of_chunk"], small["correlations"]
    small["outputs"] = {"metrics": ["rms_error"]}
    small["vary"] = [{"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "55 psi_g"}]
    small["configurations"] = [
        {"name": name, "scenario": "torque-task-proportional", "overrides": [f"run.duration={duration}"]}
        for name in ("one", "two")
    ]
    small["sample"]["runs"] = runs
    study = study_of(small)
    parts = chunks_of(study)
    assert [part.runs for part in parts] == 2 * sizes
    assert [part.configuration for part in parts] == [0] * len(sizes) + [1] * len(sizes)
    assert [part.first for part in parts] == 2 * [sum(sizes[:number]) for number in range(len(sizes))]
