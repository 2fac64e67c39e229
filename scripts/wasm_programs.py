"""The WebAssembly programs of the package: built anew, compared with what is there and with Python, and timed.

    python scripts/wasm_programs.py
    python scripts/wasm_programs.py --check
    python scripts/wasm_programs.py --compare 1000 --names torque-task-solenoid step-response
    python scripts/wasm_programs.py --time

Writes one program for each shipped scenario and walk into ``src/ppafo/page/wasm/programs``, with an index that says
of which text each was made; needs the package ziglang of the lock file. ``--check`` writes nothing and says what
differs. Beside the folder stands ``shipped.json``, by which a page finds the program of a shipped scenario without
composing its text. It holds for the files of the package as they are: after any change of them, also of a comment,
programs are found more slowly until ``--keys``, which builds nothing, has written it anew.

``--compare`` draws settings, runs them under node and in Python, and stops at the first number that differs.
``--time`` prints a table: size, a run of the settings as they are, and a map of 1,024 runs of a valve area and a
pressure, on one thread under node, in time of the processor. A walk lasts six seconds there, and its map has 64 runs.
"""

import argparse
import gzip
import importlib
import json
import pkgutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.exports.c_library import library_of
from ppafo.loading import load_scenario
from ppafo.page import wasm
from ppafo.page.wasm import module_of
from ppafo.simulation.loading import list_scenarios
from ppafo.walking.loading import list_walks
from tests.modules_under_node import compared, drawn, drawn_walks

FOLDER = Path(wasm.__file__).parent / "programs"
PACKAGE = Path(wasm.__file__).parents[2]
SIDE, SIDE_OF_WALKS = 32, 8
"""Values of each of both settings of a map."""


def shipped() -> tuple[str, ...]:
    """Names of all that has a program here."""
    return (*list_scenarios(), *list_walks())


def shipped_programs() -> dict[str, bytes]:
    """Files of the programs and of their index, built from the physics as it is now; two runs may share a program."""
    programs, contents = {}, {}
    for name in shipped():
        library = library_of(load_scenario(name))
        text = wasm.source_of(library, wasm.compose(library))
        digest = wasm.digest_of(text)
        if digest not in programs:
            programs[digest] = f"{name}.wasm"
            contents[f"{name}.wasm"] = wasm.build(text)
    index = {"ziglang": wasm.compiler_version(), "programs": programs}
    return {wasm.INDEX: f"{json.dumps(index, indent=2)}\n".encode(), **contents}


def write(is_check: bool) -> int:
    """Write the programs; 1 where only asked whether one differs, and it does."""
    built = shipped_programs()
    there = {path.name: path.read_bytes() for path in FOLDER.iterdir()} if FOLDER.is_dir() else {}
    differing = [name for name in sorted({*built, *there}) if built.get(name) != there.get(name)]
    for name in differing:
        print(f"{name}: {'new' if name not in there else 'gone' if name not in built else 'differs'}")
        if not is_check:
            FOLDER.joinpath(name).unlink(missing_ok=True)
            if name in built:
                FOLDER.mkdir(exist_ok=True)
                FOLDER.joinpath(name).write_bytes(built[name])
    return int(is_check and bool(differing))


def keys_of(names: Iterable[str]) -> dict[str, Any]:
    """Digests of the texts of scenarios and walks, with the files and values of the loaded package as they are now.

    By description, which finds a shipped scenario at once, and by outline, which finds it with other settings.
    """
    digests: dict[str, str] = {}
    key = None
    for name in names:
        scenario = load_scenario(name)
        key = wasm.module_key(scenario)
        assert key is not None, f"{name} is made of functions of the package alone"
        library = library_of(scenario)
        composed = wasm.compose(library)
        digest = wasm.digest_of(wasm.source_of(library, composed))
        outline = wasm.outline_of_unit(library, composed)
        digests |= dict.fromkeys(map(wasm.short_digest, (key.described, outline)), digest)
    assert key is not None, "there is a scenario"
    return {"files": key.files, "values": dict(sorted(key.values.items())), "digests": digests}


def write_keys(is_check: bool) -> int:
    """Write the keys of the shipped programs; 1 where only asked whether they differ, and they do."""
    # All modules, as a process may have loaded any of them.
    for folder in wasm.WRITTEN_BY:
        for module in pkgutil.walk_packages([str(PACKAGE / folder)], f"ppafo.{folder}."):
            importlib.import_module(module.name)
    file, keys = FOLDER.with_name(wasm.SHIPPED_KEYS), f"{json.dumps(keys_of(shipped()), indent=2)}\n"
    differs = not file.is_file() or file.read_text(encoding="utf-8") != keys
    if differs:
        print(f"{file.name}: differs")
        if not is_check:
            file.write_text(keys, encoding="utf-8")
    return int(is_check and differs)


def compare(names: list[str], draws: int) -> int:
    """Print how many drawn runs of each had the bits of Python; AssertionError where one had not."""
    for name in names:
        module = module_of(load_scenario(name))
        settings = drawn_walks(module, draws) if name in list_walks() else drawn(module, draws)
        ended = Counter(compared(name, module, settings))
        print(
            f"{name}: {', '.join(f'{count} {how}' for how, count in ended.most_common())}, no bit differs", flush=True
        )
    return 0


def time_programs(names: list[str]) -> int:
    """Print the table of sizes and times."""
    print("| program | kB | gzip | ready | first run | run | map | per run |\n|---|---|---|---|---|---|---|---|")
    for name in names:
        module = module_of(load_scenario(name))
        runs = _map(module.description["settings"], SIDE_OF_WALKS if name in list_walks() else SIDE)
        found = _timed(module.wasm, {**module.description, "runs": runs})
        size, packed = len(module.wasm) / 1e3, len(gzip.compress(module.wasm, 9)) / 1e3
        times = (
            f"{found['ready']:.1f} ms | {found['first']:.2f} ms | {found['run']:.2f} ms | {found['ensemble']:.0f} ms"
        )
        each = f"{found['ensemble'] / len(runs):.3f} ms"
        print(f"| {name} | {size:.0f} | {packed:.0f} | {times} | {each} |", flush=True)
    return 0


def _map(settings: list[dict[str, Any]], side: int) -> list[list[float]]:
    """Settings of the runs of a map: a valve area and a pressure, from 0.8 to 1.2 of theirs."""
    values = [item["value"] for item in settings]
    places = [place for place, item in enumerate(settings) if item["key"] in ("valve.area", "supply.pressure")]
    seconds = next(place for place, item in enumerate(settings) if item["key"] == "run.duration")
    values[seconds] = min(values[seconds], 6.0)
    factors = np.linspace(0.8, 1.2, side)
    runs = []
    for first in factors:
        for second in factors:
            run = list(values)
            run[places[0]] *= first
            run[places[1]] *= second
            runs.append(run)
    return [values, *runs[1:]]


def _timed(wasm: bytes, job: dict[str, Any]) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as name:
        program, told = Path(name) / "module.wasm", Path(name) / "job.json"
        program.write_bytes(wasm)
        told.write_text(json.dumps({**job, "channels": len(job["channels"]), "metrics": len(job["metrics"])}))
        line = ["node", str(Path(__file__).with_name("time_module.mjs")), str(program), str(told)]
        found: dict[str, float] = json.loads(subprocess.run(line, check=True, capture_output=True).stdout)
    return found


def main() -> int:
    """Write the programs, or do what is asked instead."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only say what differs")
    parser.add_argument("--keys", action="store_true", help="only the keys of shipped programs; builds nothing")
    parser.add_argument("--compare", metavar="DRAWS", type=int, default=0, help="compare drawn runs with Python")
    parser.add_argument("--time", action="store_true", help="print sizes and times")
    parser.add_argument("--names", nargs="+", default=list(shipped()), help="of what (default: all)")
    parsed = parser.parse_args()
    if parsed.compare:
        return compare(parsed.names, parsed.compare)
    if parsed.time:
        return time_programs(parsed.names)
    return max(0 if parsed.keys else write(parsed.check), write_keys(parsed.check))


if __name__ == "__main__":
    sys.exit(main())
