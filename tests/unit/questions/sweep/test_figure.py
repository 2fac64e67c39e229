"""Figures of studies: a panel for what was asked, maps for grids, and the same bytes for the same results."""

from typing import Any

import pytest

from ppafo.answers.style import render_figure
from ppafo.questions.sweep.figure import study_figure
from ppafo.questions.sweep.solve import sweep

AXIS = {"path": "reference.level", "kind": "grid", "first": "2 N m", "last": "5 N m", "count": 3}
OTHER = {"path": "valve.area", "kind": "grid", "first": "4 mm^2", "last": "16 mm^2", "count": 3}
DRAWN = {"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "55 psi_g"}
LEAK = {"path": "actuator.leak.area", "kind": "uniform", "minimum": "0.2 mm^2", "maximum": "0.4 mm^2"}
NOBODY = {"path": "actuator.angle_min", "kind": "list", "values": ["140 deg", "141 deg"]}


def study(*vary: dict[str, Any], names: tuple[str, ...] = ("proportional",), **outputs: Any) -> dict[str, Any]:
    """A short study."""
    found: dict[str, Any] = {
        "schema_version": 1,
        "name": "drawn",
        "configurations": [
            {"name": name, "scenario": f"torque-task-{name}", "overrides": ["run.duration=0.2 s"]} for name in names
        ],
        "vary": list(vary),
        "outputs": {"metrics": ["rms_error", "switchings"], "every": "20 ms", **outputs},
    }
    if DRAWN in vary:
        found["sample"] = {"method": "random", "runs": 12}
    return found


BOTH = ("proportional", "solenoid")


@pytest.mark.parametrize(
    ("document", "panels"),
    [
        (study(DRAWN), ["supply pressure (psi gauge)"] * 2),
        (study(DRAWN, LEAK, names=BOTH, bands=["torque"]), ["RMS error (N m)", "Switchings", "time (s)"]),
        (study(AXIS), ["reference level (N m)"] * 2),
        (study(AXIS, OTHER), ["reference level (N m)"] * 2),
        (study(AXIS, OTHER | {"spacing": "logarithmic"}, DRAWN, names=BOTH), ["reference level (N m)"] * 4),
        (study(DRAWN, metrics=[], bands=["command"]), ["time (s)"]),
        (study(DRAWN, metrics=[], trajectories=["command"]), []),
        (study(NOBODY), ["actuator angle min (deg)"] * 2),
        (study(names=BOTH), ["RMS error (N m)", "Switchings"]),
    ],
)
def test_there_is_a_panel_for_everything_that_was_asked(document: dict[str, Any], panels: list[str]) -> None:
    figure = study_figure(sweep(document))
    shown = [axes for axes in figure.axes if axes.axison and axes.get_label() != "<colorbar>"]
    assert [axes.get_xlabel() for axes in shown] == panels
    assert render_figure(figure, ["png"])["png"].startswith(b"\x89PNG")
    assert any("simulated" in text.get_text() for text in figure.texts)


def test_a_map_shows_the_mean_over_the_draws_where_it_belongs() -> None:
    results = sweep(study(AXIS, OTHER, DRAWN, metrics=["gas_supplied"]))
    figure = results.plot()
    mesh = figure.axes[0].collections[0]
    table = results.table()
    for row, area in enumerate((4e-6, 10e-6, 16e-6)):
        for column, level in enumerate((2.0, 3.5, 5.0)):
            own = (abs(table["valve.area"] - area) < 1e-12) & (abs(table["reference.level"] - level) < 1e-9)
            assert own.sum() == 12
            mean = 1e3 * table["gas_supplied"][own].mean()
            assert mesh.get_array()[row, column] == pytest.approx(mean, rel=1e-9)


def test_the_same_results_give_the_same_figure() -> None:
    results = sweep(study(DRAWN, LEAK, names=BOTH))
    one, other = (render_figure(results.plot(), ["svg", "png"]) for _ in range(2))
    assert one == other
