"""Golden bits: every scenario and walk has its hash, a part of them is found here, and another number is named."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.engine.lanes import BatchResult, run_batch
from ppafo.errors import SimulationError
from ppafo.questions.bits import solve
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
CHEAP = "torque-task-proportional"


def test_every_scenario_and_walk_has_golden_hashes_and_the_quick_ones_are_among_them() -> None:
    golden = solve.golden_hashes()
    assert set(golden) == set(solve.names())
    assert {*list_scenarios(), *list_walks(), *solve.QUICK} <= set(golden)
    assert all(0 < hashes["failed"] < solve.DRAWS // 2 for hashes in golden.values())
    assert len({hashes["draws"] for hashes in golden.values()}) == len(golden)


@pytest.mark.parametrize(
    ("backend", "name"),
    [
        ("", CHEAP),
        ("", "solenoid"),
        ("", "proportional"),
        pytest.param("numba", CHEAP, marks=pytest.mark.long),
        pytest.param("numba", "off", marks=pytest.mark.long),
        pytest.param("numba", "reacting", marks=[pytest.mark.long, pytest.mark.thorough]),
    ],
)
def test_the_golden_bits_are_found_on_this_computer(
    backend: str, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    assert main(["bits", name, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["differs"] == {}
    assert document["hashes"][name] == solve.golden_hashes()[name]
    assert backend != "numba" or document["compiler"].startswith("Numba ")


@pytest.mark.parametrize("name", [CHEAP, "solenoid"])
def test_a_draw_has_the_same_bits_in_a_block_and_alone(name: str) -> None:
    batch = solve.drawn_batch(solve.plain_batch(name), 100)
    together = run_batch(batch).states
    for run in range(100):
        column = slice(run, run + 1)
        alone = replace(batch, parameters=batch.parameters[:, column].copy(), states=batch.states[:, column].copy())
        assert np.array_equal(run_batch(alone).states[:, 0], together[:, run], equal_nan=True), run


@needs_gcc
def test_gcc_finds_the_golden_bits_of_a_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", "gcc")
    found = solve.bits(["off"])
    assert found.is_same
    assert found.compiler.startswith("C by gcc: gcc")


def test_another_hash_is_named_and_the_command_ends_with_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    golden: dict[str, Any] = {name: dict(hashes) for name, hashes in solve.golden_hashes().items()}
    golden[CHEAP]["draws"] = "0" * 16
    monkeypatch.setattr(solve, "golden_hashes", lambda: golden)
    assert main(["bits", CHEAP]) == 1
    said = capsys.readouterr().out
    assert f"{CHEAP}: not the golden bits" in said
    assert "differs: the draws" in said


def test_a_name_without_a_hash_is_refused_with_the_nearest() -> None:
    with pytest.raises(
        SimulationError, match=r"no golden hash of 'of', did you mean 'off'\?; there are: step-response"
    ):
        solve.bits(["of"])


def test_names_beside_all_are_refused() -> None:
    with pytest.raises(SimulationError, match=r"--all takes all .*: give no names beside it"):
        solve.bits([CHEAP], everything=True)


@pytest.mark.parametrize(
    "damaged",
    [
        b"",
        b'{"off": {"rows": "',
        b"\xff\xfe",
        b"[" * 100_000,
        b"[]",
        b"{}",
        solve.GOLDEN.read_bytes().replace(b'"draws"', b'"drawn"', 1),
        json.dumps(dict.fromkeys(solve.names(), 1)).encode(),
    ],
    ids=["empty", "half", "no text", "too deep", "a list", "nothing", "another part", "numbers"],
)
def test_a_damaged_file_of_hashes_ends_with_2_and_one_line_not_with_1_as_other_bits_do(
    damaged: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "golden.json").write_bytes(damaged)
    monkeypatch.setattr(solve, "GOLDEN", tmp_path / "golden.json")
    assert main(["bits", CHEAP]) == 2
    said = capsys.readouterr().err
    assert said.startswith("ppafo: golden.json of this installation of ppafo is damaged; install ppafo anew: ")
    assert said.count("\n") == 1


def test_the_last_bit_of_one_number_is_another_hash_and_what_a_nan_is_made_of_is_not() -> None:
    result = BatchResult(np.array([[1.0, np.nan]]), np.zeros((1, 1, 2)))
    other = replace(result, states=np.array([[np.nextafter(1.0, 2.0), np.nan]]))
    signed = replace(result, states=np.array([[1.0, -np.nan]]))
    assert solve.digest(result) == solve.digest(signed) != solve.digest(other)


def test_draws_are_made_of_whole_numbers_and_spread_over_their_range() -> None:
    plain = solve.plain_batch(CHEAP)
    drawn = solve.drawn_batch(plain, 1000)
    assert (drawn.parameters[:5] == plain.parameters[:5]).all()
    row = np.flatnonzero(plain.parameters[:, 0] > 0.0)[7]
    factors = np.delete(drawn.parameters[row] / plain.parameters[row], np.arange(0, 1000, 10))
    assert 0.7 <= factors.min() < 0.702
    assert 1.398 < factors.max() < 1.4
    assert abs(factors.mean() - 1.05) < 0.02
