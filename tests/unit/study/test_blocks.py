"""Chunks of a study: an interrupt of a small one loses little."""

from typing import Any

import pytest

from ppafo.studies.draws import study_of
from ppafo.study.blocks import chunk, chunk_count, chunk_size


@pytest.mark.parametrize(
    ("duration", "runs", "chunks"), [("0.3 s", 200, 1), ("30 s", 200, 2), ("30 s", 1000, 8), ("30 s", 20_000, 20)]
)
def test_few_long_runs_are_kept_in_several_chunks(small: Any, duration: str, runs: int, chunks: int) -> None:
    del small["runs_of_chunk"], small["correlations"]
    small["outputs"] = {"metrics": ["rms_error"]}
    small["vary"] = [{"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "55 psi_g"}]
    small["configurations"] = [
        {"name": "one", "scenario": "torque-task-proportional", "overrides": [f"run.duration={duration}"]}
    ]
    small["sample"]["runs"] = runs
    study = study_of(small)
    assert chunk_count(study) == chunks
    assert sum(chunk(study, number).runs for number in range(chunks)) == runs
    assert chunk_size(study) >= min(runs, 64)
