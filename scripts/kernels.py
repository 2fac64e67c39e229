"""Kernels of linear algebra that this computer runs, and whether what fits and searches prints the same by each.

``python scripts/kernels.py`` prints their names, the oldest first; ``python scripts/kernels.py KERNEL KERNEL ...`` runs
commands by each in a process of its own, and fails if words differ, or numbers by more than one in the last digit.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

KERNELS = ("Nehalem", "Sandybridge", "Haswell", "Zen", "SkylakeX")
"""Kernels of OpenBLAS for processors of x86-64, the oldest first; NumPy and SciPy bring each."""
_ASK = """
import numpy, scipy.linalg, threadpoolctl
scipy.linalg.qr(numpy.random.default_rng(1).normal(size=(300, 20)) @ numpy.ones((20, 20)))
print(*{library["architecture"] for library in threadpoolctl.threadpool_info()})
"""
_BENCH = (
    "--preset ideal-laboratory --set motion.kind=free --set foot_plate.inertia='10 g m^2' --set run.duration='0.6 s'"
)
_COMMANDS = (
    f"rig simulate step-response --seed 1 {_BENCH} --out fit-trajectories/there",
    f"rig simulate step-response --seed 2 {_BENCH} --set controller.command=-1 --set motion.angle='130 deg' --set "
    "initial.pressure_1='50 psi_g' --set initial.pressure_2=atmosphere --out fit-trajectories/back",
    "identify fit-trajectories/problem.toml",
    "validate ppafo2011 fit-trajectories/there/step-response.csv --motion measured",
    "tune pid-gains --set run.duration=1s",
    "sensitivity torque-task-uncertainty --configuration solenoid --samples 64",
)
"""Commands of the package, of which the first make the recordings of the others."""
_NUMBER = re.compile(r"[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")


def kernels() -> list[str]:
    """Return the kernels that this computer runs, the oldest first; one for two names that are the same."""
    found = dict[str, str]()
    for kernel in KERNELS:
        asked = _run(kernel, [sys.executable, "-c", _ASK], Path.cwd())
        # An instruction that the processor lacks ends the process.
        if asked.returncode == 0:
            found.setdefault(asked.stdout.strip(), kernel)
    return list(found.values())


def printed(kernel: str, folder: Path) -> list[str]:
    """Return what each command prints in a folder by a kernel."""
    texts = []
    program = [sys.executable, "-m", "ppafo"]
    for command in ("new example fit-trajectories", *_COMMANDS):
        done = _run(kernel, [*program, *shlex.split(command)], folder)
        if done.returncode not in (0, 1) or not done.stdout:
            raise SystemExit(f"{kernel}: ppafo {command}\n{done.stderr}")
        texts.append(done.stdout)
    return texts


def difference(first: str, second: str) -> str:
    """Return the first two lines that differ by more than one in the last digit of a number; empty if none do."""
    for line, other in zip(first.splitlines(), second.splitlines(), strict=False):
        numbers, others = _NUMBER.findall(line), _NUMBER.findall(other)
        words = [" ".join(_NUMBER.sub("0", text).split()) for text in (line, other)]
        if words[0] != words[1] or any(not _is_near(*pair) for pair in zip(numbers, others, strict=True)):
            return f"{line}\n{other}"
    return "" if len(first.splitlines()) == len(second.splitlines()) else "one has more lines"


def _is_near(first: str, second: str) -> bool:
    """Return whether two numbers as text differ by at most one in the last digit of the one with fewer digits."""
    unit = 0.0
    for text in (first, second):
        digits, _, power = text.replace(",", "").partition("e")
        unit = max(unit, 10.0 ** (int(power or 0) - len(digits.partition(".")[2])))
    return abs(float(first.replace(",", "")) - float(second.replace(",", ""))) <= 1.001 * unit


def _run(kernel: str, command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    surroundings = {**os.environ, "OPENBLAS_CORETYPE": kernel}
    return subprocess.run(command, cwd=folder, env=surroundings, capture_output=True, text=True, check=False)


def main(chosen: list[str]) -> int:
    """Print the kernels of this computer, or compare what commands print by the kernels that were chosen."""
    if not chosen:
        print(*kernels())
        return 0
    with tempfile.TemporaryDirectory() as folder:
        outputs = []
        for kernel in chosen:
            (Path(folder) / kernel).mkdir()
            outputs.append(printed(kernel, Path(folder) / kernel))
    differing = 0
    for kernel, texts in zip(chosen[1:], outputs[1:], strict=True):
        for command, first, second in zip(_COMMANDS, outputs[0][1:], texts[1:], strict=True):
            lines = difference(first, second)
            differing += bool(lines)
            print(f"{chosen[0]} and {kernel}: ppafo {command.split(' --')[0]}: {lines or 'the same'}")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
