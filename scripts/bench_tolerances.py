"""Plants the tolerances of a bench in synthetic recordings, and counts how often the intervals of a fit hold.

    python scripts/bench_tolerances.py --draws 40 --seed 41

Four step responses of 0.4 s at 1 kHz, two of them against a load, one at a low pressure. Each recording has its own
error of both supplies (within 1 psi) and of its load (2 %), the sensors one zero (0.3 deg, 0.15 psi) and one gain
(0.3 %) for all of them, each drawn evenly between its limits, and white noise. Five numbers are fitted, once with the
tolerances stated and once without. Printed: percentage of the 95 % intervals that hold, median half width in percent.
"""

import argparse
import math
import statistics
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.intervals.planted import NOISE, exact_recording
from ppafo.constants import PASCALS_PER_PSI
from ppafo.identification.trajectory import Experiment, FreeParameter, Search, TrajectoryProblem, fit
from ppafo.identification.trajectory.problem import number_at, with_numbers
from ppafo.identification.trajectory.tolerances import Tolerances, tolerance_parameters
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import FreeMotion, Scenario

TOLERANCES = Tolerances(
    load=0.02,
    supply=PASCALS_PER_PSI,
    zero_of_angle=math.radians(0.3),
    zero_of_pressure=0.15 * PASCALS_PER_PSI,
    gain=0.003,
)
PARAMETERS = (
    "valve.discharge_coefficient",
    "actuator.leak.area",
    "friction.static_torque",
    "friction.viscous_damping",
    "foot_plate.inertia",
)
BACK = ("controller.command=-1", "motion.angle=130 deg", "initial.pressure_1=supply", "initial.pressure_2=atmosphere")


def at(pressure: float) -> tuple[str, ...]:
    """Both regulators and what they feed at a pressure [psi gauge]."""
    return (f"supply.pressure={pressure} psi_g", f"supply.dorsiflexion_pressure={pressure} psi_g")


RECORDINGS: dict[str, tuple[str, ...]] = {
    "there": at(55.0),
    "back": (*at(40.0), *BACK),
    "there-loaded": (*at(70.0), "motion.external_torque=3 N m"),
    "back-loaded": (*at(25.0), *BACK, "motion.external_torque=-1.5 N m"),
}


def planned(duration: float = 0.4) -> dict[str, Scenario]:
    """The recordings as they are planned, by label."""
    length = f"run.duration={duration} s"
    return {
        label: load_scenario("step-response", ("motion.kind=free", length, f"name={label}", *changed))
        for label, changed in RECORDINGS.items()
    }


def recorded(
    scenarios: dict[str, Scenario],
    tolerances: Tolerances,
    random: np.random.Generator,
    truth: Mapping[str, float] | None = None,
) -> dict[str, Recording]:
    """What a bench with these tolerances records of the planned scenarios, on a device with other numbers [SI]."""

    def even(limit: float) -> float:
        return float(random.uniform(-limit, limit))

    zeros = {name: even(tolerances.zero_of(name)) for name in NOISE}
    gains = {name: 1.0 + even(tolerances.gain) for name in NOISE}
    found = {}
    for label, scenario in scenarios.items():
        assert isinstance(scenario.motion, FreeMotion)
        changed = {
            path: number_at(scenario, path) + even(tolerances.supply)
            for path in ("supply.pressure", "supply.dorsiflexion_pressure")
        }
        changed["motion.external_torque"] = scenario.motion.external_torque * (1.0 + even(tolerances.load))
        clean = exact_recording(with_numbers(scenario, {**changed, **(truth or {})}))
        rest = {"angle": 0.0}
        atmosphere = scenario.device.supply.atmospheric_pressure
        channels = {"command": clean.channels["command"]} if "command" in clean else {}
        for name, noise in NOISE.items():
            zero = rest.get(name, atmosphere)
            values = zero + gains[name] * (clean[name] - zero) + zeros[name]
            channels[name] = Channel(values + noise * random.standard_normal(len(clean)), clean.unit(name))
        found[label] = Recording(label, clean.time, channels, kind="synthetic")
    return found


@dataclass
class Count:
    """Of one way to fit: intervals, those that hold, their half widths over the number, fits called wrong."""

    total: int = 0
    held: int = 0
    wrong: int = 0
    seconds: float = 0.0
    widths: dict[str, list[float]] = field(default_factory=dict)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--seed", type=int, default=41)
    parser.add_argument("--directions", action="store_true", help="search what the model lacks, too")
    words = parser.parse_args()
    scenarios = planned()
    counts = {"stated": Count(), "not stated": Count()}
    for draw in range(words.draws):
        random = np.random.default_rng([words.seed, draw])
        recordings = recorded(scenarios, TOLERANCES, random)
        experiments = tuple(Experiment(label, one, recordings[label]) for label, one in scenarios.items())
        truths = {path: number_at(scenarios["there"], path) for path in PARAMETERS}
        free = tuple(FreeParameter(path, start=truths[path] * math.exp(random.uniform(-0.15, 0.15))) for path in truths)
        for name, tolerances in (("stated", TOLERANCES), ("not stated", Tolerances())):
            count, begun = counts[name], time.process_time()
            added = tolerance_parameters(tolerances, experiments, free)
            outcome = fit(TrajectoryProblem((*free, *added), experiments, Search(directions=words.directions)))
            count.seconds += time.process_time() - begun
            count.wrong += bool(outcome.misfit)
            for path, truth in truths.items():
                estimate = outcome.estimate(path)
                count.total += 1
                count.held += estimate.low <= truth <= estimate.high
                count.widths.setdefault(path, []).append(100.0 * estimate.half_width / truth)
    print("| tolerances | fits | intervals that hold | called wrong | CPU s a fit | median half width, % |")
    print("|---|---|---|---|---|---|")
    for name, count in counts.items():
        widths = ", ".join(f"{path.split('.')[-1]} {statistics.median(one):.2g}" for path, one in count.widths.items())
        share, seconds = 100.0 * count.held / count.total, count.seconds / words.draws
        print(f"| {name} | {words.draws} | {share:.1f} % | {count.wrong} | {seconds:.1f} | {widths} |")


if __name__ == "__main__":
    main()
