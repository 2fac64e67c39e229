"""What the page opens with: sliders, panels and rows by what they change, its main facts, and its questions."""

import json
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from ppafo.analyses.endurance.gas_demand import demand_of_numbers
from ppafo.analyses.endurance.solve import follow_bottle
from ppafo.page import workbench as workbench_module
from ppafo.page.opening import LEAST_CHANGE, MOST_FIRST, _key
from ppafo.page.workbench import openings_of
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks
from ppafo.walking.bottle.coupling import Schedule
from scripts.live_page import missing, opened
from scripts.page_tables import FLOWS

has_browser = pytest.mark.skipif(bool(missing()), reason=missing() or "there is a browser")
LARGE = {"width": 1400, "height": 1000}
FAULTS = "[...document.querySelectorAll('.fault')].filter(one => one.checkVisibility()).map(one => one.innerText)"
"""What a page says is wrong."""


def _opening() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(files("ppafo.page").joinpath("opening.json").read_text(encoding="utf-8"))
    return found


def test_a_pressure_loop_is_shown_in_bar_as_its_file_is_and_keeps_its_gains() -> None:
    (program,) = workbench_module._content(["pressure-loop"], (), "page")[0]["programs"]
    settings = {setting["key"]: setting for setting in program["settings"]}
    supply, gain = settings["supply.pressure"], settings["controller.proportional_gain"]
    assert (supply["shown"], supply["slider"]) == ("bar_g", (0.69, 8.3))
    # The page has the rules of a loop of torque: a gain in 1/Pa made by them would be refused.
    assert gain["made"]["terms"][0]["rule"].startswith("pressure_1.")
    assert gain["value"] < 1.0e-3


@pytest.mark.parametrize("name", ["torque-task-proportional", "swing-foot-angle"])
def test_what_the_package_keeps_of_a_scenario_is_what_its_program_gives(name: str) -> None:
    """Else run ``python scripts/page_tables.py``."""
    assert openings_of([name])[name] == _opening()[name]


def test_what_the_package_keeps_is_of_the_files_that_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else pages of these compile and run a model first: run ``python scripts/page_tables.py``."""
    assert list(_opening()) == [*list_scenarios(), *list_walks()]
    monkeypatch.setattr(workbench_module, "computed_opening", lambda _, *made_from: _key(*made_from))
    assert openings_of(_opening()) == {name: one["key"] for name, one in _opening().items()}


@has_browser
def test_every_first_slider_changes_something_and_the_largest_change_is_first(chromium: Any, file: Path) -> None:
    content = opened(chromium, file).evaluate("workbench.content")
    kept = _opening()
    for tab in content["tabs"]:
        changes = [kept[one["program"]]["changes"] for one in tab["start"]]
        largest = [max(max(one.get(key, [0.0])) for one in changes) for key in tab["first"]]
        assert len(largest) == MOST_FIRST
        assert largest == sorted(largest, reverse=True)
        assert min(largest) > LEAST_CHANGE


def test_minutes_of_the_bottle_are_those_of_endurance() -> None:
    table = json.loads(files("ppafo.page").joinpath("minutes.json").read_text(encoding="utf-8"))
    bottle, schedule = load_bottle(PAPER_BOTTLE), Schedule(3e6, 0.0, 3e6)
    assert table["flows"] == [float(f"{flow:.4g}") for flow in FLOWS]
    for place in (9, 16, 22):
        lasting = follow_bottle(bottle, demand_of_numbers(float(FLOWS[place]), 1.0, None), schedule)
        assert float(f"{lasting.discharge.walking_time / 60.0:.4g}") == table["minutes"][place]


def test_without_scripts_there_is_a_picture(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    picture = text.split("<noscript>")[1].split("</noscript>")[0]
    assert picture.count("<polyline") == 3
    assert "style=" not in picture  # the policy allows no styles but one


@has_browser
def test_the_page_says_its_main_fact_and_its_questions_set_the_sliders(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    facts = page.locator(".facts")
    assert {"6", "5", "9.4", "30"} <= set(re.findall(r"\d+(?:\.\d+)?", facts.inner_text()))
    assert "shaded" in facts.inner_text()
    page.get_by_role("link", name="What if the task required 4 N m?").click()
    page.wait_for_timeout(300)
    assert page.evaluate("workbench.values(1)['reference.level']") == 4.0
    assert "shaded" not in facts.inner_text()
    page.get_by_role("link", name="What if the valve switched at 80 Hz?").click()
    page.wait_for_timeout(300)
    values = page.evaluate("[0, 1].map(place => workbench.values(place)['controller.period'])")
    assert values == [0.0125, 0.001]
    assert page.evaluate("workbench.values(0)['reference.level']") == 6.0
    assert page.evaluate(FAULTS) == []
    for tab, question in (("Step response", "30 psi"), ("Walk", "110 kg")):
        page.get_by_role("tab", name=tab).click()
        page.get_by_role("link", name=re.compile(question)).click()
        page.wait_for_timeout(300)
        assert page.evaluate(FAULTS) == []
        assert page.evaluate("Object.keys(JSON.parse(workbench.file()).benches.flat().at(-1).changes).length") > 0
        assert page.locator(".notice").is_hidden()
    assert page.said == []


@has_browser
def test_a_sampling_period_takes_the_step_with_it_that_its_samples_need(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    box, slider = (page.get_by_label(name, exact=True) for name in ("Sampling period", "Sampling period, slider"))
    steps = {}
    for period in ("12.5 ms", "1.6 ms", "37.3 ms", "50 ms"):
        box.fill(period)
        box.press("Enter")
        page.wait_for_timeout(300)
        assert page.evaluate(FAULTS) == []
        steps[period] = page.evaluate("workbench.values(0)['run.step']")
    assert steps == {"12.5 ms": 0.0005, "1.6 ms": 0.0002, "37.3 ms": 0.0001, "50 ms": 0.001}
    for place in (0, 57, 233, 400):
        slider.evaluate(f"slider => {{ slider.value = {place}; slider.dispatchEvent(new Event('input')); }}")
        page.wait_for_timeout(300)
        assert page.evaluate(FAULTS) == []
    box.fill("0.0123456789 s")
    box.press("Enter")
    page.locator("#panel > .fault", has_text="samples have to fall on steps").wait_for()


@has_browser
def test_a_refused_value_does_not_enter_the_shared_address(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    page.evaluate("workbench.open('1=torque-task-proportional;friction.static_torque=0.3+N+m')")
    page.wait_for_timeout(400)
    address = page.evaluate("location.hash")
    assert "0.3" in address
    page.locator("summary", has_text="Friction").click()
    page.get_by_label("Dynamic friction", exact=True).fill("0.4")
    page.get_by_label("Dynamic friction", exact=True).press("Enter")
    page.locator(
        "#panel > .fault", has_text="friction.dynamic_torque must be at most friction.static_torque"
    ).wait_for()
    page.wait_for_timeout(400)
    assert page.evaluate("location.hash") == address
    refused = "1=torque-task-proportional;friction.dynamic_torque=3+N+m"
    assert "must be at most friction.static_torque" in page.evaluate(f"workbench.open('{refused}')")
