"""Prints what `ppafo validate` names of 14 known faults, of two at once, and how often right recordings disagree.

    python scripts/known_faults.py --seeds 4711 4712 --pairs 40 --right 100 --processes 4
    python scripts/known_faults.py --seeds 4711 4712 --declared

Recordings are step responses of the simulated bench (ideal-laboratory), runs in a tenth of the model's steps: 1 kHz,
free vane, its own noise. Each fault is one of the record or one number of the
device. `right`: the fault is named first; `listed`: it is among those that the recordings cannot tell from the first;
`wrong`: others are named; `usual`: errors that sensors of any bench have are; `none`: none is. ``--declared`` has each
number that is declared for either kind of valve, the joint, the gas and the effects, in turn, with a loop that moves a
free vane and white noise; `unseen`: without noise the model of the set differs from the recording by less than that
noise. ``--pairs`` has two different faults at once, drawn with the first seed: no single
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
from functools import cache, reduce
from pathlib import Path
from typing import NamedTuple

import numpy as np

if not __package__:
    # The first place is this folder, in which this file would pass for the package of the same name.
    sys.path[0] = str(Path(__file__).parents[1])

import ppafo
from ppafo.analyses.validate import Validation
from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import PpafoError
from ppafo.model.catalog import EFFECTS, find_effects
from ppafo.rig.experiments import record
from ppafo.running import simulate
from ppafo.signals.recording import Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import declared_numbers, number_at, other_form
from ppafo.storage import write_csv
from ppafo.validation.agreement import compare_recording
from ppafo.validation.measured import check_recording
from ppafo.validation.settings import ReplaySettings
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
    """A fault: the record that it makes, numbers of the device by path, and how the words that name it begin.

    ``valve`` is the valve of a loop that moves the vane; without one, the recording is a step response of the bench.
    """

    title: str
    named: tuple[str, ...]
    record: Callable[[Recording], Recording] = lambda one: one
    device: tuple[str, ...] = ()
    valve: str = ""


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
VERDICTS = ("right", "listed", "usual", "none", "unseen", "wrong", "refused")

MOVED = (*SUPPLY, "motion.kind=free", "motion.angle=60 deg", "run.duration=0.8 s", "reference.kind=sine")
LOOPS = {
    "proportional": (
        *("controller.kind=cascade", "controller.rate=1 kHz", "reference.of=angle", "reference.level=70 deg"),
        *("reference.amplitude=30 deg", "reference.frequency=2 Hz"),
        *("initial.pressure_1=20 psi_g", "initial.pressure_2=20 psi_g"),
    ),
    "solenoid": (
        *("controller.kind=on_off", "reference.level=0 N m", "reference.amplitude=1 N m", "reference.frequency=3 Hz"),
        *("initial.pressure_1=atmosphere", "initial.pressure_2=atmosphere"),
    ),
}
"""Loops that open each valve in part, or often, and keep the vane between its stops; before them all is at rest."""
RESTING = 50
"""Samples at rest."""
SECTIONS = ("valve", "actuator", "friction", "foot_plate", "supply", "gas", "effects")
OF_OTHERS = {"gas.molar_mass": 0.029, "gas.heat_capacity_ratio": 1.4, "gas.temperature": 320.0}
"""Air, in a warm room [SI]."""
OTHER = 1.3
"""Other numbers divided by those of the set [-]."""
LACKED = {
    **{"": 0.05, "s": 0.03, "Hz": 15.0, "1/s": 40.0, "N m": 0.3, "N m/rad": 0.5, "N m s^2/rad^2": 0.01},
    **{"rad/s": 0.5, "N m/Pa": 1.0e-6, "m^2": 3.0e-6, "kg/(s Pa^2)": 1.0e-16},
}
"""Numbers that are 0 in the set, by unit [SI]."""


def declared_faults(valve: str) -> tuple[Fault, ...]:
    """Every number that is declared for a device with a valve, changed to another plausible one."""
    find_effects(f"effects.{name}" for name in EFFECTS)
    scenario = load_scenario("step-response", [f"device.valve={valve}"])
    absent = {f"{part}.{name}" for part in ("valve", "actuator.leak") for name in other_form(scenario.device, part)}
    switches = {f"effects.{name}.{switch}" for name, one in EFFECTS.loaded().items() for switch in one.switch}
    faults = []
    for path, quantity in declared_numbers(scenario).items():
        section, _, rest = path.partition(".")
        if section in SECTIONS and path not in absent and (section != "effects" or path in switches):
            value = number_at(scenario, path)
            other = OF_OTHERS.get(path, OTHER * value if value else LACKED[quantity.unit])
            # A weight at the joint is a torque of gravity towards the other end; below its first node a valve is shut.
            twins = {"joint_load.weight": "foot_plate.gravity_torque", "opening.command_01": "valve.dead_band"}
            named = (f"{path} ", path, rest, rest.partition(".")[0], twins.get(rest, path))
            faults.append(Fault(f"{valve}, {path} {other:.4g}", named, device=(f"{path}={other!r} SI",), valve=valve))
    return tuple(faults)


def after_rest(recording: Recording) -> Recording:
    """The recording after samples at rest, with the command 0 that leaves all as it is."""
    time = np.arange(RESTING + len(recording)) * (recording.time[1] - recording.time[0])
    channels = {
        name: replace(one, values=np.pad(one.values, (RESTING, 0), "constant" if name == "command" else "edge"))
        for name, one in recording.channels.items()
    }
    return replace(recording, time=time, channels=channels)


def moved(fault: Fault, seed: int) -> tuple[Recording, bool]:
    """A recording of a loop with a fault, and whether the model of the set is beyond the noise without it."""
    used = [f"device.valve={fault.valve}", *MOVED, *LOOPS[fault.valve]]
    changed_there = {override.partition("=")[0] for override in fault.device}
    kept = [override for override in used if override.partition("=")[0] not in changed_there]
    made = simulate(load_scenario("step-response", [*kept, *fault.device])).recording
    made = after_rest(
        replace(
            made, channels={name: made.channels[name] for name in KEPT if name in made and name != "supply_pressure"}
        )
    )
    device = load_scenario("step-response", used).device
    clean = compare_recording(check_recording(made, device, "r.csv"), device, ReplaySettings())
    is_seen = any(channel.rms > NOISE[channel.channel] for channel in clean.channels if channel.channel in NOISE)
    random = np.random.default_rng(seed)
    white = {name: made[name] + size * random.standard_normal(len(made)) for name, size in NOISE.items()}
    return changed(made, **white), is_seen


def recorded(fault: Fault, seed: int, noise: str = "") -> Recording:
    """A recording of the bench with a fault, and more noise of a kind."""
    words = ("motion.kind=free", *SUPPLY, *fault.device)
    made = record("step-response", preset="ideal-laboratory", seed=seed, overrides=words).recording
    made = replace(made, channels={name: made.channels[name] for name in KEPT if name in made})
    if noise:
        random = np.random.default_rng([seed, len(noise)])
        made = changed(made, **{name: disturbed(made[name], size, noise, random) for name, size in NOISE.items()})
    return fault.record(made)


def validated(recording: Recording, valve: str = "") -> Validation:
    """What `ppafo validate` says of a recording."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "recorded.csv"
        write_csv(file, recording)
        return ppafo.validate("ppafo2011", [file], overrides=SUPPLY, valve=valve or None).found


def judged(fault: Fault, found: Validation, is_seen: bool = True) -> str:
    """One of ``VERDICTS``, without `refused`."""
    best = found.causes.found
    alike = () if best is None else (best, *best.same)
    is_named = [one.in_words.startswith(fault.named) or one.name in fault.named for one in alike]
    if any(is_named):
        return "right" if is_named[0] else "listed"
    if best is not None and not best.is_usual:
        return "wrong"
    return "unseen" if not is_seen else "none" if best is None else "usual"


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


@cache
def all_faults() -> tuple[Fault, ...]:
    """Known faults, and every declared number of devices with either kind of valve."""
    return (*FAULTS, *(fault for valve in LOOPS for fault in declared_faults(valve)))


def verdict_of(places: tuple[int, ...], seed: int, noise: str = "") -> Verdict:
    """What is said of the faults at places of ``all_faults`` at once; of none, a right recording."""
    fault = reduce(together, [all_faults()[place] for place in places] or [NOTHING])
    begun = time.process_time()
    try:
        made, is_seen = moved(fault, seed) if fault.valve else (recorded(fault, seed, noise), True)
        found = validated(made, fault.valve)
    except PpafoError:
        return Verdict("refused", (), False, time.process_time() - begun)
    best = found.causes.found
    same = () if best is None else tuple(one.name for one in (best, *best.same))
    return Verdict(judged(fault, found, is_seen), same, found.passes, time.process_time() - begun)


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--right", type=int, default=0, metavar="COUNT", help="COUNT right recordings")
    parser.add_argument("--declared", action="store_true", help="declared numbers in turn, not the known faults")
    parser.add_argument("--pairs", type=int, default=0, metavar="COUNT", help="COUNT recordings with two faults")
    parser.add_argument("--noise", choices=tuple(KINDS), default="", help="kind of noise that is added")
    add_processes(parser)
    words = parser.parse_args()
    first, random = words.seeds[0], np.random.default_rng(words.seeds[0])
    drawn = [tuple(random.choice(len(FAULTS), 2, replace=False).tolist()) for _ in range(words.pairs)]
    singles = range(len(FAULTS), len(all_faults())) if words.declared else range(len(FAULTS))
    work: list[tuple[tuple[int, ...], int]] = [((place,), seed) for place in singles for seed in words.seeds]
    work += [(pair, first + number) for number, pair in enumerate(drawn)]
    work += [((), first + number) for number in range(words.right)]
    results = results_of(verdict_of, [(*one, words.noise) for one in work], words.processes)
    total: Counter[str] = Counter()
    spent = 0.0
    for place in singles:
        found = [next(results) for _ in words.seeds]
        counts = Counter(one.word for one in found)
        total += counts
        spent += sum(one.seconds for one in found)
        said = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
        print(f"{all_faults()[place].title}: {said} ({' or '.join(found[0].named)})", flush=True)
    each = spent / total.total()
    print(f"\n{', '.join(f'{total[verdict]} {verdict}' for verdict in VERDICTS)}; {each:.1f} CPU s each", flush=True)
    if drawn:
        said_of: Counter[str] = Counter()
        for pair in drawn:
            word = next(results).word
            word = "right" if word == "listed" else word
            said_of[word] += 1
            if word in ("right", "wrong"):
                print(f"  {', '.join(FAULTS[place].title for place in pair)}: {word}", flush=True)
        words_for = {
            "wrong": "another named",
            "right": "one named that explains both",
            "none": "none named",
            "usual": "within usual errors",
        }
        words_for["refused"] = "refused when read"
        print(f"two faults at once: {', '.join(f'{said_of[name]} {text}' for name, text in words_for.items())}")
    if words.right:
        alarms = sum(not next(results).passes for _ in range(words.right))
        print(f"{alarms} of {words.right} right recordings do not agree")


if __name__ == "__main__":
    main()
