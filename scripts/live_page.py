"""Checks and measures the page that simulates in a headless Chromium: bits of Python, damaged files, speed, pictures.

It needs Playwright (``pip install playwright``) and a Chromium (``chromium`` on the path).

    python scripts/live_page.py bits --states 1000
    python scripts/live_page.py refusals --scenarios torque-task-solenoid off
    python scripts/live_page.py damage --files 1000
    python scripts/live_page.py speed
    python scripts/live_page.py pictures docs/images
"""

import argparse
import contextlib
import importlib.util
import math
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.errors import PpafoError
from ppafo.page.workbench import DEFAULT, workbench
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import Result
from ppafo.units import parse_quantity
from ppafo.walking.loading import load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk
from scripts.page_states import (
    address_of,
    disagreements,
    hard_states,
    is_of_page,
    mutated,
    python_refusal,
    random_changes,
)

READY = '[data-ready="true"]'
METRICS = 1.0e-12
"""Largest difference of a metric of the page from that of Python, relative."""
_OUTCOME = """place => {
    const run = workbench.run(place);
    const channels = Object.fromEntries(Object.entries(run.channels).map(([name, values]) => [name, [...values]]));
    return {scenario: workbench.scenario(place), ending: run.ending, fault: run.fault, time: [...run.time], channels,
            metrics: run.metrics};
}"""


def missing() -> str:
    """Return what is missing for a headless browser; empty where nothing is."""
    if importlib.util.find_spec("playwright") is None:
        return "Playwright is not installed"
    return "" if shutil.which("chromium") else "there is no chromium on the path"


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """Give a headless Chromium for a while."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launch = playwright.chromium.launch
        with contextlib.closing(launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])) as found:
            yield found


def opened(chromium: Any, file: Path, address: str = "", **context: Any) -> Any:
    """Return a page of a file that is ready, with what it asked for and said in ``page.requests`` and ``page.said``."""
    page = chromium.new_context(**context).new_page()
    page.requests, page.said = [], []
    page.on("request", lambda request: page.requests.append(request.url))
    page.on("console", lambda message: page.said.append(message.text))
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.goto(f"file://{file}{address}")
    page.wait_for_selector(READY, state="attached")
    return page


def programs_by_tab(page: Any) -> list[tuple[int, Mapping[str, Any]]]:
    """Return the tab, from 1, and the content of every program of a page."""
    content = page.evaluate("workbench.content")
    by_name = {program["name"]: program for program in content["programs"]}
    return [(place, by_name[name]) for place, tab in enumerate(content["tabs"], 1) for name in tab["programs"]]


def differences(
    page: Any, tab: int, program: Mapping[str, Any], changes: Mapping[str, str], folder: Path
) -> str | None:
    """Return how a state of the page departs from Python, which runs its scenario file; empty where nothing does.

    None where both refuse the state.
    """
    refused = page.evaluate("address => workbench.open(address)", address_of(tab, program["name"], changes))
    if refused:
        texts = [f"{key}={text}" for key, text in changes.items()]
        is_refused = any(is_of_page(program, key) for key in changes) or python_refusal(program, texts)
        return None if is_refused else f"the page does not open it: {refused}"
    page.wait_for_selector(READY, state="attached")
    while page.evaluate("workbench.run(0) === null"):
        page.wait_for_timeout(20)
    told = page.evaluate(_OUTCOME, 0)
    file = folder / "state.toml"
    file.write_text(told["scenario"], encoding="utf-8")
    try:
        # The record of a run that fails is shorter than the run that was asked for.
        length = told["time"][-1] if told["ending"] == "completed" else parse_quantity(changes["run.duration"], "s")
        result = _run_in_python(program, file, length)
    except PpafoError as error:
        return None if told["ending"] == "refused" else f"Python refuses what the page runs: {error}"
    if told["ending"] == "refused":
        return f"the page refuses what Python runs: {told['fault']}"
    return _departure(told, result)


def _run_in_python(program: Mapping[str, Any], file: Path, length: float) -> Result | WalkResult:
    """Run what the page wrote; a walk, whose file says nothing of its length, for as long [s] as the page did."""
    if program["kind"] == "scenario":
        return simulate(load_scenario(str(file)))
    configuration = load_walk(file)
    return walk(configuration, minutes=length / 60.0)


def _departure(told: Mapping[str, Any], result: Result | WalkResult) -> str:
    """Return the first thing in which a run of the page is not that of Python; empty where nothing is."""
    recording = result.recording
    if not np.array_equal(told["time"], recording.time):
        return f"other times: {len(told['time'])} samples, {len(recording.time)} in Python"
    channels = {name: values for name, values in told["channels"].items() if name in recording}
    for name, values in channels.items():
        other = np.flatnonzero(np.asarray(values, float) != recording[name])
        if other.size:
            return f"{name} differs in {other.size} samples, the first is number {other[0]}"
    for name, metric in result.metrics.items():
        value = told["metrics"].get(name, metric.value)
        if not _is_near(value, metric.value):
            return f"metric {name} is {value!r}, {metric.value!r} in Python"
    return ""


def _is_near(value: float | None, other: float) -> bool:
    value = math.nan if value is None else value
    if math.isnan(value) or math.isnan(other):
        return math.isnan(value) and math.isnan(other)
    # A sum that comes out at nothing, such as the imbalance of the gas, has no digits to compare.
    return abs(value - other) <= METRICS * max(abs(other), 1e-6)


def check_bits(page: Any, states: int, seed: int, folder: Path) -> tuple[list[str], int]:
    """Return what departs from Python in random states of every program of a page, and how many states were run."""
    rng = random.Random(seed)
    found, runs = [], 0
    for tab, program in programs_by_tab(page):
        for number in range(states):
            changes = random_changes(program, rng)
            wrong = differences(page, tab, program, changes, folder)
            runs += wrong == ""
            if wrong:
                found.append(f"{program['name']}, state {number}: {wrong}; {changes}")
    return found, runs


def check_refusals(page: Any, draws: int, seed: int, folder: Path, most: int | None = None) -> tuple[list[str], int]:
    """Return hard states that only page or Python refuses, and how many were tried; ``most`` of each program."""
    rng = random.Random(seed)
    units = page.evaluate("workbench.content")["units"]
    found, tried = [], 0
    for tab, program in programs_by_tab(page):
        given = list(hard_states(program, units, draws, rng))
        given = given if most is None or most >= len(given) else rng.sample(given, most)
        found += disagreements(page, tab, program, given, folder)
        tried += len(given)
    return found, tried


def check_damage(page: Any, files: int, seed: int) -> list[str]:
    """Return the damaged recordings, state files and addresses at which the page did not keep its countenance."""
    rng = random.Random(seed)
    rows = "\n".join(f"{0.001 * row:.3f},{0.01 * row:.4f},{row % 7}" for row in range(60))
    recording = f"time [s],torque [N m],pressure_1 [psi_g]\n{rows}\n"
    state, address = (
        page.evaluate("workbench.file()"),
        "tab=1&1=torque-task-solenoid;valve.area=14+mm^2;supply.pressure=60+psi_g",
    )
    found = []
    for number in range(files):
        kind = ("recording", "state", "address")[number % 3]
        given = mutated({"recording": recording, "state": state, "address": address}[kind], rng)
        call = {
            "recording": "text => workbench.read('a.csv', text)",
            "state": "text => workbench.openFile(text)",
            "address": "text => workbench.open(text)",
        }
        try:
            told = page.evaluate(call[kind], given)
        except Exception as error:  # whatever Playwright says of an exception in the page is a finding
            found.append(f"{kind} {number}: {error}")
            continue
        if (kind == "recording" and not told) or "\n" in told:
            found.append(f"{kind} {number}: said {told!r}")
    return found + [f"the page said: {text}" for text in page.said]


_FRAMES = """() => {
    window.frames_seen = [];
    const next = now => { frames_seen.push(now); requestAnimationFrame(next); };
    requestAnimationFrame(next);
}"""


def drag(page: Any, seconds: float) -> dict[str, float]:
    """Drag the first slider to and fro; return frames a second, share of them within 17 ms, simulation in ms."""
    page.evaluate(_FRAMES)
    slider = page.locator(".control input[type=range]").first
    box = slider.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 20, middle)
    page.mouse.down()
    taken, began, step = [], time.perf_counter(), 0
    while time.perf_counter() - began < seconds:
        step += 1
        page.mouse.move(box["x"] + 20 + (box["width"] - 40) * (0.5 + 0.5 * math.sin(step / 20)), middle)
        taken.append(float(page.evaluate("document.querySelector('.workbench').dataset.milliseconds")))
    page.mouse.up()
    lengths = np.diff(page.evaluate("frames_seen"))
    return {
        "frames a second": 1000.0 / float(np.mean(lengths)),
        "share of frames within 17 ms": float(np.mean(lengths <= 17.0)),
        "simulation, median, ms": float(np.median(taken)),
        "simulation, 95 %, ms": float(np.quantile(taken, 0.95)),
    }


_BESIDE_THE_MAP = ".control[data-key='reference.level'] input[type=range]"
"""A slider that the map does not go over, so that all its runs are made anew."""


def measure(chromium: Any, file: Path, seconds: float = 10.0) -> dict[str, float]:
    """Return the figures of speed of a page, by name."""
    found: dict[str, float] = {"size of the page, kB": file.stat().st_size / 1e3}
    page = opened(chromium, file, viewport={"width": 1400, "height": 1000})
    page.wait_for_timeout(1000)
    found |= drag(page, seconds)
    page.locator("summary", has_text="Map of two settings").click()
    page.wait_for_selector("canvas.map[data-milliseconds]")
    page.wait_for_timeout(2000)
    page.evaluate(_FRAMES)
    times = []
    for key in ("ArrowRight", "ArrowLeft") * 4:
        page.evaluate("delete document.querySelector('canvas.map').dataset.milliseconds")
        page.locator(_BESIDE_THE_MAP).press(key)
        page.wait_for_selector("canvas.map[data-milliseconds]")
        page.wait_for_timeout(700)
        data = page.evaluate("({...document.querySelector('canvas.map').dataset})")
        times.append((float(data["first"]), float(data["milliseconds"])))
    first, whole = np.median(times, axis=0)
    found["map, the first 256 runs are drawn after, ms"] = float(first)
    found["map of 1,024 runs, median, ms"] = float(whole)
    found["longest frame while the map is made, ms"] = float(np.max(np.diff(page.evaluate("frames_seen"))))
    found["first curve dragged, 390 px, four times slower, ms"] = _first_curve(chromium, file)
    return found


_DRAG_AT_ONCE = """new MutationObserver((_, observer) => {
    observer.disconnect();
    const slider = document.querySelector('.control input[type=range]');
    slider.value = 200;
    slider.dispatchEvent(new Event('input'));
    // Drawn in the coming frame, and seen when the one after it begins.
    requestAnimationFrame(() => requestAnimationFrame(() => { window.first_curve = performance.now(); }));
}).observe(document, {subtree: true, attributeFilter: ['data-ready']})"""


def _first_curve(chromium: Any, file: Path) -> float:
    """Milliseconds from opening to the first curve that was dragged, on a slow phone."""
    page = chromium.new_context(viewport={"width": 390, "height": 844}).new_page()
    page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": 4})
    page.add_init_script(_DRAG_AT_ONCE)
    page.goto(f"file://{file}", wait_until="commit")
    # The page drags itself: what Playwright puts into a page to ask it something takes its time there too.
    page.wait_for_timeout(8000)
    return float(page.evaluate("first_curve"))


def take_pictures(chromium: Any, file: Path, folder: Path) -> Iterator[Path]:
    """Write the picture of the documentation into a folder, small; gives its path."""
    from PIL import Image

    page = opened(chromium, file, "", viewport={"width": 1400, "height": 1000}, color_scheme="light")
    page.wait_for_timeout(600)
    path = folder / "workbench.png"
    page.screenshot(path=str(path))
    Image.open(path).convert("RGB").quantize(128).save(path, optimize=True)
    yield path


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("bits", "refusals", "damage", "speed", "pictures"))
    parser.add_argument("folder", nargs="?", type=Path, default=Path("docs/images"), help="where pictures go")
    parser.add_argument("--states", type=int, default=1000, help="random states of each scenario")
    parser.add_argument("--draws", type=int, default=300, help="hard draws of times, and of several settings at once")
    parser.add_argument("--most", type=int, help="hard states of each scenario (default: all)")
    parser.add_argument("--files", type=int, default=1000, help="damaged files")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenarios", nargs="+", default=list(DEFAULT))
    parsed = parser.parse_args()
    if missing():
        print(missing(), file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as place, browser() as chromium:
        file = Path(place) / "page.html"
        file.write_bytes(workbench(parsed.scenarios))
        if parsed.what == "speed":
            print("\n".join(f"{name:<52} {value:8.3g}" for name, value in measure(chromium, file).items()))
            return 0
        if parsed.what == "pictures":
            print("\n".join(map(str, take_pictures(chromium, file, parsed.folder))))
            return 0
        page = opened(chromium, file)
        if parsed.what == "bits":
            found, runs = check_bits(page, parsed.states, parsed.seed, Path(place))
            print(f"{runs} runs have the bits of Python")
        elif parsed.what == "refusals":
            found, tried = check_refusals(page, parsed.draws, parsed.seed, Path(place), parsed.most)
            print(f"{tried} states were tried")
        else:
            found = check_damage(page, parsed.files, parsed.seed)
    print("\n".join(found) or "nothing departs")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
