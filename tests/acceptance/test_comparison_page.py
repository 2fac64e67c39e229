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


@pytest.mark.long
@pytest.mark.thorough
def test_walks_at_equal_work_are_what_the_script_of_the_page_prints(capsys: pytest.CaptureFixture[str]) -> None:
    (script,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    (shown,) = re.findall(r"^```text\n(at 50 psi_g.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    exec(script, {})
    assert capsys.readouterr().out == shown
    at_50, at_lowest = re.findall(r"proportional valve less pair: ([+-]\d+) %", shown)
    lead = PAGE.partition("\n## ")[0]
    more_50, more_lowest = (f"{change[1:]} % {'more' if change[0] == '+' else 'less'}" for change in (at_50, at_lowest))
    assert f"takes {more_50} gas a stride" in " ".join(lead.split())
    assert f"and {more_lowest} where each has the lowest supply pressure" in lead
