"""The figure of a gait shows every curve, its band, the events, and what is synthetic."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from ppafo.gait import load_gait, walk_recording
from ppafo.gait.figure import gait_figure
from ppafo.gait.recorded import ImportedGait, ImportSettings, import_gait
from ppafo.storage import write_csv


@pytest.fixture
def imported(tmp_path: Path) -> ImportedGait:
    path = write_csv(tmp_path / "walk.csv", walk_recording(load_gait(), 5))
    return import_gait([path], ImportSettings(62.0))


def test_every_curve_has_a_panel_with_its_events() -> None:
    gait = load_gait()
    figure = gait_figure(gait)
    assert len(figure.axes) == len(gait.curves) == 6
    top = figure.axes[0]
    assert {text.get_text() for text in top.texts} == {"heel strike", "toe-off"}
    assert np.degrees(gait.shank_angle.values_at([0.25]))[0] == pytest.approx(top.lines[-1].get_ydata()[25])
    assert [text.get_text() for text in figure.texts] == ["falisse2019-subject1: 62 kg, 1.33 m/s, stride 1.04 s"]


def test_single_strides_and_their_mean_are_drawn_after_an_import(imported: ImportedGait) -> None:
    figure = gait_figure(imported.gait, imported)
    assert len(figure.axes[1].lines) == 2 + len(imported.strides) + 2
    assert "synthetic" in {text.get_text() for text in figure.texts}


def test_a_gait_of_angles_only_has_two_panels() -> None:
    missing = dict.fromkeys(("ankle_moment", "vertical_force", "knee_forward", "knee_up", "walking_speed"))
    gait = dataclasses.replace(load_gait(), **missing)
    assert len(gait_figure(gait).axes) == 2
