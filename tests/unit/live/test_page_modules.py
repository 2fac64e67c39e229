"""Modules of the page's script under node: bands of many runs, several runs on one clock, and how numbers are shown."""

import json
import random
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ppafo.loading import load_scenario
from ppafo.page.content import _SUSTAINED, page_content
from ppafo.page.wasm.description import display_of
from ppafo.parameters.reach import torque_reach
from ppafo.report.display_units import display_value, metric_quantity
from ppafo.units import without_exponent
from ppafo.units.shown import QUANTITIES, shown_in

SOURCES = Path(__file__).parents[3] / "page"
pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not (SOURCES / "node_modules" / "esbuild").is_dir(),
    reason="node or the tools in page/node_modules are not there",
)

_BUNDLED = """
import { build } from "esbuild";
const bundled = await build({ entryPoints: ["source/MODULE.ts"], bundle: true, format: "esm", write: false });
const page = await import(`data:text/javascript;base64,${Buffer.from(bundled.outputFiles[0].text).toString("base64")}`);
const told = await (WORK)(page);
console.log(JSON.stringify(told));
"""

_BAND = """async ({ bandOf }) => {
    const setting = (key, interval) => ({ key, value: 1, text: "", follows: "", made: null, words: {}, interval });
    const named = name => ({ name, unit: "", shown: "" });
    const program = {
        name: "one", kind: "scenario", metrics: [], relations: [],
        settings: [setting("a", [0, 1]), setting("b", null)],
        channels: ["command", "torque", "angle"].map(named),
    };
    const asked = [];
    const workers = { runMany: async (_, rows, trace) => {
        asked.push(trace);
        const runs = rows.length / 2;
        // A channel is its number times 1000, the place times 100, and the draw.
        const traces = Float64Array.from({ length: runs * 3 * trace.places }, (_, at) => {
            const [place, before] = [at % trace.places, Math.floor(at / trace.places)];
            return 1000 * (before % 3) + 100 * place + rows[2 * Math.floor(before / 3)];
        });
        return { metrics: new Float64Array(), ended: new Int32Array(runs), traces };
    } };
    const run = { time: Float64Array.of(0, 1, 2), channels: new Map() };
    const [content, usual] = [{ programs: [program], units: {} }, { program: "one", changes: {} }];
    const found = await bandOf(content, workers, usual, run, () => true);
    const ends = [...found].map(([name, { low, high }]) => [name, [[...low], [...high]]]);
    return { asked, bands: Object.fromEntries(ends) };
}"""

_CLOCK = """({ clockOf, onClock }) => {
    const [short, long] = [Float64Array.of(0, 0.1, 0.2), Float64Array.of(0, 0.15, 0.3, 0.45)];
    const clock = clockOf([short, long]);
    const values = onClock(clock, short, Float64Array.of(1, 2, 3));
    return { clock: [...clock], values: [...values], same: clockOf([short, short.slice()]).length };
}"""


_SHOWN = """({ plain, shownText }) => {
    const { numbers, content, values } = GIVEN;
    return {
        numbers: numbers.map(([value, digits]) => plain(value, digits)),
        values: values.map(([unit, shown, value]) => shownText(content, { unit, shown }, value, 4)),
    };
}"""


def told(module: str, work: str) -> Any:
    """What a function says of a module of the page."""
    script = _BUNDLED.replace("MODULE", module).replace("WORK", work)
    line = ["node", "--input-type=module", "--eval", script]
    return json.loads(subprocess.run(line, cwd=SOURCES, check=True, capture_output=True, timeout=120).stdout)


@pytest.mark.parametrize("supply", [("50 psi_g", "40 psi_g"), ("-6 psi_g", "-4 psi_g")])
def test_the_page_says_the_torques_that_a_vane_reaches_on_pressure_and_on_a_vacuum(supply: tuple[str, str]) -> None:
    changes = [f"supply.pressure={supply[0]}", f"supply.dorsiflexion_pressure={supply[1]}"]
    device = load_scenario("torque-task-proportional", changes).device
    values = {
        "actuator.torque_constant": device.actuator.torque_constant,
        "supply.pressure": device.supply.pressure,
        "supply.dorsiflexion_pressure": device.supply.dorsiflexion_pressure,
        "supply.atmospheric_pressure": device.supply.atmospheric_pressure,
    }
    program = json.dumps({"name": "one", "sustained": dict(_SUSTAINED)})
    work = f"""({{ sustainedTorque }}) => sustainedTorque(
        {{ programs: [{program}] }}, {{ program: "one", values: new Map(Object.entries({json.dumps(values)})) }})"""
    assert told("facts", work) == pytest.approx(torque_reach(device, 1.3), rel=1e-12)


def test_the_bands_of_all_channels_come_from_one_go_of_200_runs() -> None:
    found = told("variation", _BAND)
    assert found["asked"] == [{"every": 1, "places": 3}]
    assert sorted(found["bands"]) == ["angle", "torque"]
    for name, channel in (("torque", 1), ("angle", 2)):
        low, high = found["bands"][name]
        for place in range(3):
            begin = 1000.0 * channel + 100.0 * place
            assert begin < low[place] < begin + 0.1
            assert begin + 0.9 < high[place] < begin + 1.0


def test_runs_of_different_length_have_the_clock_of_the_longest_and_the_samples_of_the_finest() -> None:
    found = told("clock", _CLOCK)
    assert found == {"clock": [0, 0.1, 0.2, 0.3, 0.45], "values": [1, 2, 3, None, None], "same": 3}


@pytest.mark.parametrize("name", ["torque-task-proportional", "pressure-loop"])
def test_numbers_have_the_digits_the_units_and_the_zero_that_python_shows(name: str) -> None:
    draw = random.Random(name)
    sizes = [draw.choice((-1.0, 1.0)) * 10.0 ** draw.uniform(-9.0, 9.0) for _ in range(400)]
    # Halves, of which the two languages round half by themselves, and edges of the form with an exponent.
    halves = [draw.randrange(1, 4000) / 2.0 ** draw.randrange(1, 9) for _ in range(400)]
    edges = [0.0, -0.0, 1e-4, 9.9996e-5, 999999.9, 1e6, 999.5, 9.5, 1e9, 1.5e10, 2.5]
    numbers = [(value, draw.randrange(1, 8)) for value in (*sizes, *halves, *edges)]
    device = load_scenario(name).device
    with shown_in(device.shown):
        units = [
            (si, display_of(si, 101325.0, "gas mass")["unit"])
            for si in ("N m", "Pa_a", "rad", "s", "kg", "m^2", "J/kg", "")
        ]
        entries = [{"unit": si, "shown": shown} for si, shown in units]
        content = page_content("", "page", [], [{"settings": entries, "channels": [], "metrics": []}])
        values = [(si, shown, value) for si, shown in units for value in _near_zero_and_beyond(si, draw)]
        expected = [
            without_exponent(display_value(value, metric_quantity(si), 101325.0, shown), ".4g")
            for si, shown, value in values
        ]
    given = json.dumps({"numbers": numbers, "content": content, "values": values})
    found = told("shown", _SHOWN.replace("GIVEN", given))
    assert found["numbers"] == [without_exponent(value, f".{digits}g") for value, digits in numbers]
    # Units are written for a reader: ``psi gauge`` for psi_g.
    assert [text.split(" ")[0] for text in found["values"]] == expected


def _near_zero_and_beyond(unit: str, draw: random.Random) -> list[float]:
    """Values in SI about the size that a run computes nothing up to, and of every other size."""
    kind = metric_quantity(unit)
    zero = QUANTITIES[kind].zero if kind else 0.0
    usual = 101325.0 if unit == "Pa_a" else 0.0
    near = [usual + zero * share for share in (-3.0, -0.9, -0.1, 0.1, 0.9, 3.0)]
    return [usual, *near, *(usual + draw.uniform(-2.0, 2.0) * 10.0 ** draw.uniform(-6.0, 5.0) for _ in range(40))]


def test_a_value_has_the_digits_that_were_written_and_four_where_it_was_computed() -> None:
    work = """({ shownNumber }) => {
        const setting = { unit: "m", shown: "mm" };
        const content = { zeros: {}, units: { m: [{ unit: "mm", scale: "0.001", offset: "0", isGauge: false }] } };
        const shown = value => shownNumber(content, setting, value, 101325);
        return [shown(1.8699230769230768), shown(1.869923), shown(1.75125)];
    }"""
    assert told("settings", work) == ["1870", "1869.923", "1751.25"]
