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


def test_a_metric_that_all_runs_share_is_named_and_not_drawn_unless_it_is_the_only_one() -> None:
    def swept(name: str, *metrics: str) -> tuple[list[tuple[str, float, float]], str]:
        vary = [
            {"path": path, "kind": "uniform", "minimum": f"{low} {unit}", "maximum": f"{high} {unit}"}
            for path, low, high, unit in (
                ("supply.pressure", 45, 55, "psi_g"),
                ("valve.area", 8, 12, "mm^2"),
                ("actuator.leak.area", 0.1, 0.2, "mm^2"),
            )
        ]
        configurations = [{"name": "task", "scenario": "torque-task-proportional", "overrides": ["run.duration=0.2 s"]}]
        parts = {"configurations": configurations, "vary": vary, "outputs": {"metrics": list(metrics)}}
        finding = ppafo.sweep({"schema_version": 1, "name": name, "sample": {"method": "random", "runs": 8}, **parts})
        axes = finding.plot(width="84 mm").axes
        return [(each.get_xlabel(), *each.get_xlim()) for each in axes], finding.figures["figure"].caption

    # The vane is locked, so that its angle has no range.
    drawn, caption = swept("three", "angle_range", "gas_imbalance", "peak_torque")
    assert [name for name, _, _ in drawn] == ["Peak torque (N m)"]
    assert caption.endswith("Not drawn, because without a difference in the runs: angle_range, gas_imbalance.")
    ((name, low, high),), caption = swept("one", "angle_range")
    assert name == "Angle range (deg)"
    assert -5.0 < low < 0.0 < high < 5.0
    assert "Not drawn" not in caption
