"""The page that simulates, in a headless Chromium: asks for nothing, says nothing wrong, has the bits of Python."""

import shlex
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from ppafo.errors import ScenarioError
from ppafo.page.workbench import _checksum, workbench
from ppafo.running import simulate
from ppafo.simulation.loading import list_scenarios
from ppafo.walking.loading import list_walks

CHROMIUM = shutil.which("chromium") or ""
TASKS = ("torque-task-solenoid", "torque-task-proportional")


def test_a_slider_that_no_scenario_has_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"valve\.colour"):
        workbench(TASKS[:1], sliders=["valve.colour"])


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    if not CHROMIUM:
        pytest.skip("no Chromium on this machine")
    with playwright.sync_playwright() as started:
        launched = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield launched
        launched.close()


@pytest.fixture(scope="module")
def page(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    return _opened(browser, tmp_path_factory.mktemp("page") / "page.html", TASKS)


def _opened(browser: Any, file: Path, names: Sequence[str]) -> Any:
    """A page on screen, which keeps all that it complained of and asked for."""
    file.write_bytes(workbench(names))
    opened = browser.new_page()
    opened.wrong = []
    opened.on("console", lambda message: opened.wrong.append(message.text))
    opened.on("pageerror", lambda error: opened.wrong.append(str(error)))
    opened.on("request", lambda request: opened.wrong.extend([] if request.url.startswith("file:") else [request.url]))
    opened.goto(file.as_uri())
    return opened


def _check(page: Any, *overrides: str) -> None:
    """Compare all samples of the last run with those of Python: as typed, and as the page writes them."""
    page.wait_for_timeout(200)
    page.wait_for_selector("#command[data-checksum]")
    command, scenario = page.locator("#command"), page.locator("#scenario").input_value()
    content = page.evaluate("JSON.parse(document.getElementById('content').textContent).simulations")
    (compared,) = (one["compared"] for one in content if one["name"] == scenario)
    words = shlex.split(command.text_content())
    assert words[:3] == ["ppafo", "simulate", scenario]
    for given in (list(overrides), words[4::2]):
        assert int(command.get_attribute("data-checksum")) == _checksum(simulate(scenario, given).recording, compared)
    assert page.wrong == []


@pytest.mark.long
def test_every_scenario_has_the_bits_of_python(browser: Any, tmp_path: Path) -> None:
    names = (*list_scenarios(), *list_walks())
    opened = _opened(browser, tmp_path / "page.html", names)
    for name in names:
        opened.select_option("#scenario", name)
        opened.wait_for_function(
            "name => document.querySelector('#command').textContent.split(' ')[2] === name", arg=name
        )
        opened.wait_for_selector("#command[data-checksum]")
        assert "to the last bit" in opened.locator("#check").text_content(), name
    assert opened.wrong == []


def test_the_page_as_written_has_the_bits_of_python_and_says_so(page: Any) -> None:
    _check(page)
    assert "3001 samples of 12 channels are those of Python" in page.locator("#check").text_content()


@pytest.mark.parametrize(
    ("name", "typed", "override"),
    [
        ("Valve area mm²", "20.3", "valve.area=20.3 mm^2"),
        ("Supply pressure psi gauge", "65.7", "supply.pressure=65.7 psi_g"),
        ("Ankle angle deg", "81.9", "motion.angle=81.9 deg"),
        # Settings that others follow: gauge pressures, and the displacement.
        ("Atmosphere psi abs", "12.2", "supply.atmospheric_pressure=12.2 psi_a"),
        ("Torque per pressure cm³", "17", "actuator.torque_constant=17 cm^3"),
    ],
)
@pytest.mark.parametrize("scenario", TASKS)
def test_a_typed_number_gives_the_bits_of_python(
    page: Any, scenario: str, name: str, typed: str, override: str
) -> None:
    page.get_by_role("button", name="As written").click()
    page.select_option("#scenario", scenario)
    page.evaluate("document.querySelectorAll('details').forEach(group => group.open = true)")
    page.get_by_role("spinbutton", name=name, exact=True).fill(typed)
    _check(page, override)


def test_a_slider_moves_by_keys_and_a_bad_number_is_refused(page: Any) -> None:
    page.get_by_role("button", name="As written").click()
    page.get_by_role("slider", name="Valve area").focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(1000)
    assert "as written" in page.locator("#said").text_content()
    page.get_by_role("spinbutton", name="Valve area mm²").fill("-3")
    page.wait_for_timeout(1000)
    assert page.locator("#said").text_content().startswith("Not simulated: Valve area is out of range")
