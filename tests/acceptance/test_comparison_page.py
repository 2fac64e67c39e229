"""The numbers on the page about the comparison are those that its script prints."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ppafo.questions.unreported.solve import infer_settings
from scripts.comparison_findings import (
    best_volumes,
    figure_7,
    for_a_builder,
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
@pytest.mark.parametrize("section", [best_volumes, for_a_builder])
def test_the_page_shows_the_best_volumes_and_what_a_builder_must_know(section: Callable[[], Iterator[str]]) -> None:
    assert [line for line in section() if f"    {line}\n" not in PAGE] == []


@pytest.mark.long
def test_the_page_shows_what_the_evidence_leaves_open() -> None:
    # "Law and valve" and "Improved control" search for minutes: run the script after a change of either.
    assert [line for line in what_is_open(infer_settings(40_960)) if f"    {line}\n" not in PAGE] == []
