"""A process that is killed while it writes a result leaves the earlier one or the new one, and never a mixture."""

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ppafo.storage.files import write_file
from ppafo.storage.owned_folder import write_marked_folder

WRITER = """
import sys
from itertools import count
from pathlib import Path
from ppafo.storage.files import write_file
from ppafo.storage.owned_folder import write_marked_folder

folder = Path(sys.argv[1])
for number in count():
    content = str(number % 10).encode() * 100_000
    write_marked_folder(folder / "result", {name: content for name in ("a", "b", "c")}, "test")
    write_file(folder / "file", content)
    if number == 1:
        print("ready", flush=True)
"""
ROUNDS = 12


def is_whole(folder: Path) -> bool:
    """Whether a result has all of its files, of one and the same writing."""
    document = json.loads((folder / "ppafo.json").read_text())
    files = {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "ppafo.json"}
    return document["files"] == ["a", "b", "c"] == sorted(files) and len(set(files.values())) == 1


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system cannot kill a process so")
def test_killed_writer_leaves_a_whole_result_and_the_next_one_finds_its_place(tmp_path: Path) -> None:
    moment = random.Random(2026)
    for _ in range(ROUNDS):
        process = subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path)], stdout=subprocess.PIPE)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(moment.uniform(0.0, 0.02))
        process.kill()
        process.communicate()
        results = [path for path in tmp_path.iterdir() if path.name == "result" or ".replaced-" in path.name]
        assert results
        assert all(is_whole(path) for path in results if path.name == "result")
        assert any(is_whole(path) for path in results)
        assert len(set((tmp_path / "file").read_bytes())) == 1
        assert (tmp_path / "file").stat().st_size == 100_000
    write_marked_folder(tmp_path / "result", {"a": b"last"}, "test")
    write_file(tmp_path / "file", b"last")
    assert sorted(path.name for path in (tmp_path / "result").iterdir()) == ["a", "ppafo.json"]
