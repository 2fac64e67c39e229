"""What the page on exports says of Gymnasium runs as it stands there."""

import re
from pathlib import Path

import pytest

pytest.importorskip("gymnasium")

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "export.md").read_text(encoding="utf-8")


def test_first_lines_of_the_page_run(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    exec(next(block for block in blocks if block.startswith("import gymnasium")), {})
    assert "supplied_mass" in capsys.readouterr().out
