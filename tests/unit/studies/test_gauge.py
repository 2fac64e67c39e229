"""Gauge pressures of studies count from the atmosphere of their run: columns, limits and thresholds."""

import re
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.errors import StudyError
from ppafo.simulation.ensemble.planning import check_columns
from ppafo.studies.draws import uncertainty_of
from ppafo.studies.loading import load_study
from ppafo.studies.study import Study
from ppafo.studies.varying import left_out
from ppafo.study.blocks import drawn_values, varied_columns
from ppafo.units import to_si

ROOMS = {"path": "supply.atmospheric_pressure", "kind": "list", "values": ["90 kPa_a", "101.325 kPa_a"]}


def study(*vary: dict[str, Any], **further: Any) -> Study:
    return load_study(
        {
            "schema_version": 1,
            "name": "rooms",
            "configurations": [{"name": "one", "scenario": "step-response"}],
            "vary": list(vary),
            "outputs": {"metrics": ["gas_supplied"]},
            **further,
        }
    )


def columns_of(made: Study) -> dict[str, Any]:
    base, values = made.configurations[0], drawn_values(made, np.arange(made.runs))
    return dict(check_columns(base.scenario, varied_columns(made, base, values), made.gauge).values)


def test_gauge_values_are_above_the_atmosphere_of_their_run_and_absolute_ones_are_not() -> None:
    gauge = columns_of(study(ROOMS, {"path": "supply.pressure", "kind": "list", "values": ["50 psi_g"]}))
    psi = to_si(50.0, "psi_d", "Pa_d")
    assert gauge["supply.pressure"].tolist() == gauge["supply.dorsiflexion_pressure"].tolist()
    assert gauge["supply.pressure"].tolist() == [psi + 9.0e4, psi + 101325.0]
    absolute = columns_of(study(ROOMS, {"path": "supply.pressure", "kind": "list", "values": ["450 kPa_a"]}))
    assert absolute["supply.pressure"].tolist() == [4.5e5, 4.5e5]


def test_a_gauge_pressure_of_the_scenario_follows_a_varied_atmosphere() -> None:
    found = columns_of(study(ROOMS))
    above = found["supply.pressure"] - found["supply.atmospheric_pressure"]
    assert above == pytest.approx([to_si(55.0, "psi_d", "Pa_d")] * 2, rel=1e-12)
    assert found["initial.pressure_1"].tolist() == [9.0e4, 101325.0]


def test_gauge_and_absolute_values_of_one_path_do_not_go_together() -> None:
    mixed = {"path": "supply.pressure", "kind": "list", "values": ["50 psi_g", "450 kPa_a"]}
    with pytest.raises(StudyError, match=r"'psi_g' and 'kPa_a' cannot be mixed"):
        study(ROOMS, mixed)
    assert study(mixed).gauge == frozenset()


@pytest.mark.parametrize(
    "kind",
    [
        {"kind": "uniform", "minimum": "40 psi_g", "maximum": "60 psi_g"},
        {"kind": "log_uniform", "minimum": "40 psi_g", "maximum": "60 psi_g"},
        {"kind": "log_normal", "median": "50 psi_g", "factor": 1.05},
    ],
)
def test_every_distribution_of_a_gauge_pressure_moves_with_the_atmosphere(kind: dict[str, Any]) -> None:
    room = {"path": "supply.atmospheric_pressure", "kind": "uniform", "minimum": "60 kPa_a", "maximum": "110 kPa_a"}
    sample = {"method": "sobol", "runs": 256, "seed": 1}
    path = "supply.pressure"
    made = study(room, {"path": path, **kind}, sample=sample)
    found = columns_of(made)
    gauge = found[path] - found["supply.atmospheric_pressure"]
    usual = columns_of(study({"path": path, **kind}, sample=sample))[path] - 101325.0
    assert np.median(gauge) == pytest.approx(np.median(usual), rel=0.01)
    assert abs(np.corrcoef(gauge, found["supply.atmospheric_pressure"])[0, 1]) < 0.1
    assert uncertainty_of(made).gauge == {path}


def test_a_pressure_that_the_set_states_in_gauge_moves_with_the_atmosphere(tmp_path: Path) -> None:
    text = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    head, found, rest = text.partition("[supply.pressure]\n")
    (tmp_path / "stated.toml").write_text(f"{head}{found}uncertainty = 2.0\n{rest}", encoding="utf-8")
    scenario = (resources.files("ppafo") / "scenarios" / "step-response.toml").read_text(encoding="utf-8")
    changed = re.sub(r'set = "ppafo2011"', 'set = "stated.toml"', scenario)
    changed = re.sub(r"overrides = \[.*?\]\n", "", changed, flags=re.DOTALL)
    (tmp_path / "step.toml").write_text(changed, encoding="utf-8")
    made = study(
        ROOMS,
        {"path": "supply.pressure", "kind": "stated"},
        configurations=[{"name": "one", "scenario": str(tmp_path / "step.toml")}],
        sample={"method": "sobol", "runs": 64, "seed": 1},
    )
    columns = columns_of(made)
    above = columns["supply.pressure"] - columns["supply.atmospheric_pressure"]
    assert np.median(above) == pytest.approx(to_si(50.0, "psi_d", "Pa_d"), rel=0.01)
    assert np.ptp(above) < to_si(12.0, "psi_d", "Pa_d")


TASK, METRIC, ATMOSPHERE = "torque-task-proportional", "largest_pressure", "supply.atmospheric_pressure"
HIGH_UP = (f"{ATMOSPHERE}=80 kPa_a", "supply.pressure=400 kPa_a")
REFUSED = rf"50 kPa_g'.*: must not be a gauge pressure, because {ATMOSPHERE} varies"


def test_a_condition_of_find_counts_from_the_atmosphere_of_the_scenario() -> None:
    changes = {"vary": "supply.pressure=200..300 kPa_a", "overrides": HIGH_UP}
    found = ppafo.find(TASK, such_that=f"{METRIC} <= 50 kPa_g", grid=3, **changes).found
    assert found.limit == pytest.approx(130.0e3)
    with pytest.raises(StudyError, match=REFUSED):
        ppafo.find(TASK, vary=f"{ATMOSPHERE}=70..90 kPa_a", such_that=f"{METRIC} <= 50 kPa_g", overrides=HIGH_UP)


@pytest.mark.parametrize(("mean", "count"), [("70 psi_g", 1), ("55 psi_g", 0)])
@pytest.mark.parametrize("rooms", [(), (ROOMS,)])
def test_draws_that_leave_out_the_value_of_the_scenario_are_told(
    mean: str, count: int, rooms: tuple[dict[str, Any], ...]
) -> None:
    pressure = {"path": "supply.pressure", "kind": "normal", "mean": mean, "standard_deviation": "2 psi_d"}
    told = [*left_out(study(pressure, *rooms, sample={"method": "random", "runs": 8}))]
    assert len(told) == count
    assert all("which leaves out its value, 55 psi_g" in text for text in told)
