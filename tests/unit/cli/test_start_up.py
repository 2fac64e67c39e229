"""What the command line does to answer soon, and that nothing else notices."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.compilers_here import compilers_here


def printed_by(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.skipif(not compilers_here(), reason="no compiler of C on this machine")
def test_a_run_loads_nothing_that_only_others_need(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", "c")
    words = ["simulate", "step-response", "--json", "--out", str(tmp_path / "step")]
    heavy = ("scipy.linalg", "xarray", "pandas", "matplotlib.pyplot", "jax")
    code = (
        # Where dask is installed, others look for it; what it loads is not ours.
        f"import sys\nsys.modules['dask'] = None\nfrom ppafo.cli.main import main\nassert main({words!r}) == 0\n"
        f"print([name for name in {heavy!r} if name in sys.modules])"
    )
    assert printed_by(code).splitlines()[-1] == "[]"


INTERRUPTED = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == MODULE:
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt as interrupt:
                if WRAPPED:
                    raise RuntimeError("Error calling __set_name__") from interrupt
                raise

sys.meta_path.insert(0, Interrupt())
sys.argv = ["ppafo", "doctor", "--schema", "study"]
from ppafo.__main__ import start
sys.exit(start())
"""


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("module", ["ppafo.cli.main", "argparse", "ppafo.cli.doctor"])
def test_interrupt_while_modules_load_is_one_line(module: str, wrapped: bool) -> None:
    code = INTERRUPTED.replace("MODULE", repr(module)).replace("WRAPPED", repr(wrapped))
    done = subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path[:] = {sys.path!r}{code}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 130
    assert done.stderr == "ppafo: interrupted; no file is incomplete\n"
    assert done.stdout == ""


def test_package_can_be_started_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "ppafo", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("ppafo ")


CLOSED = """
import os, sys
for number in NUMBERS:
    os.close(number)
os.execv(sys.executable, [sys.executable, "-m", "ppafo", *sys.argv[1:]])
"""


@pytest.mark.skipif(os.name == "nt", reason="streams are inherited in another way there")
@pytest.mark.parametrize("numbers", [(1,), (2,), (0, 1, 2)], ids=["output", "errors", "all"])
def test_closed_streams_take_neither_the_result_nor_the_exit_code(numbers: tuple[int, ...], tmp_path: Path) -> None:
    code = CLOSED.replace("NUMBERS", repr(numbers))

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)

    done = run("sets", "list", "--out", str(tmp_path / "sets"))
    assert (done.returncode, done.stderr) == (0, "")
    written = (tmp_path / "sets" / "sets.txt").read_text(encoding="utf-8")
    assert done.stdout == ("" if 1 in numbers else written)
    refused = run("sets", "nothing")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert len(refused.stderr.splitlines()) == (2 not in numbers)
