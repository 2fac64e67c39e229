"""Plants mistakes of a record and of a set, and prints what `ppafo validate` says of each.

    python scripts/planted_disagreements.py --seed 77
    python scripts/planted_disagreements.py --right 20 --seed 77

The recordings are those of an integration with scipy that shares no code with the package (tests/judge/bench.py): a
step response of 0.4 s at 1 kHz, white noise of 0.1 deg and 0.5 kPa. ``--right`` plants nothing, as often as it says.
"""

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import ppafo
from ppafo.errors import PpafoError
from ppafo.questions.validate.solve import Validation, in_words
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import number_at, with_numbers
from ppafo.storage import write_csv
from tests.judge.bench import Extra, bench

TIMES = np.arange(401, dtype=np.float64) * 1e-3
OPENS, PSI = 0.02, 6.894757
NOISE = {"angle": (math.radians(0.1), "rad"), "pressure_1": (500.0, "Pa"), "pressure_2": (500.0, "Pa")}
SUPPLY = ["supply.pressure=55 psi_g", "supply.dorsiflexion_pressure=55 psi_g"]
ROOM = "supply.atmospheric_pressure"


@dataclass(frozen=True)
class Planted:
    """What is planted: factors of numbers of the set (the atmosphere [Pa]), a mistake of the record, physics, its name.

    ``named`` is the begin of the words that name it.
    """

    title: str
    named: str
    factors: Mapping[str, float] = field(default_factory=dict)
    mistake: str = ""
    extra: Extra = field(default_factory=Extra)


PLANTED = (
    Planted("leak 3 times", "actuator.leak.", {"actuator.leak.area": 3.0}),
    Planted("no leak", "actuator.leak.", {"actuator.leak.area": 1e-6}),
    Planted("damping twice", "friction.viscous_damping", {"friction.viscous_damping": 2.0}),
    Planted("damping a tenth", "friction.viscous_damping", {"friction.viscous_damping": 0.1}),
    Planted("torque constant 10 % low", "actuator.torque_constant", {"actuator.torque_constant": 0.9}),
    Planted("atmosphere of 83 kPa", ROOM, {ROOM: 83e3}),
    Planted("atmosphere of 83 kPa under sensors of gauge pressure", ROOM, {ROOM: 83e3}, mistake="gauge"),
    Planted("kPa read as psi", "all pressures seem to be kPa read as psi", mistake="psi"),
    Planted("pressures swapped", "pressure_1 and pressure_2 seem to be swapped", mistake="swap"),
    Planted("angle from the other end", "the angle seems to be counted from the other end", mistake="end"),
    Planted("pressure_1 3 ms late", "pressure_1 seems to be later", mistake="late"),
    Planted("inertia 30 % high", "foot_plate.inertia", {"foot_plate.inertia": 1.3}),
    Planted("leak opens at 20 kPa", "the leak seems to open", extra=Extra(leak_opens=2e4)),
)


def recorded(planted: Planted, seed: int) -> Recording:
    """A recording of what is planted."""
    base = load_scenario("step-response", ["motion.kind=free"])
    numbers = {path: by if path == ROOM else by * number_at(base, path) for path, by in planted.factors.items()}
    scenario = with_numbers(base, numbers)
    room = scenario.device.supply.atmospheric_pressure
    scenario = replace(scenario, initial_pressure_1=room)
    values = bench(scenario, [(0.0, 0.0), (OPENS, 1.0)], TIMES, planted.extra)
    random = np.random.default_rng(seed)
    channels = {
        name: Channel(one + size * random.standard_normal(TIMES.size), unit)
        for one, (name, (size, unit)) in zip(values, NOISE.items(), strict=True)
    }
    supply = scenario.device.supply.pressure + 500.0 * random.standard_normal(TIMES.size)
    channels |= {
        "command": Channel(np.where(TIMES > OPENS - 1e-9, 1.0, 0.0), "-"),
        "supply_pressure": Channel(supply, "Pa"),
    }
    if planted.mistake == "swap":
        channels["pressure_1"], channels["pressure_2"] = channels["pressure_2"], channels["pressure_1"]
    if planted.mistake == "end":
        ends = number_at(base, "actuator.angle_min") + number_at(base, "actuator.angle_max")
        channels["angle"] = Channel(ends - channels["angle"].values, "rad")
    if planted.mistake == "late":
        late = np.interp(TIMES - 0.003, TIMES, channels["pressure_1"].values)
        channels["pressure_1"] = Channel(late, "Pa")
    if planted.mistake == "gauge":
        for name in ("pressure_1", "pressure_2", "supply_pressure"):
            channels[name] = Channel(channels[name].values + number_at(base, ROOM) - room, "Pa")
    if planted.mistake == "psi":
        for name in ("pressure_1", "pressure_2", "supply_pressure"):
            channels[name] = Channel(room + PSI * (channels[name].values - room), "Pa")
    return Recording("planted", TIMES, channels, "synthetic")


def said_of(planted: Planted, seed: int) -> Validation:
    """What `ppafo validate` says of a recording."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "planted.csv"
        write_csv(file, recorded(planted, seed))
        return ppafo.validate("ppafo2011", [file], overrides=SUPPLY)


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=77)
    parser.add_argument("--right", type=int, default=0, metavar="COUNT", help="nothing planted, COUNT times")
    words = parser.parse_args()
    if words.right:
        nothing = Planted("nothing", "")
        failed = [said_of(nothing, seed) for seed in range(words.seed, words.seed + words.right)]
        print(f"{sum(not one.passes for one in failed)} of {words.right} recordings of the right set do not agree")
        return
    print(
        "| planted | agrees | largest error over noise | of full range | named | gain | next best | its gain | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for planted in PLANTED:
        begun = time.process_time()
        try:
            found = said_of(planted, words.seed)
        except PpafoError as error:
            print(f"| {planted.title} | refused: {error} | | | | | | | |", flush=True)
            continue
        channels = [channel for one in found.recordings for channel in one.channels]
        worst = max(channels, key=lambda one: one.in_noise)
        best = [(in_words(one), f"{one.gain:.0f}") for one in found.explanations.found[:2]]
        cells = [cell for pair in [*best, ("", ""), ("", "")][:2] for cell in pair]
        size = f"{worst.in_noise:.2g} | {100.0 * worst.fraction:.2g} %"
        agrees, spent = "yes" if found.passes else "no", time.process_time() - begun
        print(f"| {planted.title} | {agrees} | {size} | {' | '.join(cells)} | {spent:.1f} |", flush=True)


if __name__ == "__main__":
    main()
