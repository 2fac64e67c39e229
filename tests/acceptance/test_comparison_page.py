"""The numbers on the page about the comparison are those that its script prints."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ppafo.questions.unreported.answer import Family
from ppafo.questions.unreported.solve import infer_settings
from scripts.comparison_findings import (
    best_volumes,
    figure_7,
    for_a_builder,
    improved_control,
    law_and_valve,
    what_is_open,
    where_it_comes_from,
)

PAGE = (Path(__file__).parents[2] / "docs" / "what-the-comparison-shows.md").read_text(encoding="utf-8")


def test_the_page_shows_what_one_change_at_a_time_gives() -> None:
    lines = list(where_it_comes_from())
    assert len(lines) > 10
    assert [line for line in lines if f"    {line}\n" not in PAGE] == []


def test_the_page_shows_what_each_set_gives_of_figure_7() -> None:
    assert [line for line in figure_7() if f"    {line}\n" not in PAGE] == []


@pytest.mark.long
@pytest.mark.parametrize("level", [6.0, 4.0])
def test_the_page_shows_the_laws_and_bounds_of_both_valves(level: float) -> None:
    assert [line for line in law_and_valve(level) if f"    {line}\n" not in PAGE] == []


@pytest.mark.long
@pytest.mark.parametrize("section", [best_volumes, for_a_builder])
def test_the_page_shows_the_best_volumes_and_what_a_builder_must_know(section: Callable[[], Iterator[str]]) -> None:
    assert [line for line in section() if f"    {line}\n" not in PAGE] == []


@pytest.fixture(scope="module")
def family() -> Family:
    """What the evidence leaves, found once."""
    return infer_settings(40_960)


@pytest.mark.long
@pytest.mark.parametrize("section", [what_is_open, improved_control])
def test_the_page_shows_what_the_evidence_leaves_open(
    section: Callable[[Family], Iterator[str]], family: Family
) -> None:
    assert [line for line in section(family) if f"    {line}\n" not in PAGE] == []
