"""The page that simulates, in a headless browser: what it asks for, whether its bits are Python's, what damage does."""

import base64
import gzip
import os
import random
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ppafo.page import html as pages
from ppafo.page.html import packed, packed_once
from ppafo.page.workbench import DEFAULT, known_intervals, workbench
from ppafo.simulation.loading import load_scenario
from ppafo.units import parse_quantity
from ppafo.walking import list_walks, load_walk
from scripts.known_intervals import known_intervals as intervals_of_study
from scripts.live_page import check_bits, check_damage, check_refusals, differences, missing, opened, programs_by_tab
from scripts.page_states import address_of

MOST_BYTES = 250_000
SOURCES = Path(__file__).parents[3] / "page"
TOOLS = SOURCES / "node_modules"
has_browser = pytest.mark.skipif(bool(missing()), reason=missing() or "there is a browser")
has_tools = pytest.mark.skipif(
    shutil.which("node") is None or not (TOOLS / "esbuild").is_dir(),
    reason="node or the tools in page/node_modules are not there",
)


def test_the_page_is_one_file_of_at_most_250_kilobytes_that_names_no_other(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert len(text.encode()) <= MOST_BYTES
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", text.split("<script>")[0])


def test_the_policy_allows_one_script_and_one_style_by_their_digests(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy is not None
    assert "default-src 'none'" in policy[1]
    assert "unsafe-inline" not in policy[1]
    assert pages.digest(pages.bundled("loader.js")) in policy[1]
    assert pages.digest(pages.bundled("page.css")) in policy[1]


def test_the_same_scenarios_give_the_same_page(file: Path) -> None:
    assert workbench() == file.read_bytes()


def test_every_default_of_the_page_is_what_its_text_says() -> None:
    from ppafo.page.content import PageSimulation, program_content
    from ppafo.page.wasm import module_of

    for name in DEFAULT:
        scenario = load_walk(name) if name in list_walks() else load_scenario(name)
        content = program_content(PageSimulation(scenario, module_of(scenario), name), "module", {})
        texts = {one["key"]: one for one in content["settings"] if one["text"]}
        assert "supply.pressure" in texts
        for setting in texts.values():
            assert parse_quantity(setting["text"], setting["unit"]) == setting["value"]


def test_a_pipe_is_no_page_and_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.html")
    assert not pages.is_page(tmp_path / "pipe.html")


def test_the_intervals_of_the_page_are_those_of_the_study() -> None:
    assert known_intervals() == {path: tuple(ends) for path, ends in intervals_of_study().items()}, (
        "python scripts/known_intervals.py"
    )


def test_what_pages_hold_is_packed_once_and_unpacks_to_itself(fresh_cache: Path) -> None:
    content = bytes(range(256)) * 40
    first = packed_once(content)
    assert packed_once(content) == first == packed(content)
    assert gzip.decompress(base64.b85decode(first)) == content
    assert len(list(fresh_cache.rglob("packed-*"))) == 1


@has_browser
def test_a_text_that_a_control_shows_can_be_edited_and_what_is_refused_is_forgotten(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport={"width": 1400, "height": 1000})
    field = page.get_by_label("Supply pressure", exact=True)
    assert field.input_value().split() == ["50", "psi", "gauge"]
    field.fill(field.input_value().replace("50", "55"))
    field.press("Enter")
    assert page.evaluate("workbench.values(0)")["supply.pressure"] == parse_quantity("55 psi_g", "Pa_a")
    field.fill("70")
    field.press("Escape")
    assert field.input_value().split() == ["55", "psi", "gauge"]
    assert page.evaluate("workbench.values(0)")["supply.pressure"] == parse_quantity("55 psi_g", "Pa_a")
    field.fill("5 parsec")
    field.press("Enter")
    fault = page.locator(".control[data-key='supply.pressure'] .fault")
    assert "does not fit here" in fault.inner_text()
    page.get_by_role("button", name="Reset all").click()
    fault.wait_for(state="hidden")
    assert (field.input_value().split()[0], field.get_attribute("aria-invalid")) == ("50", "false")
    assert "must be" in page.evaluate("workbench.open('1=torque-task-solenoid;run.output_interval=0.7+ms')")
    assert page.said == []


@has_browser
def test_a_walk_is_short_and_no_shorter_than_python_allows(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, "#tab=3", viewport={"width": 1400, "height": 1000})
    lengths = "JSON.parse(workbench.file()).benches[2].map(({changes}) => changes['run.duration'])"
    page.get_by_label("Add a configuration").select_option("solenoid")
    assert page.evaluate(lengths) == ["6 s", "6 s"]
    page.locator("summary", has_text="Run").last.click()
    field = page.get_by_label("Length of the run", exact=True)
    for text in ("5 s", "61 min"):
        field.fill(text)
        field.press("Enter")
        assert "outside of its range" in page.locator(".control[data-key='run.duration'] .fault").inner_text()
    field.fill("7")
    field.press("Enter")
    assert page.evaluate(lengths) == ["7 s", "7 s"]
    page.get_by_label("Put Length of the run back").click()
    assert page.evaluate(lengths) == ["6 s", "6 s"]
    # More samples than a module can be asked for are a message and not a trap.
    page.evaluate("workbench.open('tab=3&3=solenoid;run.duration=60+min;run.step=0.1+ms;run.output_interval=0.1+ms')")
    page.locator("#panel > .fault", has_text="too many samples").wait_for()
    assert page.said == []


@has_browser
def test_the_page_asks_for_nothing_and_says_nothing(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport={"width": 1400, "height": 1000})
    for title in ("Walk", "Step response", "Torque task"):
        page.get_by_role("tab", name=title).click()
    for summary in page.query_selector_all("details.folded > summary"):
        summary.click()
    page.get_by_label("Uncertainty").check()
    page.get_by_role("button", name="Move each assumption").click()
    page.wait_for_selector(".assumptions table")
    page.wait_for_selector("canvas.map[data-milliseconds]")
    assert page.said == []
    assert [url for url in page.requests if not url.startswith(("data:", "blob:"))] == [f"file://{file}"]


@has_browser
def test_random_states_have_the_bits_of_python(chromium: Any, file: Path, tmp_path: Path) -> None:
    found, runs = check_bits(opened(chromium, file), states=6, seed=16, folder=tmp_path)
    assert found == []
    assert runs >= 12


@has_browser
def test_a_typed_text_becomes_the_same_bits_as_in_python(chromium: Any, file: Path) -> None:
    page, rng = opened(chromium, file), random.Random(3)
    content = page.evaluate("workbench.content")
    tab, program = programs_by_tab(page)[0]
    wrong = []
    for setting in program["settings"]:
        if setting["kept"] or setting["key"].endswith(("seed", "atmospheric_pressure")):
            continue
        for scale in content["units"][setting["unit"]]:
            low, high = setting["slider"]
            text = f"{rng.uniform(low, high)!r} {scale['unit']}".strip()
            if page.evaluate(
                "address => workbench.open(address)", address_of(tab, program["name"], {setting["key"]: text})
            ):
                continue
            unit = f"{text}_d" if setting["unit"] == "Pa_d" and not text.endswith("_d") else text
            expected = parse_quantity(unit, setting["unit"])
            if page.evaluate("workbench.values(0)")[setting["key"]] != expected:
                wrong.append((setting["key"], text))
    assert wrong == []


@has_browser
def test_the_page_refuses_what_python_refuses(chromium: Any, file: Path, tmp_path: Path) -> None:
    found, tried = check_refusals(opened(chromium, file), draws=20, seed=5, folder=tmp_path, most=150)
    assert found == []
    assert tried == 600


@has_browser
def test_the_state_survives_address_file_and_scenario(chromium: Any, file: Path, tmp_path: Path) -> None:
    changes = {
        "supply.pressure": "62.5 psi_g",
        "reference.level": "4.25 N m",
        "supply.atmospheric_pressure": "12 psi_a",
    }
    page = opened(chromium, file, "#" + address_of(1, "torque-task-proportional", changes))
    assert page.evaluate("workbench.address()") == "1=torque-task-proportional;" + ";".join(
        f"{key}={text.replace(' ', '+')}" for key, text in changes.items()
    )
    values, kept = page.evaluate("workbench.values(0)"), page.evaluate("workbench.file()")
    page.get_by_role("button", name="Reset all").click()
    assert page.evaluate("workbench.values(0)") != values
    assert page.evaluate("text => workbench.openFile(text)", kept) == ""
    assert page.evaluate("workbench.values(0)") == values
    scenario = tmp_path / "state.toml"
    scenario.write_text(page.evaluate("workbench.scenario(0)"), encoding="utf-8")
    assert load_scenario(str(scenario)).device.supply.pressure == values["supply.pressure"]


@has_browser
@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("#1=torque-task-solenoid;valve.aera=3+mm^2", "there is no setting 'valve.aera', did you mean 'valve.area'?"),
        ("#1=torque-task-solenoid;valve.area=3+parsec", "unit 'parsec' does not fit here"),
        ("#1=torque-task-solenoid;valve.area=-3+mm^2", "outside of its range"),
        ("#tab=9", "'9' is no tab of this page"),
        ("#1=%E0%A4%A", "is cut off or damaged"),
    ],
)
def test_a_damaged_address_gives_one_line_and_the_page_as_usual(
    chromium: Any, file: Path, address: str, said: str
) -> None:
    page = opened(chromium, file, address)
    notice = page.locator(".notice").inner_text()
    assert said in notice
    assert "\n" not in notice
    assert page.evaluate("workbench.file()") == opened(chromium, file).evaluate("workbench.file()")


@has_browser
def test_damaged_files_give_a_message_and_never_an_exception(chromium: Any, file: Path) -> None:
    assert check_damage(opened(chromium, file), files=60, seed=4) == []


@has_browser
def test_a_slider_is_dragged_and_the_drag_is_undone_at_once(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport={"width": 1400, "height": 1000})
    before, run = page.evaluate("workbench.file()"), page.evaluate("workbench.run(0).metrics")
    slider = page.locator(".control[data-key='supply.pressure'] input[type=range]")
    slider.focus()
    box = slider.bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + box["height"] / 2)
    page.mouse.down()
    for share in (0.5, 0.6, 0.7, 0.8):
        page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    page.mouse.up()
    assert page.evaluate("workbench.run(0).metrics") != run
    page.get_by_role("button", name="Undo").click()
    assert page.evaluate("workbench.file()") == before


@has_browser
def test_a_map_over_the_atmosphere_is_the_same_when_it_is_turned(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport={"width": 1400, "height": 1000})
    page.locator("summary", has_text="Map of two settings").click()
    # The first map to its end, which would else be taken for the one that is asked for.
    page.wait_for_selector("canvas.map[data-milliseconds]")
    told = []
    for pair in (
        ("supply.atmospheric_pressure", "supply.pressure"),
        ("supply.pressure", "supply.atmospheric_pressure"),
    ):
        # In one go: on a quick machine the map would be drawn before its time is taken away.
        page.evaluate(
            """keys => {
                delete document.querySelector('canvas.map').dataset.milliseconds;
                ['Across', 'Up'].forEach((label, place) => {
                    const list = document.querySelector(`select[aria-label='${label}']`);
                    list.value = keys[place];
                    for (const kind of ['input', 'change']) list.dispatchEvent(new Event(kind, { bubbles: true }));
                });
            }""",
            list(pair),
        )
        page.wait_for_selector("canvas.map[data-milliseconds]")
        told.append(page.locator(".scale").inner_text())
    assert told[0] == told[1]


@has_browser
def test_everything_can_be_reached_and_changed_by_keyboard_alone(chromium: Any, file: Path) -> None:
    page = opened(chromium, file, viewport={"width": 1400, "height": 1000})
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate("document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent")
        )
    assert {"Share and export", "Torque task", "Supply pressure", "Supply pressure, slider", "Valve area"} <= reached
    page.locator(".control[data-key='supply.pressure'] input[type=range]").focus()
    page.keyboard.press("ArrowRight")
    assert "supply.pressure" in page.evaluate("workbench.address()")
    page.get_by_label("Supply pressure", exact=True).fill("3 bar_g")
    page.keyboard.press("Enter")
    assert page.evaluate("workbench.values(0)")["supply.pressure"] == parse_quantity("3 bar_g", "Pa_a")


@has_browser
def test_a_recording_of_one_s_own_is_compared_as_validate_does(chromium: Any, file: Path) -> None:
    import numpy as np

    from ppafo.running import simulate
    from ppafo.validation.agreement import channel_agreement
    from ppafo.validation.delay import ComparedCurve, estimate_delay
    from ppafo.validation.settings import DEFAULT_LIMIT

    recording = simulate(load_scenario("torque-task-solenoid")).recording
    time = recording.time[50:2900:3]
    late = np.interp(time - 0.004, recording.time, recording["torque"]) + 0.1 * np.sin(40.0 * time)
    rows = "\n".join(f"{t!r},{x!r}" for t, x in zip(time.tolist(), late.tolist(), strict=True))
    page = opened(chromium, file)
    assert "is overlaid on the runs" in page.evaluate(
        "text => workbench.read('a.csv', text)", f"time [s],torque [N m]\n{rows}\n"
    )
    page.wait_for_selector(".recording table")
    shown = page.locator(".recording tbody tr").first.inner_text()
    supply = load_scenario("torque-task-solenoid").device
    full = 2.0 * (supply.supply.pressure - supply.supply.atmospheric_pressure) * supply.actuator.torque_constant
    curve = ComparedCurve("torque", "N m", time, late, recording.time, recording["torque"], full, usual_zero=0.0)
    expected = channel_agreement(curve, estimate_delay([curve], DEFAULT_LIMIT).value)
    assert f"{expected.rms:.3g} N\u00a0m" in shown
    assert f"{100.0 * expected.fraction:.3g} %" in shown
    # Of two files that are read at once the later one counts, and only what the run has is compared.
    longer = f"time [s],torque [N m]\n{rows}\n3.5,0.0\n"
    page.evaluate("text => Promise.all([workbench.read('b.csv', text), workbench.read('c.csv', text)])", longer)
    assert page.locator(".notice").inner_text().startswith("c.csv is overlaid")
    page.locator(".recording .note", has_text="is compared up to 3 s").wait_for(state="attached")
    assert f"{expected.rms:.3g} N\u00a0m" in page.locator(".recording tbody tr").first.inner_text()


@has_browser
@pytest.mark.parametrize("width", [390, 1400])
def test_nothing_is_wider_than_the_screen(chromium: Any, file: Path, width: int) -> None:
    page = opened(chromium, file, viewport={"width": width, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


@has_browser
@pytest.mark.skipif(not (TOOLS / "axe-core").is_dir(), reason="axe-core is not in page/node_modules")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_accessibility_checker_finds_nothing_serious(chromium: Any, file: Path, scheme: str) -> None:
    page = opened(chromium, file, color_scheme=scheme, viewport={"width": 1400, "height": 1000})
    for summary in page.query_selector_all("details > summary"):
        summary.click()
    page.evaluate((TOOLS / "axe-core" / "axe.min.js").read_text(encoding="utf-8"))
    found = page.evaluate("axe.run().then(result => result.violations)")
    serious = [(one["id"], one["nodes"][0]["html"][:120]) for one in found if one["impact"] in ("serious", "critical")]
    assert serious == []


@has_tools
def test_the_bundle_is_what_its_sources_make(tmp_path: Path) -> None:
    subprocess.run([str(TOOLS / ".bin" / "tsc"), "--project", str(SOURCES / "tsconfig.json")], check=True, timeout=120)
    subprocess.run(["node", str(SOURCES / "build.mjs"), str(tmp_path)], check=True, timeout=120)
    for name in ("loader.js", "page.js", "page.css"):
        assert (tmp_path / name).read_text(encoding="utf-8").strip() == pages.bundled(name)


def test_the_vendored_library_has_its_licence() -> None:
    assert "Leon Sorokin" in (SOURCES / "vendor" / "uplot" / "LICENSE").read_text(encoding="utf-8")
    assert "Leon Sorokin" in pages.bundled("page.js")


@has_browser
def test_what_follows_on_the_page_and_what_stays_is_what_its_file_gives_python(chromium: Any, tmp_path: Path) -> None:
    """Segments follow a stature once it is given; gains of an angle, whose rules the page does not know, stay."""
    file = tmp_path / "page.html"
    file.write_bytes(workbench(["swing-foot-angle", "solenoid"]))
    page = opened(chromium, file)
    changes = {"swing-foot-angle": {"supply.pressure": "4 bar_g"}, "solenoid": {"wearer.stature": "1.5 m"}}
    for tab, program in programs_by_tab(page):
        given = {"run.duration": "0.5 s" if program["kind"] == "scenario" else "7 s", **changes[program["name"]]}
        assert differences(page, tab, program, given, tmp_path) == ""
