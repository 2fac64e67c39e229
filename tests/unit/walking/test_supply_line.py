"""Regulators and lines of a walk file: values with their origin, overrides, mistakes, and what is recorded."""

from dataclasses import replace

import numpy as np
import pytest

from ppafo.errors import ParameterError, ScenarioError
from ppafo.model.regulator import SupplyLines
from ppafo.simulation.declaration import line_entries
from ppafo.simulation.numbers import number_at, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking import load_walk, walk
from ppafo.walking.walk import without_device

REGULATED = ("solenoid-regulators", "proportional-regulators")

MISTAKES = {
    "supply_line.plantarflexion.droop=0 Pa s/kg": "must be at least 1 Pa s/kg",
    "supply_line.plantarflexion.droop=3 psi": "does not fit: a unit like 'Pa s/kg' is needed",
    "supply_line.dorsiflexion.volume=0.1 cm^3": r"must be at least 1 cm\^3",
    "supply_line.dorsiflexion.drop=3 Pa s/kg": "did you mean 'supply_line.dorsiflexion.droop'",
    "supply.dorsiflexion_pressure=60 psi_g": "the first regulator feeds the second, so "
    "supply.dorsiflexion_pressure = 60 psi_g must not exceed supply.pressure = 50 psi_g",
}


@pytest.mark.parametrize("name", ["solenoid", "proportional"])
def test_a_walk_without_the_section_has_constant_pressures(name: str) -> None:
    assert load_walk(name).supply_lines is None


@pytest.mark.parametrize("name", REGULATED)
def test_what_is_not_given_has_value_origin_and_source(name: str) -> None:
    configuration = load_walk(name)
    assert configuration.supply_lines == SupplyLines(3.0e6, 0.01, 1.0e-5, 6.7e7, 1.5e-3, 2.0e-6, 0.0)
    assert len(line_entries()) == 6
    for path, entry in line_entries().items():
        assert entry.origin in assumed_by(configuration)[f"supply_line.{path}"]
        assert entry.source in assumed_by(configuration)[f"supply_line.{path}"]


def assumed_by(configuration: Scenario) -> dict[str, str]:
    return {item.path: item.note for item in configuration.assumptions}


def test_one_value_is_enough_for_the_lines_and_is_not_called_assumed() -> None:
    configuration = load_walk("solenoid", ["supply_line.dorsiflexion.droop=2e7 Pa s/kg"])
    assert configuration.supply_lines == SupplyLines(3.0e6, 0.01, 1.0e-5, 2.0e7, 1.5e-3, 2.0e-6, 0.0)
    assert "supply_line.dorsiflexion.droop" not in assumed_by(configuration)
    assert "supply_line.dorsiflexion.volume" in assumed_by(configuration)


@pytest.mark.parametrize("override", MISTAKES)
def test_a_mistake_is_named_in_one_line(override: str) -> None:
    with pytest.raises((ScenarioError, ParameterError), match=MISTAKES[override]) as caught:
        load_walk("solenoid-regulators", [override])
    assert "\n" not in str(caught.value)


def test_the_recording_has_line_pressures_only_where_there_are_lines() -> None:
    with_lines, without = walk("solenoid-regulators", minutes=0.1).recording, walk("solenoid", minutes=0.1).recording
    assert {"line_pressure_1", "line_pressure_2", "regulated_mass"} == set(with_lines.names) - set(without.names)
    assert with_lines["line_pressure_1"][0] == pytest.approx(446.06e3, rel=1e-4)
    assert np.ptp(with_lines["line_pressure_1"]) > 1.0e3
    assert (np.diff(with_lines["regulated_mass"]) >= 0.0).all()


def test_a_walk_without_the_device_needs_no_lines() -> None:
    assert without_device(load_walk("solenoid-regulators")).supply_lines is None


def test_a_tenfold_droop_costs_work_and_a_smaller_step_changes_little() -> None:
    base = load_walk("solenoid-regulators")
    droop = "supply_line.plantarflexion.droop"
    drooping = with_numbers(base, {droop: 10.0 * number_at(base, droop)})
    found = {
        name: walk(configuration, minutes=0.1).metrics["net_push_off_work"].value
        for name, configuration in {
            "base": base,
            "fine": replace(base, run=replace(base.run, step=1.0e-4)),
            "drooping": drooping,
        }.items()
    }
    assert found["drooping"] < 0.95 * found["base"]
    assert found["fine"] == pytest.approx(found["base"], rel=0.01)
