"""Damage files of every kind, seeded, and open each: what is not one clear line is printed with its mutation.

    python scripts/mutated_files.py --count 4000 --seed 1

Files of the package, and the folders of a run and of a study, which are made first. Ends with 1 where anything else
than a ``PpafoError`` of one line, or a result that can be used, came out.
"""

import argparse
import json
import random
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import ppafo
from ppafo.cli.verbs import sets_audit
from ppafo.errors import PpafoError
from ppafo.storage import read_stored
from ppafo.storage.reading import read_recording
from tests.contract.test_files_run_no_code import STUDY, text_of
from tests.contract.test_hostile_documents import LOADERS

VALUES = [
    None,
    True,
    -1,
    0,
    1,
    1e308,
    float("nan"),
    10**30,
    "",
    "evil:KIND",
    "rms_error",
    "1 m",
    "../x",
    [],
    {},
    [1],
    {"a": 1},
]
WORDS = ["", "nan", "-1", "1e400", '"', "[", "{", "=", "\x00", "true", "[]", '"evil:KIND"', "'../x'", '"\\u001b[31m"']
RECORDING = "time [s],angle [deg],pressure_1 [kPa_g],command [1]\n0,1,2,0\n0.1,1,3,0.5\n0.2,1.5,4,1\n"


def mutated_json(text: bytes, draw: random.Random) -> bytes:
    """A JSON document with one value lost, replaced or renamed, at any depth."""
    document = json.loads(text)
    place: Any = document
    while True:
        keys = [*place] if isinstance(place, dict) else [*range(len(place))]
        if not keys:
            break
        key = draw.choice(keys)
        if isinstance(place[key], dict | list) and place[key] and draw.random() < 0.75:
            place = place[key]
            continue
        how = draw.randrange(3)
        if how == 0:
            del place[key]
        elif how == 1 or not isinstance(place, dict):
            place[key] = draw.choice(VALUES)
        else:
            place[f"{key}x"] = place.pop(key)
        break
    return json.dumps(document).encode()


def mutated_text(text: bytes, draw: random.Random) -> bytes:
    """A text with a line lost, doubled or moved, or a word replaced."""
    lines = text.decode().splitlines()
    number = draw.randrange(len(lines))
    how = draw.randrange(4)
    if how == 0:
        del lines[number]
    elif how == 1:
        lines.insert(draw.randrange(len(lines)), lines[number])
    elif how == 2:
        lines = lines[:number]
    else:
        words = lines[number].split(" ")
        words[draw.randrange(len(words))] = draw.choice(WORDS)
        lines[number] = " ".join(words)
    return "\n".join(lines).encode()


def mutated_bytes(content: bytes, draw: random.Random) -> bytes:
    """Bytes flipped, or an end that is missing."""
    found = bytearray(content)
    for _ in range(draw.randint(1, 6)):
        found[draw.randrange(len(found))] = draw.randrange(256)
    return bytes(found[: draw.randrange(len(found))]) if draw.random() < 0.2 else bytes(found)


def mutated(name: str, content: bytes, draw: random.Random) -> bytes:
    """The content of a file, changed as its kind can be, now and then byte by byte."""
    if name.endswith(".json") and draw.random() < 0.9:
        return mutated_json(content, draw)
    if name.endswith((".toml", ".csv")) and draw.random() < 0.8:
        return mutated_text(content, draw)
    return mutated_bytes(content, draw)


def open_study(folder: str) -> None:
    """All that a folder of study results is asked for, but the drawing."""
    found = ppafo.load_study_results(folder)
    repr(found.found), str(found), found.to_dict()
    found.found.table(), found.found.bands()
    found.found.trajectories("pressure_1")


def draw_study(folder: str) -> None:
    """The drawing as well."""
    ppafo.load_study_results(folder).plot()


def open_run(folder: str) -> None:
    """The folder of a run."""
    repr(read_stored(folder)), read_recording(folder)


def audit(path: str) -> None:
    """A set, audited."""
    str(sets_audit([path]))


def main() -> int:
    """Damage, open, count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    counted: Counter[str] = Counter()
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        here = Path(place)
        (here / "study.toml").write_text(STUDY + 'bands = ["torque"]\ntrajectories = ["pressure_1"]\nevery = "50 ms"\n')
        ppafo.sweep(here / "study.toml", out=here / "study")
        ppafo.simulate("torque-task-proportional", ["run.duration=0.1 s"]).save(here / "run")
        (here / "recording.csv").write_text(RECORDING)
        # Per kind: what is opened, the file that is damaged, how often, and what opens it.
        kinds: list[tuple[str, Path, int, Callable[[str], Any]]] = []
        for kind, load in LOADERS.items():
            (here / f"{kind}.toml").write_text(text_of(kind), encoding="utf-8")
            kinds.append((str(here / f"{kind}.toml"), here / f"{kind}.toml", 6, load))
        kinds += [
            (str(here / "parameters.toml"), here / "parameters.toml", 4, audit),
            (str(here / "recording.csv"), here / "recording.csv", 6, read_recording),
            (str(here / "run"), here / "run" / "run.json", 6, open_run),
            (str(here / "run"), here / "run" / "recording.nc", 2, open_run),
            (str(here / "study"), here / "study" / "study.json", 14, open_study),
            (str(here / "study"), here / "study" / "summary.json", 14, open_study),
            (str(here / "study"), here / "study" / "study.json", 1, draw_study),
            (str(here / "study"), here / "study" / "bands.parquet", 5, open_study),
            (str(here / "study"), here / "study" / "runs" / "chunk-0000000.parquet", 5, open_study),
        ]
        weights = [weight for _, _, weight, _ in kinds]
        for number in range(options.count):
            given, file, _, opens = draw.choices(kinds, weights)[0]
            content = file.read_bytes()
            damaged = mutated(file.name, content, draw)
            file.write_bytes(damaged)
            try:
                opens(given)
                counted["can be used"] += 1
            except PpafoError as error:
                counted["one line"] += 1
                if "\n" in str(error):
                    wrong += 1
                    print(f"{number} {file.name}: several lines: {error}")
            except Exception as error:  # whatever else comes is what is looked for
                wrong += 1
                at = traceback.extract_tb(error.__traceback__)[-1]
                print(f"{number} {file.name}: {type(error).__name__}: {error} ({at.filename}:{at.lineno})")
                print(f"    {damaged[:200]!r}" if len(damaged) < 200 else "")
            finally:
                file.write_bytes(content)
    print(f"{options.count} files, seed {options.seed}: {dict(counted)}, wrong {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
