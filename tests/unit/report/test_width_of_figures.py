"""Figures at the width of a column: readable, with nothing cut, in every form that the package draws."""

from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import ppafo
from ppafo.analyses.compare import compare
from ppafo.analyses.walk.question import walk_with_and_without
from ppafo.errors import ArgumentError
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import drawn_at

INCHES = 84.0 / 25.4
"""Width of a column [inches]."""
SHORT = ["run.duration=0.2 s"]


def walked(name: str) -> Figure:
    return walk_with_and_without("solenoid", minutes=0.1, overrides=["supply.pressure=3 bar_g"]).plot(name, "84 mm")


CATALOGUE: dict[str, Callable[[], Figure]] = {
    "run": lambda: ppafo.simulate("torque-task-proportional", overrides=SHORT).plot("84 mm"),
    "cylinder": lambda: ppafo.simulate("cylinder-servo", overrides=SHORT).plot("84 mm"),
    "comparison": lambda: compare(["torque-task-proportional", "torque-task-solenoid"]).plot(width="84 mm"),
    "steps": lambda: ppafo.linearise("torque-task-proportional", overrides={"reference.level": 3.0}).plot(
        "steps", "84 mm"
    ),
    "frequencies": lambda: ppafo.linearise("torque-task-proportional", overrides={"reference.level": 3.0}).plot(
        "frequency-response", "84 mm"
    ),
    "bottle": lambda: ppafo.bottle(gas_per_stride="0.3 g").plot(width="84 mm"),
    "legs": lambda: walked("legs"),
    "mean stride": lambda: walked("mean-stride"),
}


def texts_of(figure: Figure) -> list[Text]:
    figure.draw_without_rendering()
    return [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_visible() and text.get_text()]


def tick_labels_that_touch(figure: Figure) -> list[tuple[str, str]]:
    pairs = []
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis) if axes.axison else ():
            low, high = sorted(axis.get_view_interval())
            labels = [
                label
                for place, label in zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)
                if low <= place <= high and label.get_text() and label.get_visible()
            ]
            boxes = [label.get_window_extent() for label in labels]
            pairs += [
                (one.get_text(), other.get_text())
                for one, other, a, b in zip(labels, labels[1:], boxes, boxes[1:], strict=False)
                if a.overlaps(b)
            ]
    return pairs


@pytest.mark.long
@pytest.mark.parametrize("name", CATALOGUE)
def test_a_figure_at_the_width_of_a_column_can_be_read_and_is_whole(name: str) -> None:
    assert_readable(CATALOGUE[name]())


def assert_readable(figure: Figure) -> None:
    assert figure.get_figwidth() == pytest.approx(INCHES)
    ticks = {
        id(label)
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for label in (*axis.get_majorticklabels(), *axis.get_minorticklabels())
    }
    texts = [text for text in texts_of(figure) if id(text) not in ticks]
    assert min(text.get_fontsize() for text in figure.findobj(Text)) >= 7.0
    whole = figure.bbox
    boxes = {text.get_text(): text.get_window_extent() for text in texts}
    assert [words for words, box in boxes.items() if box.x0 < whole.x0 - 1 or box.x1 > whole.x1 + 1] == []
    assert [words for words, box in boxes.items() if box.y0 < whole.y0 - 1 or box.y1 > whole.y1 + 1] == []
    assert tick_labels_that_touch(figure) == []


def panels(count: int) -> list[Panel]:
    line = Mark("line", np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 5), label="a name of some length")
    return [Panel(Kind("Time", "s"), Kind("Level of a thing"), [line], shares_x=True) for _ in range(count)]


def test_panels_beside_each_other_are_stacked_in_a_column() -> None:
    with drawn_at("84 mm"):
        narrow = draw_panels(panels(2), across=2, size=(2.7, 2.0))
    left, right = (axes.get_position() for axes in narrow.axes)
    assert left.y0 > right.y1
    assert draw_panels(panels(2), across=2, size=(2.7, 2.0)).get_figwidth() == pytest.approx(5.7)


@pytest.mark.parametrize("width", ["84", "84 kg", "5 mm", True, "2 m"])
def test_a_width_that_no_page_has_is_refused_with_the_argument_named(width: str | float) -> None:
    with pytest.raises(ArgumentError, match="width"), drawn_at(width):
        pass
