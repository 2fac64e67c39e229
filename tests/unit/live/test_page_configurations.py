"""Several configurations on the page that simulates, in a headless browser: axes, gauge pressures, focus, late work."""

import time
from pathlib import Path
from typing import Any

import pytest

from ppafo import parameters
from ppafo.constants import PASCALS_PER_PSI
from ppafo.page.workbench import workbench
from scripts.live_page import missing, opened

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing() or "there is a browser")
SHIPPED_SET = Path(parameters.__file__).parent / "sets" / "cylinder-lever.toml"
BLADDER = Path(__file__).parents[2] / "actuators" / "torque-task-measured-bladder.toml"
RECORDING = "time [s],torque [N m]\n0,0\n1,1\n2,1\n3,0\n"
LARGE = {"width": 1400, "height": 1000}
FOCUSED = "document.activeElement.getAttribute('aria-label') ?? document.activeElement.tagName"

_WATCHED = """() => {
    const Plain = Worker;
    window.crew = [];
    window.Worker = class extends Plain {
        asked = []; answered = []; isStopped = false;
        constructor(address) {
            super(address);
            crew.push(this);
            this.addEventListener("message", ({ data }) => this.answered.push(data.number));
        }
        postMessage(job, ...others) { this.asked.push(job); super.postMessage(job, ...others); }
        terminate() { this.isStopped = true; super.terminate(); }
    };
}"""
"""Workers are noted with what they are asked: those of a page start when they are first wanted."""
_RUNS = "crew.flatMap(one => one.asked).filter(({kind}) => kind === 'runs')"
_NEW_RUNS = _RUNS.replace("crew", "crew.filter(one => !one.isStopped)")
_AT_REST = """crew.filter(one => !one.isStopped).every(one =>
    one.asked.every(({kind, number}) => kind === 'program' || one.answered.includes(number)))"""

_LOAD = """files => {
    const chooser = document.querySelector("input[accept^='.json']");
    const plain = Blob.prototype.text;
    Blob.prototype.text = async function () {
        await new Promise(done => setTimeout(done, this.name === "slow.json" ? 400 : 0));
        return plain.call(this);
    };
    for (const [name, text] of files) {
        const chosen = new DataTransfer();
        chosen.items.add(new File([text], name));
        chooser.files = chosen.files;
        chooser.dispatchEvent(new Event("change"));
    }
}"""
"""Choose files of states one after the other; one called slow.json is read slowly."""


def wait_until(page: Any, expression: str, seconds: float = 60.0) -> None:
    """Wait until an expression is true; the policy of the page lets it be asked from outside only."""
    until = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < until, expression
        page.wait_for_timeout(50)


def saved(page: Any, address: str) -> str:
    """Open a state and return its file."""
    assert page.evaluate("address => workbench.open(address)", address) == ""
    return str(page.evaluate("workbench.file()"))


def test_a_state_that_is_read_while_the_page_is_changed_does_not_undo_that(chromium: Any, file: Path) -> None:
    page = opened(chromium, file)
    slow = saved(page, "1=torque-task-solenoid;valve.area=11+mm^2")
    page.evaluate(_LOAD, [("slow.json", slow)])
    mine = saved(page, "1=torque-task-solenoid;valve.area=13+mm^2")
    page.locator(".notice", has_text="the page was changed before it was read; load it again").wait_for()
    assert page.evaluate("workbench.file()") == mine


def test_plots_go_to_the_end_of_the_longest_run(chromium: Any, file: Path) -> None:
    task = "run.output_interval={}+ms;run.duration={}+s"
    short, long = task.format(1, 2), task.format(10, 5)
    address = f"#1=torque-task-solenoid;{short}&1=torque-task-proportional;{long}"
    page = opened(chromium, file, address, viewport=LARGE)
    for is_beside in (False, True):
        page.get_by_label("Side by side").set_checked(is_beside)
        page.wait_for_selector(".panels.beside" if is_beside else ".panels:not(.beside)")
        box = page.locator(".panel .u-over").first.bounding_box()
        page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 0.5 * box["height"])
        assert float(page.locator(".clock").inner_text().split()[0]) == pytest.approx(4.5, abs=0.05)


def test_gauge_pressures_count_from_the_atmosphere_of_their_configuration(chromium: Any, file: Path) -> None:
    high = "supply.atmospheric_pressure=70+kPa_a"
    address = f"#1=torque-task-proportional&1=torque-task-proportional;{high}"
    page = opened(chromium, file, address, viewport=LARGE)
    page.locator(".panel", has_text="Pressures").scroll_into_view_if_needed()
    box = page.locator(".panel", has_text="Pressures").locator(".u-over").bounding_box()
    page.mouse.move(box["x"] + 0.999 * box["width"], box["y"] + 0.5 * box["height"])
    shown = [float(text) for text in page.locator(".panel", has_text="Pressures").locator("b").all_inner_texts()]
    for place in (0, 1):
        values = page.evaluate("place => workbench.values(place)", place)
        last = page.evaluate("place => workbench.run(place).channels.pressure_1.at(-1)", place)
        gauge = (last - values["supply.atmospheric_pressure"]) / PASCALS_PER_PSI
        assert shown[2 * place] == pytest.approx(gauge, abs=0.2)


def test_a_gauge_recording_is_compared_with_each_run_from_the_atmosphere_of_that(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, "#1=torque-task-proportional;supply.atmospheric_pressure=70+kPa_a", viewport=LARGE)
    run, values = page.evaluate("workbench.run(0)"), page.evaluate("workbench.values(0)")
    atmosphere = values["supply.atmospheric_pressure"]
    pressures = run["channels"]["pressure_1"]
    rows = "\n".join(f"{at!r},{pressure - atmosphere!r}" for at, pressure in zip(run["time"], pressures, strict=True))
    page.evaluate("workbench.open('1=torque-task-proportional')")
    said = page.evaluate("text => workbench.read('a.csv', text)", f"time [s],pressure_1 [Pa_g]\n{rows}\n")
    assert "is overlaid" in said
    page.evaluate("workbench.open('1=torque-task-proportional;supply.atmospheric_pressure=70+kPa_a')")
    first = page.locator(".recording tbody tr").first
    first.filter(has_text="0 psi").wait_for(state="attached")
    assert float(first.inner_text().split("\t")[1].split()[0]) < 1e-6


def test_the_focus_stays_where_configurations_are_added_and_removed(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport=LARGE)

    def focused_with(configurations: int) -> str:
        page.locator(".chip").nth(configurations - 1).wait_for()
        page.locator(".chip").nth(configurations).wait_for(state="detached")
        return str(page.evaluate(FOCUSED))

    add = page.get_by_label("Add a configuration")
    add.focus()
    add.select_option("torque-task-solenoid")
    assert focused_with(3) == "Add a configuration"
    add.select_option("torque-task-solenoid")
    assert focused_with(4) == "Remove Solenoid pair 3"
    page.keyboard.press("Enter")
    assert focused_with(3) == "Add a configuration"
    # A slider keeps it where the controls are made anew.
    page.locator(".control[data-key='supply.pressure'] input[type=range]").focus()
    page.keyboard.press("Control+z")
    assert focused_with(4) == "Supply pressure, slider"


def test_work_for_settings_that_are_gone_is_given_up(chromium: Any, file: Path) -> None:
    long, short = (f"tab=3&3=solenoid;run.duration={length}" for length in ("20+min", "6+s"))
    page = opened(chromium, file, f"#{short}", viewport=LARGE)
    page.evaluate(_WATCHED)
    assert "is overlaid" in page.evaluate("text => workbench.read('a.csv', text)", RECORDING)
    page.evaluate("address => workbench.open(address)", long)
    page.get_by_label("Uncertainty").check()
    wait_until(page, f"{_RUNS}.length > 0")
    page.evaluate("address => workbench.open(address)", short)
    wait_until(page, "crew.some(one => one.isStopped)")
    assert page.evaluate("crew.filter(one => one.isStopped).every(one => one.asked.some(({kind}) => kind === 'runs'))")
    # The band of the short walk comes from all its draws, by workers that were begun anew; the recording is there.
    wait_until(page, f"{_NEW_RUNS}.length > 0 && {_AT_REST}")
    count = page.evaluate("workbench.settings(0).length")
    assert page.evaluate(f"{_NEW_RUNS}.reduce((sum, job) => sum + job.rows.length, 0)") == 200 * count
    page.locator(".recording tbody tr").first.wait_for(state="attached")
    assert page.said == []


def test_a_page_of_one_chamber_draws_one_and_asks_only_what_its_device_can_answer(
    chromium: Any, tmp_path: Path
) -> None:
    made = tmp_path / "bladder.html"
    made.write_bytes(workbench(str(BLADDER)))
    page = opened(chromium, made)
    visible = page.locator(".drawing .chamber:not([hidden]), .drawing .way:not([hidden])")
    assert visible.count() == 2
    assert page.said == []


def test_a_page_shows_units_digits_and_names_of_its_own_device(chromium: Any, tmp_path: Path) -> None:
    joint = '\n[joint]\nname = "elbow"\npositive = "flexion"\n'
    (tmp_path / "elbow.toml").write_bytes(SHIPPED_SET.read_bytes() + joint.encode())
    made = tmp_path / "elbow.html"
    made.write_bytes(
        workbench(
            ["cylinder-servo", "torque-task-moving-ankle"],
            overrides=[f"device.set={tmp_path / 'elbow.toml'}"],
        )
    )
    page = opened(chromium, made, viewport=LARGE)
    # All digits of the atmosphere, which somebody wrote, and four of a pressure that was given in another unit.
    page.locator(".control[data-key='supply.pressure'] input[type=text]").fill("50 psi_g")
    page.keyboard.press("Enter")
    assert shown_by(page, "supply.pressure") == "3.447 bar gauge"
    page.locator("summary", has_text="Supply").first.click()
    assert shown_by(page, "supply.atmospheric_pressure") == "1.01325 bar abs"
    # As the file has it.
    assert shown_by(page, "sensors.delay") == "2 ms"
    page.locator(".control[data-key='sensors.delay'] input[type=range]").fill("200")
    assert shown_by(page, "sensors.delay") == "25.3 ms"
    assert page.evaluate("workbench.values(0)")["sensors.delay"] == 0.0253
    assert page.said == []


def shown_by(page: Any, key: str) -> str:
    """Return the text in the box of a setting, once the page has drawn what was changed."""
    page.wait_for_timeout(300)
    box = page.locator(f".control[data-key='{key}'] input[type=text]")
    return str(box.input_value()).replace("\u00a0", " ")
