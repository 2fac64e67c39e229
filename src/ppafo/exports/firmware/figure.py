"""Runs with a simulated chip in charge over time, with those of the integer controller in the lanes on top of them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.style import BLACK, BLUE, VERMILION, WANTED, house_style, mark_kind
from ppafo.exports.firmware.lock_step import ChipRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARGINS = Margins(left=0.68, right=0.15, top=0.42, bottom=0.52, row_gap=0.36)
"""Inches."""
_WIDTH, _TORQUE, _COMMAND = 7.6, 2.6, 0.9
_COLOURS = (VERMILION, BLUE)
_LANES = (0, (1, 3))


def chip_figure(runs: Sequence[ChipRun]) -> "Figure":
    """Return the figure of some runs, two panels for each: torque with its reference, and the command to the valve.

    With ``torque-task-solenoid`` and ``torque-task-proportional`` it is figure 8 of the paper.
    """
    heights = [_TORQUE, _COMMAND] * len(runs)
    gaps = _MARGINS.row_gap * (len(heights) - 1)
    size = (_WIDTH, _MARGINS.top + _MARGINS.bottom + gaps + sum(heights))
    with house_style():
        figure, rows = figure_of_panels(size, _MARGINS, rows=len(heights), heights=heights)
        grid = [axes for (axes,) in rows]
        for place, run in enumerate(runs):
            _draw(grid[2 * place], grid[2 * place + 1], run, _COLOURS[place % len(_COLOURS)])
        grid[-1].set_xlabel("Time (s)")
        grid[-1].set_xlim(0.0, max(run.chip.recording.duration for run in runs))
        mark_kind(figure, runs[0].chip.recording.kind)
        return figure


def _draw(torque: "Axes", command: "Axes", run: ChipRun, colour: str) -> None:
    """Draw a run, and that in the lanes as dots on its lines."""
    chip, lanes, target = run.chip.recording, run.lanes.recording, run.cost.target.name
    bits = "same bits as in the lanes" if run.same_bits else "NOT the bits of the lanes"
    torque.set_title(f"{run.scenario.name}: {run.differences} of {run.samples} decisions differ, {bits}")
    torque.plot(chip.time, chip["reference"], "--", color=WANTED, linewidth=1.3, label="reference")
    for axes, name in ((torque, "torque"), (command, "command")):
        step = "steps-post" if name == "command" else "default"
        axes.plot(chip.time, chip[name], color=colour, drawstyle=step, label=f"{target} in its simulator")
        axes.plot(
            lanes.time, lanes[name], color=BLACK, linewidth=0.9, linestyle=_LANES, drawstyle=step, label="the lanes"
        )
    torque.set_ylabel("Torque (N m)")
    torque.legend(loc="lower right")
    command.set_ylabel("Valve")
    command.set_ylim(-1.1, 1.1)
