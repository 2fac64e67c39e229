"""WebAssembly modules under node beside Python: settings drawn, run in both, every number compared."""

import json
import math
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import PpafoError
from ppafo.page.wasm import WasmModule
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, simulate_many
from ppafo.walking import load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk

Floats = NDArray[np.float64]

NEAR = 1.0e-12
"""Largest relative difference of a metric from that of a recording, which sums in another order."""
COMPLETED, DIVERGED, REFUSED = 0, 1, 3
NEAR_STOPS = 1.0e-2
"""Angle [rad] from a stop from which on a file may look closer than the samples do."""
EVERY = 8
"""Samples between two that an ensemble traces."""
_SCRIPT = Path(__file__).with_suffix(".mjs")
_BATCH = 50


@dataclass(frozen=True)
class FinishedRun:
    """What a module gave for one run: checked settings, status, samples that hold, metrics, columns of channels."""

    checked: int
    status: int
    good: int
    metrics: Floats
    columns: Floats


@dataclass(frozen=True)
class NumberWithUnit:
    """What a module gave for many: each alone, and statuses, metrics and traces of all as an ensemble.

    ``traces`` are those of one channel (runs, places), ``every_trace`` those of all (runs, channels, places).
    """

    runs: list[FinishedRun]
    statuses: Floats
    metrics: Floats
    traces: Floats
    every_trace: Floats


def driven(module: WasmModule, settings: Floats, channel: int = 0, places: int = 100) -> NumberWithUnit:
    """Run a module under node for settings (runs, settings)."""
    counts = {key: len(module.description[key]) for key in ("settings", "channels", "metrics")}
    traced = {"channel": channel, "every": EVERY, "places": places}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "module.wasm").write_bytes(module.wasm)
        (folder / "job.json").write_text(json.dumps({**counts, "runs": len(settings), "traced": traced}))
        (folder / "settings.bin").write_bytes(np.ascontiguousarray(settings).tobytes())
        files = ["module.wasm", "job.json", "settings.bin", "out.bin"]
        subprocess.run(["node", str(_SCRIPT), *files], cwd=folder, check=True)
        numbers = np.frombuffer((folder / "out.bin").read_bytes())
    taken = 0

    def take(count: int) -> Floats:
        nonlocal taken
        taken += count
        return numbers[taken - count : taken]

    runs = []
    for _ in settings:
        checked, samples, status, good = map(int, take(4))
        metrics = take(counts["metrics"])
        columns = take(samples * counts["channels"]).reshape(counts["channels"], samples)
        runs.append(FinishedRun(checked, status, good, metrics, columns))
    ended, *statuses = take(1 + len(settings))
    assert ended == COMPLETED
    metrics = take(counts["metrics"] * len(settings)).reshape(len(settings), -1)
    traces = take(places * len(settings)).reshape(len(settings), places)
    channels = counts["channels"] - 1
    every_trace = take(places * len(settings) * channels).reshape(len(settings), channels, places)
    assert taken == numbers.size
    return NumberWithUnit(runs, np.array(statuses), metrics, traces, every_trace)


def drawn(module: WasmModule, draws: int, spread: tuple[float, float] = (0.7, 1.4), seed: int = 16) -> Floats:
    """Settings (draws, settings): those of the scenario first, then all times factors; what is 0 stays 0."""
    draw = np.random.default_rng(seed)
    settings = module.description["settings"]
    found = np.tile([item["value"] for item in settings], (draws, 1))
    column = {item["key"]: place for place, item in enumerate(settings)}
    for place, item in enumerate(settings):
        low, high = item["minimum"], item["maximum"]
        moved = found[1:, place] * draw.uniform(*spread, draws - 1)
        found[1:, place] = np.clip(moved, -np.inf if low is None else low, np.inf if high is None else high)
        if item["is_whole"]:
            found[1:, place] = draw.integers(0, 1000, draws - 1)
    # Samples at steps, and a whole number of them: what the programs of these scenarios and a file ask for.
    step = found[0, column["run.step"]] * draw.uniform(0.8, 2.5, draws)
    interval = step * draw.integers(1, 4, draws)
    times = {
        "run.step": step,
        "run.output_interval": interval,
        "run.duration": interval * np.ceil(found[:, column["run.duration"]] / interval),
        "controller.period": step * draw.integers(1, 40, draws),
    }
    for key, values in times.items():
        found[1:, column[key]] = values[1:]
    # Knots of a profile stay in their order.
    knots = [place for key, place in column.items() if ".time_" in key]
    found[:, knots] = found[0, knots]
    if _wants_a_place(module):
        # An angle that is wanted stays between the stops, a pressure below the supply's, where a file has to have it.
        kept = [place for key, place in column.items() if key.startswith(("reference.", "actuator.angle_m", "supply."))]
        found[:, kept] = found[0, kept]
    if "motion.angle" in column:
        stops = found[:, column["actuator.angle_min"]], found[:, column["actuator.angle_max"]]
        found[:, column["motion.angle"]] = np.clip(found[:, column["motion.angle"]], *stops)
    return found


def drawn_walks(module: WasmModule, draws: int, seed: int = 16) -> Floats:
    """Settings (draws, settings) of walks that last some strides: those of the file first, then all times factors."""
    draw = np.random.default_rng(seed)
    settings = module.description["settings"]
    found = np.tile([item["value"] for item in settings], (draws, 1))
    for place, item in enumerate(settings):
        low, high = item["minimum"], item["maximum"]
        moved = found[1:, place] * draw.uniform(0.9, 1.1, draws - 1)
        found[1:, place] = np.clip(moved, -np.inf if low is None else low, np.inf if high is None else high)
        if item["is_whole"]:
            found[1:, place] = draw.integers(0, 1000, draws - 1)
    column = {item["key"]: place for place, item in enumerate(settings)}
    # In Python a walk is told in minutes: parts of one that are exact.
    found[:, column["run.duration"]] = 60.0 * (draw.integers(52, 66, draws) / 512.0)
    interval = column["run.output_interval"]
    found[:, interval] = settings[interval]["value"]
    return found


def walked_in_python(name: str, module: WasmModule, settings: Floats) -> list[WalkResult | None]:
    """The walks of settings as a file would give them; None where it is refused."""
    keys = [item["key"] for item in module.description["settings"]]
    found: list[WalkResult | None] = []
    for row in settings:
        seconds = float(row[keys.index("run.duration")])
        try:
            walked = load_walk(name, overrides_of(module, row, ("run.duration", "run.output_interval")))
        except PpafoError:
            found.append(None)
            continue
        found.append(walk(walked, minutes=seconds / 60.0))
    return found


def overrides_of(module: WasmModule, row: Floats, without: Sequence[str] = ()) -> list[str]:
    """Settings as overrides; bandwidths of 0, for which a file of a walk has no word, are left out."""
    pairs = zip(module.description["settings"], row.tolist(), strict=True)
    return [
        f"{item['key']}={int(value) if item['is_whole'] else repr(value)} {item['unit']}"
        for item, value in pairs
        if item["key"] not in without and not (item["key"].endswith("_bandwidth") and value == 0.0)
    ]


def in_python(name: str, module: WasmModule, settings: Floats) -> list[Scenario | None]:
    """The scenarios of settings (runs, settings) as a file would give them; None where it is refused."""
    found: list[Scenario | None] = []
    for row in settings:
        try:
            found.append(load_scenario(name, overrides_of(module, row)))
        except PpafoError:
            found.append(None)
    return found


def compared(name: str, module: WasmModule, settings: Floats) -> list[str]:
    """Run settings (runs, settings) under node and in Python: how each ended; AssertionError where a number differs."""
    ended = []
    for first in range(0, len(settings), _BATCH):
        rows = settings[first : first + _BATCH]
        given, results = driven(module, rows), _results(name, module, rows)
        assert_alike(given)
        for ran, row, result in zip(given.runs, rows, results, strict=True):
            ended.append(_compared_run(module, ran, row, result))
    return ended


def _results(name: str, module: WasmModule, rows: Floats) -> Sequence[Result | WalkResult | None]:
    if module.description["kind"] == "walk":
        return walked_in_python(name, module, rows)
    scenarios = in_python(name, module, rows)
    results = iter(simulate_many([scenario for scenario in scenarios if scenario is not None]))
    return [None if scenario is None else next(results) for scenario in scenarios]


def _compared_run(module: WasmModule, ran: FinishedRun, row: Floats, result: Result | WalkResult | None) -> str:
    if result is None:
        # A module does not know all contradictions of a walk, nor whether an angle that is wanted is beyond the stops.
        is_walk = module.description["kind"] == "walk"
        assert ran.status == REFUSED or is_walk or _wants_a_place(module) or _leaves_the_stops(module, ran, row)
        return "refused"
    assert_same(module, ran, result)
    return "completed" if result.status.is_completed else "diverged"


def _wants_a_place(module: WasmModule) -> bool:
    """True where the reference is of an angle or of pressures, of which a device reaches some only."""
    return module.description["document"].get("reference", {}).get("of", "torque") != "torque"


def assert_same(module: WasmModule, ran: FinishedRun, result: Result | WalkResult) -> None:
    """A run has the bits of Python in every sample of every channel, and its metrics but for rounding.

    One that was not completed has no metrics.
    """
    assert ran.checked == -1
    assert (ran.status == COMPLETED) == result.status.is_completed
    kept = len(result.recording)
    assert ran.good == kept
    for item, column in zip(module.description["channels"], ran.columns, strict=True):
        channel = item["name"]
        if channel not in ("time", *result.recording.names):
            continue
        expected = result.recording.time if channel == "time" else result.recording[channel]
        assert expected.tobytes() == column[:kept].tobytes(), channel
    if result.status.is_completed:
        _assert_near(module.description["metrics"], ran.metrics, result)
    else:
        assert np.isnan(ran.metrics).all()


def _leaves_the_stops(module: WasmModule, ran: FinishedRun, row: Floats) -> bool:
    """True for an ankle that is moved to the stops or beyond: no file may have it, a module runs it."""
    names = [item["name"] for item in module.description["channels"]]
    settings = dict(zip([item["key"] for item in module.description["settings"]], row.tolist(), strict=True))
    angle = ran.columns[names.index("angle"), : ran.good]
    low, high = settings["actuator.angle_min"], settings["actuator.angle_max"]
    return ran.status == DIVERGED or bool(angle.min() < low + NEAR_STOPS or angle.max() > high - NEAR_STOPS)


def _assert_near(metrics: Sequence[dict[str, str]], values: Floats, result: Result | WalkResult) -> None:
    compared = 0
    for item, value in zip(metrics, values.tolist(), strict=True):
        found = result.metrics.get(item["name"])
        # Of a walk a module leaves out what has no whole stride with help.
        if found is None or (isinstance(result, WalkResult) and math.isnan(value)):
            assert math.isnan(value), item["name"]
        else:
            assert abs(value - found.value) <= NEAR * abs(found.value), item["name"]
            compared += 1
    assert compared >= min(3, len(result.metrics))


def assert_alike(given: NumberWithUnit) -> None:
    """The runs of an ensemble have the bits of each alone."""
    for place, ran in enumerate(given.runs):
        assert given.statuses[place] == ran.status
        if ran.status != COMPLETED:
            assert np.isnan(given.metrics[place]).all()
            assert np.isnan(given.traces[place]).all()
            assert np.isnan(given.every_trace[place]).all()
            continue
        assert given.metrics[place].tobytes() == ran.metrics.tobytes()
        expected = ran.columns[1, ::EVERY][: given.traces.shape[1]]
        assert expected.tobytes() == given.traces[place, : expected.size].tobytes()
        assert np.isnan(given.traces[place, expected.size :]).all()
        several = ran.columns[1:, ::EVERY][:, : given.every_trace.shape[2]]
        assert several.tobytes() == given.every_trace[place, :, : expected.size].tobytes()
        assert np.isnan(given.every_trace[place, :, expected.size :]).all()
