"""What a command prints for a person to paste is taken again: overrides with their values, units and paths of files."""

import re
import shlex
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from ppafo.cli.command_line import CommandGroup
from ppafo.cli.commands import COMMANDS
from ppafo.cli.main import main
from ppafo.control.catalog import CONTROLLERS
from ppafo.errors import PpafoError
from ppafo.loading import list_all_scenarios, load_scenario
from ppafo.model.declaration import Quantity
from ppafo.parameters.bottles.bottle import PATHS
from ppafo.parameters.parameter_set import in_first_unit
from ppafo.simulation.numbers import declared_numbers
from ppafo.storage.comma_separated import parse_header
from ppafo.units import check_unit, parse_quantity

STUDY = """
schema_version = 1
name = "noise"
configurations = [{ name = "held", scenario = "pressure-loop", overrides = ["run.duration=0.2 s"] }]
sample = { method = "sobol", runs = 4 }
vary = [
    { path = "sensors.pressure_noise", kind = "uniform", minimum = "0.1 psi_d", maximum = "0.5 psi_d" },
    { path = "valve.area", kind = "uniform", minimum = "9 mm^2", maximum = "9.5 mm^2" },
]
outputs = { metrics = ["rms_pressure_1_error", "gas_supplied"] }
"""
TUNING = """
schema_version = 1
name = "few"
scenario = "pressure-loop"
overrides = ["run.duration=0.2 s"]
search = [{ path = "sensors.pressure_resolution", minimum = "0.05 psi_d", maximum = "0.5 psi_d" }]
objective = [{ metric = "rms_pressure_1_error" }]
constraints = [{ metric = "rms_pressure_1_error", at_most = "90 psi_d" }]
effort = { starts = 1, generations = 2, candidates_per_gain = 5, seed = 1 }
"""
DESIGN = """
schema_version = 1
name = "small"
scenario = "torque-task-proportional"
bottles = ["paper-co2-9oz"]
profile = { time = ["0 s", "0.2 s", "0.4 s"], torque = ["0 N m", "2 N m", "0 N m"] }
use = { repetitions = 5 }
limits = { rms_error = "20 %" }
valves = { paper = {} }
pressure = { lowest = "40 psi_g", highest = "60 psi_g" }
"""
FILES = {"noise.toml": STUDY, "few.toml": TUNING, "small.toml": DESIGN}
NOISE = "--set 'sensors.pressure_noise=0.1 psi_d'"
WITH_RANGE = "--vary 'sensors.pressure_noise=0.05..0.5 psi_d' --such-that 'rms_pressure_1_error <= 9 psi_d' --grid 3"
LINES = {
    "reproduce": ["reproduce --study jrrd-2011 --out out"],
    "new": ["new set mine --from ppafo2011", "new scenario hold --from pressure-loop"],
    "simulate": [
        f"simulate pressure-loop {NOISE} --out out",
        "simulate torque-task-solenoid --set 'reference.level=4 N m' --out low",
        "simulate swing-foot --set controller.kind=constant --set controller.command=0 --out swing",
    ],
    "workbench": ["workbench --out page.html"],
    "sets list": ["sets list"],
    "sets show": ["sets show ppafo2011"],
    "sets audit": ["sets audit cylinder-lever --all", "sets audit ppafo2011 --set 'supply.pressure=5000 psi_g'"],
    "rig simulate": ["rig simulate step-response --preset ideal-laboratory --seed 1 --out bench"],
    "identify": ["identify measured-cylinder/chamber.toml --out out"],
    "validate": ["validate ppafo2011 bench/step-response.csv --motion leg --out out"],
    "sweep": ["sweep noise.toml --out out"],
    "compare": [
        f"compare pressure-loop torque-task-solenoid --task 'low:run.duration=0.2 s' {NOISE} --draws 32 --out out"
    ],
    "sensitivity": ["sensitivity noise.toml --metric gas_supplied --samples 64 --out out"],
    "find": [f"find pressure-loop {WITH_RANGE} --highest --out out"],
    "tune": ["tune few.toml --out out"],
    "linearise": ["linearise torque-task-proportional --set 'reference.level=3 N m' --out out"],
    "design": ["design small.toml --out out"],
    "bottle": ["bottle --gas-per-stride '0.3 g' --set 'regulator.pressure_margin=5 psi_d' --out out"],
    "gait list": ["gait list"],
    "gait show": ["gait show falisse2019-subject1"],
    "gait import": ["gait import walk.csv --body-mass '62 kg' --speed '1.33 m/s' --name mine --out out"],
    "gait record": ["gait record falisse2019-subject1 --strides 10 --out walk.csv"],
    "walk": ["walk proportional --minutes 0.1 --set 'controller.torque_gain=20 1/(N m)' --out out"],
    "export c": ["export c torque-task-proportional --out out"],
    "export firmware": ["export firmware torque-task-proportional --out out"],
    "export fmu": ["export fmu torque-task-proportional --interface plant --out out"],
    "export opensim": ["export opensim proportional --set wearer.keeps_gait=1 --out out"],
    "export figure": ["export figure out --width '84 mm'"],
    "doctor": ["doctor"],
}
"""One run of every command, in cases that print much; what a run needs stands in ``BEFORE``."""
BEFORE = {
    "validate": LINES["rig simulate"],
    "identify": ["new example measured-cylinder"],
    "gait import": LINES["gait record"],
    "export figure": [f"simulate pressure-loop {NOISE} --out out"],
}
ASSIGNED = re.compile(r"(?<![\w.])([a-z_]\w*(?:\.\w+)+) ?= ?([+-]?\d[\d.]*(?:[eE][+-]?\d+)?)((?: ?[\w%^/()*.-]+){0,5})")
TEXTS = {".txt", ".toml", ".md", ".json"}


@cache
def declared() -> dict[str, set[Quantity]]:
    """Numbers of all scenarios that come with the package, of all laws and of bottles, by path.

    A gain has several declarations, by the quantity that its law controls.
    """
    numbers: dict[str, set[Quantity]] = {}
    scenarios = [load_scenario(name) for name in list_all_scenarios()]
    tables = [declared_numbers(scenario) for scenario in scenarios]
    tables += [dict(scenario.motion.motion_kind.quantities(scenario)) for scenario in scenarios]
    tables += [{f"controller.{item.name}": item for item in law.quantities} for law in CONTROLLERS.values()]
    for table in (*tables, PATHS):
        for path, quantity in table.items():
            numbers.setdefault(path, set()).add(quantity)
    return numbers


def is_taken(path: str, value: str) -> bool:
    """Whether a number at a path takes a value with its unit."""
    for quantity in declared()[path]:
        with suppress(PpafoError):
            in_first_unit(quantity, lambda unit: parse_quantity(value, unit))
            return True
    return False


def unit_before(words: str) -> str:
    """The longest unit with which some words begin, which may be none."""
    parts = words.split()
    for count in range(len(parts), 0, -1):
        head = " ".join(parts[:count]).rstrip(".,;:")
        for unit in (head, head.rstrip(")")):
            try:
                check_unit(unit)
            except PpafoError:
                continue
            return unit
    return ""


def refused_values(text: str) -> Iterator[str]:
    """Numbers that a text assigns to a path and that this path refuses."""
    for match in ASSIGNED.finditer(text):
        path = re.sub(r"^(?:device\.)?valves\.\w+\.", "valve.", match[1])
        if path in declared():
            value = f"{match[2].rstrip('.')} {unit_before(match[3])}".rstrip()
            if not is_taken(path, value):
                yield match[0]


def refused_commands(text: str, scenario: str) -> Iterator[str]:
    """Printed lines of a command line whose overrides its scenario, or the one that was run, refuses."""
    for line in text.splitlines():
        if line.startswith(("ppafo simulate", "ppafo walk", "--set")):
            words = shlex.split(line)
            overrides = [after for word, after in pairwise(words) if word == "--set"]
            try:
                load_scenario(words[2] if words[0] == "ppafo" else scenario, overrides)
            except PpafoError as error:
                yield f"{line}: {error}"


def refused_files(text: str, folder: Path) -> Iterator[str]:
    """Printed names of written files that are not there, and written tables whose units are refused."""
    for match in re.finditer(r"^written: ([^,;\n(]+?)(?: \(([^)]*)\))?(?:;.*|,.*)?$", text, re.MULTILINE):
        named = [name for name in (match[2] or "").split(", ") if re.fullmatch(r"\S+[.]\S+", name)]
        for name in ("", *named):
            if not (folder / match[1].strip() / name).exists():
                yield match[0]
    for table in folder.rglob("recording.csv"):
        head = next(line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
        parse_header(head.split(","))


def names_of_commands() -> list[str]:
    """Every command of the package, a group by its actions."""
    return [
        f"{name} {action}".rstrip()
        for name, entry in COMMANDS.items()
        for action in (entry.actions if isinstance(entry, CommandGroup) else ("",))
    ]


def test_every_command_has_a_run_here() -> None:
    assert sorted(LINES) == sorted(names_of_commands())


@pytest.mark.parametrize("name", LINES)
def test_what_a_command_prints_for_input_is_taken_again(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for file, text in FILES.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    for line in BEFORE.get(name, []):
        assert main(shlex.split(line)) == 0
    capsys.readouterr()
    for line in LINES[name]:
        words = shlex.split(line)
        assert main(words) in (0, 1)
        printed = "".join(capsys.readouterr())
        files = [path for path in tmp_path.rglob("*") if path.suffix in TEXTS and path.stat().st_size < 2_000_000]
        texts = [printed, *(path.read_text(encoding="utf-8") for path in files)]
        refused = [fault for text in texts for fault in refused_values(text)]
        refused += [
            *refused_commands(printed, words[-1] if len(words) == 1 else words[1]),
            *refused_files(printed, tmp_path),
        ]
        assert refused == []
