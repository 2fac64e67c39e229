"""Settings that somebody made for Numba, in the environment or in a folder, are a line and no traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

RUN = ["simulate", "torque-task-proportional", "--set", "run.duration=0.02 s"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("settings", "file", "said"),
    [
        ({"NUMBA_NUM_THREADS": "0"}, "", "ppafo: Numba refuses its settings: NUMBA_... in the environment"),
        ({"NUMBA_DISABLE_JIT": "1"}, "", "ppafo: Numba compiles nothing, as DISABLE_JIT is set in its settings"),
        ({}, "{bad: [", ".numba_config.yaml in the working folder: while parsing a flow node"),
        ({"MPLBACKEND": "nonsense", "PPAFO_BACKEND": ""}, "", "ppafo: Matplotlib refuses its settings: MPLBACKEND"),
    ],
)
def test_a_setting_that_a_library_refuses_is_one_line(
    settings: dict[str, str], file: str, said: str, tmp_path: Path
) -> None:
    if file:
        pytest.importorskip("yaml")
        (tmp_path / ".numba_config.yaml").write_text(file, encoding="utf-8")
    surroundings = {**os.environ, "PPAFO_BACKEND": "numba", **settings}
    done = subprocess.run(
        [sys.executable, "-m", "ppafo", *RUN],
        cwd=tmp_path,
        env=surroundings,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
