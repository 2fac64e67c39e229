"""How often good sensors give an alarm: wearers on every task sequence, and what is seen in them.

    python scripts/false_alarms.py --wearers 1000 --out out/false-alarms

A stop on good sensors is a false alarm, and the exit code is then 1. A pause, and a foot that is lifted only, are for
what walking does; they are counted apart, by the last fault flag of each wearer: who sat last, and the others. Every
configuration and task sequence that is done is kept in the folder, and a second call goes on where the first one
ended. It prints a table.
"""

import argparse
import json
import sys
from pathlib import Path

from ppafo.walking.loading import load_walk
from ppafo.walking.population import walk_population
from ppafo.walking.task_sequence import FILE

CONFIGURATIONS = ("solenoid", "proportional")
SENSORS = {
    "ideal": (),
    "coarse": (
        "sensors.force_resolution=15 N",
        "sensors.angle_resolution=0.5 deg",
        "sensors.pressure_resolution=1 psi_d",
    ),
    "noisy": ("sensors.force_noise=10 N", "sensors.angle_noise=0.2 deg", "sensors.pressure_noise=0.3 psi_d"),
}
"""Good sensors: what stands between foot and controller."""

WEARERS = {"impaired": (), "nondisabled": ("wearer.keeps_gait=1",)}
"""Whose foot drops, and who keeps the measured gait whatever the device does."""

SITS = "endless_phase"
"""The fault flag of who sits: on the task sequences of the package before the first stride or after the last one."""

HEAD = (
    "Task sequence",
    "Sensors",
    "Configuration",
    "Wearers",
    "Stops",
    "Sat last",
    "Less help else",
    "Last flag of these",
)


def counted(configuration: str, sequence: str, sensors: str, who: str, wearers: int) -> dict[str, object]:
    """Walk a task sequence with many wearers: how many they were, were stopped, had less help, by which last flag."""
    overrides = [f"task_sequence={sequence}", *SENSORS[sensors], *WEARERS[who]]
    people = walk_population(load_walk(configuration, overrides), wearers=wearers)
    return {
        "wearers": people.count,
        "diverged": people.diverged,
        "stops": people.vented,
        "less": people.paused,
        "flags": dict(people.fault_flags),
    }


def line(sequence: str, sensors: str, configuration: str, found: dict[str, object]) -> str:
    """One row of the table."""
    seen = found["flags"]
    assert isinstance(seen, dict), "as counted"
    sat = seen.get(SITS, 0)
    others = {name: count for name, count in seen.items() if name != SITS}
    words = ", ".join(f"{name} {count}" for name, count in others.items()) or "-"
    cells = (sequence, sensors, configuration, found["wearers"], found["stops"], sat, sum(others.values()), words)
    return f"| {' | '.join(map(str, cells))} |"


def arguments() -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--wearers", type=int, default=1000, help="wearers of each task sequence and configuration")
    parser.add_argument("--out", type=Path, default=Path("out/false-alarms"), help="folder of what is done")
    parser.add_argument(
        "--task-sequence",
        nargs="*",
        default=FILE.names(),
        choices=FILE.names(),
        help="which task sequences",
    )
    parser.add_argument("--sensors", nargs="*", default=["ideal"], choices=list(SENSORS), help="which good sensors")
    parser.add_argument("--who", default="impaired", choices=list(WEARERS), help="whose foot it is")
    parser.add_argument("--configuration", nargs="*", default=CONFIGURATIONS, help="which walks of the package")
    return parser.parse_args()


def main() -> int:
    """Walk what is not done yet, and print the table; 1 where a stop was found."""
    given = arguments()
    given.out.mkdir(parents=True, exist_ok=True)
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    stops = 0
    for configuration in given.configuration:
        for sensors in given.sensors:
            for sequence in given.task_sequence:
                file = given.out / f"{configuration}-{sensors}-{sequence}-{given.who}-{given.wearers}.json"
                if not file.exists():
                    aside = file.with_suffix(".part")
                    aside.write_text(json.dumps(counted(configuration, sequence, sensors, given.who, given.wearers)))
                    aside.rename(file)
                found = json.loads(file.read_text())
                stops += found["stops"]
                print(line(sequence, sensors, configuration, found), flush=True)
    print(f"\n{stops} stops on good sensors", file=sys.stderr)
    return 1 if stops else 0


if __name__ == "__main__":
    sys.exit(main())
