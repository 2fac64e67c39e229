"""The same study on a Dask cluster: the same bytes, also where a worker dies in the middle."""

import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from ppafo.analyses.sweep import cluster
from ppafo.analyses.sweep.solve import LOG, sweep
from ppafo.errors import StudyError
from ppafo.progress import Progress
from ppafo.storage.files import LEFT_ASIDE
from ppafo.storage.places import place_at
from ppafo.study.store import Finished, Task, work_on_chunk

pytestmark = pytest.mark.skipif(not find_spec("distributed"), reason="needs the extra 'cluster'")


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder of results, without the log."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if name != LOG}


@pytest.fixture
def two_workers(tmp_path: Path) -> Iterator[Any]:
    """A scheduler with two worker processes on this machine."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=":0",
        local_directory=str(tmp_path / "dask"),
    ) as local:
        yield local


def test_a_worker_that_dies_in_the_middle_changes_nothing(small: Any, tmp_path: Path, two_workers: Any) -> None:
    small["sample"]["runs"] = 64
    here, there = tmp_path / "here", tmp_path / "there"
    sweep(small, out=here, threads=1)
    victim = two_workers.workers[0].process.pid
    told: list[Progress] = []

    def watch(progress: Progress) -> None:
        told.append(progress)
        if len(told) == 3:
            os.kill(victim, signal.SIGKILL)

    found = sweep(small, out=there, threads=1, scheduler=two_workers.scheduler_address, progress=watch).found
    assert [progress.done for progress in told][-1] == found.document["runs"] == 256
    assert len(told) == found.document["chunks"] == 52
    assert victim not in {nanny.process.pid for nanny in two_workers.workers.values()}
    # Killed in the middle of writing, it leaves a file aside, which the next one to come by takes away once it is old.
    for aside in there.rglob(f"*{LEFT_ASIDE}*"):
        os.utime(aside, (0.0, 0.0))
    place_at(there).tidy()
    assert contents(there) == contents(here)


def test_bad_input_found_by_a_worker_is_one_line(small: Any, tmp_path: Path, two_workers: Any) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    out = tmp_path / "out"
    out.mkdir()
    sweep(small, out=out)
    (out / "finished" / "chunk-0000001.json").unlink()
    target = out / "runs" / "chunk-0000001.parquet"
    target.unlink()
    target.mkdir()
    with pytest.raises(Exception, match="cannot be written") as caught:
        sweep(small, out=out, scheduler=two_workers.scheduler_address)
    assert "\n" not in str(caught.value)


def test_workers_that_write_elsewhere_are_noticed(
    small: Any, tmp_path: Path, two_workers: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    monkeypatch.setattr(cluster, "work_on_chunk", partial(_written_elsewhere, str(elsewhere)))
    with pytest.raises(StudyError, match="must be a folder that they share"):
        sweep(small, out=tmp_path / "out", scheduler=two_workers.scheduler_address)


def _written_elsewhere(address: str, task: Task, number: int) -> Finished:
    return work_on_chunk(replace(task, address=address), number)


def test_a_scheduler_that_is_not_there_is_one_line(small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_SECONDS_TO_CONNECT", 1)
    with pytest.raises(StudyError, match=r"--scheduler tcp://127\.0\.0\.1:9: cannot be reached"):
        sweep(small, out=tmp_path / "out", scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize("address", ["nix", "tcp://127.0.0.1:9"])
def test_a_scheduler_that_is_not_there_leaves_no_client_that_complains_later(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import distributed

    monkeypatch.setattr(cluster, "_SECONDS_TO_CONNECT", 1)
    monkeypatch.setattr(distributed, "Client", None)
    with pytest.raises(StudyError, match=f"--scheduler {address}: cannot be reached: ") as refused:
        cluster.compute_on_cluster(address, None, [], list)  # type: ignore[arg-type]
    assert "\n" not in str(refused.value)


def test_without_the_extra_the_option_says_what_to_install(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(StudyError, match=r"pip install 'ppafo\[cluster\]'"):
        sweep(small, out=tmp_path / "out", scheduler="tcp://127.0.0.1:9")
