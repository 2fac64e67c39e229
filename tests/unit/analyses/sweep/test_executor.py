"""Studies on the workers of an executor: the same bytes as on one computer, whatever is lost on the way."""

import contextlib
import copy
import os
import pickle
import signal
import subprocess
import sys
import time
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


class Answering(ThreadPoolExecutor):
    """An executor that answers in a way of its own, after ``good`` answers as they should be."""

    def __init__(self, answer: Any, good: int = 1) -> None:
        super().__init__(1)
        self.answer, self.good = answer, good
        self.first: Future[Any] | None = None

    def submit(self, function: Any, /, *values: Any, **named: Any) -> Any:
        self.good -= 1
        if self.good >= 0:
            self.first = super().submit(function, *values, **named)
            self.first.result()
            return self.first
        return self.answer(self)


def fails(error: Exception) -> Any:
    """Raises an error, as a function."""
    raise error


def ended(result: Any) -> "Future[Any]":
    """A future that has a result."""
    future: Future[Any] = Future()
    future.set_result(result)
    return future


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (
            lambda _: fails(OSError("connection lost\nline 2")),
            "takes no more work, give a new one: connection lost line",
        ),
        (lambda _: fails(TypeError("cannot pickle 'x'")), "takes no more work, give a new one: cannot pickle 'x'"),
        (lambda _: None, "takes no more work, give a new one: 'NoneType' object has no attribute"),
        (lambda _: ended("garbage"), "answers block 1 with a str that is not its result"),
        (lambda own: ended(own.first.result()), "answers block 1 with a tuple that is not its result"),
    ],
)
def test_an_executor_that_fails_is_refused_in_one_line_after_its_finished_blocks(answer: Any, message: str) -> None:
    answers = computed_by(Answering(answer), abs, [-4, -5])
    assert next(answers) == (0, 4)
    with pytest.raises(StudyError, match=message) as refused:
        next(answers)
    assert "\n" not in str(refused.value)


def test_a_function_that_ends_the_process_is_no_executor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ends_process.py").write_text("import sys\ndef make():\n    sys.exit(3)\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StudyError, match=r"executor = 'ends_process:make': calls sys\.exit: 3"):
        ppafo.tune("pid-gains", executor="ends_process:make", plugins=["ends_process.py"])


CALLER = """
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import pickle, ppafo, time
from ppafo.study.executing import _computed
if __name__ == "__main__":
    pool = ProcessPoolExecutor(4, get_context("fork"))
    block = pickle.dumps(eval), "__import__('os').getpid()"
    seal, content = pool.submit(_computed, *block, ppafo.__version__, "").result()
    print(pickle.loads(content), *pool._processes, flush=True)
    time.sleep(60)
"""


def is_running(number: int) -> bool:
    """Whether a process is there and has not ended."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{number}/stat").read_text(encoding="utf-8").split()[2] != "Z"
    return False


def test_a_worker_that_computed_ends_with_a_caller_that_is_killed(tmp_path: Path) -> None:
    (tmp_path / "caller.py").write_text(CALLER)
    with subprocess.Popen([sys.executable, tmp_path / "caller.py"], stdout=subprocess.PIPE, text=True) as caller:
        assert caller.stdout is not None
        worker, *pool = map(int, caller.stdout.readline().split())
        caller.kill()
        limit = time.monotonic() + 20.0
        try:
            while is_running(worker):
                assert time.monotonic() < limit
                time.sleep(0.1)
        finally:
            # Those that computed nothing know of no caller.
            for number in pool:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(number, signal.SIGKILL)


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
