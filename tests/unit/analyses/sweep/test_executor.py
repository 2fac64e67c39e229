"""Studies on the workers of an executor: the same bytes as on one computer, whatever is lost on the way."""

import copy
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

import ppafo
from ppafo.analyses.study_results import StudyResults
from ppafo.errors import StudyError
from ppafo.progress import Progress
from ppafo.study.executing import _computed, computed_by
from tests.unit.analyses.sweep.test_run_study import contents

PAIR = {"metrics": "rms_error", "configuration": "solenoid", "samples": 64}


def test_sweep_sensitivity_and_tune_are_the_same_on_two_processes(
    small_results: StudyResults, small: Any, tmp_path: Path
) -> None:
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        ppafo.sweep(small, out=tmp_path / "out", threads=1, executor=pool)
        assert contents(tmp_path / "out") == contents(small_results.folder.path)
        there, here = (ppafo.sensitivity("torque-task-uncertainty", executor=each, **PAIR) for each in (pool, None))
        assert there.to_dict() == here.to_dict()
        found, expected = (ppafo.tune("pid-gains", executor=each).found for each in (pool, None))
        assert (found.starts, found.after) == (expected.starts, expected.after)


class Losing(ThreadPoolExecutor):
    """An executor that loses its first submissions."""

    def __init__(self, lost: int) -> None:
        super().__init__(1)
        self.lost, self.submitted = lost, 0

    def submit(self, function: Any, /, *values: Any, **named: Any) -> "Future[Any]":
        self.submitted += 1
        if self.submitted > self.lost:
            return super().submit(function, *values, **named)
        future: Future[Any] = Future()
        if self.submitted % 2:
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_exception(OSError("connection lost"))
        return future


def test_a_lost_block_is_submitted_again_and_given_up_in_the_end() -> None:
    pool = Losing(2)
    assert sorted(computed_by(pool, abs, [-4, -5, 6])) == [(0, 4), (1, 5), (2, 6)]
    assert pool.submitted == 5
    with pytest.raises(StudyError, match="block 0 was lost 3 times: CancelledError"):
        list(computed_by(Losing(3), abs, [-4]))
    pool.shutdown()
    with pytest.raises(StudyError, match="takes no more work"):
        list(computed_by(pool, abs, [-4]))


def test_a_worker_of_another_version_and_a_study_that_cannot_be_sent_are_refused() -> None:
    with pytest.raises(StudyError, match=f"a worker has ppafo {ppafo.__version__}, not 0.0.1; install the same"):
        _computed(pickle.dumps(len), 1, "0.0.1", "")
    with pytest.raises(StudyError, match="a class or function of the study cannot be sent to workers"):
        list(computed_by(ThreadPoolExecutor(1), lambda block: block, [1]))


CALLER = """
from concurrent.futures import ProcessPoolExecutor
import os, pickle, ppafo, time
from ppafo.study.executing import _computed
if __name__ == "__main__":
    pool = ProcessPoolExecutor(1)  # of two, one may take both blocks, and the other, which computed nothing, stays
    print(pool.submit(_computed, pickle.dumps(divmod), 0, ppafo.__version__, "").exception() and 0, flush=True)
    time.sleep(60)
"""


def test_the_worker_of_a_pool_ends_with_a_caller_that_is_killed(tmp_path: Path) -> None:
    (tmp_path / "caller.py").write_text(CALLER)
    with subprocess.Popen([sys.executable, tmp_path / "caller.py"], stdout=subprocess.PIPE, text=True) as caller:
        assert caller.stdout is not None
        assert caller.stdout.readline() == "0\n"
        caller.kill()
        caller.communicate(timeout=20)  # the output ends with the last process that has it: the worker


@pytest.fixture(scope="module")
def dask() -> Iterator[Any]:
    """A client of two processes."""
    distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_a_cluster_that_loses_a_worker_ends_with_the_same_bytes(
    dask: Any, small_results: StudyResults, small: Any, tmp_path: Path
) -> None:
    executor, killed = dask.get_executor(), list[int]()
    ppafo.sweep(copy.deepcopy(small), out=tmp_path / "whole", executor=executor)

    def kill(progress: Progress) -> None:
        if progress.done and not killed:
            killed.append(next(iter(dask.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    ppafo.sweep(small, out=tmp_path / "lost", executor=executor, progress=kill)
    assert killed
    assert contents(tmp_path / "lost") == contents(tmp_path / "whole") == contents(small_results.folder.path)
