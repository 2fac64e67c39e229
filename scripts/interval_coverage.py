"""Counts how often intervals of the trajectory fit hold, on recordings that are synthetic and whose truth is known.

    python scripts/interval_coverage.py --seed 5 --fits 40 --cell ideal --cell white --processes 4

Two step responses of 501 samples, there and back; four numbers of the device are sought beside all tolerances.
``ideal`` and ``default`` are recorded by the simulated bench (ideal-laboratory and paper-bench), in a tenth of the
model's steps. The kinds of noise are runs of the model, whose truth, tolerances included, is drawn anew for each fit.
Departures are runs of a device that the fitted model is not. A seed is given, so that no fit was tuned to it.
"""

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

if not __package__:
    # The first place is this folder, in which this file would pass for the package of the same name.
    sys.path[0] = str(Path(__file__).parents[1])

from ppafo.constants import PASCALS_PER_PSI
from ppafo.identification.fit import FitNumber
from ppafo.identification.tolerances import Tolerances
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    FittedExperiment,
    TrajectoryProblem,
    number_at,
    tolerance_parameters,
)
from ppafo.identification.trajectory.fitting import TrajectoryFit, fit, numbers_in, prepare, signals_of
from ppafo.parameters.loading import load_parameter_set
from ppafo.rig.experiments import record
from ppafo.running import simulate
from ppafo.signals.recording import Channel, Floats, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from scripts.processes import add_processes, results_of

COMMON = ("motion.kind=free", "run.duration=0.5 s")
BACK = (
    "controller.command=-1", "motion.angle=130 deg", "supply.pressure=40 psi_g",
    "supply.dorsiflexion_pressure=40 psi_g", "initial.pressure_1=40 psi_g", "initial.pressure_2=atmosphere",
)  # fmt: skip
SOUGHT = {
    "valve.discharge_coefficient": 0.13,
    "foot_plate.inertia": 0.010,
    "friction.viscous_damping": 0.025,
    "friction.static_torque": 0.45,
}
UNITS = ("", " kg m^2", " N m s/rad", " N m")
NOISE = {"angle": math.radians(0.05), "pressure_1": 400.0, "pressure_2": 400.0}
PRESETS = {"ideal": "ideal-laboratory", "default": "paper-bench"}
DEPARTURES = {
    "stribeck": ("effects.stribeck.velocity=0.3 rad/s",),
    "whole stribeck": ("effects.stribeck.velocity=0.1 rad/s", "effects.stribeck.share=0.99"),
    "dead volume": ("actuator.dead_volume_1=70 cm^3", "actuator.dead_volume_2=70 cm^3"),
    "displacement per radian": ("actuator.displacement_per_radian=28 cm^3/rad",),
    "slew limit": ("valve.slew_limit=40 1/s",),
}


def white(random: np.random.Generator, count: int) -> Floats:
    """White noise of size 1, as all below."""
    return random.standard_normal(count)


def autoregression(random: np.random.Generator, count: int, memory: float = 0.9) -> Floats:
    """AR(1) whose neighbours are correlated by ``memory``."""
    values = random.standard_normal(count)
    for place in range(1, count):
        values[place] = memory * values[place - 1] + math.sqrt(1.0 - memory**2) * values[place]
    return values


def slow(random: np.random.Generator, count: int) -> Floats:
    """AR(1) of 0.97, whose memory is thirty samples."""
    return autoregression(random, count, 0.97)


def outliers(random: np.random.Generator, count: int) -> Floats:
    """White noise, of which one sample in two hundred is off by thirty sizes."""
    is_out = random.random(count) < 0.005
    return np.asarray(random.standard_normal(count) + 30.0 * is_out * random.choice([-1.0, 1.0], count))


def little(random: np.random.Generator, count: int) -> Floats:
    """A tenth of white noise, as before a coarse converter."""
    return 0.1 * random.standard_normal(count)


def walk(random: np.random.Generator, count: int) -> Floats:
    """White noise and a random walk that ends as far away."""
    return random.standard_normal(count) + np.cumsum(random.standard_normal(count)) / math.sqrt(count)


def drift(random: np.random.Generator, count: int) -> Floats:
    """White noise and a straight drift that ends three sizes away."""
    end = float(random.choice([-3.0, 3.0]))
    return random.standard_normal(count) + end * np.linspace(0.0, 1.0, count)


def heavy(random: np.random.Generator, count: int) -> Floats:
    """Student t of 3 degrees of freedom."""
    return np.asarray(random.standard_t(3.0, count) / math.sqrt(3.0))


def hum(random: np.random.Generator, count: int) -> Floats:
    """White noise and a hum of 50 Hz of the same size, at 1 kHz."""
    phase = 2.0 * math.pi * (0.05 * np.arange(count) + random.random())
    return np.asarray(random.standard_normal(count) + math.sqrt(2.0) * np.sin(phase))


KINDS: dict[str, Callable[[np.random.Generator, int], Floats]] = {
    "white": white, "AR(1)": autoregression, "random walk": walk, "Student t": heavy, "hum": hum, "drift": drift,
    "AR(0.97)": slow, "outliers": outliers, "quantised": little,
}  # fmt: skip
STEP_OF_CONVERTER = 3.0
"""Resolution of a quantised channel over the size of the noise that others have."""


def disturbed(values: Floats, size: float, kind: str, random: np.random.Generator) -> Floats:
    """Values with noise of a kind and a size, rounded where a coarse converter follows."""
    found = values + size * KINDS[kind](random, len(values))
    step = STEP_OF_CONVERTER * size
    return np.asarray(step * np.round(found / step) if kind == "quantised" else found)


OTHER_SUPPLY = "supply 3 psi off"
CELLS = (*PRESETS, *KINDS, *DEPARTURES, OTHER_SUPPLY)


def scenarios(more: Sequence[str] = ()) -> tuple[Scenario, Scenario]:
    """Return the two step responses, of the device of the set but for overrides."""
    there = load_scenario("step-response", [*COMMON, *more])
    return there, load_scenario("step-response", [*COMMON, *BACK, *more])


def problem_of(recordings: Sequence[Recording], random: np.random.Generator, states: bool = True) -> TrajectoryProblem:
    """Return what a user writes: four numbers from other starts, all tolerances by default.

    Without ``states`` the uncertainties that the set states of its volumes (25 %) are left out.
    """
    labels = ("there", "back")
    experiments = tuple(
        FittedExperiment(label, scenario, recording)
        for label, scenario, recording in zip(labels, scenarios(), recordings, strict=True)
    )
    sought = tuple(
        FitNumber(path, start=value * math.exp(random.uniform(-0.3, 0.3)), low=value / 10.0, high=value * 10.0)
        for path, value in SOUGHT.items()
    )
    stated = load_parameter_set("ppafo2011") if states else None
    return TrajectoryProblem((*sought, *tolerance_parameters(Tolerances(), experiments, sought, stated)), experiments)


def truth_in_words() -> list[str]:
    """Return the truth as overrides."""
    return [f"{path}={value}{unit}" for (path, value), unit in zip(SOUGHT.items(), UNITS, strict=True)]


def of_model(kind: str, random: np.random.Generator, supply_error: float = 0.0) -> tuple[Recording, ...]:
    """Return recordings of the model with noise of a kind, whose tolerances are drawn from their priors.

    A ``supply_error`` [Pa] of both supplies is one that nobody says.
    """
    clean = [noisy(simulate(one).recording, "white", random) for one in scenarios(truth_in_words())]
    problem = problem_of(clean, random)
    numbers = problem.numbers
    truth = np.array([item.start for item in numbers])
    for place, item in enumerate(numbers):
        if item.path.startswith("supply.") and supply_error:
            truth[place] += supply_error
        elif item.is_tolerance:
            moved = truth[place] + item.deviation * math.sqrt(3.0) * random.uniform(-1.0, 1.0)
            truth[place] = min(max(moved, item.low), item.high)
        else:
            truth[place] = SOUGHT[item.path.replace("valves.proportional.", "valve.")]
    prepared = [prepare(one, numbers_in(one.label, numbers, truth)) for one in problem.experiments]
    return tuple(
        noisy(Recording(one.measured.label, one.measured.time, {name: Channel(column[:, 0], clean[0].unit(name))
                                             for name, column in signals.items()}, "synthetic"), kind, random)
        for one, signals in zip(prepared, signals_of(prepared, numbers, truth[:, None]), strict=True)
    )  # fmt: skip


def noisy(clean: Recording, kind: str, random: np.random.Generator) -> Recording:
    """Return a recording with noise of a kind."""
    channels = {
        name: Channel(disturbed(clean[name], NOISE[name], kind, random), clean.unit(name)) for name in FITTED_CHANNELS
    }
    return Recording(clean.label, clean.time, channels, "synthetic")


def recordings_of(cell: str, random: np.random.Generator) -> tuple[Recording, ...]:
    """Return two step responses of a cell of the table."""
    if cell in KINDS:
        return of_model(cell, random)
    if cell == OTHER_SUPPLY:
        return of_model("white", random, float(random.choice([-3.0, 3.0])) * PASCALS_PER_PSI)
    if cell in DEPARTURES:
        found = (simulate(one).recording for one in scenarios([*truth_in_words(), *DEPARTURES[cell]]))
        return tuple(noisy(one, "white", random) for one in found)
    seeds = random.integers(2**31, size=2).tolist()
    return tuple(
        record("step-response", PRESETS[cell], seed, overrides=[*COMMON, *more, *truth_in_words()]).recording
        for seed, more in zip(seeds, ((), BACK), strict=True)
    )


class One(NamedTuple):
    """What one fit of a cell comes to, by number: intervals that hold, are identified, half widths over the truth."""

    holds: list[bool]
    identified: list[bool]
    is_flagged: bool
    half_widths: list[float]
    seconds: float


def one_of(cell: str, seed: int, number: int) -> One:
    """Return what a fit of a cell comes to; its recordings are drawn with the seed and the number."""
    random = np.random.default_rng([seed, CELLS.index(cell), number])
    truth = [number_at(scenarios(truth_in_words())[0], path) for path in SOUGHT]
    recordings = recordings_of(cell, random)
    begun = time.process_time()
    found: TrajectoryFit = fit(problem_of(recordings, random, cell not in DEPARTURES))
    seconds = time.process_time() - begun
    holds = [one.low <= true <= one.high for one, true in zip(found.estimates, truth, strict=True)]
    identified = [one.is_identified for one in found.estimates]
    half = [one.wider_half_width / true for one, true in zip(found.estimates, truth, strict=True)]
    return One(holds=holds, identified=identified, is_flagged=bool(found.conflict), half_widths=half, seconds=seconds)


class Row(NamedTuple):
    """A line of the table, by number: intervals that hold, identified, wrong of these; fits flagged, and their cost."""

    cell: str
    fits: int
    held: list[int]
    flagged: int
    identified: list[int]
    wrong: list[int]
    half_widths: list[float]
    seconds: float

    def text(self) -> str:
        """Return it as a line of a table of Markdown."""
        held, identified, wrong = (", ".join(map(str, one)) for one in (self.held, self.identified, self.wrong))
        widths = ", ".join(f"{100.0 * one:.2g}" for one in self.half_widths)
        counts = f"{held} | {self.flagged} | {identified} | {wrong}"
        return f"| {self.cell} | {self.fits} | {counts} | {widths} | {self.seconds:.1f} |"


def row_of(cell: str, ones: Iterable[One]) -> Row:
    """Return what the fits of a cell come to together."""
    ones = list(ones)
    return Row(
        cell=cell,
        fits=len(ones),
        held=np.sum([one.holds for one in ones], axis=0).tolist(),
        flagged=sum(one.is_flagged for one in ones),
        identified=np.sum([one.identified for one in ones], axis=0).tolist(),
        wrong=np.sum([np.greater(one.identified, one.holds) for one in ones], axis=0).tolist(),
        half_widths=np.median([one.half_widths for one in ones], axis=0).tolist(),
        seconds=float(np.median([one.seconds for one in ones])),
    )


def main(words: Sequence[str] | None = None) -> int:
    """Fit, count and print; the exit code is 0."""
    parser = argparse.ArgumentParser(description="How often intervals of the trajectory fit hold.")
    parser.add_argument("--seed", type=int, required=True, help="random seed of truths, noise and starts")
    parser.add_argument("--fits", type=int, default=40, help="fits for each cell; default 40")
    parser.add_argument("--cell", action="append", choices=CELLS, help="a line of the table; default: all")
    parser.add_argument("--out", type=Path, help="write the table as JSON into this file, too")
    add_processes(parser)
    parsed = parser.parse_args(words)
    print(f"synthetic recordings; numbers are those of {', '.join(SOUGHT)}")
    print("| cell | fits | held | flagged | identified | wrong, yet identified | half width, % | CPU s a fit |")
    print("|---|---|---|---|---|---|---|---|")
    cells, rows = parsed.cell or CELLS, []
    ones = results_of(
        one_of, [(cell, parsed.seed, number) for cell in cells for number in range(parsed.fits)], parsed.processes
    )
    for cell in cells:
        rows.append(row_of(cell, [next(ones) for _ in range(parsed.fits)]))
        print(rows[-1].text(), flush=True)
    if parsed.out is not None:
        parsed.out.write_text(json.dumps([row._asdict() for row in rows], indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
