"""What was judged by what, with which result, and what was not: a report of a few pages.

    make validation                                                  out/validation/report.md
    python scripts/validation_report.py --out out/validation --long out

References are simulators, solvers, tools and data that the package does not contain, or its own tests where these hold
it against such. Each is run by the command that stands beside its result. One that ended is kept in the folder, and a
second call goes on from there; ``--again`` begins anew. What takes hours is read from the folders in which its command
left its result, below ``--long``; where there is none, the report says that it was not run.
"""

import argparse
import json
import os
import platform
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from ppafo.version import __version__  # noqa: E402

AGREES, DIFFERS, NOT_RUN, OPEN = "agrees", "differs", "not run", "stated"
"""``OPEN`` is a result that no limit was set for."""

LEAST = 0.90
"""Least share of 95 % intervals that may hold."""

RIGHT_MODELS = ("ideal", "white", "AR(1)", "random walk", "Student t", "hum", "drift")
"""Cells of ``scripts/interval_coverage.py`` whose device is the fitted model."""

MISSING = 2
"""Skipped tests that are named."""


@dataclass(frozen=True, slots=True)
class Line:
    """One result: what was judged, by what, what came out, what was allowed, whether it agrees, the command."""

    what: str
    reference: str
    result: str
    allowed: str
    verdict: str
    command: str


Check = Callable[[Path], list[Line]]


def against_reference(_long: Path) -> list[Line]:
    """Shipped scenarios against the reference solver."""
    from ppafo.simulation.loading import list_scenarios, load_scenario
    from ppafo.simulation.plan import plan_run
    from tests.reference.reference_solver import compare_with_reference

    found = [compare_with_reference(plan_run(load_scenario(name))) for name in list_scenarios()]
    limits = ((2e-4, "angle"), (1e-3, "worst_pressure"), (1e-4, "worst_rms"))
    worst = {name: max(float(getattr(item, name)) for item in found) for _, name in limits}
    return [
        Line(
            f"Time stepping, all {len(found)} scenarios of the package",
            "SUNDIALS CVODE, relative tolerance 1e-10, with exact flow functions and located events",
            ", ".join(f"{worst[name]:.1e} {words}" for words, name in _words(limits)),
            ", ".join(f"{limit:.0e} {words}" for (words, _), (limit, _) in zip(_words(limits), limits, strict=True)),
            AGREES if all(worst[name] <= limit for limit, name in limits) else DIFFERS,
            "make validation",
        )
    ]


def _words(limits: tuple[tuple[float, str], ...]) -> list[tuple[str, str]]:
    return list(zip(("angle", "pressure", "RMS"), (name for _, name in limits), strict=True))


def against_simulator(_long: Path) -> list[Line]:
    """Random devices against the independent simulator."""
    command = "python scripts/compare_with_reference.py --draws 330"
    done = _called(command)
    cells = [line[24:].split() for line in done.stdout.splitlines()[1:]]
    draws, sure, above, failed = (sum(int(cell[column]) for cell in cells) for column in range(4))
    worst = max((float(cell[4]) for cell in cells), default=float("nan"))
    return [
        Line(
            f"Time stepping, {draws} random devices and experiments of {len(cells)} families",
            "a simulator written from docs/equations.md alone (tests/reference)",
            f"{above} above the limits, {failed} failed, of {sure} determined; the worst at {worst:.2g} of a limit",
            "none above 2e-4 of the angle range, 1e-3 of the pressure range",
            AGREES if cells and not above and not failed else DIFFERS,
            command,
        )
    ]


def balances(_long: Path) -> list[Line]:
    """Gas and energy of the shipped scenarios."""
    from ppafo.running import simulate
    from ppafo.simulation.loading import list_scenarios

    found = [simulate(name).metrics for name in list_scenarios()]
    gas = max(
        abs(item["gas_imbalance"].value) / item["gas_supplied"].value for item in found if "gas_imbalance" in item
    )
    return [
        Line(
            "Gas: supplied less vented less stored, of the gas supplied",
            "conservation of mass",
            f"{gas:.1e}",
            "1e-10",
            AGREES if gas <= 1e-10 else DIFFERS,
            "make validation",
        )
    ]


def claims(_long: Path) -> list[Line]:
    """Published numbers."""
    command = "ppafo reproduce --study all --json"
    document = json.loads(_called(command).stdout)
    counts = {name: count for name, count in document["counts"].items() if count}
    words = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in counts.items())
    return [
        Line(
            f"{sum(counts.values())} claims of five publications",
            "their printed numbers; most rest on values that are not printed",
            words,
            "the tables in docs/the-paper.md",
            OPEN,
            command,
        )
    ]


def intervals(long: Path) -> list[Line]:
    """How often 95 % intervals of trajectory fits hold."""
    command = "python scripts/interval_coverage.py --seed 20611 --fits 40 --out out/coverage.json"
    what = "95 % intervals of trajectory fits: rig, six kinds of noise"
    file = long / "coverage.json"
    if not file.is_file():
        return [Line(what, "known truth", "", "", NOT_RUN, command)]
    rows = [row for row in json.loads(file.read_text(encoding="utf-8")) if row["cell"] in RIGHT_MODELS]
    held = [(count / row["fits"], row["cell"]) for row in rows for count in row["held"]]
    (least, name), most = min(held), max(held)[0]
    outside = sum(share < LEAST for share, _ in held)
    result = f"hold {least:.0%} ({name}) to {most:.0%}; {outside} of {len(held)} cells outside"
    return [
        Line(what, "known truth", result, f"{LEAST:.0%} or more in every cell", DIFFERS if outside else AGREES, command)
    ]


def tested(what: str, reference: str, *paths: str) -> Check:
    """Return a check that runs tests of the repository, which hold the package against something else."""
    command = f"python -m pytest -n 0 {' '.join(paths)}"

    def check(long: Path) -> list[Line]:
        report = long / ".tests.xml"
        report.parent.mkdir(parents=True, exist_ok=True)
        _called(f"{command} --no-cov -q --junitxml={report}")
        suite = ElementTree.parse(report).getroot()[0]
        report.unlink()
        bad = int(suite.get("failures", 0)) + int(suite.get("errors", 0))
        skips = [skip.get("message", "") for skip in suite.iter("skipped")]
        passed = int(suite.get("tests", 0)) - bad - len(skips)
        result = f"{passed} tests pass" + (f", {bad} fail" if bad else "")
        if skips:
            result += f"; {len(skips)} not run: {'; '.join(sorted(set(skips))[:MISSING])}"
        return [Line(what, reference, result, "all", DIFFERS if bad else AGREES if passed else NOT_RUN, command)]

    return check


def bits(_long: Path) -> list[Line]:
    """Golden bits by the compiler that is chosen here."""
    command = "python scripts/bits.py --targets here"
    done = _called(command)
    row = next((line for line in done.stdout.splitlines() if line.startswith("| this computer")), "")
    result = row.strip("| ").rpartition("| ")[2] or done.stderr.strip()
    what, reference = "Bits on this computer: runs, and 1,000 draws of each program", "golden hashes"
    verdict = NOT_RUN if not row else DIFFERS if done.returncode else AGREES
    return [Line(what, reference, result, "all", verdict, command)]


SECTIONS: Mapping[str, Mapping[str, Check]] = {
    "The numbers, against the equations": {
        "reference": against_reference,
        "simulator": against_simulator,
        "balances": balances,
        "formulas": tested(
            "Closed formulas, gas with an energy balance",
            "solutions by hand, and CVODE",
            "tests/convergence/test_closed_formulas.py",
            "tests/convergence/test_thermal_gas.py",
        ),
        "order": tested(
            "Order of convergence, and ten thousand random devices in one batch",
            "the reference solver; conservation of mass",
            "tests/convergence/test_order.py",
        ),
        "bottle": tested(
            "A walk on its bottle of CO2",
            "a simulator of its own with the properties of CoolProp",
            "tests/unit/walking/test_on_bottle.py",
        ),
    },
    "The same bits elsewhere": {
        "bits": bits,
        "c": tested("The library in C and C++", "gcc, clang", "tests/unit/exports/test_c_library.py"),
        "fmu": tested("FMUs, FMI 2.0 and 3.0", "FMPy and its checker", "tests/unit/exports/test_fmu.py"),
        "platforms": tested("FMUs for other computers", "Wine, QEMU", "tests/unit/exports/test_fmu_platforms.py"),
        "page": tested("The page that simulates", "Chromium; Python", "tests/unit/page"),
        "firmware": tested("The controller on its processor", "mspdebug", "tests/unit/processor/test_firmware.py"),
    },
    "Identification and statistics": {
        "real": tested(
            "Identification of real recordings: a cylinder and a chamber (E. Zillen, TU Delft 2021)",
            "the known area of the cylinder",
            "tests/acceptance/test_identify_real_files.py",
        ),
        "intervals": intervals,
        "audit": tested("The audit of the printed set", "arithmetic by hand", "tests/published"),
    },
    "Published studies": {"claims": claims},
}

NOT_JUDGED = (
    "No recording of the paper's device: its curves are not available, so its validation cannot be repeated.",
    "No person has worn anything that ppafo designed; the gait is prescribed and does not answer the device.",
    "No board: firmware has run on a simulator of its processor only.",
    "No graphics card: kernels for one have run on the processor.",
    "No Mac, and Windows and 64-bit ARM only as emulated.",
    "How far the gas is from that of the paper's device, whose volumes and gains are not printed.",
)
"""What nothing of this report says anything of."""


def _called(command: str, environment: Mapping[str, str] | None = None) -> "subprocess.CompletedProcess[str]":
    """Run a command of the report by the Python and from the repository of this one."""
    words = shlex.split(command)
    program = {"python": [sys.executable], "ppafo": [sys.executable, "-m", "ppafo"]}[words[0]]
    everything = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)]), **(environment or {})}
    return subprocess.run([*program, *words[1:]], cwd=ROOT, env=everything, capture_output=True, text=True, check=False)


def results(folder: Path, long: Path) -> Iterator[tuple[str, list[Line]]]:
    """Give every section with its lines; what ended before is read from the folder."""
    for section, checks in SECTIONS.items():
        lines = []
        for name, check in checks.items():
            file = folder / f"{name}.json"
            if not file.is_file():
                began = time.perf_counter()
                sys.stderr.write(f"{name}: {(check.__doc__ or section).splitlines()[0]}\n")
                found = [asdict(line) for line in check(long)]
                file.with_suffix(".part").write_text(json.dumps(found, indent=1), encoding="utf-8")
                file.with_suffix(".part").rename(file)
                sys.stderr.write(f"{name}: {time.perf_counter() - began:.0f} s\n")
            lines += [Line(**line) for line in json.loads(file.read_text(encoding="utf-8"))]
        yield section, lines


def report(sections: list[tuple[str, list[Line]]]) -> str:
    """Return the report as Markdown."""
    everything = [line for _, lines in sections for line in lines]
    counts = {verdict: sum(line.verdict == verdict for line in everything) for verdict in (AGREES, DIFFERS, NOT_RUN)}
    parts = [
        "# Validation report",
        f"ppafo {__version__}, {platform.system()} on {platform.machine()}, Python {platform.python_version()}. "
        "Made by `make validation`; each result by the command whose number stands beside it.",
        f"Of {len(everything)} lines {counts[AGREES]} agree, {counts[DIFFERS]} differ, {counts[NOT_RUN]} not run here.",
    ]
    commands: dict[str, int] = {}
    for section, lines in sections:
        rows = [_row(line, commands.setdefault(line.command, len(commands) + 1)) for line in lines]
        head = ["| What | Judged by | Result | Allowed | Verdict | By |", "|---|---|---|---|---|---|"]
        parts += [f"## {section}", "\n".join([*head, *rows])]
    parts += ["## What was not judged", "\n".join(f"- {words}" for words in NOT_JUDGED)]
    parts += ["## Commands", "\n".join(f"{number}. `{command}`" for command, number in commands.items())]
    return "\n\n".join(parts) + "\n"


def _row(line: Line, number: int) -> str:
    cells: tuple[Any, ...] = (line.what, line.reference, line.result or "-", line.allowed or "-", line.verdict, number)
    return f"| {' | '.join(str(cell).replace('|', '/') for cell in cells)} |"


def main() -> int:
    """Write the report; 1 where a line differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/validation"), help="folder of the report")
    parser.add_argument("--long", type=Path, default=Path("out"), help="where results that take hours are")
    parser.add_argument("--again", action="store_true", help="run what ended before once more")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.again:
        for file in given.out.glob("*.json"):
            file.unlink()
    sections = list(results(given.out, given.long))
    (given.out / "report.md").write_text(report(sections), encoding="utf-8")
    sys.stdout.write(f"written: {given.out / 'report.md'}\n")
    return int(any(line.verdict == DIFFERS for _, lines in sections for line in lines))


if __name__ == "__main__":
    sys.exit(main())
