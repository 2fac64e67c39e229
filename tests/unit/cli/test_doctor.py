"""``ppafo doctor`` shows, compiles and removes the compiled models."""

import json
import shutil
import subprocess
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import pytest

from ppafo import golden_bits
from ppafo.cli import doctor
from ppafo.cli.main import completion_script, main
from ppafo.engine import loading
from ppafo.engine.cache import entries
from ppafo.engine.loading import load_generated
from ppafo.loading import load_scenario
from ppafo.simulation import simulate
from tests.compilers_here import first_compiler

SOURCE = '@entry("void(float64[::1])")\ndef thrice(x):\n    x[0] = 3.0 * x[0]\n'


def test_cache_is_shown_and_cleared(fresh_cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    load_generated(SOURCE, first_compiler())
    assert main(["doctor", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["folder"] == str(fresh_cache)
    assert shown["compilers"] == [compiler.name for compiler in loading.compilers_to_try()]
    assert shown["not_used"] is None
    assert [item["name"].startswith(f"ppafo_{first_compiler().name}_") for item in shown["programs"]] == [True]
    assert shown["size"] == shown["programs"][0]["size"] > 1000
    assert main(["doctor", "--clear", "--json"]) == 0
    cleared = json.loads(capsys.readouterr().out)
    assert cleared["freed"] == shown["size"]
    assert cleared["programs"] == []
    assert not fresh_cache.exists()


def test_cache_says_why_a_folder_is_not_used(fresh_cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fresh_cache.mkdir()
    fresh_cache.chmod(0o777)
    assert main(["doctor"]) == 0
    assert "not used: other users can write into" in capsys.readouterr().out
    assert main(["doctor", "--warm"]) == 2
    assert "cannot be stored: other users can write into" in capsys.readouterr().err


@pytest.mark.usefixtures("fully_compiled")
def test_model_that_was_compiled_for_later_is_the_one_that_a_run_uses(fresh_cache: Path) -> None:
    simulate.compile_models([load_scenario("torque-task-proportional")])
    simulate.simulate(load_scenario("torque-task-proportional", ["run.duration=10 ms"]))
    assert not [path for path, _, _ in entries(fresh_cache) if "_quick_" in path.name]


def test_bits_are_compared_with_the_golden_ones_and_another_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("swing-foot", "torque-task-proportional")
    monkeypatch.setattr(golden_bits, "names", lambda: names)
    assert main(["doctor", "--bits", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["same_bits"] == dict.fromkeys(names, True)
    golden = dict(golden_bits.golden_hashes())
    golden["swing-foot"] = {**golden["swing-foot"], "run": "0" * 16}
    monkeypatch.setattr(golden_bits, "golden_hashes", lambda: golden)
    assert main(["doctor", "--bits"]) == 1
    said = capsys.readouterr().out
    assert "1 of 2 runs" in said
    assert "swing-foot: different bits" in said


@pytest.mark.parametrize("name", doctor.FORMATS)
def test_the_schema_of_each_format_is_printed_and_valid(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--schema", name]) == 0
    schema = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["title"].startswith("ppafo ")


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("wal", ["walk"]),
        ("sets aud", ["audit"]),
        ("sets audit ppafo2011-", ["ppafo2011-printed"]),
        ("simulate --check torque-task-so", ["torque-task-solenoid"]),
        ("simulate --ch", ["--check"]),
        ("doctor --bi", ["--bits"]),
    ],
)
def test_a_line_is_completed_in_bash(line: str, found: list[str]) -> None:
    words = ["ppafo", *line.split()]
    typed = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _ppafo; echo ${{COMPREPLY[@]}}"
    script = f"{completion_script('bash')}\n{typed}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == found
