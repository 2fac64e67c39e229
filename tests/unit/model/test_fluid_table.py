"""Property tables: monotonic, continuous at saturation, and CoolProp's numbers within stated tolerances."""

import json
from importlib import resources
from typing import Any

import numpy as np
import pytest

from ppafo.model.source import (
    between,
    densest_gas,
    fluid_pressure,
    gas_specific_energy,
    has_liquid,
    liquid_density,
    nodes_around,
)
from ppafo.parameters.bottles.bottle import list_fluids, load_fluid
from scripts import fluid_tables

FLUIDS = list_fluids()
CO2 = load_fluid("CO2").table
SATURATED = 1e4
"""kg/m^3, denser than any vapour: the gas is then the saturated one."""

WELL_BELOW_CRITICAL = 303.0
"""K; one kelvin further the pressure of CO2 hardly depends on its density, and straight lines cannot show its sign."""

LARGEST_ERROR = 2e-4
LARGEST_ERROR_OF_GAS = 5e-4
LARGEST_ERROR_OF_ENERGY = 15.0
"""Shares of the value, and J/kg, 0.02 K or less; that one is reached half a kelvin below the critical point."""


def liquid_energy(at: float) -> float:
    """Specific internal energy [J/kg] of the liquid of CO2 under its own vapour at a temperature [K]."""
    return between(CO2.liquid_energies, nodes_around(CO2, at))


@pytest.fixture(scope="module")
def properties() -> Any:
    """CoolProp's function, with the reference that the table of CO2 states."""
    module = pytest.importorskip("CoolProp.CoolProp")
    module.set_reference_state("CO2", "IIR")
    return module.PropsSI


def draws(low: float, high: float, count: int = 200) -> list[float]:
    return [float(value) for value in np.random.default_rng(5).uniform(low, high, count)]


def test_there_are_tables_of_co2_air_and_nitrogen_and_only_co2_has_a_liquid() -> None:
    assert FLUIDS == ("CO2", "N2", "air")
    assert [name for name in FLUIDS if has_liquid(load_fluid(name).table)] == ["CO2"]


@pytest.mark.parametrize("name", FLUIDS)
def test_a_table_says_where_it_comes_from(name: str) -> None:
    source = load_fluid(name).source
    assert "CoolProp 8" in source
    assert "equation of state" in source
    assert "reference" in source


@pytest.mark.parametrize("name", FLUIDS)
def test_pressure_grows_with_density_and_energy_with_temperature(name: str) -> None:
    table = load_fluid(name).table
    for temperature in np.linspace(
        table.temperatures[0], WELL_BELOW_CRITICAL if has_liquid(table) else table.temperatures[-1], 31
    ):
        densities = np.linspace(1e-3, 1.0, 101) * densest_gas(table, temperature)
        assert (np.diff([fluid_pressure(table, temperature, density) for density in densities]) > 0.0).all()
    span = np.linspace(table.temperatures[0], table.temperatures[-1], 500)
    for density in (0.5, 5.0, 15.0):
        assert (np.diff([gas_specific_energy(table, temperature, density) for temperature in span]) > 0.0).all()


def test_vapour_pressure_and_vapour_grow_and_liquid_falls_with_the_temperature() -> None:
    span = np.linspace(CO2.temperatures[0], CO2.temperatures[-1], 1500)
    assert (np.diff([fluid_pressure(CO2, at, SATURATED) for at in span]) > 0.0).all()
    assert (np.diff([densest_gas(CO2, at) for at in span]) > 0.0).all()
    assert (np.diff([liquid_density(CO2, at) for at in span]) < 0.0).all()
    assert (np.diff([liquid_energy(at) for at in span]) > 0.0).all()


@pytest.mark.parametrize("temperature", [220.0, 260.3, 299.9])
def test_gas_becomes_saturated_vapour_without_a_jump(temperature: float) -> None:
    vapour = densest_gas(CO2, temperature)
    below, above = (fluid_pressure(CO2, temperature, vapour * (1.0 + sign * 1e-9)) for sign in (-1.0, 1.0))
    assert below == pytest.approx(above, rel=1e-8)


def test_saturated_co2_is_that_of_coolprop(properties: Any) -> None:
    for at in draws(216.6, 303.8):

        def saturated(key: str, quality: int, at: float = at) -> float:
            return float(properties(key, "T", at, "Q", quality, "CO2"))

        assert fluid_pressure(CO2, at, SATURATED) == pytest.approx(saturated("P", 1), rel=LARGEST_ERROR)
        assert densest_gas(CO2, at) == pytest.approx(saturated("D", 1), rel=LARGEST_ERROR)
        assert liquid_density(CO2, at) == pytest.approx(saturated("D", 0), rel=LARGEST_ERROR)
        assert liquid_energy(at) == pytest.approx(saturated("U", 0), abs=LARGEST_ERROR_OF_ENERGY)
        assert gas_specific_energy(CO2, at, SATURATED) == pytest.approx(saturated("U", 1), abs=LARGEST_ERROR_OF_ENERGY)


@pytest.mark.parametrize("name", FLUIDS)
def test_gas_is_that_of_coolprop(name: str, properties: Any) -> None:
    table, coolprop_name = load_fluid(name).table, fluid_tables.PLANS[name].coolprop_name
    for at, share in zip(
        draws(table.temperatures[0], min(table.temperatures[-1], 303.0)), draws(0.0, 1.0), strict=True
    ):
        density = share * densest_gas(table, at)
        pressure, energy = (properties(key, "T|gas", at, "D", density, coolprop_name) for key in "PU")
        assert fluid_pressure(table, at, density) == pytest.approx(pressure, rel=LARGEST_ERROR_OF_GAS)
        assert gas_specific_energy(table, at, density) == pytest.approx(energy, abs=LARGEST_ERROR_OF_ENERGY)


@pytest.mark.parametrize("name", FLUIDS)
def test_the_tables_are_what_the_script_makes(name: str, properties: Any) -> None:
    content = json.loads(
        (resources.files("ppafo.parameters.bottles") / "fluid_tables" / f"{name}.json").read_text(encoding="utf-8")
    )
    plan = fluid_tables.PLANS[name]
    assert content["temperatures"] == pytest.approx(plan.temperatures, rel=1e-7)
    for index in (0, len(plan.temperatures) // 2, len(plan.temperatures) - 1):
        for column, value in fluid_tables.row_at(plan, plan.temperatures[index]).items():
            assert content[column][index] == pytest.approx(value, rel=1e-6), column


def test_the_script_writes_files_that_are_read_back(tmp_path: Any, properties: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(fluid_tables, "PLANS", {"N2": fluid_tables.Plan("Nitrogen", (250.0, 300.0), 3, 400.0)})
    fluid_tables.main(tmp_path)
    content = json.loads((tmp_path / "N2.json").read_text())
    assert content["temperatures"] == [250.0, 300.0]
    assert len(content["factors"]) == 2
    assert content["factors"][0][0] == pytest.approx(1.0, abs=1e-6)
