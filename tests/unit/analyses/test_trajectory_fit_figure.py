import numpy as np
import pytest
from matplotlib.figure import Figure

from ppafo.analyses.identify import trajectory_panels
from ppafo.report.panels import draw_panels
from ppafo.signals.recording import Channel, Recording, RecordingKind

TIME = np.linspace(0.0, 1.0, 101)


def recording(kind: RecordingKind, shift: float) -> Recording:
    channels = {
        "angle": Channel(np.radians(90.0 + 10.0 * TIME + shift), "rad"),
        "pressure_1": Channel(101325.0 + 1.0e5 * TIME, "Pa"),
    }
    return Recording("bench", TIME, channels, kind)


def fit_figure(samples: Recording, model: Recording) -> Figure:
    return draw_panels(trajectory_panels(samples, model), kind=samples.kind)


def test_every_fitted_channel_has_a_panel_and_one_for_what_is_left() -> None:
    figure = fit_figure(recording("measured", 0.0), recording("simulated", 0.5))
    names = [axes.get_title(loc="left") for axes in figure.axes]
    assert names == [
        "Vane angle (deg)",
        "Residual (measured - model) (deg)",
        "Pressure in chamber 1 (psig)",
        "Residual (measured - model) (psi)",
    ]
    left = figure.axes[1].lines[0].get_ydata()
    assert np.asarray(left) == pytest.approx(np.full(101, -0.5))
