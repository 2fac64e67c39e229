"""A whole course over time: speed, ankle, forces, torque, toes and gas, with its segments and the safe state."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLACK, GREY, Margins, figure_of_panels, house_style, mark_kind
from ppafo.gait.gait import clinical_angle
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH = 9.4
_MARGINS = Margins(left=0.75, right=0.2, top=0.95, bottom=0.5, row_gap=0.32, label=0.55)
_PANEL = 1.05
_TITLES = (
    "Walking speed (m/s)",
    "Ankle angle (deg, 0 neutral, dorsiflexion positive)",
    "Force under heel and toes (N)",
    "Actuator torque (N m, plantarflexion positive); strip: controller",
    "Toe height above ground (cm)",
    "Gas taken (g)",
)
_SHADED = "#f3f3f3"
_PHASES = {1.0: "#f6d5bd", 2.0: "#e4e4e4", 3.0: "#8fbfe0", 0.0: "#f0b48a"}
_PHASE_NAMES = {1.0: "landing", 2.0: "mid-stance", 3.0: "push-off", 0.0: "swing"}
_SAFE = "#cc3311"
_NARROWEST = 0.045
"""Fraction of the course below which the name of a segment stands upright."""


def course_figure(worn: WalkResult, bare: WalkResult) -> "Figure":
    """Return a course over time with the device (and without it); needs a recording of at least two samples."""
    height = len(_TITLES) * _PANEL + (len(_TITLES) - 1) * _MARGINS.row_gap + _MARGINS.top + _MARGINS.bottom
    with house_style():
        figure, grid = figure_of_panels((_WIDTH, height), _MARGINS, len(_TITLES))
        panels = [row[0] for row in grid]
        for axes, title in zip(panels, _TITLES, strict=True):
            axes.set_title(title)
            axes.locator_params(axis="y", nbins=4)
            _background(axes, worn)
        _speed(panels[0], worn)
        _both(panels[1], worn, bare)
        _forces(panels[2], worn)
        panels[3].plot(worn.recording.time, worn.recording["torque"], color=WITH, linewidth=0.8)
        _toes(panels[4], worn, bare)
        panels[5].plot(worn.recording.time, 1.0e3 * worn.recording["supplied_mass"], color=WITH)
        _phases(panels[3], worn)
        panels[-1].set_xlabel("Time (s)")
        panels[-1].set_xlim(0.0, float(worn.recording.time[-1]))
        _segment_names(panels[0], worn)
        _head(figure, worn, height)
        mark_kind(figure, worn.recording.kind)
        return figure


def _background(axes: "Axes", worn: WalkResult) -> None:
    """Every other segment on grey, and a line where the controller helps less."""
    for segment in worn.segments[1::2]:
        axes.axvspan(segment.start, segment.end, color=_SHADED, zorder=0, linewidth=0.0)
    for segment in worn.segments:
        if segment.safe_time is not None:
            axes.axvline(segment.safe_time, color=_SAFE, linewidth=1.2)


def _speed(axes: "Axes", worn: WalkResult) -> None:
    recording = worn.recording
    has_speed = "walking_speed" in recording
    values = recording["walking_speed" if has_speed else "stride_frequency"]
    axes.plot(recording.time, values, color=BLACK)
    # Room above the curve for the names of the segments.
    axes.set_ylim(-0.05 * float(values.max()), 1.9 * float(values.max()) + 0.01)
    if not has_speed:
        axes.set_title("Strides per second (Hz)")


def _both(axes: "Axes", worn: WalkResult, bare: WalkResult) -> None:
    for result, colour in ((bare, WITHOUT), (worn, WITH)):
        angle = np.degrees(clinical_angle(result.recording["angle"]))
        axes.plot(result.recording.time, angle, color=colour, linewidth=0.8)


def _forces(axes: "Axes", worn: WalkResult) -> None:
    axes.plot(worn.recording.time, worn.recording["heel_force"], color=BLACK, linewidth=0.8, label="heel")
    axes.plot(worn.recording.time, worn.recording["toe_force"], color=GREY, linewidth=0.8, label="toes")
    _legend(axes, 2)


def _toes(axes: "Axes", worn: WalkResult, bare: WalkResult) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    for result, colour in ((bare, WITHOUT), (worn, WITH)):
        axes.plot(result.recording.time, 100.0 * result.recording["toe_height"], color=colour, linewidth=0.8)


def _phases(axes: "Axes", worn: WalkResult) -> None:
    """The phase that the controller sees, as a strip under the curve."""
    if "controller_phase" not in worn.recording:
        return
    time, seen = worn.recording.time, worn.recording["controller_phase"]
    low, high = axes.get_ylim()
    strip = low - 0.18 * (high - low)
    for phase, colour in _PHASES.items():
        name = _PHASE_NAMES[phase]
        axes.fill_between(time, strip, low, where=seen == phase, color=colour, linewidth=0.0, step="post", label=name)
    axes.set_ylim(strip, high)
    _legend(axes, 4)


def _legend(axes: "Axes", columns: int) -> None:
    """Beside the title of a panel, where no curve is."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1,
        ncols=columns,
        fontsize=8,
        handlelength=1.2,
        columnspacing=1.0,
    )


def _segment_names(axes: "Axes", worn: WalkResult) -> None:
    whole = float(worn.recording.time[-1])
    for segment in worn.segments:
        narrow = segment.end - segment.start < _NARROWEST * whole
        axes.text(
            0.5 * (segment.start + segment.end),
            0.96,
            segment.kind,
            transform=axes.get_xaxis_transform(),
            rotation=90.0 if narrow else 0.0,
            ha="center",
            va="top",
            fontsize=8,
            color=GREY,
        )


def _head(figure: "Figure", worn: WalkResult, height: float) -> None:
    course = walk_of(worn.scenario).course
    title = f"{worn.scenario.name}, course {'' if course is None else course.name}"
    figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
    remark = "blue: with the device; orange: without it; red line: the controller helps less"
    figure.text(0.12 / _WIDTH, 1.0 - 0.34 / height, remark, ha="left", va="top", fontsize=8.5, color=GREY)
