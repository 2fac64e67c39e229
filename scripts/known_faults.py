"""Prints what `ppafo validate` names of 14 known faults, of two at once, and how often right recordings disagree.

    python scripts/known_faults.py --seeds 4711 4712 --pairs 40 --right 100 --processes 4

Recordings are step responses of the simulated bench (ideal-laboratory), runs in a tenth of the model's steps: 1 kHz,
free vane, its own noise. Each fault is one of the record or one number of the
device. `right`: the fault is named first, or among those that the recordings cannot tell from the first; `wrong`:
another is named; `none`: none is. ``--pairs`` has two different faults at once, drawn with the first seed: no single
change explains them. ``--right`` has no fault, with seeds from the first on. ``--noise`` adds a kind of noise of
``scripts/interval_coverage.py`` to angle and pressures.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

if not __package__:
    # The first place is this folder, in which this file would pass for the package of the same name.
    sys.path[0] = str(Path(__file__).parents[1])

import ppafo
from ppafo.analyses.validate.result import Validation, in_words
from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import PpafoError
from ppafo.rig.experiments import record
from ppafo.signals.recording import Recording
from ppafo.storage import write_csv
from scripts.interval_coverage import KINDS, NOISE, disturbed
from scripts.processes import add_processes, results_of

ROOM = 101325.0
SUPPLY = ("supply.pressure=55 psi_g", "supply.dorsiflexion_pressure=55 psi_g")
GAUGES = ("pressure_1", "pressure_2")
KEPT = ("command", "supply_pressure", "angle", *GAUGES)


def changed(recording: Recording, **values: np.ndarray) -> Recording:
    """The recording with other values in some channels."""
    for name, series in values.items():
        recording = recording.with_channel(name, series, recording.unit(name))
    return recording


def read_with_gain(recording: Recording, gain: float, *names: str) -> Recording:
    """Gauge pressures that are read too large by a factor."""
    return changed(recording, **{name: ROOM + gain * (recording[name] - ROOM) for name in names})


def with_outliers(recording: Recording) -> Recording:
    """Five samples that a bad contact made."""
    places = [len(recording) * part // 13 for part in (2, 5, 7, 10, 12)]
    values = recording["pressure_1"].copy()
    values[places] += 4.0e4 * np.array([1.0, -1.0, 1.0, 1.0, -1.0])
    return changed(recording, pressure_1=values)


def clipped(recording: Recording) -> Recording:
    """A sensor whose range ends below what it should measure."""
    values = recording["pressure_1"]
    return changed(recording, pressure_1=np.minimum(values, 0.75 * float(values.max())))


@dataclass(frozen=True)
class Fault:
    """A fault: the record that it makes, numbers of the device by path, and how the words that name it begin."""

    title: str
    named: tuple[str, ...]
    record: Callable[[Recording], Recording] = lambda one: one
    device: tuple[str, ...] = ()


FAULTS = (
    Fault(
        "pressures swapped",
        ("pressure_1 and pressure_2 seem to be swapped",),
        lambda one: changed(one, pressure_1=one["pressure_2"], pressure_2=one["pressure_1"]),
    ),
    Fault(
        "gain of pressure_1 4 % high",
        ("pressure_1 seems to read",),
        lambda one: read_with_gain(one, 1.04, "pressure_1"),
    ),
    Fault(
        "gain of both chambers 4 % high",
        ("pressure_1 and pressure_2 seem to read",),
        lambda one: read_with_gain(one, 1.04, *GAUGES),
    ),
    Fault(
        "zero of pressure_2 at 8 kPa",
        ("the zero of pressure_2 seems",),
        lambda one: changed(one, pressure_2=one["pressure_2"] + 8e3),
    ),
    Fault(
        "kPa read as psi",
        ("all pressures seem to be kPa read as psi",),
        lambda one: read_with_gain(one, PASCALS_PER_PSI / 1e3, *GAUGES, "supply_pressure"),
    ),
    Fault("pressure_1 clipped", ("pressure_1 is clipped",), clipped),
    Fault(
        "pressure_2 dead", ("pressure_2 never changes",), lambda one: changed(one, pressure_2=np.full(len(one), ROOM))
    ),
    Fault("five outliers in pressure_1", ("pressure_1 has 5 isolated outliers",), with_outliers),
    Fault(
        "clock 3 % fast", ("the clock of the recording seems to run",), lambda one: replace(one, time=1.03 * one.time)
    ),
    Fault(
        "command with the wrong sign",
        ("command seems to have the wrong sign",),
        lambda one: changed(one, command=-one["command"]),
    ),
    Fault("gain of the angle 5 % high", ("angle seems to read",), lambda one: changed(one, angle=1.05 * one["angle"])),
    Fault("leak 3 times", ("actuator.leak.",), device=("actuator.leak.area=0.9 mm^2",)),
    Fault("Cd of the valve 10 % low", ("valve.discharge_coefficient",), device=("valve.discharge_coefficient=0.1017",)),
    Fault("inertia 30 % high", ("foot_plate.inertia",), device=("foot_plate.inertia=0.01092 kg m^2",)),
)
NOTHING = Fault("", ())
VERDICTS = ("right", "wrong", "none", "refused")


def recorded(fault: Fault, seed: int, noise: str = "") -> Recording:
    """A recording of the rig with a fault, and more noise of a kind."""
    words = ("motion.kind=free", *SUPPLY, *fault.device)
    made = record("step-response", preset="ideal-laboratory", seed=seed, overrides=words).recording
    made = replace(made, channels={name: made.channels[name] for name in KEPT if name in made})
    if noise:
        random = np.random.default_rng([seed, len(noise)])
        made = changed(made, **{name: disturbed(made[name], size, noise, random) for name, size in NOISE.items()})
    return fault.record(made)


def validated(fault: Fault, seed: int, noise: str = "") -> Validation:
    """What `ppafo validate` says of a recording with a fault."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "recorded.csv"
        write_csv(file, recorded(fault, seed, noise))
        return ppafo.validate("ppafo2011", [file], overrides=SUPPLY).found


def judged(fault: Fault, found: Validation) -> str:
    """`right`, `wrong` or `none`."""
    best = found.causes.found
    if best is None:
        return "none"
    return "right" if any(in_words(one).startswith(fault.named) for one in (best, *best.same)) else "wrong"


def together(first: Fault, second: Fault) -> Fault:
    """Both faults at once."""
    return Fault(
        f"{first.title}, {second.title}",
        (*first.named, *second.named),
        lambda one: second.record(first.record(one)),
        (*first.device, *second.device),
    )


class Verdict(NamedTuple):
    """What is said of a fault, by which names, whether the recordings agree with the model, and CPU seconds."""

    word: str
    named: tuple[str, ...]
    passes: bool
    seconds: float


def verdict_of(places: tuple[int, ...], seed: int, noise: str = "") -> Verdict:
    """What is said of the faults at places of ``FAULTS`` at once; of none, a right recording."""
    fault = NOTHING
    for place in places:
        fault = together(fault, FAULTS[place]) if fault.title else FAULTS[place]
    begun = time.process_time()
    try:
        found = validated(fault, seed, noise)
    except PpafoError:
        return Verdict("refused", (), False, time.process_time() - begun)
    best = found.causes.found
    same = () if best is None else tuple(one.name for one in (best, *best.same))
    return Verdict(judged(fault, found), same, found.passes, time.process_time() - begun)


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--right", type=int, default=0, metavar="COUNT", help="COUNT right recordings")
    parser.add_argument("--pairs", type=int, default=0, metavar="COUNT", help="COUNT recordings with two faults")
    parser.add_argument("--noise", choices=tuple(KINDS), default="", help="kind of noise that is added")
    add_processes(parser)
    words = parser.parse_args()
    first, random = words.seeds[0], np.random.default_rng(words.seeds[0])
    drawn = [tuple(random.choice(len(FAULTS), 2, replace=False).tolist()) for _ in range(words.pairs)]
    work: list[tuple[tuple[int, ...], int]] = [((place,), seed) for place in range(len(FAULTS)) for seed in words.seeds]
    work += [(pair, first + number) for number, pair in enumerate(drawn)]
    work += [((), first + number) for number in range(words.right)]
    results = results_of(verdict_of, [(*one, words.noise) for one in work], words.processes)
    total: Counter[str] = Counter()
    spent = 0.0
    for fault in FAULTS:
        found = [next(results) for _ in words.seeds]
        counts = Counter(one.word for one in found)
        total += counts
        spent += sum(one.seconds for one in found)
        said = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
        print(f"{fault.title}: {said} ({' or '.join(found[0].named)})", flush=True)
    each = spent / total.total()
    print(f"\n{', '.join(f'{total[verdict]} {verdict}' for verdict in VERDICTS)}; {each:.1f} CPU s each", flush=True)
    if drawn:
        said_of: Counter[str] = Counter()
        for pair in drawn:
            word = next(results).word
            said_of[word] += 1
            if word in ("right", "wrong"):
                print(f"  {', '.join(FAULTS[place].title for place in pair)}: {word}", flush=True)
        words_for = {"wrong": "another named", "right": "one named that explains both", "none": "none named"}
        words_for["refused"] = "refused when read"
        print(f"two faults at once: {', '.join(f'{said_of[name]} {text}' for name, text in words_for.items())}")
    if words.right:
        alarms = sum(not next(results).passes for _ in range(words.right))
        print(f"{alarms} of {words.right} right recordings do not agree")


if __name__ == "__main__":
    main()
