"""Counts how often the intervals of the bench procedures hold the truth, on recordings of the simulated test bench.

    python scripts/bench_coverage.py --first 5101 --count 40 --preset paper-bench --processes 4

Each seed is one recording for each procedure, with sensors of its own; all are synthetic. ``--noise`` adds a kind of
noise of ``scripts/interval_coverage.py``, of 0.2 % of the range of each channel. The problem is that of the
how-to page: no tolerance is stated, so the defaults count. For each number: how many intervals hold the truth of
rig.json, how many of the others are flagged ("holds for this model only"), and the median half width.
"""

import argparse
import statistics
import sys
import time
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

if not __package__:
    # The first place is this folder, in which this file would pass for the package of the same name.
    sys.path[0] = str(Path(__file__).parents[1])

from ppafo.errors import PpafoError
from ppafo.identification.bench.law import BenchContext
from ppafo.identification.estimate import Estimate
from ppafo.identification.problem import ProblemFile
from ppafo.identification.procedures import LAWS, run_procedure
from ppafo.identification.source import RecordingSource
from ppafo.parameters import load_parameter_set
from ppafo.parameters.records import record_from
from ppafo.rig import record
from ppafo.signals import Recording
from scripts.interval_coverage import KINDS, disturbed
from scripts.processes import add_processes, results_of

DEVICE = "ppafo2011"
EXTRA = {"vane-leak": 'angle = "90 deg"\n'}
HEAD = f'schema_version = 1\nname = "bench"\ndevice.set = "{DEVICE}"\n'


def truths(truth: Mapping[str, Any]) -> dict[str, float]:
    """Return the true value [SI] of every number that the procedures report, by path."""
    device = truth["device"]
    valve, actuator = device["valve"], device["actuator"]
    return {
        "actuator.torque_constant": actuator["torque_constant"],
        "friction.static_torque": device["friction"]["static_torque"],
        "effects.seal_friction.static_per_pressure": device["effects"]
        .get("seal_friction", {})
        .get("static_per_pressure", 0.0),
        "friction.viscous_damping": device["friction"]["viscous_damping"],
        "friction.dynamic_torque": device["friction"]["dynamic_torque"],
        "valves.proportional.discharge_coefficient": valve["discharge_coefficient"],
        "valves.proportional.dead_band": valve["dead_band"],
        "valve_map.hysteresis": truth["preset"]["values"]["bench.hysteresis"],
        "actuator.leak.area": actuator["leak"]["area"],
    }


@dataclass
class Count:
    """Of one number: intervals, those that hold, those that miss and are flagged, half widths over the truth."""

    total: int = 0
    held: int = 0
    flagged: int = 0
    missed_flagged: int = 0
    widths: list[float] = field(default_factory=list)


@dataclass
class Identified:
    """What a procedure makes of a recording: its estimates, the truth, CPU seconds, and why it was refused."""

    estimates: tuple[Estimate, ...]
    truth: dict[str, float]
    seconds: float
    refused: str = ""


_NO_SENSORS = ("command", "direction", "repetition")
_SIZE = 0.002
"""Noise that is added over the range of a channel."""


def with_noise(recording: Recording, kind: str, seed: int) -> Recording:
    """Return a recording with more noise of a kind in each channel of a sensor."""
    random = np.random.default_rng([seed, len(kind)])
    for name in (name for name in recording.names if kind and name not in _NO_SENSORS):
        values = recording[name]
        recording = recording.with_channel(
            name, disturbed(values, _SIZE * float(np.ptp(values)) or 1.0, kind, random), recording.unit(name)
        )
    return recording


def identified(experiment: str, preset: str, seed: int, noise: str = "") -> Identified:
    """Return what the procedure makes of a recording, and the truth."""
    begun = time.process_time()
    made = record(experiment, preset, seed, DEVICE)
    text = f'{HEAD}[[procedure]]\nkind = "{experiment}"\nrecordings = ["made.csv"]\n{EXTRA.get(experiment, "")}'
    problem = record_from(ProblemFile, tomllib.loads(text)).procedure[0]
    setting = BenchContext(load_parameter_set(DEVICE), "proportional", experiment)
    try:
        found, refused = (
            run_procedure((RecordingSource(with_noise(made.recording, noise, seed)),), problem, setting).estimates,
            "",
        )
    except PpafoError as error:
        found, refused = (), str(error)
    return Identified(found, truths(made.truth), time.process_time() - begun, refused)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, required=True, help="first seed")
    parser.add_argument("--count", type=int, default=40, help="seeds in a row")
    parser.add_argument("--preset", default="paper-bench")
    parser.add_argument("--only", choices=tuple(LAWS), nargs="*", default=tuple(LAWS))
    parser.add_argument("--noise", choices=tuple(KINDS), default="", help="kind of noise that is added")
    add_processes(parser)
    words = parser.parse_args()
    seeds = range(words.first, words.first + words.count)
    print(f"{words.preset}, seeds {words.first} to {words.first + words.count - 1}, synthetic\n")
    print("| experiment | number | hold | miss, flagged | miss, not flagged | flagged | half width | CPU ms a fit |")
    print("|---|---|---|---|---|---|---|---|")
    results = results_of(
        identified, [(one, words.preset, seed, words.noise) for one in words.only for seed in seeds], words.processes
    )
    for experiment in words.only:
        counts: dict[str, Count] = {}
        refused, spent = 0, 0.0
        for _ in seeds:
            found = next(results)
            spent += found.seconds
            if found.refused:
                refused += 1
                print(f"refused: {found.refused}")
            for estimate in found.estimates:
                if estimate.path not in found.truth:
                    continue
                count, value = counts.setdefault(estimate.path, Count()), found.truth[estimate.path]
                holds, is_flagged = estimate.low <= value <= estimate.high, estimate.verdict != "identified"
                count.total += 1
                count.held += holds
                count.flagged += is_flagged
                count.missed_flagged += is_flagged and not holds
                count.widths.append(0.5 * (estimate.high - estimate.low) / (abs(value) or abs(estimate.value) or 1.0))
        for path, count in counts.items():
            silent = count.total - count.held - count.missed_flagged
            width = statistics.median(count.widths)
            print(
                f"| {experiment} | `{path}` | {count.held} of {count.total} | {count.missed_flagged} | {silent} | "
                f"{count.flagged} | {width:.1%} | {1000.0 * spent / words.count:.0f} |",
                flush=True,
            )
        if refused:
            print(f"| {experiment} | refused {refused} | | | | | | |")


if __name__ == "__main__":
    main()
