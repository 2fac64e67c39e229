"""A study from its file to its rows: every run is what it is alone, failures are rows, a stopped study goes on."""

import dataclasses
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.analyses.study_results import StudyResults, load_study_results
from ppafo.analyses.sweep import LOG, sweep
from ppafo.errors import DataError, StudyError
from ppafo.progress import Progress
from ppafo.storage.files import LEFT_ASIDE
from ppafo.studies.loading import load_study
from ppafo.study import store
from ppafo.study.blocks import chunks_of
from ppafo.study.store import StudyFolder, chunk_file, compute_chunk, estimate_bytes

AREA = {"path": "valve.area", "kind": "uniform", "minimum": "10 mm^2", "maximum": "12 mm^2"}


def contents(folder: Path | str) -> dict[str, bytes]:
    """Every file of a folder of results, without the log."""
    files = {path.relative_to(folder).as_posix(): path for path in Path(folder).rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if name != LOG}


def test_every_run_is_what_it_is_alone(small_results: StudyResults) -> None:
    table = small_results.table()
    assert table["run"].tolist() == list(range(32))
    assert table["configuration"].tolist() == ["proportional"] * 16 + ["solenoid"] * 16
    for run in (0, 13, 16, 31):
        overrides = [
            "run.duration=0.2 s",
            f"supply.pressure={table['supply.pressure'][run]!r} Pa_a".replace("np.float64(", "").replace(")", ""),
            f"actuator.leak.area={float(table['actuator.leak.area'][run])!r} m^2",
            f"reference.level={float(table['reference.level'][run])!r} N m",
        ]
        alone = ppafo.simulate(f"torque-task-{table['configuration'][run]}", overrides)
        assert table["rms_error"][run] == pytest.approx(alone.metrics["rms_error"].value, rel=1e-12)
        assert table["gas_supplied"][run] == alone.metrics["gas_supplied"].value, "the course has the same bits"
        kept = small_results.trajectories("torque")[run]
        expected = np.interp(0.02 * np.arange(11), alone.recording.time, alone.recording["torque"])
        np.testing.assert_allclose(kept, expected, rtol=1e-6, atol=1e-6)


def test_noise_has_a_column_with_which_a_row_is_run_again(varying: Callable[..., Any]) -> None:
    document = varying({"path": "valve.area", "kind": "uniform", "minimum": "9 mm^2", "maximum": "11 mm^2"}, runs=4)
    noisy = ["run.duration=0.2 s", "sensors.pressure_noise=5 kPa_d"]
    document["configurations"] = [
        {"name": name, "scenario": "torque-task-proportional", "overrides": noisy} for name in ("one", "other")
    ]
    results = sweep(document).found
    table, seeds = results.table(), results.by_configuration("sensors.seed")
    assert np.unique(seeds["one"]).size == 4
    assert seeds["one"].tolist() == seeds["other"].tolist()
    again = [f"valve.area={float(table['valve.area'][2])!r} m^2", f"sensors.seed={int(table['sensors.seed'][2])}"]
    alone = ppafo.simulate("torque-task-proportional", [*noisy, *again]).metrics
    assert table["rms_error"][2] == pytest.approx(alone["rms_error"].value, rel=1e-12)


def test_a_row_has_the_estimated_error_of_each_metric_where_the_study_keeps_it(varying: Callable[..., Any]) -> None:
    document = varying({"path": "valve.area", "kind": "uniform", "minimum": "8 mm^2", "maximum": "16 mm^2"})
    plain = sweep(document).found
    document["outputs"] = document["outputs"] | {"metrics": ["rms_error", "largest_pressure"], "errors": True}
    results = sweep(document).found
    table = results.table()
    assert np.array_equal(table["rms_error"], plain.table()["rms_error"])
    assert "rms_error_error" not in plain.table()
    assert all((table["rms_error_error"] > 0.0) & (table["rms_error_error"] < 1e-3 * table["rms_error"]))
    assert all(table["largest_pressure_error"] < 10.0)


def test_the_folder_opens_as_it_is_with_units_in_the_columns(small_results: StudyResults) -> None:
    import pyarrow.dataset

    folder = small_results.folder.path
    table = pyarrow.dataset.dataset(f"{folder}/runs").to_table()
    assert table.num_rows == 32
    units = {field.name: (field.metadata or {}).get(b"unit") for field in table.schema}
    assert units["supply.pressure"] == b"Pa_a"
    assert units["gas_supplied"] == b"kg"
    assert units["failure_time"] == b"s"
    frame = table.select(["configuration", "status", "rms_error"]).to_pylist()[0]
    assert frame["status"] == "completed"
    assert sorted(contents(folder)) == [
        "bands.parquet",
        *(f"finished/chunk-000000{number}.json" for number in range(8)),
        *(f"runs/chunk-000000{number}.parquet" for number in range(8)),
        "study.json",
        "summary.json",
    ]


def test_the_summary_says_what_numpy_says_of_the_rows(small_results: StudyResults) -> None:
    values = small_results.by_configuration("rms_error")["solenoid"]
    said = small_results.metrics["solenoid"]["rms_error"]
    assert said["count"] == 16
    assert said["mean"] == pytest.approx(values.mean(), rel=1e-12)
    assert said["sd"] == pytest.approx(values.std(ddof=1), rel=1e-12)
    assert said["unit"] == "N m"
    assert said["quantiles"]["0.25"] == pytest.approx(np.quantile(values, 0.25), rel=1e-12)
    assert small_results.summary["completed"] == 32
    assert small_results.summary["failures"] == []


def test_bands_are_the_quantiles_over_the_runs(small_results: StudyResults) -> None:
    bands = small_results.bands()
    own = (bands["configuration"] == "solenoid") & (bands["channel"] == "torque")
    traces = small_results.trajectories("torque")[16:]
    assert bands["time"][own].tolist() == pytest.approx((0.02 * np.arange(11)).tolist())
    assert bands["runs"][own].tolist() == [16] * 11
    for share in (0.05, 0.5, 0.95):
        np.testing.assert_allclose(bands[f"q{share:g}"][own], np.quantile(traces, share, axis=0), rtol=1e-14)


def test_chunks_are_the_same_in_any_order_and_on_any_number_of_threads(small_results: StudyResults, small: Any) -> None:
    written = contents(small_results.folder.path)
    study = load_study(small)
    for number in (7, 2, 0, 5):
        _, content = compute_chunk(study, chunks_of(study)[number], 1 + number % 2)
        assert content == written[chunk_file(number)]


@pytest.fixture(autouse=True)
def counts_of_whole_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slow computer, runs are counted within a chunk too."""
    monkeypatch.setattr("ppafo.study.runs._BETWEEN_COUNTS", math.inf)


class StoppedError(Exception):
    """Stands for whatever ends a process."""


def stopped_after(chunks: int) -> Callable[[Progress], None]:
    """A watcher that ends the study once some chunks are finished."""
    told: list[Progress] = []

    def watch(progress: Progress) -> None:
        # The first report is of no chunk.
        if progress.done:
            told.append(progress)
        if len(told) == chunks:
            raise StoppedError

    return watch


@pytest.mark.parametrize("chunks", [1, 4, 8])
def test_a_stopped_study_goes_on_to_the_same_bytes(
    small_results: StudyResults, small: Any, tmp_path: Path, chunks: int
) -> None:
    out = tmp_path / "out"
    with pytest.raises(StoppedError):
        sweep(small, out=out, progress=stopped_after(chunks))
    before = {path: path.stat().st_mtime_ns for path in (out / "finished").iterdir()}
    assert chunks <= len(before) <= chunks + 1
    with pytest.raises(DataError, match="the study is not finished"):
        load_study_results(out)
    left = out / "runs" / f".chunk-0000007.parquet{LEFT_ASIDE}0badcafe"
    left.write_bytes(b"PAR1")
    os.utime(left, (0.0, 0.0))
    sweep(small, out=out)
    assert contents(out) == contents(small_results.folder.path)
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_the_results_are_the_same_with_any_number_of_runs_of_a_chunk(
    small_results: StudyResults, small: Any, tmp_path: Path
) -> None:
    small["runs_of_chunk"] = 7
    again = sweep(small, out=tmp_path / "out").found
    assert len(list((tmp_path / "out" / "runs").iterdir())) == 6
    for name in ("summary.json", "bands.parquet"):
        assert (tmp_path / "out" / name).read_bytes() == (small_results.folder.path / name).read_bytes()
    for name, values in small_results.table(["rms_error", "supply.pressure"]).items():
        np.testing.assert_array_equal(again.table(name)[name], values)


def cut(content: bytes) -> bytes:
    """The first half."""
    return content[: len(content) // 2]


def flipped(content: bytes) -> bytes:
    """One bit changed early in the data, which leaves the footer whole."""
    return content[:60] + bytes([content[60] ^ 1]) + content[61:]


def nothing(content: bytes) -> bytes:
    """An empty file."""
    return content[:0]


@pytest.mark.parametrize("folder", ["runs", "finished"])
@pytest.mark.parametrize("damage", [cut, flipped, nothing])
def test_damaged_chunks_are_found_and_computed_again(
    small_results: StudyResults, small: Any, tmp_path: Path, folder: str, damage: Callable[[bytes], bytes]
) -> None:
    out = copied(small_results, tmp_path)
    path = next((out / folder).glob("chunk-0000003.*"))
    path.write_bytes(damage(path.read_bytes()))
    told: list[Progress] = []
    sweep(small, out=out, progress=told.append)
    done = [progress.done for progress in told]
    assert len(done) == 3, "the count at the start, one chunk, and the summary"
    assert done[-1] == 32
    assert contents(out) == contents(small_results.folder.path)


def copied(results: StudyResults, tmp_path: Path) -> Path:
    """A copy of finished results."""
    out = tmp_path / "out"
    for name, content in contents(results.folder.path).items():
        StudyFolder(out).write(name, content)
    return out


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda study: study["sample"].update(seed=4), "study.sample.seed was 3 and is now 4"),
        (
            lambda study: study["vary"][1].update(maximum="70 psi_g"),
            r"study.vary.supply.pressure.maximum was '60 psi_g' and is now '70 psi_g'",
        ),
        (
            lambda study: study["configurations"][0].update(overrides=["run.duration=0.2 s", "valve.area=9 mm^2"]),
            r"configurations.proportional.overrides was .* and is now .*valve.area=9",
        ),
    ],
)
def test_a_changed_study_is_refused_with_what_changed(
    small_results: StudyResults, small: Any, change: Callable[[Any], None], expected: str
) -> None:
    before = contents(small_results.folder.path)
    change(small)
    with pytest.raises(StudyError, match=expected) as caught:
        sweep(small, out=small_results.folder.path)
    assert "\n" not in str(caught.value)
    assert contents(small_results.folder.path) == before


def test_a_study_whose_draws_were_changed_in_python_is_refused(small_results: StudyResults, small: Any) -> None:
    study = load_study(small)
    other = dataclasses.replace(study, sample=dataclasses.replace(study.sample, seed=study.sample.seed + 1))
    with pytest.raises(StudyError, match=r"drawn\.sample\.seed was 3 and is now 4"):
        sweep(other, out=small_results.folder.path)


def test_more_disk_than_there_is_is_refused_before_anything_is_written(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "free_bytes", lambda _: 1000)
    with pytest.raises(StudyError, match=r"32 runs of 'small' need about .* MB, but only 0.001 MB are free"):
        sweep(small, out=tmp_path / "out", agreed=True)
    assert not (tmp_path / "out").exists()


def test_a_large_study_asks_for_consent(small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "ASKED_ABOVE", 1000)
    with pytest.raises(StudyError, match="give agreed to start the study"):
        sweep(small, out=tmp_path / "out")
    assert sweep(small, out=tmp_path / "out", agreed=True).found.summary["completed"] == 32


def test_the_estimate_of_the_disk_is_near_and_above_what_is_written(
    varying: Callable[..., Any], tmp_path: Path
) -> None:
    study = load_study(varying(AREA, AREA | {"path": "actuator.leak.area"}, runs=600))
    study_results = sweep(study, out=tmp_path / "out").found
    written = sum(len(content) for name, content in contents(tmp_path / "out").items() if name.startswith("runs/"))
    assert written <= estimate_bytes(study) <= 4 * written + 10_000 * study_results.document["chunks"]


def test_runs_that_fail_are_rows_with_status_and_reason(varying: Callable[..., Any], tmp_path: Path) -> None:
    stops = {"path": "actuator.angle_min", "kind": "list", "values": ["20 deg", "140 deg"]}
    document = varying(stops)
    del document["sample"]
    swept = sweep(document, out=tmp_path / "out")
    results = swept.found
    assert swept.passed
    assert swept.said[1].startswith("2 of 4 runs failed and have no metrics; the first is run 1: ")
    stops["values"] = ["20 deg", "140 deg", "150 deg"]
    most = sweep(document)
    assert not most.passed
    assert "solenoid: most runs failed: the statistics of the others do not describe the study" in most.said
    table = results.table()
    assert table["status"].tolist() == ["completed", "refused"] * 2
    assert np.isnan(table["rms_error"][[1, 3]]).all()
    assert np.isfinite(table["rms_error"][[0, 2]]).all()
    assert table["reason"][0] is None
    assert "angle_m" in table["reason"][1]
    assert results.summary["refused"] == 2
    assert [item["run"] for item in results.summary["failures"]] == [1, 3]
    assert results.metrics["proportional"]["rms_error"]["count"] == 1


def test_a_path_that_varies_in_one_configuration_has_no_value_in_the_others(
    varying: Callable[..., Any], tmp_path: Path
) -> None:
    gain = {"path": "controller.proportional_gain", "kind": "uniform", "minimum": "0.05 1/(N m)"}
    document = varying(gain | {"maximum": "0.2 1/(N m)", "only": ["proportional"]}, runs=3)
    values = sweep(document, out=tmp_path / "out").found.by_configuration("controller.proportional_gain")
    assert np.isfinite(values["proportional"]).all()
    assert np.isnan(values["solenoid"]).all()


def test_without_a_folder_the_results_live_as_long_as_their_object(varying: Callable[..., Any]) -> None:
    results = sweep(varying(AREA, runs=4)).found
    folder = results.folder.path
    rows = results.table(["run"])["run"].size
    del results
    assert rows == 8
    assert not folder.exists()


def test_a_seed_takes_the_place_of_that_of_the_file(varying: Callable[..., Any]) -> None:
    document = varying(AREA, runs=4)
    seeds = (None, document["sample"]["seed"], document["sample"]["seed"] + 1)
    first, same, other = (sweep(document, seed=seed).found.table(["valve.area"])["valve.area"] for seed in seeds)
    assert (first == same).all()
    assert (first != other).all()
