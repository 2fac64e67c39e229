"""``ppafo doctor`` shows, compiles and removes the compiled models."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.engine import loading
from ppafo.engine.cache import load_generated
from ppafo.engine.numba_compiler import NumbaCompiler
from ppafo.loading import load_scenario
from ppafo.simulation import simulate
from ppafo.simulation.scenario import Scenario

SOURCE = 'from numba import njit\n\n\n@njit("float64(float64)", cache=True)\ndef thrice(x):\n    return 3.0 * x\n'


def test_cache_is_shown_and_cleared(fresh_cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    load_generated(SOURCE, NumbaCompiler())
    assert main(["doctor", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["folder"] == str(fresh_cache)
    assert shown["compilers"] == [compiler.name for compiler in loading.compilers_to_try()]
    assert shown["not_used"] is None
    assert [item["name"].startswith("ppafo_numba_") for item in shown["programs"]] == [True]
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
    assert "not used: others can write into" in capsys.readouterr().out
    assert main(["doctor", "--warm"]) == 2
    assert "cannot be kept: others can write into" in capsys.readouterr().err


def test_warming_compiles_every_scenario_of_the_package(
    fresh_cache: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from ppafo.simulation.loading import list_scenarios

    asked: list[Scenario] = []
    monkeypatch.setattr(simulate, "compile_models", asked.extend)
    assert main(["doctor", "--warm"]) == 0
    assert [scenario.name for scenario in asked] == list(list_scenarios())
    assert "programs: 0" in capsys.readouterr().out


def test_model_that_was_compiled_for_later_is_the_one_that_a_run_uses(fresh_cache: Path) -> None:
    loading._load_by.cache_clear()
    simulate.compile_models([load_scenario("torque-task-proportional")])
    wanted = loading._load_by.cache_info().misses
    simulate.simulate(load_scenario("torque-task-proportional", ["run.duration=10 ms"]))
    assert loading._load_by.cache_info().misses == wanted == 1
