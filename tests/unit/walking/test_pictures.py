"""Pictures of a walk: what they show is what was walked."""

from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from ppafo.analyses.walk.answer import comparison_table
from ppafo.analyses.walk.wearers import wearers_finding
from ppafo.report.finding import Section, text_of
from ppafo.walking import WalkComparison, compare_walks, load_walk, walk, walk_population
from ppafo.walking.figures import task_sequence
from ppafo.walking.figures.legs import frames_figure, legs_of, phases_of_last_stride
from ppafo.walking.figures.mean_stride import walk_figure
from ppafo.walking.figures.population import population_figure

CONFIGURATIONS = ("solenoid", "proportional")


@lru_cache(maxsize=4)
def compared(name: str) -> WalkComparison:
    return compare_walks(load_walk(name), minutes=0.15)


def texts(figure: "Figure") -> list[str]:
    found = [text.get_text() for text in figure.texts]
    for axes in figure.axes:
        found += [text.get_text() for part in (axes, *axes.child_axes) for text in part.texts]
    return found


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_drop_foot_is_seen_without_the_device_and_lifted_with_it(name: str) -> None:
    pair = compared(name)
    turns = phases_of_last_stride(pair.with_device, 100)
    late = np.flatnonzero(turns % 1.0 > 0.7)
    bare, worn = legs_of(pair.without_device, turns), legs_of(pair.with_device, turns)
    lowest = [legs.worn.toe[late, 1].min() for legs in (bare, worn)]
    assert lowest[0] < -0.06, "the toes drag"
    assert lowest[1] > lowest[0] + 0.05, "and are lifted"
    assert legs_of(pair.with_device, turns).healthy.toe[late, 1].min() > -0.002
    assert sum(worn.drags) < sum(bare.drags)


def test_toes_of_the_figures_drag_where_the_verdict_says_so() -> None:
    # The pair drags by millimetres, the proportional valve by nothing; the healthy stance is no drag.
    for name in ("solenoid", "proportional"):
        for result in (compared(name).with_device, compared(name).without_device):
            legs = legs_of(result, phases_of_last_stride(result, 200))
            assert any(legs.drags) == (result.metrics["lowest_toes"].value < 0.0), name
            assert not any(np.array(legs.drags)[legs.turns % 1.0 < 0.6])


def test_the_strip_of_frames_marks_toes_that_drag() -> None:
    figure = frames_figure(compared("solenoid"))
    marks = [[line.get_marker() for line in axes.lines].count("x") for axes in figure.axes]
    assert marks[0] >= 1
    assert marks[0] >= marks[1]
    assert {"without the device", "with the device", "simulated", "90 %"} <= set(texts(figure))


def test_the_mean_stride_shows_both_walks_and_the_healthy_gait() -> None:
    pair = compared("solenoid")
    figure = walk_figure({"with the device": pair.with_device, "without": pair.without_device})
    angle, torque, _, pressures, toes = figure.axes
    counted = [f"{walked.metrics['counted_strides'].value:.0f}" for walked in (pair.with_device, pair.without_device)]
    named = f"with the device, mean of {counted[0]}"
    assert [line.get_label() for line in angle.lines if not str(line.get_label()).startswith("_")] == [
        "toe-off",
        named,
        f"without, mean of {counted[1]}",
        "healthy gait",
    ]
    # Printed in grey the two walks differ by their dashes.
    dashes = {str(line.get_label()): line.get_linestyle() for line in angle.lines}
    assert dashes[named] != dashes[f"without, mean of {counted[1]}"]
    flexion = next(line for line in angle.lines if line.get_label() == named).get_ydata()
    np.testing.assert_allclose(flexion, 90.0 - np.degrees(pair.with_device.averages["angle"].mean))
    curve = next(line for line in torque.lines if line.get_label() == named).get_ydata()
    np.testing.assert_array_equal(curve, pair.with_device.averages["external_torque"].mean)
    assert len([line for line in pressures.lines if len(np.asarray(line.get_xdata())) > 2]) == 2
    assert len([line for line in toes.lines if len(np.asarray(line.get_xdata())) > 2]) == 3
    assert "simulated" in texts(figure)
    assert len(walk_figure({"off": pair.without_device}).axes[0].lines) < len(angle.lines)


def test_the_table_has_a_cell_for_each_walk() -> None:
    rows = {title: cells for title, *cells in Section(columns=comparison_table(compared("solenoid"))).rows}
    assert rows["Gas per stride (g)"][1:] == ["0.000", "-"]
    assert rows["Strides that begin on the toes (%)"] == ["0", "0", "0"]
    assert float(rows["... of the healthy ankle's positive work (%)"][0]) == pytest.approx(7.3, abs=0.1)
    assert {len(cells) for cells in rows.values()} == {3}


def test_histograms_hold_every_wearer() -> None:
    people = walk_population(load_walk("proportional"), minutes=0.1, wearers=60, seed=2)
    figure = population_figure(people)
    filled = next(patch for patch in figure.axes[0].patches if patch.get_fill())
    assert filled.get_data().values.sum() == 60  # type: ignore[attr-defined]
    dashes = [line.get_linestyle() for line in figure.axes[0].lines[:3]]
    assert dashes == ["--", "-", "--"], "percentiles and median differ in grey too"
    lines = text_of(wearers_finding(people)).splitlines()
    assert lines[0] == "proportional: 60 wearers, 0.1 min each"
    gas = [float(cell) for cell in next(line for line in lines if line.startswith("Gas")).split()[4:]]
    assert gas == sorted(gas)
    assert len(gas) == 5


def test_the_name_of_a_segment_stands_upright_where_it_would_run_into_the_next() -> None:
    segments = [SimpleNamespace(kind="walk", start=0.0, end=94.0), SimpleNamespace(kind="stand", start=94.0, end=100.0)]
    worn: Any = SimpleNamespace(recording=SimpleNamespace(time=np.array([0.0, 100.0])), segments=segments)
    axes = Figure().subplots()
    task_sequence._name_segments(worn, np.array([0.0, 1.0]), axes)
    assert [text.get_rotation() for text in axes.texts] == [0.0, 90.0]


def test_the_mean_stride_says_how_many_strides_it_is_the_mean_of() -> None:
    result = walk("solenoid", minutes=0.1)
    counted = int(result.counted.sum())
    assert 0 < counted < result.counted.size
    assert result.metrics["counted_strides"].value == counted
    figure = walk_figure({"with the device": result})
    assert " ".join(texts(figure)[0].split()).endswith(f", {result.counted.size} strides")
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend[:2] == ["toe-off", f"with the device, mean of {counted}"]
    assert "band: standard deviation" in legend
