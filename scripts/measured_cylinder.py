"""Prints what a real cylinder and two real chambers say of the laws of the package, and draws it in two figures.

    python scripts/measured_cylinder.py
    python scripts/measured_cylinder.py FOLDER --out out/measured

FOLDER has recordings ``SEAL_Nbar.csv`` of a cylinder that is driven to and fro at N bar, and ``chamber-NAME.csv`` of
closed chambers, in the forms of the example ``measured-cylinder``, which is taken where none is named. Friction over
pressure is fitted with one pressure left out and predicted there, and whether it is a straight line is what
`ppafo identify cylinder.toml` says; the pressure in a closed chamber is fitted to the
first half of its recording and predicted for the second.
"""

import argparse
import math
import re
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from ppafo.errors import PpafoError
from ppafo.identification.bench.law import BenchContext
from ppafo.identification.problem import load_problem
from ppafo.identification.procedures import run_procedure
from ppafo.identification.source import source_of
from ppafo.identification.tolerances import DEFAULTS
from ppafo.model.orifice import isentropic_flow_function
from ppafo.parameters.loading import load_parameter_set
from ppafo.report.style import BLACK, COLOURS, GREY, house_style
from ppafo.storage.column_map import load_column_map
from ppafo.storage.foreign import read_foreign
from ppafo.units import to_si

Floats = NDArray[np.float64]

EXAMPLE = Path(str(resources.files("ppafo"))) / "examples" / "measured-cylinder"
MIDDLE = (0.25, 0.75)
"""Part of the stroke that is read: the piston moves at one speed there, far from where it turns."""
REPRODUCIBILITY = 0.05 / math.sqrt(3.0)
"""Standard deviation, as part of the friction, from one recording to another: 5 % at most, which nobody measured."""
WITHIN = 1.96
ATMOSPHERE, AIR = 101_325.0, 1.4
STARTS = {"chamber-Prusa": 10.0, "chamber-Formlabs": 25.0}
"""Time [s] from which a chamber is closed for certain; 10 s for others."""
FEWEST = 20


@dataclass(frozen=True)
class Reading:
    """A recording at one pressure: the middle of each stroke; a row has force [N], pressure [Pa] and speed [m/s]."""

    bar: float
    push: Floats
    pull: Floats

    @property
    def pressure(self) -> float:
        """The mean pressure [Pa] of both directions."""
        return float((self.push[:, 1].mean() + self.pull[:, 1].mean()) / 2.0)

    @property
    def force(self) -> float:
        """The force [N] in the middle between both directions, where friction cancels."""
        return float((np.median(self.push[:, 0]) + np.median(self.pull[:, 0])) / 2.0)

    @property
    def half_gap(self) -> float:
        """Half the distance [N] of both directions: friction, and what the regulator lets the pressure change."""
        return float((np.median(self.push[:, 0]) - np.median(self.pull[:, 0])) / 2.0)

    def friction(self, area: float) -> tuple[float, float]:
        """Return friction [N] and its scatter from stroke to stroke [N]; ``area`` [m^2] takes the pressure out."""
        count = min(len(self.push), len(self.pull))
        left = [one[:count, 0] - area * one[:count, 1] for one in (self.push, self.pull)]
        strokes = (left[0] - left[1]) / 2.0
        return float(strokes.mean()), float(strokes.std(ddof=1))


def read(file: Path, bar: float) -> Reading:
    """Return the reading of a recording; PpafoError where it has fewer than three strokes each way."""
    found = read_foreign(file, load_column_map(EXAMPLE / "cylinder.toml"))
    position, pressure, force = (found[name] for name in ("position", "pressure_difference", "force"))
    low, high = np.quantile(position, (0.02, 0.98))
    first, last = (low + part * (high - low) for part in MIDDLE)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (position > first) & (position < last), [0])).astype(int)))
    strokes: dict[bool, list[tuple[float, float, float]]] = {True: [], False: []}
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        path = position[end - 1] - position[begin]
        if abs(path) > 0.8 * (last - first):
            speed = path / (found.time[end - 1] - found.time[begin])
            metres = to_si(float(speed), f"{found.unit('position')}/s", "m/s")
            row = float(np.median(force[begin:end])), float(np.median(pressure[begin:end])), metres
            strokes[bool(path > 0.0)].append(row)
    if min(map(len, strokes.values())) < 3:
        raise PpafoError(f"{file}: has fewer than three strokes each way, with which no friction is read")
    return Reading(bar, np.array(strokes[True]), np.array(strokes[False]))


@dataclass(frozen=True)
class LeftOut:
    """Friction [N] at a pressure that the fit did not see: measured, by a line with half its band, by a constant."""

    bar: float
    measured: float
    line: float
    band: float
    constant: float

    @property
    def is_predicted(self) -> bool:
        """Whether the measured friction lies in the band."""
        return abs(self.measured - self.line) <= self.band


@dataclass(frozen=True)
class Seal:
    """What the recordings of a seal say; ``area`` [m^2], line [N] and [N/Pa] with their standard errors."""

    name: str
    readings: tuple[Reading, ...]
    area: float
    friction: tuple[tuple[float, float], ...]
    line: tuple[float, float]
    errors: tuple[float, float]
    left_out: tuple[LeftOut, ...]
    is_line: bool

    @property
    def bend(self) -> float:
        """How much more friction the ends have than the middle has, against the line [N]."""
        left = [one.measured - one.line for one in self.left_out]
        return (left[0] + left[-1]) / 2.0

    @property
    def verdict(self) -> str:
        """Whether a straight line explains the friction over pressure, as `ppafo identify` says it."""
        if self.is_line:
            return "identify: a straight line"
        worst = max(self.left_out, key=lambda one: abs(one.measured - one.line) / one.band)
        return (
            f"identify: NO STRAIGHT LINE; bends {'up' if self.bend > 0.0 else 'down'}wards; misses {worst.bar:g} bar "
            f"by {abs(worst.measured - worst.line):.2f} N, {abs(worst.measured - worst.line) / worst.measured:.0%}"
        )


def is_line(files: list[Path]) -> bool:
    """Return whether `ppafo identify cylinder.toml` finds friction linear in pressure in these recordings."""
    problem = load_problem(EXAMPLE / "cylinder.toml")
    sources = tuple(source_of(file, read_foreign(file, problem.columns["rig"])) for file in files)
    setting = BenchContext(load_parameter_set(problem.device.set), "", "cylinder.toml", problem.bench or DEFAULTS)
    return all(one.is_identified for one in run_procedure(sources, problem.procedure[0], setting).estimates)


def area_of(readings: list[Reading]) -> float:
    """Return the area [m^2]: the slope of the force over the pressure, the zero of the load cell apart."""
    return float(np.polyfit([one.pressure for one in readings], [one.force for one in readings], 1)[0])


def line_through(readings: list[Reading], area: float) -> tuple[Floats, Floats, Floats]:
    """Return friction at no pressure [N] and slope [N/Pa], their covariance, and the scatter of each reading [N]."""
    friction, strokes = np.array([one.friction(area) for one in readings]).T
    scatter = np.hypot(strokes, REPRODUCIBILITY * friction)
    rows = np.column_stack((np.ones(len(readings)), [one.pressure for one in readings])) / scatter[:, None]
    scale = np.linalg.norm(rows, axis=0)
    covariance = np.linalg.inv((rows / scale).T @ (rows / scale)) / np.outer(scale, scale)
    return covariance @ (rows.T @ (friction / scatter)), covariance, scatter


def without(readings: list[Reading], index: int) -> LeftOut:
    """Return what all other readings say of one; area, line and scatter are theirs alone."""
    others, one = readings[:index] + readings[index + 1 :], readings[index]
    area = area_of(others)
    numbers, covariance, _ = line_through(others, area)
    at = np.array([1.0, one.pressure])
    line = float(at @ numbers)
    strokes = float(np.mean([other.friction(area)[1] for other in others]))
    own = math.hypot(strokes, REPRODUCIBILITY * line)
    band = WITHIN * math.hypot(math.sqrt(float(at @ covariance @ at)), own)
    constant = float(np.mean([other.friction(area)[0] for other in others]))
    return LeftOut(one.bar, one.friction(area)[0], line, band, constant)


def seal_of(name: str, files: list[tuple[float, Path]]) -> Seal:
    """Return what the recordings of a seal say, each with its pressure [bar]."""
    readings = [read(file, bar) for bar, file in files]
    area = area_of(readings)
    numbers, covariance, _ = line_through(readings, area)
    line, errors = numbers.tolist(), np.sqrt(np.diag(covariance)).tolist()
    friction = tuple(one.friction(area) for one in readings)
    left_out = tuple(without(readings, index) for index in range(len(readings)))
    straight = is_line([file for _, file in files])
    return Seal(name, tuple(readings), area, friction, (line[0], line[1]), (errors[0], errors[1]), left_out, straight)


def seals_in(folder: Path) -> list[Seal]:
    """Return every seal with recordings at four pressures or more in a folder."""
    found: dict[str, list[tuple[float, Path]]] = {}
    for file in sorted(folder.glob("*_*bar.csv")):
        parts = re.fullmatch(r"(.+)_([0-9.]+)bar", file.stem)
        if parts is not None:
            found.setdefault(parts[1], []).append((float(parts[2]), file))
    few = [name for name, files in found.items() if len(files) < 4]
    if few:
        raise PpafoError(
            f"{folder}: {few[0]} has recordings at {len(found[few[0]])} pressures; four or more are needed"
        )
    return [seal_of(name, sorted(files)) for name, files in found.items()]


LAWS = ("orifice", "laminar", "both")


@dataclass(frozen=True)
class Leak:
    """A closed chamber: time [s], absolute pressure [Pa], where its first half ends, and each law's course [Pa]."""

    name: str
    time: Floats
    pressure: Floats
    half: int
    courses: dict[str, Floats]
    noise: float

    def missed(self, law: str, *, in_the_second_half: bool) -> float:
        """Return the RMS distance [Pa] of a law in one half of the recording."""
        part = slice(self.half, None) if in_the_second_half else slice(0, self.half)
        return float(np.sqrt(np.mean(np.square(self.courses[law][part] - self.pressure[part]))))

    @property
    def verdict(self) -> str:
        """Which law predicts the second half from the first."""
        missed = min(self.missed(law, in_the_second_half=True) for law in LAWS)
        if missed > 3.0 * self.noise:
            return f"NO LAW OF A LEAK: the second half is missed by {missed / self.noise:.1f} times the noise, or more"
        alike = [law for law in LAWS if self.missed(law, in_the_second_half=True) < 3.0 * self.noise]
        return f"the second half is predicted within noise by: {', '.join(alike)}"


def emptied(time: Floats, start: float, orifice: float, laminar: float) -> Floats:
    """Return the pressure [Pa abs] in a closed isothermal chamber: dP/dt = -a P psi(P_atm/P) - b (P^2 - P_atm^2).

    a = Cd A C1 R T / (M V) [1/s] of an orifice, equations (6) to (8); b [1/(s Pa)] of a laminar gap.
    """

    def slope(_time: float, pressure: Floats) -> list[float]:
        now = float(pressure[0])
        flow = now * isentropic_flow_function(min(ATMOSPHERE / now, 1.0), AIR)
        return [-orifice * flow - laminar * (now * now - ATMOSPHERE * ATMOSPHERE)]

    return np.asarray(solve_ivp(slope, (time[0], time[-1]), [start], t_eval=time, rtol=1e-8).y[0])


def leak_in(file: Path) -> Leak:
    """Return what the recording of a closed chamber says of the laws of a leak."""
    found = read_foreign(file, load_column_map(EXAMPLE / "chamber.toml"))
    begins = STARTS.get(file.stem, 10.0)
    closed = found.time >= begins
    if np.count_nonzero(closed) < FEWEST:
        raise PpafoError(f"{file}: has fewer than {FEWEST} samples from {begins:g} s on, when the chamber is closed")
    time, pressure = found.time[closed] - found.time[closed][0], found["pressure_1"][closed]
    half, courses = len(time) // 2, {}
    rate = math.log(pressure[0] / pressure[half - 1]) / time[half - 1]
    scales = np.array([rate, rate / pressure[0]])
    for law, free in (("orifice", [0]), ("laminar", [1]), ("both", [0, 1])):

        def course(numbers: Floats, times: Floats, free: list[int] = free) -> Floats:
            both = np.zeros(2)
            both[free] = np.abs(numbers[1:]) * scales[free]
            return emptied(times, numbers[0] * pressure[0], both[0], both[1])

        def left(numbers: Floats, course=course) -> Floats:  # type: ignore[no-untyped-def]
            return np.asarray(course(numbers, time[:half]) - pressure[:half])

        best = least_squares(left, np.ones(1 + len(free)) / np.array([1.0, *[len(free)] * len(free)]))
        courses[law] = course(best.x, time)
    steps = np.diff(pressure, 2)
    return Leak(file.stem, time, pressure, half, courses, float(np.sqrt(np.mean(steps * steps) / 6.0)))


def table_of(seals: list[Seal], leaks: list[Leak]) -> str:
    """Return the tables as text."""
    lines = ["Friction over pressure, each pressure predicted from the others (N):"]
    lines += ["seal       bar   half gap  friction  predicted      constant  area of all, cm^2"]
    for seal in seals:
        for reading, (friction, _), one in zip(seal.readings, seal.friction, seal.left_out, strict=True):
            predicted = f"{one.line:.2f} +- {one.band:.2f}"
            mark = "" if one.is_predicted else "  outside"
            lines.append(
                f"{seal.name:<10} {reading.bar:<5g} {reading.half_gap:<9.2f} {friction:<9.2f} {predicted:<14} "
                f"{one.constant:<9.2f} {1e4 * seal.area:.3f}{mark}"
            )
        (rest, slope), (error, error_of_slope) = seal.line, seal.errors
        lines.append(
            f"  {seal.name}: {rest:.2f} +- {WITHIN * error:.2f} N and {1e5 * slope:.3f} +- "
            f"{1e5 * WITHIN * error_of_slope:.3f} N/bar; {seal.verdict}"
        )
    speeds = [np.abs(part[:, 2]).mean() for seal in seals for one in seal.readings for part in (one.push, one.pull)]
    if seals:
        lines.append(
            f"Speeds: push {1e3 * min(speeds[::2]):.0f} to {1e3 * max(speeds[::2]):.0f} mm/s, pull "
            f"{1e3 * min(speeds[1::2]):.0f} to {1e3 * max(speeds[1::2]):.0f} mm/s: pressure and speed change together."
        )
    for leak in leaks:
        lines += ["", f"{leak.name}: {leak.time[-1]:.0f} s closed; noise {leak.noise:.0f} Pa; RMS distance (Pa):"]
        lines += ["law        first half, fitted   second half, predicted"]
        for law in LAWS:
            halves = [leak.missed(law, in_the_second_half=part) for part in (False, True)]
            lines.append(f"{law:<10} {halves[0]:<20.0f} {halves[1]:.0f}")
        lines.append(f"  {leak.name}: {leak.verdict}")
    return "\n".join(lines)


def friction_figure(seals: list[Seal]) -> Figure:
    """Return friction over pressure, a panel for each seal: measured, the line, and what was predicted."""
    with house_style():
        figure = Figure(figsize=(2.5 * len(seals), 2.9), layout="constrained")
        axes: list[Axes] = list(figure.subplots(1, len(seals), sharey=True, squeeze=False)[0])
        for panel, seal, colour in zip(axes, seals, COLOURS, strict=False):
            bars = [one.bar for one in seal.readings]
            ends = np.array([0.0, max(bars)])
            panel.plot(ends, seal.line[0] + seal.line[1] * 1e5 * ends, color=GREY, linewidth=1.0, label="line of all")
            panel.errorbar(
                bars,
                [one.line for one in seal.left_out],
                [one.band for one in seal.left_out],
                fmt="none",
                ecolor=BLACK,
                capsize=3,
                label="predicted from the others",
            )
            panel.plot(bars, [one[0] for one in seal.friction], "o", color=colour, label="measured")
            panel.set_title(seal.name)
            panel.set_xlabel("Pressure (bar)")
            panel.set_xlim(0.0, None)
        axes[0].set_ylim(0.0, 1.25 * max(one.measured for seal in seals for one in seal.left_out))
        axes[0].set_ylabel("Friction (N)")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        return figure


def leak_figure(leaks: list[Leak]) -> Figure:
    """Return the pressure of closed chambers over time, and what each law predicts for the second half."""
    with house_style():
        figure = Figure(figsize=(4.2 * len(leaks), 3.0), layout="constrained")
        axes: list[Axes] = list(figure.subplots(1, len(leaks), squeeze=False)[0])
        for panel, leak in zip(axes, leaks, strict=True):
            panel.plot(leak.time, (leak.pressure - ATMOSPHERE) / 1e5, color=GREY, linewidth=0.8, label="measured")
            for law, colour, line in zip(LAWS, COLOURS, ("-", "--", ":"), strict=False):
                gauge = (leak.courses[law] - ATMOSPHERE) / 1e5
                panel.plot(leak.time, gauge, color=colour, linewidth=1.6, linestyle=line, label=law)
            panel.axvline(float(leak.time[leak.half]), color=BLACK, linewidth=0.8, linestyle=":")
            panel.set_title(f"{leak.name} (dotted: end of the fit)")
            panel.set_xlabel("Time (s)")
        axes[0].set_ylabel("Pressure (bar gauge)")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        return figure


def main() -> int:
    """Print the tables and write the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "folder", nargs="?", type=Path, default=EXAMPLE, help="folder of recordings; default: the example"
    )
    parser.add_argument("--out", type=Path, default=Path("out/measured"), help="folder for table and figures")
    parsed = parser.parse_args()
    try:
        seals = seals_in(parsed.folder)
        leaks = [leak_in(file) for file in sorted(parsed.folder.glob("chamber-*.csv"))]
        if not (seals or leaks):
            raise PpafoError(f"{parsed.folder}: has no recording SEAL_Nbar.csv or chamber-NAME.csv")
    except PpafoError as error:
        print(f"error: {error}")
        return 2
    text = table_of(seals, leaks)
    print(text)
    parsed.out.mkdir(parents=True, exist_ok=True)
    (parsed.out / "measured.txt").write_text(text + "\n", encoding="utf-8")
    if seals:
        friction_figure(seals).savefig(parsed.out / "friction.png", dpi=150)
    if leaks:
        leak_figure(leaks).savefig(parsed.out / "leak.png", dpi=150)
    print(f"written: {parsed.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
