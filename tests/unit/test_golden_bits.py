"""Golden bits: every scenario and walk has its hash, a part of them is found here, and another number is named."""

import shutil
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import BatchResult, LaneBlock, RunnableProgram, run_batch, write_source
from ppafo.engine.loading import load_generated
from ppafo.golden_bits import digest, golden_hashes, names, plain_batch
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks
from scripts import bits, golden_bits
from tests.compilers_here import compilers_here, first_compiler

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
needs_zig = pytest.mark.skipif("zig" not in compilers_here(), reason="no zig on this machine")
CHEAP = "torque-task-proportional"
QUICK = (CHEAP, "solenoid", "proportional")


def test_every_scenario_and_walk_has_golden_hashes() -> None:
    golden = golden_hashes()
    assert set(golden) == set(names())
    assert {*list_scenarios(), *list_walks()} <= set(golden)
    assert all(0 < hashes["failed"] < golden_bits.DRAWS // 2 for hashes in golden.values())
    assert len({hashes["draws"] for hashes in golden.values()}) == len(golden)


@pytest.mark.parametrize(
    ("backend", "name"),
    [
        *(pytest.param("", name, marks=() if name in QUICK else pytest.mark.long) for name in names()),
        pytest.param("gcc", "off", marks=needs_gcc),
        pytest.param("zig", CHEAP, marks=[pytest.mark.long, needs_zig]),
        pytest.param("zig", "off", marks=[pytest.mark.long, needs_zig]),
    ],
)
@pytest.mark.usefixtures("fully_compiled")
def test_the_golden_bits_are_found_on_this_computer(backend: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    assert golden_bits.hashes_of(name, lambda _batch: run_batch) == golden_hashes()[name]


@pytest.mark.parametrize("name", [CHEAP, "off"])
def test_a_quickly_compiled_program_has_the_golden_bits(name: str) -> None:
    batch = plain_batch(name)
    module = load_generated(write_source(batch.program)[1], first_compiler().with_effort(Effort.QUICK))
    block = LaneBlock(cast(RunnableProgram, module), batch.program, batch.clock, batch.parameters, batch.states)
    block.advance(batch.clock.step_count)
    assert digest(block.result()) == golden_hashes()[name]["run"]


@pytest.mark.parametrize("name", [CHEAP, "solenoid"])
def test_a_draw_has_the_same_bits_in_a_block_and_alone(name: str) -> None:
    batch = golden_bits.drawn_batch(plain_batch(name), 100)
    together = run_batch(batch).states
    for run in range(100):
        column = slice(run, run + 1)
        alone = replace(batch, parameters=batch.parameters[:, column].copy(), states=batch.states[:, column].copy())
        assert np.array_equal(run_batch(alone).states[:, 0], together[:, run], equal_nan=True), run


def test_another_hash_is_named_and_the_script_ends_with_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    golden: dict[str, Any] = {name: dict(hashes) for name, hashes in golden_hashes().items()}
    golden[CHEAP]["draws"] = "0" * 16
    monkeypatch.setattr(bits, "golden_hashes", lambda: golden)
    assert bits.compare([bits.HERE], [CHEAP]) == 1
    assert f"this computer | 0 of 2; differs: {CHEAP} |" in capsys.readouterr().out


def test_the_last_bit_of_one_number_is_another_hash_and_what_a_nan_is_made_of_is_not() -> None:
    result = BatchResult(np.array([[1.0, np.nan]]), np.zeros((1, 1, 2)))
    other = replace(result, states=np.array([[np.nextafter(1.0, 2.0), np.nan]]))
    signed = replace(result, states=np.array([[1.0, -np.nan]]))
    assert digest(result) == digest(signed) != digest(other)


def test_draws_are_made_of_whole_numbers_and_spread_over_their_range() -> None:
    plain = plain_batch(CHEAP)
    drawn = golden_bits.drawn_batch(plain, 1000)
    assert (drawn.parameters[:5] == plain.parameters[:5]).all()
    row = np.flatnonzero(plain.parameters[:, 0] > 0.0)[7]
    factors = np.delete(drawn.parameters[row] / plain.parameters[row], np.arange(0, 1000, 10))
    assert 0.7 <= factors.min() < 0.702
    assert 1.398 < factors.max() < 1.4
    assert abs(factors.mean() - 1.05) < 0.02
