"""Results of a study: statistics of what is too large for the memory, tables and columns, bands, the figure."""

from typing import Any

import numpy as np
import pytest

from ppafo.analyses.study_results import StudyResults, describe, sorted_quantiles
from ppafo.analyses.sweep import sweep
from ppafo.errors import PpafoError, UnitError

SHARES = (0.0, 0.05, 0.25, 0.5, 0.777, 0.95, 1.0)
RANDOM = np.random.default_rng(6)
COLUMNS = {
    "normal": RANDOM.normal(1e5, 3.0, 5001),
    "both signs": RANDOM.normal(0.0, 1e-9, 4000),
    "counts": RANDOM.integers(-2, 3, 3000).astype(np.float64),
    "wide": np.sign(RANDOM.normal(size=999)) * 10.0 ** RANDOM.uniform(-100, 100, 999),
    "constant": np.full(77, -0.1),
    "one": np.array([4.0]),
}


@pytest.mark.parametrize("name", COLUMNS)
def test_statistics_are_those_of_numpy(name: str) -> None:
    values = COLUMNS[name]
    said = describe(values, SHARES)
    assert said["count"] == values.size
    assert said["mean"] == pytest.approx(values.mean(), rel=1e-12)
    assert said["minimum"] == values.min()
    assert said["maximum"] == values.max()
    if name not in ("one", "wide"):
        assert said["sd"] == pytest.approx(values.std(ddof=1), rel=1e-9, abs=1e-15)
    for share in SHARES:
        assert said["quantiles"][f"{share:g}"] == pytest.approx(np.quantile(values, share), rel=1e-9)


def test_rows_are_a_data_frame_in_si_or_in_units(small_results: StudyResults) -> None:
    frame, rows = small_results.to_dataframe(), small_results.table()
    assert list(frame) == list(rows)
    assert {str(frame[name].dtype) for name in ("oscillates", "follows")} == {"boolean"}
    assert frame.attrs["units"]["supply.pressure"] == "Pa_a"
    gauge = small_results.to_dataframe({"supply.pressure": "bar_g", "rms_error": "mN m"})
    np.testing.assert_allclose(gauge["supply.pressure"], (rows["supply.pressure"] - 101325.0) / 1e5)
    np.testing.assert_allclose(gauge["rms_error"], 1e3 * rows["rms_error"])
    assert gauge.attrs["units"]["supply.pressure"] == "bar_g"
    with pytest.raises(UnitError, match="column 'rms_error' in 'psi_g': unit 'psi_g' does not fit"):
        small_results.to_dataframe({"rms_error": "psi_g"})
    with pytest.raises(PpafoError, match="rms_eror"):
        small_results.to_dataframe({"rms_eror": "N m"})


BAND_SHARES = (0.0, 0.05, 0.25, 0.5, 0.9, 1.0)


def test_quantiles_over_time_are_those_of_numpy_wherever_runs_failed() -> None:
    random = np.random.default_rng(2)
    values = np.stack([random.normal(3.0, 1.0, 500), random.exponential(2.0, 500), np.full(500, 1.0), np.ones(500)], 1)
    values[::50, 0] = np.nan
    values[:499, 1] = np.nan
    values[:, 3] = np.nan
    counts = np.count_nonzero(np.isfinite(values), axis=0)
    found = sorted_quantiles(np.sort(values, axis=0), counts, BAND_SHARES)
    np.testing.assert_allclose(found[:, :3], np.nanquantile(values[:, :3], BAND_SHARES, axis=0), rtol=1e-14)
    assert np.isnan(found[:, 3]).all()


AXIS = {"path": "reference.level", "kind": "grid", "first": "2 N m", "last": "5 N m", "count": 3}
OTHER = {"path": "valve.area", "kind": "grid", "first": "4 mm^2", "last": "16 mm^2", "count": 3}
DRAWN = {"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "55 psi_g"}


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


def test_a_map_shows_the_mean_over_the_draws_where_it_belongs() -> None:
    results = sweep(study(AXIS, OTHER, DRAWN, metrics=["gas_supplied"]))
    figure = results.plot()
    mesh = figure.axes[0].collections[0]
    table = results.found.table()
    for row, area in enumerate((4e-6, 10e-6, 16e-6)):
        for column, level in enumerate((2.0, 3.5, 5.0)):
            own = (abs(table["valve.area"] - area) < 1e-12) & (abs(table["reference.level"] - level) < 1e-9)
            assert own.sum() == 12
            mean = 1e3 * table["gas_supplied"][own].mean()
            assert mesh.get_array()[row, column] == pytest.approx(mean, rel=1e-9)
