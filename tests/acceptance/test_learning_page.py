"""What the page on learning a controller shows runs as it stands there."""

import re
from pathlib import Path

import pytest

pytest.importorskip("gymnasium")

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "learn-a-controller.md").read_text(encoding="utf-8")


def test_first_lines_of_the_page_run(capsys: pytest.CaptureFixture[str]) -> None:
    first = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)[0]
    exec(first, {})
    assert "supplied_mass" in capsys.readouterr().out
