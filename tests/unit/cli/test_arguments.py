"""Words that the command line does not understand, and output that nobody can take."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ppafo.arguments.reading import whole_number
from ppafo.cli.main import main
from ppafo.parameters.bottles.bottle import list_bottles
from ppafo.walking import list_walks

FULL = Path("/dev/full")


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("simulate", ("step-response", "torque-task-solenoid")),
        ("walk", tuple(list_walks())),
        ("bottle", tuple(list_bottles())),
        ("tune", ("pid-gains",)),
        ("design", ("push-off",)),
        ("rig simulate", ("step-response", "vane-leak")),
        ("sweep", ("pressure-and-area",)),
        ("sets", ("ppafo2011", "ppafo2011-printed")),
        ("gait", ("falisse2019-subject1",)),
    ],
)
def test_what_comes_with_the_package_is_listed_by_name_with_what_it_is(
    words: str, names: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    listing = [*words.split(), "list" if words in ("sets", "gait") else "--list"]
    assert main(listing) == 0
    printed = capsys.readouterr().out
    assert all(re.search(rf"^ *{name} +\S", printed, re.MULTILINE) for name in names)
    assert main([*listing, "--json"]) == 0
    rows = next(value for value in json.loads(capsys.readouterr().out).values() if isinstance(value, list))
    assert {row["name"] for row in rows} >= set(names)


@pytest.mark.skipif(not FULL.exists(), reason="there is no full device here")
@pytest.mark.parametrize(
    "words",
    [["sets", "audit", "ppafo2011-printed"], ["sets", "list", "--json"], ["--help"], ["--version"]],
    ids=" ".join,
)
def test_output_that_cannot_be_written_is_one_line_and_exit_code_2(words: list[str]) -> None:
    command = [sys.executable, "-c", "import sys; from ppafo.cli.main import main; sys.exit(main())", *words]
    with FULL.open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.stderr == "ppafo: cannot write to standard output: no space left on device\n"
    assert done.returncode == 2


@pytest.mark.parametrize(
    "words",
    [
        ["validate", "ppafo2011", "bench-\udcff.csv", "--out", "out"],
        ["simulate", "step-response", "--out", "out-\udcff"],
        ["sweep", "pressure-and-area", "--out", "out-\udcff"],
    ],
)
def test_name_that_is_not_utf_8_is_refused_before_anything_runs(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "is not valid UTF-8; rename the file or folder" in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


MANY = "9" * 5000


@pytest.mark.parametrize(
    "words",
    [
        ["compare", "step-response", "--draws", MANY],
        ["sweep", "pressure-and-area", "--threads", MANY],
        ["sweep", "pressure-and-area", "--threads", "1__0x"],
        ["design", "torque-task", "--seed", MANY],
        ["walk", "--set", f"sensors.seed={MANY}"],
        ["simulate", "step-response", "--set", f"{'a' * 100_000}=1"],
    ],
    ids=lambda words: " ".join(words)[:40],
)
def test_number_or_key_without_end_is_one_line_that_can_be_read(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert len(told) < 1100
    assert list(tmp_path.iterdir()) == []


def test_count_may_have_its_digits_in_groups_but_not_as_python_refuses_them(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert whole_number("1__000") == whole_number("1_000") == whole_number("1,000") == 1000
    assert main(["sweep", "pressure-and-area", "--draws", "1__0"]) == 2
    assert main(["sweep", "pressure-and-area", "--threads", "0"]) == 2
    assert "--threads 0: must be a whole number, 1 or more" in capsys.readouterr().err
