"""Figures and tables of a result."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from ppafo.metrics import Metric
from ppafo.report.kind import metrics_lines
from ppafo.report.recording_figure import draw_stored_result, recording_figure
from ppafo.report.style import house_style, render_figure
from ppafo.signals import CHANNELS, Channel, Recording, RecordingKind
from ppafo.storage import StoredResult
from ppafo.units.shown import counted_from, shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TIME = np.linspace(0.0, 1.0, 11)


def recording(kind: RecordingKind = "measured", **channels: float) -> Recording:
    made = {name: Channel(np.full(11, level), CHANNELS[name].unit) for name, level in channels.items()}
    return Recording("task", TIME, made, kind)


def titles(figure: "Figure") -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes]


def texts(figure: "Figure") -> list[str]:
    return [text.get_text() for text in figure.texts]


def drawn(figure: "Figure", panel: int) -> list[list[float]]:
    return [list(map(float, line.get_ydata())) for line in figure.axes[panel].lines]


def test_there_is_a_panel_for_each_quantity_that_was_recorded_and_no_other() -> None:
    assert titles(recording_figure(recording(torque=1.0, angle=1.0))) == ["Ankle angle (deg)", "Actuator torque (N m)"]
    whole = recording_figure(recording(**dict.fromkeys(CHANNELS, 1.0)))
    assert titles(whole)[-1] == "Gas since the start (g)"
    assert len(whole.axes) == 6


def test_angles_are_drawn_in_degrees_and_gas_in_grams() -> None:
    figure = recording_figure(recording(angle=np.pi / 2.0, supplied_mass=4e-4))
    assert drawn(figure, 0)[0][0] == pytest.approx(90.0)
    assert drawn(figure, 1)[0][0] == pytest.approx(0.4)


def test_pressure_is_drawn_above_the_atmosphere_of_the_device() -> None:
    given = recording(pressure_1=90e3 + 50.0 * 6894.757293168361)
    with shown_in(counted_from({}, 90e3)):
        assert drawn(recording_figure(given), 0)[0][0] == pytest.approx(50.0)


def test_a_signal_that_hardly_changes_is_not_blown_up() -> None:
    lowest, highest = recording_figure(recording(angle=1.3)).axes[0].get_ylim()
    assert highest - lowest >= 10.0


def test_the_command_axis_reaches_both_ends_unless_the_command_would_be_flat() -> None:
    lowest, highest = recording_figure(recording(command=0.3)).axes[0].get_ylim()
    assert lowest < -1.0
    assert highest > 1.0
    lowest, highest = recording_figure(recording(command=0.07)).axes[0].get_ylim()
    assert -0.3 < lowest < 0.0
    assert 0.07 < highest < 0.3


@pytest.mark.parametrize("kind", ["simulated", "synthetic"])
def test_what_nobody_measured_says_so_in_the_corner(kind: RecordingKind) -> None:
    assert kind in texts(recording_figure(recording(kind, angle=1.0)))


def test_every_format_is_written_and_the_same_recording_gives_the_same_bytes() -> None:
    files = [render_figure(recording_figure(recording(angle=1.0)), ("png", "svg", "pdf")) for _ in range(2)]
    assert files[0] == files[1]
    assert files[0]["png"].startswith(b"\x89PNG")
    assert b"<svg" in files[0]["svg"]
    assert files[0]["pdf"].startswith(b"%PDF")
    assert b"/Type3" not in files[0]["pdf"]
    assert not re.search(rb"<dc:date>", files[0]["svg"])


def test_the_style_of_the_surrounding_program_is_neither_used_nor_changed() -> None:
    import matplotlib

    matplotlib.rcParams["font.size"] = 31.0
    try:
        figure = recording_figure(recording(angle=1.0))
        assert matplotlib.rcParams["font.size"] == 31.0
        with house_style():
            assert matplotlib.rcParams["font.size"] == 10.0
    finally:
        matplotlib.rcParams["font.size"] = 10.0
    assert figure.axes[0].title.get_fontsize() != 31.0


def test_a_table_shows_metrics_in_the_units_of_the_field() -> None:
    metrics = {
        "gas_supplied": Metric(4.2e-4, "kg", "gas taken"),
        "angle_range": Metric(np.pi, "rad", "range"),
        "largest_pressure": Metric(446063.0, "Pa", "pressure"),
        "switchings": Metric(10.0, "-", "switchings"),
    }
    rows = [line.split() for line in metrics_lines(metrics)]
    assert rows[0] == ["gas_supplied", "0.42", "g", "gas", "taken"]
    assert rows[1][:3] == ["angle_range", "180", "deg"]
    assert rows[2][:3] == ["largest_pressure", "50", "psi_g"]
    assert rows[3] == ["switchings", "10", "switchings"]
    with shown_in(counted_from({}, 446063.0 - 55.0 * 6894.757293168361)):
        high = [line.split() for line in metrics_lines(metrics)]
    assert high[2][:3] == ["largest_pressure", "55", "psi_g"]


def stored(**document: object) -> StoredResult:
    return StoredResult(Path("run-7"), recording(pressure_1=90e3 + 50.0 * 6894.757293168361), document)


def test_a_saved_result_is_drawn_with_its_name_its_status_and_its_atmosphere() -> None:
    scenario = {"name": "$\\foo$", "device": {"supply": {"atmospheric_pressure": 90e3}}}
    figure = draw_stored_result(stored(status={"kind": "diverged", "message": "at $1$ s"}, scenario=scenario))
    assert drawn(figure, 0)[0][0] == pytest.approx(50.0)
    render_figure(figure, ["png"])
    assert texts(figure)[:2] == ["$\\foo$", "at $1$ s"]
