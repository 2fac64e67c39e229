"""The same study on a Dask cluster: the same bytes, also where a worker dies in the middle."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from ppafo import plugins
from ppafo.analyses.sweep import cluster
from ppafo.analyses.sweep.solve import LOG, sweep
from ppafo.errors import KindError, StudyError
from ppafo.metrics import METRICS
from ppafo.plugins import Plugin
from ppafo.progress import Progress
from ppafo.storage.files import LEFT_ASIDE
from ppafo.storage.places import place_at
from ppafo.study.sent_plugins import SentPlugin, take_plugins
from ppafo.study.store import ChunkTask, FinishedChunk, work_on_chunk
from tests.virtual_wire import free_port

pytestmark = pytest.mark.skipif(not find_spec("distributed"), reason="needs the extra 'cluster'")


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder of results, without the log."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if name != LOG}


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A scheduler with two worker processes on this machine, which start anew where one of them is killed."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=":0",
        local_directory=str(tmp_path_factory.mktemp("dask")),
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


def _written_elsewhere(address: str, task: ChunkTask, number: int) -> FinishedChunk:
    return work_on_chunk(replace(task, address=address), number)


def test_a_scheduler_that_is_not_there_is_one_line_at_once_and_leaves_no_folder(small: Any, tmp_path: Path) -> None:
    begun = time.monotonic()
    with pytest.raises(StudyError, match=r"^--scheduler tcp://127\.0\.0\.1:9: cannot be reached: connection refused$"):
        sweep(small, out=tmp_path / "out", scheduler="tcp://127.0.0.1:9")
    assert time.monotonic() - begun < 20.0
    assert not (tmp_path / "out").exists()


@pytest.fixture
def scheduler_of_its_own(tmp_path: Path) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    """The address of a scheduler in a process of its own, with one worker, and that process."""
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    begin = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", str(port), "--no-dashboard"]
    work = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    aside: dict[str, Any] = {"cwd": tmp_path, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen(begin, **aside) as scheduler, subprocess.Popen([*work, "--no-nanny"], **aside) as worker:
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            time.sleep(0.1)
        yield address, scheduler
        scheduler.kill()
        worker.kill()


@pytest.mark.long
def test_a_scheduler_that_dies_in_the_middle_is_one_line_that_says_how_to_resume(
    small: Any, tmp_path: Path, scheduler_of_its_own: tuple[str, "subprocess.Popen[str]"]
) -> None:
    small["sample"]["runs"] = 64
    address, process = scheduler_of_its_own
    told: list[Progress] = []

    def watch(progress: Progress) -> None:
        told.append(progress)
        if len(told) == 3:
            process.kill()

    with pytest.raises(StudyError, match=r"the connection was lost; \d+ of 52 chunks are finished and kept") as lost:
        sweep(small, out=tmp_path / "there", threads=1, scheduler=address, progress=watch)
    assert "\n" not in str(lost.value)
    assert "run the same command again" in str(lost.value)
    sweep(small, out=tmp_path / "there", threads=1)
    sweep(small, out=tmp_path / "here", threads=1)
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


@pytest.mark.long
def test_workers_get_the_modules_of_the_person(
    small: Any, tmp_path: Path, two_workers: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my_metric.py").write_text(METRIC, encoding="utf-8")
    (tmp_path / "my_number.py").write_text("NAME = 'own'\n", encoding="utf-8")
    monkeypatch.setattr(plugins, "_named", {})
    monkeypatch.setenv(plugins.VARIABLE, "")
    # The metric goes with this test.
    monkeypatch.setattr(METRICS, "_kinds", {**METRICS.loaded()})
    small["outputs"]["metrics"] = ["my_metric:KIND"]
    sweep(small, out=tmp_path / "here", threads=1, plugins=[tmp_path / "my_metric.py"])
    monkeypatch.setattr(cluster, "work_on_chunk", _on_another_computer)
    sweep(small, out=tmp_path / "there", threads=1, scheduler=two_workers.scheduler_address)
    assert contents(tmp_path / "there") == contents(tmp_path / "here")
    # What a worker has loaded it goes on with: another text of the same name would not be what was asked for.
    take_plugins([SentPlugin(Plugin("my_law", str(tmp_path)), ())])
    with pytest.raises(KindError, match=r"plugin 'my_law': a worker has loaded an earlier version of it"):
        take_plugins([SentPlugin(Plugin("my_law", str(tmp_path)), (("my_law.py", b"KIND = 1"),))])


def _on_another_computer(task: ChunkTask, number: int) -> FinishedChunk:
    """Compute where the folder of the module is not there."""
    moved = [replace(item, plugin=replace(item.plugin, folder="/nowhere")) for item in task.plugins]
    assert [name for name, _ in moved[0].files] == ["my_metric.py", "my_number.py"]
    return work_on_chunk(replace(task, plugins=tuple(moved)), number)


METRIC = """
from dataclasses import replace
from ppafo.metrics import METRICS
from my_number import NAME
KIND = replace(METRICS["rms_error"], name=NAME)
"""


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
