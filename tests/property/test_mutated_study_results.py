"""Damaged results of a study end in one clear line, or in something that can be used and drawn."""

import json
import random
import shutil
from pathlib import Path
from typing import Any

import pytest

import ppafo
from ppafo.errors import DataError, PpafoError
from scripts.mutated_files import draw_study, mutated, open_study

STUDY: dict[str, Any] = {
    "schema_version": 1,
    "name": "small",
    "configurations": [
        {"name": "a", "scenario": "torque-task-proportional", "overrides": ["run.duration=0.1 s"]},
        {
            "name": "b",
            "scenario": "torque-task-proportional",
            "overrides": ["run.duration=0.1 s", "reference.level=1 N m"],
        },
    ],
    "sample": {"method": "sobol", "runs": 4},
    "vary": [
        {"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "50 psi_g"},
        {"path": "valve.area", "kind": "uniform", "minimum": "4 mm^2", "maximum": "5 mm^2"},
    ],
    "outputs": {
        "metrics": ["rms_error", "gas_vented"],
        "bands": ["torque"],
        "trajectories": ["pressure_1"],
        "every": "50 ms",
    },
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study") / "out"
    ppafo.sweep(STUDY, out=folder)
    return folder


@pytest.mark.parametrize("name", ["study.json", "summary.json", "bands.parquet", "runs/chunk-0000001.parquet"])
def test_damage_is_one_line(name: str, results: Path) -> None:
    file = results / name
    draw = random.Random(name)
    content = file.read_bytes()
    refused = 0
    try:
        for number in range(60):
            file.write_bytes(mutated(file.name, content, draw))
            try:
                (draw_study if number % 30 == 0 else open_study)(str(results))
            except PpafoError as error:
                refused += 1
                assert "\n" not in str(error)
    finally:
        file.write_bytes(content)
    assert refused > 15


@pytest.mark.parametrize(
    ("name", "said"), [("summary.json", "is not finished"), ("study.json", r"study\.json is damaged, or of another")]
)
def test_a_document_that_was_changed_is_named(name: str, said: str, results: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    shutil.copytree(results, folder)
    document = json.loads((folder / name).read_text(encoding="utf-8"))
    (folder / name).write_text(json.dumps(document | {"runs": 9}), encoding="utf-8")
    with pytest.raises(DataError, match=said):
        ppafo.load_study_results(folder)


@pytest.mark.parametrize("name", ["bands.parquet", "runs/chunk-0000000.parquet"])
def test_a_table_that_is_missing_is_named(name: str, results: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    shutil.copytree(results, folder)
    (folder / name).unlink()
    with pytest.raises(DataError, match=rf"{name}: is missing or damaged; run the study again"):
        ppafo.load_study_results(folder).plot()
