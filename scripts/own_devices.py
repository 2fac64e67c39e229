"""Draws devices that are not the paper's and walks them with every torque law: what gains that follow the device cost.

    python scripts/own_devices.py --seed 1 --devices 12
    python scripts/own_devices.py --seed 1 --joints 20 --log joints.jsonl

With ``--joints`` it runs joints of a bench in place of walks, and counts what the verdict on tracking says of them
(``drawn_joints.py``). Joints that the log has are not run again: a count that was stopped goes on.

Each law walks with the gains that it has where nobody gives any, and with these times 1/8 to 4. Tuned are, of
these, the least gas among loops that do not oscillate and whose error is within a quarter of the least one, and that
error. A cell is gas over tuned and error over tuned; `!` marks a loop that oscillates. All of it is synthetic.
"""

import argparse
import random
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.control.torque_loop import boundary_layer, convergence_rate, dead_zone_opening, proportional_gain
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking import most_reversals
from ppafo.walking import load_walk

sys.path.insert(0, str(Path(__file__).parents[1]))

from scripts.drawn_joints import KINDS, angle_text, counts_of, run_joints, table_text

LAWS = (
    "event_on_off_dead_zone",
    "event_proportional",
    "event_pid",
    "event_pid_feedforward",
    "event_sliding_mode",
    "event_feedback_linearisation",
)
FACTORS = (1.0, 0.125, 0.25, 0.5, 2.0, 4.0)
"""The rule's gain first, then those that it is compared with."""
MAIN = (proportional_gain, boundary_layer, convergence_rate, dead_zone_opening)
"""What sets how fast a law is; a wider boundary layer is a slower one."""
METRICS = ("gas", "torque_error", "command_reversals", "peak_torque")
ALLOWED_ERROR = 1.25
FAR = 2.0
"""Gas over tuned that is called far."""


@dataclass(frozen=True, slots=True)
class RandomValue:
    """A device in words and as overrides of the walk ``proportional``."""

    words: str
    overrides: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """A law on a device: gas and error over tuned, nan where no gain walked; whether it oscillates."""

    gas: float
    error: float
    oscillates: bool

    @property
    def text(self) -> str:
        """The numbers with their marks."""
        return f"{self.gas:.2f} {self.error:.2f}{'!' if self.oscillates else ''}"


def draw_device(draw: random.Random) -> RandomValue:
    """A vane with a proportional valve between a toy and a hoist; the law asks for no more than the supply holds."""
    constant, gauge = draw.uniform(9.0, 47.0), draw.uniform(3.3, 6.9)
    dead_1, dead_2 = (draw.uniform(2.0, 37.0) for _ in range(2))
    conductance, delay = 0.2 * 12.0 ** draw.random(), draw.uniform(1.0, 13.0)
    species = draw.choice(("air", "CO2"))
    torque = min(5.0, 0.08 * constant * gauge)
    return RandomValue(
        f"K {constant:.0f} cm^3, dead {dead_1:.0f} and {dead_2:.0f} cm^3, C {conductance:.2f} L/(s bar), "
        f"{delay:.1f} ms, {species}, {gauge:.1f} bar",
        (
            f"gas.species={species}",
            f"actuator.torque_constant={constant!r} cm^3",
            f"actuator.displacement_per_radian={constant!r} cm^3/rad",
            f"actuator.dead_volume_1={dead_1!r} cm^3",
            f"actuator.dead_volume_2={dead_2!r} cm^3",
            f"supply.pressure={gauge!r} bar_g",
            f"supply.dorsiflexion_pressure={gauge!r} bar_g",
            f"valve.sonic_conductance={conductance!r} L/(s bar)",
            "valve.critical_ratio=0.3",
            f"valve.delay={delay!r} ms",
            f"controller.largest_torque={torque!r} N m",
        ),
    )


def main_gain(scenario: Scenario) -> tuple[str, bool]:
    """Path of the setting of a law that sets how fast it is, and whether a larger one is slower."""
    kind = WALKING_CONTROLLERS[scenario.controller.kind]
    item = next(item for item in kind.quantities if item.follows in MAIN)
    return f"controller.{item.name}", item.follows == boundary_layer


def walk_law(law: str, device: RandomValue, seconds: float) -> Cell:
    """A law on a device with the gains of the rule, against the best of its multiples."""
    scenario = load_walk("proportional", [f"controller.kind={law}", f"run.duration={seconds!r} s", *device.overrides])
    path, slower = main_gain(scenario)
    factors = np.array(FACTORS)
    gains = number_at(scenario, path) * (1.0 / factors if slower else factors)
    if path.endswith(".opening"):
        gains = np.minimum(gains, 1.0)
    found = run_ensemble(scenario, {path: gains}, METRICS).metrics
    gas, error = found["gas"], found["torque_error"]
    # A law that only switches may turn: it is judged by gas and error alone.
    oscillates = found["command_reversals"] > most_reversals(scenario)
    usable = np.isfinite(gas) & np.isfinite(error) & ~oscillates
    if not usable.any():
        return Cell(np.nan, np.nan, bool(oscillates[0]))
    least = float(error[usable].min())
    tuned = float(gas[usable & (error <= ALLOWED_ERROR * least)].min())
    return Cell(
        gas=float(gas[0]) / tuned,
        error=float(error[0]) / least,
        oscillates=bool(oscillates[0]),
    )


def main(words: Sequence[str] | None = None) -> int:
    """Print the table; 0 where no law needs more than twice the gas of tuned gains and none oscillates."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--devices", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=10.0, help="length of each walk [s]")
    parser.add_argument(
        "--joints", type=int, default=0, help="joints of a bench in place of walks: are verdicts right?"
    )
    parser.add_argument("--log", type=Path, default=None, help="records of the joints that were run")
    parser.add_argument("--kinds", default=",".join(KINDS), help="kinds of joints that are run, with commas between")
    parser.add_argument(
        "--valve", default="prop", choices=("prop", "reg"), help="valve of the joints: a spool, or regulators"
    )
    given = parser.parse_args(words)
    if given.joints:
        log = given.log or Path(f"joints-{given.seed}.jsonl")
        records = run_joints(given.seed, given.joints, log, given.kinds.split(","), given.valve)
        counts = counts_of(records)
        print(table_text(counts), angle_text(records), sep="\n\n")
        return 1 if any(row["good said"] or row["fails silent"] for row in counts.values()) else 0
    draw = random.Random(given.seed)
    devices = [draw_device(draw) for _ in range(given.devices)]
    for number, device in enumerate(devices, start=1):
        print(f"{number:3} {device.words}")
    print(f"\nsynthetic: gas and error over tuned, walks of {given.seconds:g} s; ! oscillates\n")
    print(f"{'law':30}" + "".join(f"{number:>14}" for number in range(1, given.devices + 1)) + "   worst")
    is_good = True
    for law in LAWS:
        cells = [walk_law(law, device, given.seconds) for device in devices]
        worst = [max((getattr(cell, name) for cell in cells), default=0.0) for name in ("gas", "error")]
        print(f"{law:30}" + "".join(f"{cell.text:>14}" for cell in cells) + f"   {worst[0]:.2f} {worst[1]:.2f}")
        is_good &= worst[0] <= FAR and not any(cell.oscillates for cell in cells)
    return 0 if is_good else 1


if __name__ == "__main__":
    raise SystemExit(main())
