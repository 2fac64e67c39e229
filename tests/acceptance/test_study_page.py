"""What the page on studies shows is run as it stands there, with fewer draws."""

import re
import tomllib
from pathlib import Path

import pytest

from ppafo.analyses.sweep import sweep
from ppafo.studies.declaration import KINDS

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "study.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The code blocks of the page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_table_of_the_page_has_every_kind_with_its_keys() -> None:
    table = PAGE.partition("| kind | keys |")[2].partition("\n\n")[0]
    for kind, declared in KINDS.items():
        row = next(line for line in table.splitlines() if f"`{kind}`" in line)
        if kind != "truncated_normal":
            assert set(re.findall(r"`(\w+)`", row.split("|")[2])) == set(declared.fields)


def test_the_python_of_the_page_reads_what_the_study_wrote(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pandas

    monkeypatch.chdir(tmp_path)
    document = tomllib.loads(blocks("toml")[0])
    sweep(document, out="out/my-study", overrides=["run.duration=0.2 s"], draws=8)
    names: dict[str, object] = {}
    for text in re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE):
        exec(text, names)
    frame = names["frame"]
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == 32
    units = names["units"]
    assert isinstance(units, dict)
    assert (units["gas_supplied"], units["supply.pressure"]) == ("kg", "Pa_a")
    assert set(units) == set(frame.columns)
    assert set(frame["configuration"]) == {"proportional", "solenoid"}
    assert (tmp_path / "study.png").stat().st_size > 10_000
