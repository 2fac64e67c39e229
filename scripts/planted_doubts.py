"""Plants physics and faults of a record that the fitted model lacks, and counts what a trajectory fit says of them.

    python scripts/planted_doubts.py --draws 20 --seed 31
    python scripts/planted_doubts.py --clean --draws 20 --seed 31

The recordings are those of an integration with scipy that shares no code with the package (tests/judge/bench.py): two
step responses of 0.4 s at 1 kHz, white noise of sensors, five numbers fitted. Each row plants one thing at four sizes.
Printed for each: fits that call the model wrong, those that name what was planted and those that name something else as
what explains all; of all numbers the fraction that is called identified without a condition and lies outside its
interval, that has a condition and lies outside the interval beside it, and that is said to be identified, with a
condition or without; and of the numbers that a fit with the named effect gives, how many intervals hold.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.intervals import Planted, planted_problem, two_step_responses
from benchmarks.intervals.noise_kinds import NOISE_KINDS
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import FreeParameter, Search, TrajectoryFit, fit
from ppafo.signals.recording import Channel, Recording
from tests.judge.bench import Extra, bench

DURATION, INTERVAL, FINE = 0.4, 1.0e-3, 1.0e-4
PARAMETERS = (
    "valve.discharge_coefficient",
    "actuator.leak.area",
    "friction.static_torque",
    "friction.viscous_damping",
    "foot_plate.inertia",
)
UNITS = {"angle": "rad", "pressure_1": "Pa", "pressure_2": "Pa"}
Sampled = Callable[[Any, float, np.random.Generator], Any]


@dataclass(frozen=True)
class Row:
    """What is planted: its sizes, the physics of a size, what a sampled record makes of it, and the direction it is."""

    name: str
    sizes: Sequence[float]
    physics: Callable[[float], Extra]
    sampled: Sampled | None = None
    named: str = ""


def late_stamps(fine: Any, size: float, random: np.random.Generator) -> Any:
    """Each sample taken ``size`` [s] early or late at random, all channels together."""
    times = np.arange(fine.shape[1]) * FINE
    regular = np.arange(round(DURATION / INTERVAL) + 1) * INTERVAL
    moved = regular + size * random.standard_normal(regular.size)
    return np.array([np.interp(moved, times, one) for one in fine])


def drifting_gain(fine: Any, size: float, random: np.random.Generator) -> Any:
    """Each channel with a gain that wanders by ``size`` over the recording."""
    samples = fine[:, :: round(INTERVAL / FINE)]
    walk = np.cumsum(random.standard_normal(samples.shape), axis=1) / math.sqrt(samples.shape[1])
    return samples * (1.0 + size * walk)


def nothing(_: float) -> Extra:
    """The model itself."""
    return Extra()


ROWS = (
    Row("nothing", (0.0,), nothing),
    Row(
        "leak that opens, 8 to 40 kPa",
        (8e3, 14e3, 24e3, 40e3),
        lambda size: Extra(leak_opens=size),
        named="leak_opening",
    ),
    Row(
        "friction that grows with pressure, 1e-7 to 6e-7 m^3",
        (1e-7, 2e-7, 3.5e-7, 6e-7),
        lambda size: Extra(pressed=size),
        named="seal_friction",
    ),
    Row("heat, h = 3,000 to 12,000", (3e3, 5e3, 8e3, 12e3), lambda size: Extra(heat=size), named="heat"),
    Row("heat, h = 60", (60.0,), lambda size: Extra(heat=size), named="heat"),
    Row("Stribeck, 0.1 to 0.6 rad/s", (0.1, 0.2, 0.35, 0.6), lambda size: Extra(stribeck=size), named="stribeck"),
    Row("line of 2 to 10 cm^3", (2e-6, 4e-6, 7e-6, 10e-6), lambda size: Extra(line=size), named="line_volume"),
    Row(
        "real gas, B = -60 to -250 cm^3/mol",
        (60.0, 100.0, 160.0, 250.0),
        lambda size: Extra(virial=-size * 1e-6 / 2478.0),
        named="second_virial",
    ),
    Row("time stamps off by 0.05 to 0.2 ms", (5e-5, 8e-5, 1.3e-4, 2e-4), nothing, late_stamps),
    Row("gain that drifts by 0.15 to 0.6 %", (1.5e-3, 2.5e-3, 4e-3, 6e-3), nothing, drifting_gain, named="gain of"),
)


HEAD = (
    "planted",
    "fits",
    "model called wrong",
    "named",
    "something else named",
    "identified and wrong",
    "conditional, and outside the interval beside",
    "identified",
    "of these conditional",
    "interval holds",
    "interval beside holds",
    "interval with the named effect holds",
    "CPU s a fit",
)


@dataclass
class Count:
    """What was counted of one row."""

    fits: int = 0
    wrong_model: int = 0
    named: int = 0
    misnamed: int = 0
    numbers: int = 0
    identified: int = 0
    wrong: int = 0
    conditional: int = 0
    conditional_wrong: int = 0
    held: int = 0
    held_beside: int = 0
    with_effect: int = 0
    held_with_effect: int = 0
    seconds: float = 0.0


def truth_of(planted: Planted, extra: Extra) -> list[Any]:
    """The channels (3, fine samples) of both experiments."""
    times = np.arange(round(DURATION / FINE) + 1) * FINE
    return [bench(one, [(0.0, one.control.settings["command"])], times, extra) for one in planted.scenarios]


def fitted(
    planted: Planted, signals: Sequence[Any], random: np.random.Generator, noise: str = "white"
) -> TrajectoryFit:
    """The fit of five numbers that begin up to 15 % off, to signals with noise of a kind."""
    recordings, kind = [], NOISE_KINDS[noise]
    times = np.arange(round(DURATION / INTERVAL) + 1, dtype=np.float64) * INTERVAL
    for number, values in enumerate(signals):
        channels = {}
        for one, (name, unit) in zip(values, UNITS.items(), strict=True):
            errors = (kind if name in kind.channels else NOISE_KINDS["white"]).draw(one.size, number, random)
            channels[name] = Channel(one + planted.noise[name] * errors, unit)
        recordings.append(Recording("planted", times, channels, kind="synthetic"))
    starts = [planted.truth(path) * math.exp(random.uniform(-0.15, 0.15)) for path in PARAMETERS]
    begin = [FreeParameter(path, start=start) for path, start in zip(PARAMETERS, starts, strict=True)]
    return fit(planted_problem(planted, begin, recordings, Search(directions=True)))


def count_row(row: Row, planted: Planted, draws: int, seed: int) -> Count:
    """What ``draws`` fits say of a row, its sizes in turn."""
    found = Count()
    signals = [truth_of(planted, row.physics(size)) for size in row.sizes]
    for draw in range(draws):
        random = np.random.default_rng([seed, ROWS.index(row), draw])
        place = draw % len(row.sizes)
        every = round(INTERVAL / FINE)
        values = [
            one[:, ::every] if row.sampled is None else row.sampled(one, row.sizes[place], random)
            for one in signals[place]
        ]
        begun = time.process_time()
        found.fits += 1
        try:
            outcome = fitted(planted, values, random)
        except IdentificationError:
            # No number comes out, and so none that is wrong.
            found.wrong_model += 1
            found.numbers += len(PARAMETERS)
            continue
        found.seconds += time.process_time() - begun
        found.wrong_model += bool(outcome.misfit)
        assert outcome.doubt is not None
        first = outcome.doubt.shown[0] if outcome.doubt.shown else None
        if first is not None and first.explains:
            is_it = bool(row.named) and first.finding.column.name.startswith(row.named)
            found.named += is_it
            found.misnamed += not is_it
            count_with_effect(found, planted, outcome)
        for path in PARAMETERS:
            estimate, truth = outcome.estimate(path), planted.truth(path)
            is_inside = estimate.low <= truth <= estimate.high
            wide = estimate.beside or (estimate.low, estimate.high)
            is_inside_wide = wide[0] <= truth <= wide[1]
            found.numbers += 1
            found.held += is_inside
            found.held_beside += is_inside_wide
            if estimate.is_identified:
                found.identified += 1
                found.conditional += bool(estimate.condition)
                found.wrong += not estimate.condition and not is_inside
                found.conditional_wrong += bool(estimate.condition) and not is_inside_wide
    return found


def count_with_effect(found: Count, planted: Planted, outcome: TrajectoryFit) -> None:
    """Count the intervals that a fit with the named effect gives."""
    assert outcome.doubt is not None
    refit = outcome.doubt.shown[0].refit
    if refit is None:
        return
    reach = 1.96 * math.sqrt(outcome.uncertainty.inflation)
    for item, at, error in zip(outcome.optimum.residuals.ranges, refit.point, refit.errors, strict=True):
        found.with_effect += 1
        found.held_with_effect += bool(abs(item.coordinate(planted.truth(item.path)) - at) <= reach * error)


def print_false_alarms(planted: Planted, draws: int, seed: int, wanted: Sequence[str]) -> None:
    """Print what fits of the right model say under each kind of noise, a row when it is done."""
    print("| noise | fits | model called wrong | a direction named | largest score of one not named | CPU s a fit |")
    print("|---|---|---|---|---|---|")
    signals = [one[:, :: round(INTERVAL / FINE)] for one in truth_of(planted, Extra())]
    for number, noise in enumerate(NOISE_KINDS):
        if wanted and not any(noise.startswith(one) for one in wanted):
            continue
        begun, wrong, named, largest = time.process_time(), 0, 0, 0.0
        for draw in range(draws):
            outcome = fitted(planted, signals, np.random.default_rng([seed, 100 + number, draw]), noise)
            assert outcome.doubt is not None
            wrong += bool(outcome.misfit)
            named += bool(outcome.doubt.shown)
            if not outcome.doubt.shown:
                largest = max(largest, *(abs(one.score) for one in outcome.doubt.findings))
        seconds = (time.process_time() - begun) / draws
        print(f"| {noise} | {draws} | {wrong} | {named} | {largest:.1f} | {seconds:.1f} |", flush=True)


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--clean", action="store_true", help="nothing planted, under ten kinds of noise")
    parser.add_argument("--rows", default="", help="begin of the names of the rows that are wanted, by commas")
    words = parser.parse_args()
    planted = two_step_responses(DURATION)
    wanted = [one for one in words.rows.split(",") if one]
    if words.clean:
        print_false_alarms(planted, words.draws, words.seed, wanted)
        return
    print(f"| {' | '.join(HEAD)} |")
    print(f"|{'---|' * len(HEAD)}")
    for row in ROWS:
        if wanted and not any(row.name.startswith(one) for one in wanted):
            continue
        count = count_row(row, planted, words.draws, words.seed)
        of_fits = [100.0 * value / count.fits for value in (count.wrong_model, count.named, count.misnamed)]
        values = [count.wrong, count.conditional_wrong, count.identified, count.conditional]
        values += [count.held, count.held_beside]
        cells = [f"{value:.0f} %" for value in (*of_fits, *(100.0 * value / count.numbers for value in values))]
        cells[1] = cells[1] if row.named else ""
        told = 100.0 * count.held_with_effect / max(1, count.with_effect)
        cells.append(f"{told:.0f} % of {count.with_effect}" if count.with_effect else "")
        print(f"| {row.name} | {count.fits} | {' | '.join(cells)} | {count.seconds / count.fits:.1f} |", flush=True)


if __name__ == "__main__":
    main()
