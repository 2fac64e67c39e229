"""Samples that processors are compared with reach every condition of the controllers in C both ways: MC/DC by clang.

Each condition has been true and false, and each of a decision of several has, on its own, changed what the decision
came to. The samples are the first of every comparison with the same seed, however long that is.
"""

import json
import os
import shutil
import subprocess
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import pytest

from ppafo.processor.controller import fixed_point_controller
from ppafo.processor.firmware import firmware
from ppafo.processor.simulated import EPISODE, drawn_readings
from tests.unit.exports.test_firmware import SCENARIOS, scenario_of

SAMPLES = 4000
ENDINGS = ("-19", "-20", "-21", "-18", "")


class Tools(NamedTuple):
    """Programs of LLVM of one version that measures MC/DC."""

    clang: str
    profdata: str
    cov: str


def tools() -> Tools | None:
    """Those of this machine; clang measures MC/DC from version 18 on."""
    for ending in ENDINGS:
        found = [shutil.which(f"{name}{ending}") for name in ("clang", "llvm-profdata", "llvm-cov")]
        if None in found:
            continue
        said = subprocess.run([str(found[0]), "-dumpversion"], capture_output=True, text=True, check=True).stdout
        if int(said.partition(".")[0]) >= 18:
            return Tools(*map(str, found))
    return None


TOOLS = tools()
pytestmark = pytest.mark.skipif(
    TOOLS is None, reason="no clang with MC/DC on this machine: Debian has clang-19, llvm-19"
)
SMALL = """\
#include <stdbool.h>
#include <stdio.h>
static bool both(int one, int other)
{
    return one > 0 && other > 0;
}
int main(void)
{
    int one, other;
    while (scanf("%d %d", &one, &other) == 2) {
        printf("%d\\n", both(one, other) ? 1 : 0);
    }
    return 0;
}
"""


class Reached(NamedTuple):
    """What was found in the functions of a file: conditions, decisions of several, and what was not reached of both."""

    conditions: int
    decisions: int
    missing: tuple[str, ...]


def reached(sources: tuple[str, ...], of: str, folder: Path, given: str) -> Reached:
    """What some input reaches in the static functions of a file, as the counters of clang say."""
    assert TOOLS is not None
    flags = ["-std=c99", "-O0", "-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc"]
    subprocess.run([TOOLS.clang, *flags, *sources, "-o", "counted"], cwd=folder, check=True)
    environment = {**os.environ, "LLVM_PROFILE_FILE": "counted.profraw"}
    subprocess.run(
        ["./counted"], cwd=folder, input=given, text=True, stdout=subprocess.DEVNULL, env=environment, check=True
    )
    subprocess.run([TOOLS.profdata, "merge", "counted.profraw", "-o", "counted.profdata"], cwd=folder, check=True)
    said = subprocess.run(
        [TOOLS.cov, "export", "counted", "-instr-profile=counted.profdata"],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    functions = json.loads(said.stdout)["data"][0]["functions"]
    conditions, decisions, missing = 0, 0, []
    for item in functions:
        if not item["name"].startswith(f"{of}:"):
            continue
        for line, column, _, _, is_true, is_false, *_ in item["branches"]:
            conditions += 1
            missing += [
                f"{item['name']} {line}:{column} never {way}" for way, n in ((1, is_true), (0, is_false)) if not n
            ]
        for line, column, *_, pairs in item["mcdc_records"]:
            decisions += 1
            missing += [
                f"{item['name']} {line}:{column} condition {n} decides nothing"
                for n, is_in in enumerate(pairs)
                if not is_in
            ]
    return Reached(conditions, decisions, tuple(missing))


@pytest.mark.parametrize("law", SCENARIOS)
def test_the_samples_reach_every_condition_both_ways_and_each_decides_alone(law: str, tmp_path: Path) -> None:
    scenario = scenario_of(law)
    for name, content in firmware(scenario).items():
        (tmp_path / name).write_bytes(content)
    found = reached(("host.c", "controller.c"), "controller.c", tmp_path, samples_of(law, SAMPLES))
    assert found.missing == ()
    # Readings at either end, their three sensors, and what the law itself asks.
    assert found.conditions >= (12 if law.startswith("pid") else 7)
    assert found.decisions == 2


def test_a_few_samples_leave_conditions_out(tmp_path: Path) -> None:
    for name, content in firmware(scenario_of("pid")).items():
        (tmp_path / name).write_bytes(content)
    found = reached(("host.c", "controller.c"), "controller.c", tmp_path, "2000 1500 1500\n")
    assert any("never" in line for line in found.missing)
    assert any("decides nothing" in line for line in found.missing)


@pytest.mark.parametrize(
    ("given", "missing"),
    [
        ("1 1\n0 1\n1 0\n", []),
        ("1 1\n0 1\n", ["5:23 never 0", "5:12 condition 1 decides nothing"]),
        ("0 1\n0 0\n", ["5:12 never 1", "5:23 never 1", "5:23 never 0", "5:12 condition 0", "5:12 condition 1"]),
    ],
)
def test_a_small_decision_is_measured_as_one_counts_it_by_hand(given: str, missing: list[str], tmp_path: Path) -> None:
    (tmp_path / "small.c").write_text(SMALL, encoding="utf-8")
    found = reached(("small.c",), "small.c", tmp_path, given)
    assert (found.conditions, found.decisions) == (2, 1)
    assert len(found.missing) == len(missing)
    assert all(wanted in line for wanted, line in zip(missing, found.missing, strict=True))


def samples_of(law: str, count: int) -> str:
    """Drawn samples as the program for this computer takes them."""
    top = int(fixed_point_controller(scenario_of(law)).limits.top)
    lines = []
    for number, readings in enumerate(drawn_readings(top, count, 1)):
        lines += ["begin"] if number % EPISODE == 0 else []
        lines.append(" ".join(map(str, readings)))
    return "\n".join([*lines, ""])


def test_the_first_samples_are_those_of_every_longer_comparison() -> None:
    longer = drawn_readings(4095, 100_000, 1)
    assert list(drawn_readings(4095, SAMPLES, 1)) == list(islice(longer, SAMPLES))
