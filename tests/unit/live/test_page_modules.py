"""Modules of the page's script under node: bands of many runs, and several runs on one clock."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

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


def told(module: str, work: str) -> Any:
    """What a function says of a module of the page."""
    script = _BUNDLED.replace("MODULE", module).replace("WORK", work)
    line = ["node", "--input-type=module", "--eval", script]
    return json.loads(subprocess.run(line, cwd=SOURCES, check=True, capture_output=True, timeout=120).stdout)


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
