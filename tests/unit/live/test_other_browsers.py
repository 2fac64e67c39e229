"""The page in Firefox and in WebKit: it opens from a file, asks for nothing, is dragged, and has the bits of Python."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from scripts.browsers import NAMES, DrivenPage, driven, missing
from scripts.live_page import check_bits

SLIDER = ".control[data-key='supply.pressure'] input[type=range]"
UNDO = "button[title^=Undo]:enabled"


@pytest.fixture(scope="module", params=NAMES)
def page(request: pytest.FixtureRequest) -> Iterator[DrivenPage]:
    if missing(request.param):
        pytest.skip(missing(request.param))
    with driven(request.param) as found:
        yield found


def test_it_opens_from_a_file_asks_for_nothing_and_says_nothing(page: DrivenPage, file: Path) -> None:
    page.open(f"file://{file}")
    for tab in (3, 2, 1):
        page.evaluate("place => document.querySelectorAll('[role=tab]')[place].click()", tab - 1)
        page.wait_for_timeout(200)
    page.evaluate("document.querySelectorAll('details.folded').forEach(one => { one.open = true; })")
    page.wait_for_selector("canvas.map[data-milliseconds]")
    page.evaluate(
        "[...document.querySelectorAll('button')].find(one => one.textContent === 'Move each assumption').click()"
    )
    page.wait_for_selector(".assumptions table")
    asked = page.evaluate("performance.getEntriesByType('resource').map(one => one.name)")
    assert [url for url in asked if not url.startswith(("blob:", "data:"))] == []
    assert page.said == []


def test_a_drag_changes_the_metrics_and_is_undone_at_once(page: DrivenPage, file: Path) -> None:
    page.open(f"file://{file}")
    before, run = page.evaluate("workbench.file()"), page.evaluate("workbench.run(0).metrics")
    page.drag(SLIDER, (0.4, 0.5, 0.6, 0.7, 0.8))
    assert page.evaluate("workbench.run(0).metrics") != run
    page.wait_for_selector(UNDO)
    page.evaluate("wanted => document.querySelector(wanted).click()", UNDO)
    assert page.evaluate("workbench.file()") == before


def test_random_states_have_the_bits_of_python(page: DrivenPage, file: Path, tmp_path: Path) -> None:
    page.open(f"file://{file}")
    found, runs = check_bits(page, states=3, seed=11, folder=tmp_path)
    assert found == []
    assert runs >= 6
