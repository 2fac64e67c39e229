"""Figure of a task sequence over time, with and without the device: pace, angle, forces, torque, toes and gas."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.gait.gait import clinical_angle
from ppafo.model.helping import LANDING, MID_STANCE, PUSH_OFF, SWING
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import BLACK, GREY, font_size, print_scale, printed_width
from ppafo.signals.recording import Floats, Recording
from ppafo.walking.figures.axes import GAS, GROUND, THIN, TOES
from ppafo.walking.figures.mean_stride import ANGLE, OPACITY, WITH, WITHOUT
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PHASES = {
    LANDING: ("landing", "#f3c9a6"),
    MID_STANCE: ("mid-stance", "#ececec"),
    PUSH_OFF: ("push-off", "#8fbfe0"),
    SWING: ("swing", "#cf8146"),
}
"""Name and colour of each phase in the strip below the torque; the colours also differ in greyscale."""
_SHADED = "#f3f3f3"
_WIDTH, _LETTER = 5.7, 0.0145
"""Width of the figure [inches], and of a letter as a fraction of it; a name that does not fit is written vertically."""
_ROOM = 2.2
"""Height of the pace panel relative to its curve, to make room for the names of the segments."""
_STRIP, _STRIP_GAP = 0.18, 0.05
"""Height of the phase strip and its distance below the torque, as fractions of the range of the torque."""
_LEAST_RANGE = 1.0e-3
"""Smallest range of the torque [N m] for the height of the strip, used if the torque is always 0."""


def task_sequence_figure(worn: WalkResult, bare: WalkResult) -> "Figure":
    """Return a task sequence over time, with the device and optionally without it; needs at least two samples."""
    recording, time = worn.recording, worn.recording.time
    walks = {WITHOUT: bare.recording, WITH: worn.recording}
    names = {WITHOUT: "without the device", WITH: "with it"}
    # Pale and not dashed: in many strides dashes cannot be told apart, and in grey the colours neither.
    looks = {colour: {**THIN, "alpha": opacity, "linestyle": "-"} for colour, opacity in OPACITY.items()}
    angles = [
        Mark("line", walk.time, clinical_angle(walk["angle"]), label=names[colour], colour=colour, style=looks[colour])
        for colour, walk in walks.items()
    ]
    toes = [
        Mark("line", walk.time, walk["toe_height"], colour=colour, style=looks[colour])
        for colour, walk in walks.items()
    ]
    forces = [
        Mark("line", time, recording["heel_force"], label="heel", colour=BLACK, style=THIN),
        Mark("line", time, recording["toe_force"], label="toes", colour=GREY, style=THIN),
    ]
    torque = [Mark("line", time, recording["torque"], colour=WITH, style=THIN), *_phase_strip(recording)]
    marks_by_kind = {
        ANGLE: angles,
        Kind("Force under heel and toes", "N", "force"): forces,
        Kind("Actuator torque; strip: phase of the controller", "N m", "torque"): torque,
        TOES: [GROUND, *toes],
        GAS: [Mark("line", time, recording["supplied_mass"], colour=WITH)],
    }
    behind: dict[str, Any] = {"alpha": 1.0, "zorder": 0}
    shaded = [Mark("span", (part.start, part.end), colour=_SHADED, style=behind) for part in worn.segments[1::2]]
    segments = shaded
    set_limits = partial(_set_limits, float(time[-1]))
    # The walking speed, or strides per second where there is none, under the names of the segments.
    has_speed = "walking_speed" in recording
    pace_kind = Kind("Walking speed", "m/s", "velocity") if has_speed else Kind("Strides per second", "Hz", "frequency")
    pace = recording["walking_speed" if has_speed else "stride_frequency"]
    curve, name_segments = Mark("line", time, pace, colour=BLACK), partial(_name_segments, worn, pace)
    panels = [Panel(TIME, pace_kind, [*segments, curve], then=name_segments, shares_x=True)]
    panels += [
        Panel(TIME, kind, [*segments, *marks], then=set_limits, shares_x=True) for kind, marks in marks_by_kind.items()
    ]
    sequence = walk_of(worn.scenario).task_sequence
    return draw_panels(
        panels,
        size=(5.4, 1.45),
        title=f"{worn.scenario.name}, task sequence {'' if sequence is None else sequence.name}",
        kind=recording.kind,
    )


def _name_segments(worn: WalkResult, pace: Floats, axes: "Axes") -> None:
    """Write the names of the segments above the pace curve, and extend the axis to make room for them."""
    from matplotlib.patheffects import withStroke

    end = float(worn.recording.time[-1])
    letter = _LETTER * print_scale() * _WIDTH / printed_width(_WIDTH)
    for segment in worn.segments:
        is_narrow = segment.end - segment.start < letter * len(segment.kind) * end
        name = axes.text(
            0.5 * (segment.start + segment.end),
            0.96,
            segment.kind,
            transform=axes.get_xaxis_transform(),
            rotation=90.0 if is_narrow else 0.0,
            ha="center",
            va="top",
            fontsize=font_size(8.0),
            color=BLACK,
        )
        # Readable where a line goes through it.
        name.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    axes.set_ylim(-0.05 * float(pace.max()), _ROOM * float(pace.max()) + 0.01)
    _set_limits(end, axes)


def _set_limits(end: float, axes: "Axes") -> None:
    axes.set_xlim(0.0, end)
    axes.locator_params(axis="y", nbins=4)


def _phase_strip(recording: Recording) -> list[Mark]:
    """Return the phase in which the device acts as a coloured strip below the torque curve."""
    if "controller_phase" not in recording:
        return []
    acting, torque = recording["controller_phase"], recording["torque"]
    height = max(float(np.ptp(torque)), _LEAST_RANGE)
    top = np.full(acting.size, float(torque.min()) - _STRIP_GAP * height)
    return [
        Mark(
            "band",
            recording.time,
            (top - _STRIP * height, top),
            label=name,
            colour=colour,
            style={"alpha": 1.0, "where": acting == phase, "step": "post"},
        )
        for phase, (name, colour) in _PHASES.items()
    ]
