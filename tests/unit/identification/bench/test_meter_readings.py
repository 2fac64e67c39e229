"""Readings of a flow meter that no opening has, and a meter that shows no sign."""

import math
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.identify import Identification
from ppafo.errors import IdentificationError

RISE = np.array([100.0 + 39.0 * number for number in range(60)])


def identified(folder: Path, columns: str, rows: list[tuple[float, ...]], procedure: str) -> Identification:
    lines = [columns, *(",".join(f"{value:.9g}" for value in (0.05 * n, *row)) for n, row in enumerate(rows))]
    (folder / "readings.csv").write_text("\n".join(lines) + "\n")
    problem = folder / "problem.toml"
    head = 'schema_version = 1\nname = "x"\ndevice.set = "ppafo2011"\n\n[[procedure]]\n'
    problem.write_text(
        f'{head}kind = "{procedure}"\nrecordings = ["readings.csv"]\ngas = "air"\ntemperature = "20 degC"\n'
    )
    return ppafo.identify(problem).found


def orifice(difference: float) -> float:
    return 20.3e-6 * math.sqrt(2.0 * 1.204 * abs(difference))


@pytest.mark.parametrize("odd", [[], [-20.0], [-20.0, -35.0, -5.0]])
def test_a_reading_against_the_pressure_difference_does_not_move_the_orifice(odd: list[float], tmp_path: Path) -> None:
    columns = "time [s],upstream_pressure [Pa_g],downstream_pressure [Pa_g],mass_flow [kg/s]"
    rows = [(difference, 0.0, orifice(difference)) for difference in (*RISE, *odd)]
    (result,) = identified(tmp_path, columns, rows, "open-valve-flow").results
    assert result.estimates[0].value == pytest.approx(0.6425, abs=0.0003)
    said = [remark for remark in result.remarks if remark.startswith("left out")]
    assert len(said) == bool(odd)
    if odd:
        assert f"{len(odd)} of {60 + len(odd)} readings" in said[0]
        assert "sample 61 of readings.csv" in said[0]


def test_exchanged_pressures_are_still_refused(tmp_path: Path) -> None:
    columns = "time [s],upstream_pressure [Pa_g],downstream_pressure [Pa_g],mass_flow [kg/s]"
    with pytest.raises(IdentificationError, match="are the two columns swapped"):
        identified(tmp_path, columns, [(0.0, one, orifice(one)) for one in RISE], "open-valve-flow")


@pytest.mark.parametrize("has_sign", [True, False])
def test_a_valve_map_by_a_meter_without_sign_is_the_map(has_sign: bool, tmp_path: Path) -> None:
    columns = "time [s],command [-],mass_flow [kg/s],upstream_pressure [bar_g],downstream_pressure [bar_g]"
    commands = [*np.linspace(-1.0, 1.0, 81), *np.linspace(0.975, -1.0, 80)]
    flows = [math.copysign(4.0e-3 * max(abs(command) - 0.04, 0.0), command) for command in commands]
    # Shut, it shows its zero with either sign.
    read = [(flow if has_sign else abs(flow)) + 4.0e-6 * (-1) ** number for number, flow in enumerate(flows)]
    rows = [(command, flow, 6.0, 0.0) for command, flow in zip(commands, read, strict=True)]
    (result,) = identified(tmp_path, columns, rows, "valve-map").results
    found = {estimate.path.rpartition(".")[2]: estimate for estimate in result.estimates}
    assert found["dead_band"].value == pytest.approx(0.04, abs=0.002)
    assert found["dead_band"].is_identified


def rise(volume: float, hours: float = 0.03) -> list[tuple[float, float]]:
    """Gauge pressures [Pa] of an evacuated chamber [m^3] into which a Cd A of 0.01 mm^2 leaks, and of the room."""
    pressure, rows, conductance = 21_325.0, [], 1.0e-8 * 0.6847 / math.sqrt(287.0 * 293.15)
    for _ in range(int(3600.0 * hours)):
        rows.append((pressure - 101_325.0, 0.0))
        # Choked throughout: the flow is constant, and so is the rise.
        pressure += conductance * 101_325.0 * 287.0 * 293.15 / volume
    return rows


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_leak_into_an_evacuated_chamber_is_identified_on_either_side(exchanged: bool, tmp_path: Path) -> None:
    columns = "time [s],pressure_1 [Pa_g],pressure_2 [Pa_g]"
    rows = [(0.0, *(row[::-1] if exchanged else row)) for row in rise(2.0e-3)]
    lines = [columns, *(",".join(f"{value:.9g}" for value in (float(n), *row[1:])) for n, row in enumerate(rows))]
    (tmp_path / "rise.csv").write_text("\n".join(lines) + "\n")
    problem = tmp_path / "rise.toml"
    air = '["gas.species=air","gas.molar_mass=28.97 g/mol","gas.heat_capacity_ratio=1.4","gas.temperature=20 degC"]'
    problem.write_text(
        f'schema_version = 1\nname = "r"\ndevice.set = "ppafo2011"\ndevice.overrides = {air}\n\n[[procedure]]\n'
        f'kind = "vane-leak"\nvolume_{1 + exchanged} = "2 L"\nrecordings = ["rise.csv"]\n'
    )
    (result,) = ppafo.identify(problem).found.results
    # The set's discharge coefficient is 0.113.
    assert 0.113 * result.estimates[0].value == pytest.approx(1.0e-8, rel=0.02)
    assert result.estimates[0].is_identified
    assert any("is treated as a reservoir" in remark for remark in result.remarks)


@pytest.mark.parametrize(("meter", "apart"), [(0.0, 0.0), (2.0e-6, 4.0), (-2.0e-6, -3.0)])
def test_readings_at_rest_show_the_zeros_of_a_meter_whose_discharge_rises_with_flow(
    meter: float, apart: float, tmp_path: Path
) -> None:
    columns = "time [s],upstream_pressure [Pa_g],downstream_pressure [Pa_g],mass_flow [kg/s]"
    random, rest = np.random.default_rng(5), [(0.0, 0.0)] * 11
    flows = np.geomspace(1.0e-4, 2.2e-3, 30)
    sizes = 66.0e-6 + 8.0e-6 * (1.0 - np.exp(-flows / 6.0e-4))
    driven = [*rest, *zip(flows**2 / (2.0 * 1.204 * sizes**2), flows, strict=True)]
    rows = [(step + apart + random.normal(0.0, 0.5), 0.0, flow + meter) for step, flow in driven]
    (result,) = identified(tmp_path, columns, rows, "open-valve-flow").results
    # No reading has more than the largest size.
    assert 31.6e-6 * result.estimates[0].value < 74.2e-6
    assert any("11 of 41 readings are without flow" in remark for remark in result.remarks)
