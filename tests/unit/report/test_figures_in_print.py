"""Figures as they are printed: at the width of a column, in grey, with numbers that stand for themselves."""

from dataclasses import replace

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.figure import Figure

from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import COLOURS, DASHES

TIMES = np.linspace(0.0, 1.0, 5)


def grey(colour: str) -> float:
    return float(np.dot(matplotlib.colors.to_rgb(colour), (0.299, 0.587, 0.114)))


def lines_of(colours: list[str], **style: object) -> Panel:
    marks = [
        Mark("line", TIMES, TIMES + number, label=f"line {number}", colour=colour, style=style)
        for number, colour in enumerate(colours)
    ]
    return Panel(Kind("Time"), Kind("Level"), marks)


def test_lines_of_two_colours_that_are_one_grey_differ_by_their_dashes() -> None:
    looks = [(grey(colour), DASHES.get(colour, "-")) for colour in COLOURS]
    for number, (one, dashes) in enumerate(looks):
        assert all(abs(one - other) > 0.2 or dashes != others for other, others in looks[number + 1 :])
    drawn = draw_panels([lines_of(list(COLOURS))]).axes[0].lines
    assert len({line.get_linestyle() if line.get_linestyle() == "-" else str(line._dash_pattern) for line in drawn}) > 4  # type: ignore[attr-defined]


def test_no_axis_has_an_offset_or_a_power_of_ten() -> None:
    near = Mark("line", TIMES, 100.6 + 1e-4 * TIMES)
    powers = Mark("line", TIMES, 10.0 ** (4.0 * TIMES))
    logarithmic = Panel(Kind(), Kind(), [powers], then=lambda axes: axes.set_yscale("log"))
    figure = draw_panels([Panel(Kind(), Kind(), [near]), logarithmic])
    figure.canvas.draw()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            assert axis.get_offset_text().get_text() == ""
            assert not any("$" in label.get_text() for label in axis.get_ticklabels())


def overlaps(figure: Figure) -> list[tuple[str, str]]:
    """Titles, legends and labels of axes that cover each other, or leave the figure."""
    figure.canvas.draw()
    boxes = []
    for axes in figure.axes:
        named = {
            axes.get_title("left"): axes.title,
            axes.get_ylabel(): axes.yaxis.label,
            axes.get_xlabel(): axes.xaxis.label,
        }
        named[axes.get_title("left")] = axes._left_title  # type: ignore[attr-defined]
        boxes += [(words, text.get_window_extent()) for words, text in named.items() if words]
        legend = axes.get_legend()
        if legend is not None:
            boxes.append(("legend", legend.get_window_extent()))
    whole = figure.bbox
    outside = [(words, "edge") for words, box in boxes if box.x0 < whole.x0 - 1 or box.x1 > whole.x1 + 1]
    pairs = [(one, other) for n, (one, a) in enumerate(boxes) for other, b in boxes[n + 1 :] if a.overlaps(b)]
    return outside + pairs


@pytest.mark.parametrize(
    "words", ["Pressure in chamber 1 (bar gauge)", "A", "Torque of the actuator, measured and modelled"]
)
@pytest.mark.parametrize("names", [["a"], ["supplied", "vented", "leaked between the chambers"], ["a long name"] * 6])
@pytest.mark.parametrize("across", [1, 2])
def test_titles_legends_and_labels_cover_nothing(words: str, names: list[str], across: int) -> None:
    marks = [
        Mark("line", TIMES, TIMES + number, label=f"{name} {number}", colour=COLOURS[number % len(COLOURS)])
        for number, name in enumerate(names)
    ]
    panel = Panel(Kind("Time", "s"), Kind(words), marks, shares_x=True)
    size = (5.4 if across == 1 else 3.0, 1.8)
    assert overlaps(draw_panels([panel, replace(panel, legend="")] * 2, across, size, title="A run")) == []
