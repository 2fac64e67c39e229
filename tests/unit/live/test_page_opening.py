"""What the page opens with: sliders, panels and rows by what they change, its main facts, and its questions."""

import json
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from ppafo.analyses.endurance.gas_demand import demand_of_numbers
from ppafo.analyses.endurance.solve import follow_bottle
from ppafo.loading import load_scenario
from ppafo.page import html as pages
from ppafo.page import workbench as workbench_module
from ppafo.page.opening import LEAST_CHANGE, MOST_FIRST, _key
from ppafo.page.words import words
from ppafo.page.workbench import DEFAULT, openings_of, workbench
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
from ppafo.parameters.joint import JointNames
from ppafo.report.style import PAGE_COLOURS
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


# Runs of the last fail at both ends of a setting.
def test_a_scenario_of_ones_own_is_called_by_its_name_as_it_is() -> None:
    own = replace(load_scenario("step-response"), name="knoechel-bench")
    labels = [
        program["label"] for program in workbench_module._content([own, "step-response"], (), "page")[0]["programs"]
    ]
    assert labels == ["knoechel-bench", "Step response"]


def test_a_pressure_loop_is_shown_in_bar_as_its_file_is_and_keeps_its_gains() -> None:
    (program,) = workbench_module._content(["pressure-loop"], (), "page")[0]["programs"]
    settings = {setting["key"]: setting for setting in program["settings"]}
    supply, gain = settings["supply.pressure"], settings["controller.proportional_gain"]
    assert (supply["shown"], supply["slider"]) == ("bar_g", (0.69, 8.3))
    # The page has the rules of a loop of torque: a gain in 1/Pa made by them would be refused.
    assert gain["made"]["terms"][0]["rule"].startswith("pressure_1.")
    assert gain["value"] < 1.0e-3


def test_a_task_of_another_quantity_is_in_its_words_and_between_its_ends() -> None:
    content = workbench_module._content(["pressure-loop", "swing-foot-angle"], (), "page")[0]
    loop, swing = ({entry["key"]: entry for entry in program["settings"]} for program in content["programs"])
    assert loop["reference.level"]["label"] == "Chamber 1 pressure to hold"
    assert loop["reference.start_level"]["label"] == "Chamber 1 pressure before the ramp"
    assert loop["reference.level"]["slider"] == pytest.approx((0.0, 3.4))
    assert swing["reference.level"]["label"] == "Angle to hold"
    largest = {entry["name"]: entry["shown"] for entry in content["programs"][0]["metrics"]}["largest_pressure"]
    assert largest == "bar_g"
    tab = next(tab for tab in content["tabs"] if "pressure-loop" in tab["programs"])
    questions = {question["text"]: question["changes"] for question in tab["questions"]}
    assert questions["What if the supply had 4.5 bar?"] == {"supply.pressure": "4.5 bar_g"}
    assert not any("required" in text for text in questions)


def test_a_page_is_called_after_the_joint_of_its_devices() -> None:
    knee = load_scenario("step-response")
    knee = replace(knee, device=replace(knee.device, joint=JointNames("knee", "flexion", "extension")))
    content = workbench_module._content([knee], (), "page")[0]
    assert (content["title"], content["joint"]) == ("The powered knee orthosis, live", "knee")
    assert not [text for text in (entry["label"] for entry in content["programs"][0]["settings"]) if "ankle" in text]


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


def test_curves_have_the_colours_of_the_figures() -> None:
    style = pages.bundled("page.css")
    light = style.split("@media")[0]
    found = re.findall(r"--line-(\d): ?(#[0-9a-f]{3,6})", light)
    long = [colour if len(colour) == 7 else "#" + "".join(2 * digit for digit in colour[1:]) for _, colour in found]
    assert long == [colour.lower() for colour in PAGE_COLOURS]


def test_each_question_is_of_a_tab_and_in_the_range_of_its_settings() -> None:
    page = workbench(DEFAULT)
    assert b"<noscript>" in page
    tabs = {tab for one in words()["questions"] for tab in one["tabs"]}
    for tab in tabs:
        assert sum(tab in one["tabs"] for one in words()["questions"]) == 3


def test_without_scripts_there_is_a_picture(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    picture = text.split("<noscript>")[1].split("</noscript>")[0]
    assert picture.count("<polyline") == 3
    assert "Torque (N m)" in picture
    assert "Time (s)" in picture
    assert "Solenoid pair" in picture
    assert PAGE_COLOURS[1] in picture
    assert "style=" not in picture  # the policy allows no styles but one


@has_browser
def test_the_page_says_its_main_fact_and_its_questions_set_the_sliders(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    facts = page.locator(".facts")
    said = facts.inner_text().replace("\u00a0", " ")
    assert "The task requires 6 N m; the supply sustains 5 N m, so the shaded part is out of reach." in said
    assert "lasts 9.4 minutes (Solenoid pair), 30 minutes (Proportional valve)" in facts.inner_text()
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
    assert "(Solenoid pair)" in facts.inner_text()
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
def test_what_stays_is_said_in_a_line_until_it_moves(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    titles = page.locator(".panel .title").all_inner_texts()
    assert titles == ["Torque", "Pressures, chamber 2 dashed", "Command to the valve", "Gas taken from the supply"]
    assert page.locator(".still").inner_text() == "Angle stays at 75 deg."
    rows = page.locator(".outcome tbody tr")
    shown = [row for row in rows.all() if row.is_visible()]
    assert len(shown) < rows.count()
    for row in shown:
        cells = row.locator("td:not(.change)").all_inner_texts()
        assert set(cells) - {"0", "\u2013"}
    page.get_by_role("tab", name="Step response").click()
    page.wait_for_timeout(300)
    assert "Angle of the ankle" in page.locator(".panel .title").all_inner_texts()


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
    page.locator("summary", has_text="Share and export").click()
    page.get_by_role("button", name="Copy address").click()
    assert "Nothing is shared: friction.dynamic_torque must be at most" in page.locator(".notice").inner_text()
    refused = "1=torque-task-proportional;friction.dynamic_torque=3+N+m"
    assert "must be at most friction.static_torque" in page.evaluate(f"workbench.open('{refused}')")


@has_browser
def test_ranges_are_written_as_people_write_them(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    for group in ("Friction", "Actuator", "Run", "Gas"):
        page.locator("summary", has_text=group).first.click()
    said = {}
    for key in ("friction.static_torque", "actuator.dead_volume_1", "actuator.angle_max", "run.step", "motion.angle"):
        page.locator(f".control[data-key='{key}'] .name").click()
        said[key] = page.locator(f"[id='about-{key}'] span").nth(1).inner_text().replace("\u00a0", " ")
    assert said == {
        "friction.static_torque": "0 to 10,000 N m. friction.static_torque",
        "actuator.dead_volume_1": "More than 0 cm³. actuator.dead_volume_1",
        "actuator.angle_max": "\u2212572 to 572 deg. actuator.angle_max",
        "run.step": "10⁻⁵ to 1,000,000 ms. run.step",
        "motion.angle": "\u2212572 to 572 deg. motion.angle",
    }


@has_browser
def test_files_that_are_not_opened_are_named(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    page.evaluate(
        """() => {
        const data = new DataTransfer();
        const text = "time [s],torque [N m]\\n0,0\\n1,1\\n2,2\\n";
        for (const name of ["one.csv", "two.csv", "three.csv"]) data.items.add(new File([text], name));
        window.dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
    }"""
    )
    page.locator(".notice", has_text="Not opened").wait_for()
    said = page.locator(".notice").inner_text()
    assert said.startswith("one.csv")
    assert said.endswith("Not opened, as one file is read at a time: two.csv, three.csv.")


@has_browser
def test_there_is_one_main_landmark_and_pressures_have_units(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)
    assert page.get_by_role("main").count() == 1
    assert page.get_by_role("tabpanel").count() == 1
    pressures = page.locator(".drawing text").all_text_contents()
    assert next(text for text in pressures if text.endswith(" psi")) == "1: 50 psi"
    # Neither number runs across the vane or the other one, wherever the vane is.
    for address in ("1=torque-task-solenoid;motion.angle=21+deg", "1=torque-task-solenoid;motion.angle=129+deg"):
        page.evaluate(f"workbench.open('{address}')")
        page.wait_for_timeout(300)
        boxes = page.evaluate(
            "['.drawing .vane', '.drawing .words:nth-of-type(1)', '.drawing .words:nth-of-type(2)']"
            ".map(name => { const {left, right, top, bottom} = document.querySelector(name).getBoundingClientRect();"
            " return [left, right, top, bottom]; })"
        )
        for one in range(3):
            for other in range(one):
                (a, b, c, d), (e, f, g, h) = boxes[one], boxes[other]
                assert b <= e or f <= a or d <= g or h <= c
