"""``ppafo sweep`` killed at any moment and started again ends with the bytes of a run that was left in peace."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ppafo.storage.files import LEFT_ASIDE

STUDY = """
schema_version = 1
name = "killed"
runs_of_chunk = 64

[[configurations]]
name = "proportional"
scenario = "torque-task-proportional"

[[configurations]]
name = "solenoid"
scenario = "torque-task-solenoid"

[sample]
method = "latin_hypercube"
runs = 1024
seed = 5

[[vary]]
path = "supply.pressure"
kind = "normal"
mean = "50 psi_g"
standard_deviation = "2 psi_d"

[[vary]]
path = "actuator.dead_volume_1"
kind = "log_normal"
median = "2 cm^3"
factor = 1.3

[outputs]
metrics = ["rms_error", "gas_supplied"]
trajectories = ["torque"]
bands = ["torque"]
every = "50 ms"
"""
CHUNKS = 32
LONGEST = 240.0


WORKERS = """
from dask.distributed import Client, LocalCluster

def cluster():
    return Client(LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)).get_executor()
"""


def started(study: Path, out: Path, *words: str) -> "subprocess.Popen[bytes]":
    """A process that runs the study, in the folder of its file."""
    command = [sys.executable, "-c", "from ppafo.cli.main import main; raise SystemExit(main())", "sweep", str(study)]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([*command, "--out", str(out), *words], cwd=study.parent, **silent)


def finished_chunks(out: Path) -> int:
    """Number of chunks that count as finished."""
    return len(list((out / "finished").glob("chunk-*.json")))


def killed_after(study: Path, out: Path, chunks: int, delay: float, *words: str) -> int:
    """Start the study, kill it some time [s] after so many chunks are there; returns how many are there then."""
    process = started(study, out, *words)
    end = time.monotonic() + LONGEST
    while finished_chunks(out) < chunks and process.poll() is None and time.monotonic() < end:
        time.sleep(0.002)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait(LONGEST)
    return finished_chunks(out)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder of results, without the log and what may be half written: no reader takes that."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if name != "log.jsonl" and LEFT_ASIDE not in name}


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system cannot kill a process so")
@pytest.mark.parametrize("words", [(), ("--executor", "workers:cluster")])
def test_a_study_killed_again_and_again_ends_with_the_same_bytes(tmp_path: Path, words: tuple[str, ...]) -> None:
    if words:
        pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    study = tmp_path / "killed.toml"
    (tmp_path / "workers.py").write_text(WORKERS)
    study.write_text(STUDY, encoding="utf-8")
    in_peace, killed = tmp_path / "in-peace", tmp_path / "killed"
    assert started(study, in_peace).wait(LONGEST) == 0
    draw = random.Random(os.environ.get("PPAFO_TEST_SEED", "1"))
    there = [killed_after(study, killed, chunks, draw.uniform(0.0, 0.05), *words) for chunks in (1, 12)]
    assert any(0 < count < CHUNKS for count in there)
    assert there == sorted(there)
    # What a process leaves that is killed while it writes; for a day it may be another one's.
    (killed / "runs" / f".chunk-0000031.parquet{LEFT_ASIDE}0badcafe").write_bytes(b"PAR1")
    assert started(study, killed, *words).wait(LONGEST) == 0
    assert finished_chunks(killed) == CHUNKS
    assert contents(killed) == contents(in_peace)
