"""A release: wheel and source archive, made twice, checked, and installed where nothing of the repository is.

    make dist

Writes both archives into ``dist/``, with ``ppafo.cdx.json``, the bill of materials of the environment that the wheel
was installed into. Builds what is committed, dated as the commit. Says what does not hold in one line each, and ends
with 1; needs the extra ``release``.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import venv
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"
LARGEST = 4_000_000
"""Bytes that an archive may have."""

TRIED = (
    ("--version",),
    ("simulate", "step-response", "--out", "step"),
    ("simulate", "torque-task-solenoid", "--set", "supply.pressure=80 psi_g", "--out", "task"),
    ("workbench", "--out", "page.html"),
    ("new", "scenario", "mine"),
    ("simulate", "mine.toml", "--out", "mine"),
    ("new", "example", "write-a-scenario"),
    ("simulate", "write-a-scenario/stairs.toml", "--out", "stairs"),
)
"""What a new user tries, in an empty folder."""


def main() -> int:
    """Make and check the archives; 1 where something does not hold."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        first, second = _build(folder / "first"), _build(folder / "second")
        complaints = [*_differing(first, second), *_too_large(first), *_complaints_of_checkers(first)]
        wheel = next(path for path in first if path.suffix == ".whl")
        python = _install(wheel, folder / "environment")
        complaints += _failures(python, folder / "empty")
        shutil.rmtree(DIST, ignore_errors=True)
        DIST.mkdir()
        for path in first:
            shutil.copy(path, DIST)
        _run(["cyclonedx-py", "environment", str(python), "--output-reproducible", "-o", str(DIST / "ppafo.cdx.json")])
    for path in sorted(DIST.iterdir()):
        content = path.read_bytes()
        sys.stdout.write(f"{path.name}  {len(content) / 1e6:.2f} MB  sha256 {hashlib.sha256(content).hexdigest()}\n")
    sys.stdout.writelines(f"{complaint}\n" for complaint in complaints)
    return int(bool(complaints))


def _build(folder: Path) -> list[Path]:
    """Build both archives from what is committed, in a folder of its own."""
    source = folder / "source"
    source.mkdir(parents=True)
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x"], cwd=source, input=archive, check=True)
    date = subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=ROOT, capture_output=True, text=True, check=True)
    env = {**os.environ, "SOURCE_DATE_EPOCH": date.stdout.strip()}
    made = folder / "made"
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(made)]
    subprocess.run(command, cwd=source, env=env, check=True, capture_output=True)
    return sorted(made.iterdir())


def _differing(first: list[Path], second: list[Path]) -> Iterator[str]:
    for one, other in zip(first, second, strict=True):
        if one.read_bytes() != other.read_bytes():
            yield f"{one.name}: two builds of one commit differ"


def _too_large(archives: list[Path]) -> Iterator[str]:
    for path in archives:
        if path.stat().st_size > LARGEST:
            inside = _largest_inside(path) if path.suffix == ".gz" else ""
            yield f"{path.name}: {path.stat().st_size:,} bytes, at most {LARGEST:,} are allowed{inside}"


def _largest_inside(path: Path) -> str:
    with tarfile.open(path) as archive:
        members = sorted(archive.getmembers(), key=lambda member: -member.size)[:3]
    return f"; largest are {', '.join(f'{member.name} ({member.size:,})' for member in members)}"


def _complaints_of_checkers(archives: list[Path]) -> Iterator[str]:
    names = [str(path) for path in archives]
    wheels = [name for name in names if name.endswith(".whl")]
    for command in (["twine", "check", "--strict", *names], ["check-wheel-contents", *wheels]):
        done = _run(command)
        if done.returncode:
            yield f"{command[0]}: {' '.join(done.stdout.split())}"


def _install(wheel: Path, folder: Path) -> Path:
    """Install the wheel with what it needs into an empty environment; returns its Python."""
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"{wheel}[workbench]"]
    subprocess.run(command, check=True, cwd=folder, stderr=subprocess.PIPE)
    return python


def _failures(python: Path, folder: Path) -> Iterator[str]:
    """What of the tried commands fails in an empty folder, without anything of the repository on the path."""
    folder.mkdir()
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    env |= {"PPAFO_CACHE_DIR": str(folder / "programs")}
    for words in TRIED:
        command = [str(python.parent / "ppafo"), *words]
        done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)
        if done.returncode:
            yield f"ppafo {' '.join(words)}: exit code {done.returncode}: {done.stderr.strip()[-300:]}"


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a program of this environment, both of its streams as one."""
    words = [str(Path(sys.executable).parent / command[0]), *command[1:]]
    return subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)


if __name__ == "__main__":
    sys.exit(main())
