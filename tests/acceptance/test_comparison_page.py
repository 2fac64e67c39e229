"""The page about the paper shows what the commands and the script on it give."""

import re
from pathlib import Path

import pytest

from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate

PAGE = (Path(__file__).parents[2] / "docs" / "the-paper.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (?:`([^`]+)`|\(as completed\)) \| (-?[\d.]+) \| (-?[\d.]+) \|$", PAGE, re.MULTILINE)


def test_the_page_has_its_rows() -> None:
    assert len(ROWS) == 11


@pytest.mark.parametrize(("override", "error", "gas"), ROWS)
def test_a_row_is_what_both_runs_give(override: str, error: str, gas: str) -> None:
    changed = [override] if override else []
    pair, spool = (
        simulate(load_scenario(f"torque-task-{valve}", changed)).metrics for valve in ("solenoid", "proportional")
    )
    less = [100.0 * (1.0 - spool[name].value / pair[name].value) for name in ("rms_error", "gas_supplied")]
    assert [f"{value:.1f}" for value in less] == [error, gas]
