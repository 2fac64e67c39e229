"""Subprocess call of a C compiler: arguments, time limit, and error message.

Loading a cached program does not import this module.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ppafo import interrupts
from ppafo.engine.compilers import OFFERED, CompilerError
from ppafo.errors import SimulationError
from ppafo.wording import one_line, reason

LONGEST_COMPILING = 300.0
"""Time limit of a compilation [s]; the longest program takes a tenth of it."""
# Between two looks at an interrupt while a compiler runs [s].
_PAUSE = 0.25
_INTERRUPTED = (-signal.SIGINT, -signal.SIGTERM)


def asked(
    line: Sequence[str],
    remedy: str = "",
    folder: str | None = None,
    scratch: Path | None = None,
) -> "subprocess.CompletedProcess[str]":
    """Run a compiler in ``folder``; return its output and exit status. Raises CompilerError if it cannot be run.

    ``scratch`` is the folder for temporary files, which remain there if the compiler is killed. A compiler that runs
    longer than ``LONGEST_COMPILING`` is stopped with its child processes, and raises
    CompilerError, with ``remedy``.
    """
    # A compiler that is killed leaves its files here, where the whole folder goes away.
    temporary = {} if scratch is None else dict.fromkeys(("TMPDIR", "TMP", "TEMP"), str(scratch))
    # zig needs a home folder, which the environment may not set.
    home: dict[str, str] = {}
    if not os.environ.get("HOME") and os.name == "posix":
        with contextlib.suppress(RuntimeError):
            home = {"HOME": str(Path("~").expanduser())}
    try:
        process = subprocess.Popen(
            line,
            cwd=folder,
            env={**os.environ, **home, **temporary},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
            # A group of its own, so that cc1 and the linker end with the driver.
            process_group=0 if os.name == "posix" else None,
        )
    except OSError as error:
        raise CompilerError(f"{line[0]} cannot be run: {reason(error)}{remedy and '; '}{remedy}") from error
    with process:
        end = time.monotonic() + LONGEST_COMPILING
        try:
            while True:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    said, complained = process.communicate(timeout=min(_PAUSE, LONGEST_COMPILING))
                    return subprocess.CompletedProcess(line, process.returncode, said, complained)
                interrupts.check()
                if time.monotonic() > end:
                    raise CompilerError(
                        f"{Path(line[0]).name} did not finish within {LONGEST_COMPILING:g} s and was stopped"
                    )
        finally:
            # Ended by an interrupt or its time, the driver's children would go on.
            if process.poll() is None or process.returncode < 0:
                with contextlib.suppress(OSError):
                    if os.name == "posix":
                        os.killpg(process.pid, signal.SIGKILL)
                    else:
                        process.kill()


def complaint(done: "subprocess.CompletedProcess[str]") -> str:
    """Return the output line of a compiler that states the error, or the exit status without output."""
    # gcc and clang say it on stderr, some wrappers on stdout.
    lines = [*done.stderr.splitlines(), *done.stdout.splitlines(), f"it returned {done.returncode}"]
    return one_line(next((text for text in lines if "error" in text), next(filter(str.strip, lines))))


def compile_library(source: str, library: Path, command: Sequence[str], flags: Sequence[str]) -> None:
    """Compile C source text into a shared library. Raises CompilerError if that fails."""
    folder = library.parent
    # Windows has no mounts without execution, nor the flag.
    if hasattr(os, "ST_NOEXEC") and os.statvfs(folder).f_flag & os.ST_NOEXEC:
        raise CompilerError(
            f"libraries in {folder.parent} cannot be loaded, because this folder is mounted noexec; set "
            "PPAFO_CACHE_DIR to a folder on another file system",
            *OFFERED,
        )
    written = folder / "program.c"
    written.write_text(source, encoding="utf-8")
    position = () if sys.platform == "win32" else ("-fPIC",)
    line = [*command, *flags, "-shared", *position, str(written), "-o", str(library), "-lm"]
    done = asked(line, scratch=folder)
    name = Path(command[0]).name
    if done.returncode in _INTERRUPTED:
        # By the same key as this process: the compiler works all the same.
        raise SimulationError(f"the compiler {name} was interrupted; try again")
    if done.returncode != 0:
        raise CompilerError(f"{name} does not compile a model: {complaint(done)}")
    if not library.is_file():
        raise CompilerError(f"the compiler {name} reported success but wrote no library; check its installation")
