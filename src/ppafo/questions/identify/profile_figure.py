"""Profile likelihood: how much worse the best fit becomes when one number is held away from its estimate."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.identification.estimate import Estimate
from ppafo.identification.new_set import in_set_unit
from ppafo.identification.trajectory.follow_up import Profile
from ppafo.identification.trajectory.section import TrajectoryOutcome
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.signals import RecordingKind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 3
_WIDTH, _HEIGHT = 2.75, 2.35
_LEFT, _RIGHT, _TOP, _BOTTOM, _COLUMN_GAP, _ROW_GAP = 0.62, 0.25, 0.82, 0.55, 0.5, 0.85
"""Inches."""
_MAXIMUM_SHOWN = 1.9
"""Largest rise that a panel shows, in thresholds."""


def profile_figure(outcome: TrajectoryOutcome, before: ParameterSet, kind: RecordingKind) -> "Figure":
    """Return a panel for each profile, numbers in the units of the set that the fit started from."""
    from matplotlib.figure import Figure

    profiles = outcome.profiles
    columns = min(_COLUMNS, len(profiles))
    rows = -(-len(profiles) // columns)
    width = max(_LEFT + _RIGHT + columns * _WIDTH + (columns - 1) * _COLUMN_GAP, 6.2)
    height = _TOP + _BOTTOM + rows * _HEIGHT + (rows - 1) * _ROW_GAP
    with house_style():
        figure = Figure(figsize=(width, height))
        for index, one in enumerate(profiles):
            row, column = divmod(index, columns)
            left = _LEFT + column * (_WIDTH + _COLUMN_GAP)
            bottom = height - _TOP - _HEIGHT - row * (_HEIGHT + _ROW_GAP)
            axes = figure.add_axes((left / width, bottom / height, _WIDTH / width, _HEIGHT / height))
            _draw(axes, one, outcome.fit.estimate(one.path), before)
            if column == 0:
                axes.set_ylabel("Rise of the misfit (-)")
        confidence = outcome.fit.problem.search.confidence
        _label(figure, confidence)
        mark_kind(figure, kind)
        return figure


def _draw(axes: "Axes", one: Profile, estimate: Estimate, before: ParameterSet) -> None:
    numbers = np.array([in_set_unit(float(number), one.path, one.unit, before)[0] for number in one.numbers])
    value, unit = in_set_unit(estimate.value, one.path, one.unit, before)
    axes.plot(*_smooth(numbers, one.rises), color=BLUE, linewidth=1.4)
    axes.plot(numbers, one.rises, "o", color=BLUE, markersize=4)
    axes.axhline(one.threshold, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)))
    for side in (one.low, one.high):
        if side is not None:
            axes.axvline(in_set_unit(side, one.path, one.unit, before)[0], color=VERMILION, linewidth=1.0)
    axes.plot([value], [0.0], "|", color=BLACK, markersize=12)
    axes.set_ylim(0.0, _MAXIMUM_SHOWN * one.threshold)
    axes.set_title(one.path, fontsize=9.5)
    axes.set_xlabel(f"({unit})" if unit not in ("", "-") else "")
    axes.locator_params(axis="x", nbins=3)
    axes.ticklabel_format(axis="x", useOffset=False)


def _smooth(numbers: "np.ndarray", rises: "np.ndarray") -> "tuple[np.ndarray, np.ndarray]":
    """Return a curve through the points whose signed square root is piecewise straight: a parabola stays one."""
    roots = np.sqrt(rises) * np.where(np.arange(len(rises)) < int(np.argmin(rises)), -1.0, 1.0)
    fine = np.linspace(numbers[0], numbers[-1], 200)
    return fine, np.square(np.interp(fine, numbers, roots))


def _label(figure: "Figure", confidence: float) -> None:
    from matplotlib.lines import Line2D

    height, width = figure.get_figheight(), figure.get_figwidth()
    figure.text(0.12 / width, 1.0 - 0.12 / height, "Profile likelihood", ha="left", va="top", fontweight="bold")
    handles = [
        Line2D([], [], color=BLUE, marker="o", markersize=4, label="all other numbers refitted"),
        Line2D([], [], color=GREY, linestyle=(0, (4, 3)), linewidth=1.0, label=f"threshold of {100.0 * confidence:g}%"),
        Line2D([], [], color=VERMILION, linewidth=1.0, label="interval"),
    ]
    place = (0.02 / width, 1.0 - 0.3 / height)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=place, ncols=3, handlelength=1.6)
