"""Figures at the width of a column: readable, with nothing cut, in every form that the package draws."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

import ppafo
from ppafo.analyses.compare.question import compare
from ppafo.analyses.walk.question import walk_with_and_without
from ppafo.errors import ArgumentError
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import drawn_at
from ppafo.walking.figures.mean_stride import OPACITY, WITH, WITHOUT

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


def test_a_legend_of_several_rows_stands_close_below_its_title_and_makes_the_axes_no_narrower() -> None:
    def axes_of(*labels: str) -> Axes:
        marks = [Mark("line", [0.0, 1.0], [0.0, 1.0], label=label) for label in labels]
        figure = draw_panels([Panel(Kind("Time"), Kind("Torque"), marks, "Torque over time")])
        figure.draw_without_rendering()
        return figure.axes[0]

    with drawn_at("84 mm"):
        narrow, wide = axes_of("a", "b"), axes_of("reference", "maximum: 5.0 N m", "synthetic experiment", "simulated")
    legend = wide.get_legend()
    assert legend is not None
    assert wide.get_window_extent().width == pytest.approx(narrow.get_window_extent().width, rel=0.02)
    title = next(text for text in texts_of(wide.get_figure()) if text.get_text() == "Torque over time")
    gap = title.get_window_extent().y0 - legend.get_window_extent().y1
    # Less than the height of a row, 11 pt at full width, in points of 1/72 inch.
    assert 0.0 <= 72.0 * gap / wide.get_figure().dpi < 11.0


def test_a_logarithmic_axis_of_less_than_two_decades_has_more_labels_than_its_powers_of_ten() -> None:
    panel = Panel(Kind("Frequency"), Kind("Gain"), [Mark("line", [1.0, 2.0], [1.5, 14.0])])
    figure = draw_panels([replace(panel, then=lambda axes: axes.set_yscale("log"))])
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert {"2", "5", "10"} <= set(labels)


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


def test_the_panel_of_a_difference_stays_below_its_curve_in_a_column() -> None:
    curves = [replace(panel, title=name) for panel, name in zip(panels(2), "AB", strict=True)]
    differences = [replace(panel, title=f"{panel.title} less model", tall=0.5) for panel in curves]
    with drawn_at("84 mm"):
        narrow = draw_panels([*curves, *differences], across=2, size=(2.7, 1.0))
    assert [axes.get_title(loc="left") for axes in narrow.axes] == ["A", "A less model", "B", "B less model"]
    wide = draw_panels([*curves, *differences], across=2, size=(2.7, 1.0))
    assert [axes.get_title(loc="left") for axes in wide.axes] == ["A", "B", "A less model", "B less model"]


def test_lines_without_the_device_are_paler_than_those_with_it_in_grey() -> None:
    with_it, without = (
        1.0 - OPACITY[colour] * (1.0 - float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114))))
        for colour in (WITH, WITHOUT)
    )
    assert without - with_it > 0.3


@pytest.mark.filterwarnings("error")
def test_a_figure_whose_size_is_changed_keeps_its_panels() -> None:
    figure = draw_panels(panels(4), size=(5.4, 1.5), title="A run")
    figure.set_size_inches(3.3, 2.5)
    figure.draw_without_rendering()
    assert all(axes.get_position().width > 0.5 for axes in figure.axes)


@pytest.mark.parametrize("width", ["84", "84 kg", "5 mm", True, "2 m"])
def test_a_width_that_no_page_has_is_refused_with_the_argument_named(width: str | float) -> None:
    with pytest.raises(ArgumentError, match="width"), drawn_at(width):
        pass


def test_ticks_keep_their_labels_after_the_layout_so_that_no_label_of_an_axis_leaves_the_figure() -> None:
    x, y = np.linspace(4.0, 8.0, 9), np.linspace(5.0, 15.0, 9)
    marks = (Mark("map", x, y, np.add.outer(y, x)),)
    with drawn_at("84 mm"):
        figure = draw_panels([Panel(Kind("Pressure"), Kind("Valve area"), marks, scale=Kind(name)) for name in "abc"])
    figure.draw_without_rendering()
    assert min(axes.yaxis.label.get_window_extent().x0 for axes in figure.axes[:3]) > 0.0


def test_the_title_of_a_narrow_figure_breaks_between_its_clauses() -> None:
    figure = ppafo.simulate("torque-task-proportional", overrides=SHORT).plot("84 mm")
    assert figure.get_suptitle() == "torque-task-proportional,\nankle at 75 deg"
