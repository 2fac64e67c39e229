"""The torque task: what the paper claims of it in numbers, and what its text tells of both valves."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, WANTED, Margins, figure_of_panels, house_style, mark_kind
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.reproduce.bench import AssumedValue
from ppafo.questions.reproduce.claim import Claim, Observation, Verdict, observation, stated_claim
from ppafo.signals import Recording
from ppafo.simulation.simulate import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MEASURED = "The paper measured its number."
_PERCENT = 100.0
FEWEST_REVERSALS = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0


def torque_task_claims(solenoid: Result, proportional: Result, assumed: Sequence[AssumedValue]) -> list[Claim]:
    """Return the claims on tracking error and gas, from the metrics of both runs; gas is what the supply gave.

    Each has the window that the task as completed here has to meet.
    """
    error_solenoid, error_proportional = (run.metrics["rms_error"].value for run in (solenoid, proportional))
    gas_solenoid, gas_proportional = (
        GRAMS_PER_KILOGRAM * run.metrics["gas_supplied"].value for run in (solenoid, proportional)
    )
    rests_on = tuple(value.sentence() for value in assumed)

    def less_in_percent(new: float, old: float) -> float | None:
        # Where there is nothing to save from, nothing can be said.
        return _PERCENT * (1.0 - new / old) if old > 0.0 else None

    def claim(identifier: str, value: float | None, note: str) -> Claim:
        entry = paper_entries()[identifier]
        assert entry.at_least is not None, f"{identifier} has a window"
        assert entry.at_most is not None, f"{identifier} has a window"
        window = entry.at_least, entry.at_most
        verdict: Verdict = "not_testable"
        if value is not None:
            verdict = "reproduced_with_assumptions" if window[0] <= value <= window[1] else "contradicted"
        note = f"{note} Accepted from {window[0]:g} to {window[1]:g} {entry.unit}."
        return stated_claim(identifier, value, verdict, note, rests_on, window=window)

    supplied = f"Simulated: gas taken from the supply over the whole task. {_MEASURED}"
    return [
        claim(
            "torque_rms_improvement",
            less_in_percent(error_proportional, error_solenoid),
            f"Simulated: {error_proportional:.3f} against {error_solenoid:.3f} N m over the whole task.",
        ),
        claim("co2_solenoid", gas_solenoid, supplied),
        claim("co2_proportional", gas_proportional, supplied),
        claim(
            "co2_saving",
            less_in_percent(gas_proportional, gas_solenoid),
            f"Simulated: {gas_proportional:.3g} instead of {gas_solenoid:.3g} g. {_MEASURED}",
        ),
    ]


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return what the text tells of the torque task, each with our numbers."""

    def count(result: Result, part: str) -> int | None:
        metric = result.metrics.get(f"oscillations_{part}")
        return None if metric is None else round(metric.value)

    def reversals(number: int | None, part: str) -> str:
        if number is None:
            return f"this reference has no {part}"
        return f"{number} torque reversal{'' if number == 1 else 's'} on the {part}"

    ramp, hold = count(solenoid, "ramp"), count(solenoid, "hold")
    own_ramp, own_hold = count(proportional, "ramp"), count(proportional, "hold")
    tracks_better, errors = False, "this reference has no ramp and hold"
    parts = [(run.metrics.get("rms_error_ramp"), run.metrics.get("rms_error_hold")) for run in (solenoid, proportional)]
    (on_ramp, on_hold), (own_on_ramp, own_on_hold) = parts
    if on_ramp and on_hold and own_on_ramp and own_on_hold:
        gains = on_ramp.value - own_on_ramp.value, on_hold.value - own_on_hold.value
        tracks_better = gains[0] > 0.0 and gains[0] > gains[1]
        errors = (
            f"RMS error on the ramp {own_on_ramp.value:.2f} against {on_ramp.value:.2f} N m, "
            f"on the hold {own_on_hold.value:.2f} against {on_hold.value:.2f} N m"
        )
    return [
        observation(
            "solenoid_oscillates_on_ramp",
            ramp is not None and ramp >= FEWEST_REVERSALS,
            f"{reversals(ramp, 'ramp')} that swing over 5 % of the largest reference",
        ),
        observation("solenoid_quiet_on_hold", hold == 0, reversals(hold, "hold")),
        observation(
            "proportional_does_not_oscillate",
            own_ramp == 0 and own_hold == 0,
            f"{reversals(own_ramp, 'ramp')}, {reversals(own_hold, 'hold')}",
        ),
        observation("proportional_tracks_better_on_ramp", tracks_better, errors),
    ]


_SIZE = (7.6, 8.5)
_MARGINS = Margins(left=0.68, right=0.15, top=0.42, bottom=0.52, row_gap=0.36)
"""Inches."""
_HEIGHTS = (3.0, 0.9, 3.0, 0.9, 2.0)
_MAXIMUM_POINTS = 1000
_SOLENOID, _PROPORTIONAL = VERMILION, BLUE


def torque_task_figure(
    solenoid: Recording,
    proportional: Recording,
    ceiling: float,
    gas_in_paper: tuple[float, float],
    synthetic: tuple[Recording, Recording] | None = None,
) -> "Figure":
    """Return figure 8: torque and reference with each valve, what the valve does below, and the gas at the bottom.

    ``ceiling`` is the torque that the supply can hold [N m], ``gas_in_paper`` what the paper states for the solenoid
    valves and for the proportional valve [g]. ``synthetic`` is the same task on the virtual rig with the one and with
    the other, shown as a thin line.
    """
    with house_style():
        figure, rows = figure_of_panels(_SIZE, _MARGINS, rows=len(_HEIGHTS), heights=_HEIGHTS)
        grid = [axes for (axes,) in rows]
        _torque(grid[0], solenoid, "Solenoid valves, on or off", _SOLENOID, ceiling)
        _states(grid[1], solenoid)
        _torque(grid[2], proportional, "Proportional valve", _PROPORTIONAL, ceiling)
        _opening(grid[3], proportional)
        _gas(grid[4], solenoid, proportional, gas_in_paper)
        if synthetic is not None:
            for axes, recording in zip((grid[0], grid[2]), synthetic, strict=True):
                thin = slice(None, None, max(1, len(recording) // _MAXIMUM_POINTS))
                times, torque = recording.time[thin], recording["torque"][thin]
                axes.plot(times, torque, color=BLACK, linewidth=0.6, zorder=3, label="torque, synthetic experiment")
                axes.legend(loc="lower right")
        grid[4].set_xlabel("Time (s)")
        grid[4].set_xlim(float(solenoid.time[0]), float(solenoid.time[-1]))
        limits = [axes.get_ylim() for axes in (grid[0], grid[2])]
        for axes in (grid[0], grid[2]):
            axes.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        mark_kind(figure, solenoid.kind)
        return figure


def _torque(axes: "Axes", recording: Recording, title: str, colour: str, ceiling: float) -> None:
    axes.axhline(ceiling, color=GREY, linewidth=0.9, linestyle=(0, (1, 2)), zorder=0.9)
    axes.plot(recording.time, recording["reference"], "--", color=WANTED, linewidth=1.3, label="reference")
    axes.plot(recording.time, recording["torque"], color=colour, label="torque, simulated")
    axes.set_title(title)
    axes.set_ylabel("Torque (N m)")
    axes.annotate(
        f"maximum that the supply can hold: {ceiling:.1f} N m",
        (1.0, ceiling),
        xycoords=("axes fraction", "data"),
        xytext=(-2, -4),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=8.5,
        color=GREY,
    )
    axes.legend(loc="lower right")


def _states(axes: "Axes", recording: Recording) -> None:
    """Show which of the two valves is on, as bars."""
    for row, valve, colour in ((1, 1.0, _SOLENOID), (0, -1.0, GREY)):
        axes.broken_barh(_spans(recording, valve), (row + 0.12, 0.76), color=colour, linewidth=0.0)
    axes.set_ylim(0.0, 2.0)
    axes.set_yticks((0.5, 1.5), ("B on", "A on"))
    axes.tick_params(axis="y", length=0.0, labelsize=8.5)
    axes.grid(visible=False)
    axes.set_ylabel("Valve")


def _spans(recording: Recording, command: float) -> list[tuple[float, float]]:
    """Return beginning and length [s] of every time with a command of this sign."""
    is_on = np.concatenate(([False], np.sign(recording["command"][:-1]) == command, [False]))
    edges = recording.time[np.flatnonzero(np.diff(is_on))]
    return [(float(start), float(end - start)) for start, end in zip(edges[::2], edges[1::2], strict=True)]


def _opening(axes: "Axes", recording: Recording) -> None:
    axes.plot(recording.time, recording["command"], color=_PROPORTIONAL)
    axes.set_ylim(-0.08, 1.08) if recording["command"].min() >= 0.0 else axes.set_ylim(-1.1, 1.1)
    axes.set_ylabel("Opening")


def _gas(axes: "Axes", solenoid: Recording, proportional: Recording, gas_in_paper: tuple[float, float]) -> None:
    for recording, name, colour, stated in (
        (solenoid, "solenoid valves", _SOLENOID, gas_in_paper[0]),
        (proportional, "proportional valve", _PROPORTIONAL, gas_in_paper[1]),
    ):
        supplied = GRAMS_PER_KILOGRAM * recording["supplied_mass"]
        axes.plot(recording.time, supplied, color=colour)
        axes.axhline(stated, color=colour, linewidth=0.9, linestyle=(0, (1, 2)), zorder=0.9)
        axes.annotate(
            f"{name}: {supplied[-1]:.2f} g simulated, {stated:g} g in the paper",
            (1.0, max(float(supplied[-1]), stated)),
            xycoords=("axes fraction", "data"),
            xytext=(-2, 4),
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=8.5,
            color=colour,
        )
    axes.set_title("Gas taken from the supply")
    axes.set_ylabel("CO$_2$ (g)")
    axes.set_ylim(0.0, 1.3 * max(gas_in_paper[0], GRAMS_PER_KILOGRAM * float(solenoid["supplied_mass"][-1])))
