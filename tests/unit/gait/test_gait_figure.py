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


def test_the_ankle_angle_is_drawn_from_neutral_with_dorsiflexion_positive(imported: ImportedGait) -> None:
    gait = load_gait()
    flexion = 90.0 - np.degrees(gait.ankle_angle.values_at([0.45, 0.67]))
    assert flexion[0] > 10.0, "the shank leans forward over the foot before push-off"
    assert flexion[1] < -10.0, "the toes point down after push-off"
    np.testing.assert_allclose(gait_figure(gait).axes[1].lines[-1].get_ydata()[[45, 67]], flexion)
    drawn = gait_figure(imported.gait, imported).axes[1].lines
    np.testing.assert_allclose(drawn[2].get_ydata(), 90.0 - np.degrees(imported.curves["ankle_angle"].curves[0]))


def test_single_strides_and_their_mean_are_drawn_after_an_import(imported: ImportedGait) -> None:
    figure = gait_figure(imported.gait, imported)
    assert len(figure.axes[1].lines) == 2 + len(imported.strides) + 2
    assert "synthetic" in {text.get_text() for text in figure.texts}


def test_a_gait_of_angles_only_has_two_panels() -> None:
    missing = dict.fromkeys(("ankle_moment", "vertical_force", "knee_forward", "knee_up", "walking_speed"))
    gait = dataclasses.replace(load_gait(), **missing)
    assert len(gait_figure(gait).axes) == 2
