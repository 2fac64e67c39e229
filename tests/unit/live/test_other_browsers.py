"""The page in Firefox and in WebKit: it opens from a file, asks for nothing, is dragged, and has the bits of Python."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from scripts.browsers import NAMES, DrivenPage, driven, missing
from scripts.live_page import check_bits, check_damage

SLIDER = ".control[data-key='supply.pressure'] input[type=range]"
UNDO = "button[title^=Undo]:enabled"
FOCUSED = "document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent"

LOAD = """text => {
    const chooser = document.querySelector("input[accept^='.json']");
    const chosen = new DataTransfer();
    chosen.items.add(new File([text], "state.json"));
    chooser.files = chosen.files;
    chooser.dispatchEvent(new Event("change"));
}"""


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


def test_a_saved_state_is_loaded(page: DrivenPage, file: Path) -> None:
    page.open(f"file://{file}#1=torque-task-solenoid;supply.pressure=62.5+psi_g")
    page.wait_for_selector("[data-ready]")
    kept, values = page.evaluate("workbench.file()"), page.evaluate("workbench.values(0)")
    page.evaluate("[...document.querySelectorAll('button')].find(one => one.textContent === 'Reset all').click()")
    assert page.evaluate("workbench.values(0)") != values
    page.evaluate(LOAD, kept)
    for _ in range(100):
        if page.evaluate("workbench.values(0)") == values:
            break
        page.wait_for_timeout(50)
    assert page.evaluate("workbench.file()") == kept
    assert page.said == []


def test_it_is_changed_by_keyboard_alone(page: DrivenPage, file: Path) -> None:
    page.open(f"file://{file}")
    reached = set()
    page.evaluate("document.body.focus()")
    for _ in range(30):
        page.press("Tab")
        reached.add(page.evaluate(FOCUSED))
    assert {"Torque task", "Supply pressure", "Supply pressure, slider", "Valve area"} <= reached
    page.evaluate("wanted => document.querySelector(wanted).focus()", SLIDER)
    page.press("ArrowRight")
    assert "supply.pressure" in page.evaluate("workbench.address()")


def test_random_states_have_the_bits_of_python(page: DrivenPage, file: Path, tmp_path: Path) -> None:
    page.open(f"file://{file}")
    found, runs = check_bits(page, states=3, seed=11, folder=tmp_path)
    assert found == []
    assert runs >= 6


def test_damaged_files_give_a_message_and_never_an_exception(page: DrivenPage, file: Path) -> None:
    page.open(f"file://{file}")
    assert check_damage(page, files=30, seed=5) == []
