"""The page about the comparison is what its command writes, and the ranges of the README are those of a run."""

import re
from pathlib import Path

import pytest

from ppafo.questions.reproduce import solve
from ppafo.questions.reproduce.answer import Reproduction
from scripts import comparison_findings
from scripts.comparison_findings import FINDINGS, PAGE, TEMPLATE, family, main, sections, text_of_figure_7, written

ROOT = Path(__file__).parents[2]
README, STUDIES_PAGE = (
    (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/how-to/repeat-a-published-study.md")
)
SHOWN, PARTS = (sections(file.read_text(encoding="utf-8")) for file in (PAGE, TEMPLATE))
AT_ONCE = ["Results 1: the 15 % depend on the level", "Limits"]
SEARCHED = ["Results 2: law and valve", "Results 3: improved control in other completions"]
"""Sections whose numbers take minutes of search."""


def is_as_written(title: str) -> bool:
    """Whether a section of the page is what the command writes."""
    return SHOWN[title] == written(PARTS[title], FINDINGS)


def test_the_page_has_the_sections_of_its_template_in_their_order() -> None:
    assert list(SHOWN) == list(PARTS)


@pytest.mark.parametrize("title", AT_ONCE)
def test_the_page_shows_what_one_change_at_a_time_gives(title: str) -> None:
    assert is_as_written(title)


def test_the_page_shows_what_each_set_gives_of_figure_7() -> None:
    assert text_of_figure_7()["table"] in SHOWN["Results 4: what the text of figure 7 says about the volume"]


@pytest.mark.long
def test_a_number_that_is_not_that_of_the_command_is_found_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    monkeypatch.setattr(comparison_findings, "PAGE", page)
    page.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    assert main(["--check", "--only", "Results 1"]) == 0
    row = next(line for line in SHOWN[AT_ONCE[0]].splitlines() if line.startswith("| level 5.5 N m"))
    other = page.read_text(encoding="utf-8").replace(row, "| level 5.5 N m | 40.0 | 68.5 |")
    page.write_text(other, encoding="utf-8")
    assert main(["--check", "--only", "Results 1"]) == 1
    assert row in capsys.readouterr().out
    assert page.read_text(encoding="utf-8") == other
    assert main(["--only", "Results 1"]) == 0
    assert page.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8")


@pytest.mark.thorough
@pytest.mark.long
@pytest.mark.parametrize("title", [title for title in PARTS if title not in (*AT_ONCE, *SEARCHED)])
def test_a_section_is_what_the_command_writes(title: str) -> None:
    assert is_as_written(title)


@pytest.mark.thorough
@pytest.mark.long
@pytest.mark.parametrize("title", SEARCHED)
def test_a_section_that_searches_for_minutes_is_what_the_command_writes(title: str) -> None:
    assert is_as_written(title)


@pytest.mark.thorough
@pytest.mark.long
def test_the_ranges_of_the_readme_and_of_the_table_of_claims_are_those_of_make_reproduce(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The completions are those that the page rests on too, drawn once.
    monkeypatch.setattr(solve, "infer_settings", {solve.COMPLETIONS: family()}.__getitem__)
    reproduction = solve.reproduce()
    assert isinstance(reproduction, Reproduction)
    ranges = {claim.id: claim.open_range for claim in reproduction.claims}
    shown = dict(
        re.findall(r"^\| [^|]+ \| `(\w+)` \| [^|]+ \| [^|]+ \| ([^|]+) \| [^|]+ \|$", STUDIES_PAGE, re.MULTILINE)
    )
    paper = {name: left for name, left in shown.items() if name in ranges}
    assert paper == {name: left for name, left in ranges.items() if name in paper}
    assert [name for name in ranges if name not in paper] == ["large_and_heavy"]
    headlines = ("torque_rms_improvement", "co2_solenoid", "co2_proportional", "co2_saving")
    rows = re.findall(r"^\| [^|]+ \| [\d.]+ \S+ \| [\d.]+ \S+ \| ([^|]+) \|$", README, re.MULTILINE)
    assert rows == [ranges[name] for name in headlines]


@pytest.mark.long
def test_the_readme_says_what_a_builder_must_know_as_a_range() -> None:
    walks = FINDINGS["walks"]()
    told = " ".join(README.split())
    for text in (
        f"peaks at {walks['peak']} N m",
        f"{walks['share']} % of a healthy",
        f"lasts {walks['minutes']} minutes",
    ):
        assert text in told
