"""What the page on linear models shows runs as it stands there, and prints the numbers of the page."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import ppafo

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "linear-model.md"
TEXT = PAGE.read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The code blocks of the page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def test_the_python_of_the_page_prints_the_numbers_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("control", reason="loop shaping needs the extra 'control'")
    names: dict[str, Any] = {}
    for block in blocks("python"):
        exec(block, names)
    shaped, paper, own = capsys.readouterr().out.splitlines()
    assert f"`{shaped}`" in TEXT
    assert f"leave {paper}, these {own.removesuffix(' N m')} N m" in TEXT


def test_the_margins_hold_for_changes_of_the_size_that_the_page_states() -> None:
    assert all(f"{size} N m" in TEXT for size in ("-0.003", "-0.01", "-0.1"))
    task = "torque-task-proportional"
    model = ppafo.linearise(task, overrides=["reference.level=3 N m"]).found
    # The gains of the paper.
    gains = {"proportional_gain": 0.095, "integral_gain": 0.25, "derivative_gain": 0.006}

    def reversals(share: float, step: float) -> float:
        changed = {f"controller.{name}": share * model.margins.gain_margin * gain for name, gain in gains.items()}
        level = {"reference.kind": "constant", "reference.level": 3.0 + step}
        scenario = ppafo.load_scenario(task, {**changed, **level})
        still = replace(scenario.initial, pressure_1=model.values["pressure_1"], pressure_2=model.values["pressure_2"])
        return float(ppafo.simulate(replace(scenario, initial=still)).metrics["command_reversals"])

    assert [reversals(0.96, -0.003), reversals(0.8, -0.01), reversals(0.8, -0.03)] == [0.0, 0.0, 0.0]
    assert min(reversals(0.96, -0.01), reversals(0.8, -0.1), reversals(1.04, -0.003), reversals(1.04, 0.0)) > 300.0
