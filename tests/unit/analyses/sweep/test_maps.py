"""Maps of a study over two values: only what differs is drawn, and whether a run follows."""

import ppafo

GRID = {
    "schema_version": 1,
    "name": "grid",
    "description": "Two values of a loop, some of which follow their reference.",
    "configurations": [{"name": "angle", "scenario": "torque-task-anti-windup", "overrides": ["run.duration=5 s"]}],
    "vary": [
        {"path": "supply.pressure", "kind": "grid", "first": "30 psi_g", "last": "90 psi_g", "count": 3},
        {"path": "valve.area", "kind": "grid", "first": "4 mm^2", "last": "12 mm^2", "count": 2},
    ],
    "outputs": {"metrics": ["gas_imbalance", "rms_error", "angle_range"]},
}


def test_a_map_is_drawn_of_what_differs_and_of_whether_the_run_follows() -> None:
    finding = ppafo.sweep(GRID)
    bars = [axes for axes in finding.plot().axes if axes.get_label() == "<colorbar>"]
    assert set(finding.found.table(["follows"])["follows"]) == {0.0, 1.0}
    assert [axes.get_ylabel() for axes in bars] == ["RMS error (N m)", "Follows its reference"]
    assert [text.get_text() for text in bars[1].get_yticklabels()] == ["no", "yes"]
    # The labels of ticks keep their width when the figure is saved, so that no label of an axis leaves it.
    narrow = finding.plot(width="84 mm")
    narrow.draw_without_rendering()
    assert min(axes.yaxis.label.get_window_extent().x0 for axes in narrow.axes if axes.get_ylabel()) > 0.0
