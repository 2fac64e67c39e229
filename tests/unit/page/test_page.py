"""The page that simulates, in a headless Chromium: asks for nothing, complains of nothing, has the bits of Python."""

import importlib.util
import json
import random
import shlex
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from ppafo.errors import PpafoError, ProgramError, ScenarioError
from ppafo.page.workbench import _checksum, workbench
from ppafo.running import simulate
from ppafo.simulation.loading import list_scenarios
from ppafo.walking.loading import list_walks

CHROMIUM = shutil.which("chromium") or ""
TASKS = ("torque-task-solenoid", "torque-task-proportional")
DRAWN = {
    **dict.fromkeys(list_scenarios(), ()),
    **dict.fromkeys(list_walks(), ("run.duration=6 s",)),
}
"""What random settings are drawn for, with what keeps a walk short."""


def test_a_slider_that_no_scenario_has_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"valve\.colour"):
        workbench(TASKS[:1], sliders=["valve.colour"])


def test_without_a_compiler_the_refusal_says_how_to_get_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    with pytest.raises(ProgramError, match=r"^a page needs a compiler .*pip install 'ppafo\[workbench\]', or clang"):
        workbench(TASKS[:1])


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


def _opened(browser: Any, file: Path, names: Sequence[str | Path], overrides: Sequence[str] = ()) -> Any:
    """A page on screen, which keeps all that it complained of and asked for."""
    file.write_bytes(workbench(names, overrides=overrides))
    opened = browser.new_page()
    opened.wrong = []
    opened.on("console", lambda message: opened.wrong.append(message.text))
    opened.on("pageerror", lambda error: opened.wrong.append(str(error)))
    asked = ("file:", "blob:")
    opened.on("request", lambda request: opened.wrong.extend([] if request.url.startswith(asked) else [request.url]))
    opened.goto(file.as_uri())
    _wait(opened)
    return opened


def _wait(page: Any) -> str:
    """Wait for a run, or for its refusal; returns what the page says."""
    page.locator("#command[data-checksum], #said:has-text('Not simulated')").first.wait_for(state="attached")
    said: str = page.locator("#said").text_content()
    return said


def _content(page: Any) -> Any:
    (found,) = (
        one
        for one in json.loads(page.locator("#content").text_content())["simulations"]
        if one["name"] == page.locator("#scenario").input_value()
    )
    return found


def _check(page: Any, *overrides: str) -> None:
    """Compare all samples of the last run with those of Python: as typed, and as the page writes them."""
    _wait(page)
    command, content = page.locator("#command"), _content(page)
    words = shlex.split(command.text_content())
    assert words[:2] == ["ppafo", "simulate"]
    for given in ([*overrides], words[4::2]):
        recording = simulate(words[2], given).recording
        assert int(command.get_attribute("data-checksum")) == _checksum(recording, content["compared"])
    assert page.wrong == []


def _restored(page: Any, scenario: str) -> None:
    page.select_option("#scenario", scenario)
    _wait(page)
    page.get_by_role("button", name="As written").click()
    # A refusal of before stays on the page until the run is said.
    page.locator("#command[data-checksum]").wait_for(state="attached")
    page.evaluate("document.querySelectorAll('details').forEach(group => group.open = true)")


def _typed(page: Any, name: str, text: str) -> str:
    page.get_by_role("spinbutton", name=name, exact=True).fill(text)
    page.wait_for_timeout(50)
    return _wait(page)


@pytest.mark.parametrize("scenario", TASKS)
def test_a_typed_number_and_what_follows_it_give_the_bits_of_python(page: Any, scenario: str) -> None:
    for name, typed, override in (
        ("Valve area mm²", "20.3", "valve.area=20.3 mm^2"),
        ("Sampling period s", "0.003", "controller.period=3 ms"),
        ("Ankle angle deg", "81.9", "motion.angle=81.9 deg"),
        # Settings that others follow: gauge pressures, and the displacement.
        ("Atmosphere psi abs", "12.2", "supply.atmospheric_pressure=12.2 psi_a"),
        ("Torque per pressure cm³", "17", "actuator.torque_constant=17 cm^3"),
    ):
        _restored(page, scenario)
        _typed(page, name, typed)
        _check(page, override)
        assert f"={typed} " in page.locator("#command").text_content()


def test_a_reload_keeps_settings_and_the_curves_of_another_valve(page: Any) -> None:
    _restored(page, TASKS[0])
    page.get_by_role("slider", name="Valve area").focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(50)
    _wait(page)
    page.get_by_role("button", name="Keep these curves").click()
    page.select_option("#scenario", TASKS[1])
    _wait(page)
    _typed(page, "Valve area mm²", "25")
    before = [page.locator(part).text_content() for part in ("#results", "#legend", "#command")]
    assert "torque-task-solenoid, Valve area" in before[0]
    page.reload()
    page.locator("#legend li").nth(3).wait_for()
    _wait(page)
    assert [page.locator(part).text_content() for part in ("#results", "#legend", "#command")] == before


def test_each_cause_of_a_refusal_has_words_of_its_own_and_what_is_out_of_reach_a_curve(page: Any) -> None:
    _restored(page, TASKS[1])
    assert "required, within reach" in page.locator("#legend").text_content()
    assert "The reference is beyond the reach of the actuator by up to 0.9979 N m." in _wait(page)
    assert "Valve area = nothing is out of range" in _typed(page, "Valve area mm²", "")
    _restored(page, TASKS[1])
    said = _typed(page, "Supply pressure psi gauge", "20000")
    assert "it must be at least \N{MINUS SIGN}14.55 psi gauge and at most 14490 psi gauge. The curves" in said
    _restored(page, TASKS[1])
    said = _typed(page, "Valve area mm²", "-3")
    assert "Valve area = \N{MINUS SIGN}3 mm² is out of range: it must be at least 0 mm² and at most" in said
    _restored(page, TASKS[1])
    said = _typed(page, "Upper stop deg", "25")
    assert "Ankle angle = 75 deg contradicts another setting: it must be at least Lower stop and at most Upper" in said
    _restored(page, TASKS[1])
    _typed(page, "Torque to hold N m", "3")
    assert "within reach" not in page.locator("#legend").text_content()
    assert page.locator("#panels figure").count() == page.locator("#panels figure.wide").count() + 2
    address = page.url.partition("#")[0]
    page.goto("about:blank")
    page.goto(f"{address}#{TASKS[1]}&nosuch=1&supply.pressure=70000")
    said = _wait(page)
    assert 'nosuch".' in said
    assert 'needs functions that this page has not: write a page with --set "supply.pressure=..."' in said
    assert said.endswith("The curves are those as written.")
    assert page.wrong == []


@pytest.mark.long
def test_every_scenario_has_the_bits_of_python(browser: Any, tmp_path: Path) -> None:
    names = (*list_scenarios(), *list_walks())
    opened = _opened(browser, tmp_path / "page.html", names)
    for name in names:
        opened.select_option("#scenario", name)
        opened.locator(f"#command:text-is('ppafo simulate {name}')").wait_for()
        _wait(opened)
        assert "to the last bit" in opened.locator("#check").text_content(), name
    assert opened.wrong == []


@pytest.mark.long
@pytest.mark.parametrize("name", DRAWN)
def test_random_settings_have_the_bits_of_python_or_are_refused_by_both(
    browser: Any, tmp_path: Path, name: str
) -> None:
    opened, draw = _opened(browser, tmp_path / "page.html", [name], DRAWN[name]), random.Random(name)
    content, address = _content(opened), opened.url.partition("#")[0]
    usable = [one for one in content["settings"] if not one["hidden"] and not one["path"].startswith("run.")]
    same = 0
    for _ in range(9):
        values = {}
        for one in draw.sample(usable, draw.choice([1, 1, 2, 3])):
            size = one["value"] or 0.1 * float(one["scale"]) * one["to"] * draw.random()
            values[one["path"]] = float(f"{size * draw.choice([draw.uniform(0.8, 1.25), draw.uniform(0.2, 4.0)]):.6g}")
        opened.goto("about:blank")
        opened.goto(f"{address}#{name}&" + "&".join(f"{path}={value!r}" for path, value in values.items()))
        said = _wait(opened)
        units = {one["path"]: one["si"] for one in usable}
        given = [*DRAWN[name], *(f"{path}={value!r} {units[path]}".strip() for path, value in values.items())]
        try:
            found = _checksum(simulate(name, given).recording, content["compared"])
        except PpafoError as error:
            assert said.startswith("Not simulated"), (given, str(error))
        else:
            if "needs functions that this page has not" not in said:
                assert not said.startswith("Not simulated"), (given, said)
                assert int(opened.locator("#command").get_attribute("data-checksum")) == found, given
                same += 1
    assert same > 3
    assert opened.wrong == []
