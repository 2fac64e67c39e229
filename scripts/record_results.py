"""Record what the commands print as JSON, and compare two such records number by number.

``python scripts/record_results.py DIR`` runs every line of ``LINES`` with ``--json`` and keeps what it prints.
``python scripts/record_results.py DIR --against OLD`` also lists every number, text and key that differs from OLD.
A change that should leave the results as they are is done between the two.
"""

import argparse
import json
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

SCENARIOS = (
    "step-response",
    "torque-task-anti-windup",
    "torque-task-moving-ankle",
    "torque-task-proportional",
    "torque-task-slow-valve",
    "torque-task-solenoid",
)
WALKS = (
    "off",
    "proportional",
    "proportional-learning",
    "proportional-regulators",
    "solenoid",
    "solenoid-regulators",
)
SETS = ("ppafo2011", "ppafo2011-printed")

LINES: dict[str, str] = {
    **{f"simulate-{name}": f"simulate {name} --out {{out}}" for name in SCENARIOS},
    **{f"walk-{name}": f"walk {name} --minutes 0.1 --out {{out}}" for name in WALKS},
    "wearers": "walk proportional --minutes 0.1 --wearers 20 --out {out}",
    **{f"audit-{name}": f"sets audit {name}" for name in SETS},
    **{f"set-{name}": f"sets show {name}" for name in SETS},
    "parts": "sets parts",
    "gait": "gait show falisse2019-subject1",
    "compare": "compare torque-task-solenoid torque-task-proportional --study torque-task-uncertainty --draws 256",
    "sensitivity": "sensitivity torque-task-uncertainty --configuration proportional --metric gas_supplied",
    "sweep-statistic": "sweep torque-task-uncertainty --configuration proportional --statistic mean --metric rms_error "
    "--draws 2048 --out {out}",
    "endurance": "bottle --gas-per-stride '0.3 g'",
    "design": "design push-off",
    "tune": "tune pid-gains",
    "sweep": "sweep torque-task-uncertainty --draws 256 --out {out}",
    "reproduce": "reproduce --out {out}",
}


def record(folder: Path, names: list[str]) -> None:
    """Run the lines and keep what each prints, and its exit code."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        words = shlex.split(LINES[name].format(out=folder / f"{name}.out"))
        sys.stderr.write(f"{name}: ppafo {' '.join(words)}\n")
        command = [sys.executable, "-m", "ppafo", *words, "--json"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        kept = {"exit": done.returncode, "printed": done.stdout, "said": done.stderr if done.returncode else ""}
        (folder / f"{name}.json").write_text(json.dumps(kept), encoding="utf-8")


def differences(old: Any, new: Any, path: str = "") -> Iterator[str]:
    """Return a line for each key, number or text that differs between two documents."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new}):
            if key not in old or key not in new:
                yield f"{path}.{key}: only in the {'old' if key in old else 'new'} one"
            else:
                yield from differences(old[key], new[key], f"{path}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f"{path}[{index}]")
    elif repr(old) != repr(new):
        yield f"{path}: {str(old)[:80]!r} became {str(new)[:80]!r}"


def compare(old: Path, new: Path, names: list[str]) -> int:
    """Print what differs; 1 where anything does."""
    found = 0
    for name in names:
        one, other = (json.loads((folder / f"{name}.json").read_text("utf-8")) for folder in (old, new))
        documents = [json.loads(item["printed"] or "null") for item in (one, other)]
        lines = [*differences(one["exit"], other["exit"], " exit"), *differences(*documents)]
        for line in lines:
            sys.stdout.write(f"{name}{line}\n")
        found += len(lines)
    sys.stdout.write(f"{found} differences in {len(names)} results\n")
    return int(found > 0)


def main() -> int:
    """Record, and compare where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="DIR", type=Path, help="where the results are kept")
    parser.add_argument("--against", metavar="OLD", type=Path, help="an earlier record to compare with")
    parser.add_argument(
        "--only", metavar="NAME", nargs="*", default=list(LINES), choices=list(LINES), help="lines to run"
    )
    parsed = parser.parse_args()
    record(parsed.folder, parsed.only)
    return 0 if parsed.against is None else compare(parsed.against, parsed.folder, parsed.only)


if __name__ == "__main__":
    sys.exit(main())
