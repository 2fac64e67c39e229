"""A unit is accused only where the procedure does better in another unit; a value far from the set is no evidence."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify import Identification, finding_of, identify
from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import BenchContext, BenchResult
from ppafo.identification.estimate import Estimate
from ppafo.identification.procedures import with_tried_units
from ppafo.identification.source import RecordingSource
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.parameter_set import number_in_si
from ppafo.signals import Channel, Recording
from ppafo.units import from_si
from tests.unit.identification import planted

STATIC = (planted.static(growth=8.0e-7), 'kind = "static-torque"\n')


def solved(
    folder: Path, source: RecordingSource, kind: str, units: dict[str, tuple[str, str]], overrides: str = ""
) -> Identification:
    """Identify from a file whose header states the second unit over numbers in the first unit, by channel."""
    recording = source.recording
    columns = {"time [s]": recording.time}
    for name, channel in recording.channels.items():
        true, stated = units.get(name, (channel.unit, channel.unit))
        si_unit = "Pa_a" if channel.unit == "Pa" else channel.unit
        values = [value if true == channel.unit else from_si(value, true, si_unit) for value in channel.values.tolist()]
        columns[f"{name} [{stated}]"] = np.array(values)
    text = "\n".join(",".join(map(repr, row)) for row in np.column_stack([*columns.values()]).tolist())
    (folder / "bench.csv").write_text(f"{','.join(columns)}\n{text}\n")
    problem = f'schema_version = 1\nname = "twin"\ndevice.set = "ppafo2011"\n{overrides}'
    (folder / "problem.toml").write_text(f'{problem}[[procedure]]\n{kind}recordings = ["bench.csv"]\n')
    return identify(folder / "problem.toml").found


@pytest.mark.parametrize("true", ["psi_d", "N cm"])
def test_a_value_far_from_the_set_is_identified_and_remarked_on(true: str, tmp_path: Path) -> None:
    channel, read = ("torque", "N m") if true == "N cm" else ("pressure_difference", "kPa_d")
    found = solved(tmp_path, *STATIC, {channel: (true, read)})
    assert found.estimates[0].verdict == "identified"
    assert found.is_good
    set_value = number_in_si(found.before, "actuator.torque_constant") or 0.0
    remark = next(row for row in str(finding_of(found)).splitlines() if "times the value of the set" in row)
    assert float(remark.split(" is ")[1].split()[0]) == pytest.approx(found.estimates[0].value / set_value, rel=0.01)


@pytest.mark.parametrize(
    ("channel", "true", "read"), [("torque", "N mm", "N m"), ("pressure_difference", "kPa_d", "MPa_d")]
)
def test_a_value_a_thousand_times_that_of_the_set_is_a_wrong_unit(
    channel: str, true: str, read: str, tmp_path: Path
) -> None:
    found = solved(tmp_path, *STATIC, {channel: (true, read)})
    assert found.estimates[0].verdict == "unit probably wrong"
    assert "a factor of 1000, actuator.torque_constant is near that of the set" in found.estimates[0].explanation
    assert not found.is_good
    assert not found.new_set.written


@pytest.mark.parametrize("coefficient", [0.642, 0.75, 0.9])
@pytest.mark.parametrize("unit", ["kPa_g", "bar_g", "psi_g"])
@pytest.mark.parametrize("rise", [6.0e3, 1.0e5])
def test_an_ordinary_valve_measured_in_a_right_unit_is_identified(
    coefficient: float, unit: str, rise: float, tmp_path: Path
) -> None:
    found = flow_of_orifice(tmp_path, coefficient, rise, unit, unit)
    assert found.estimates[0].value == pytest.approx(coefficient, rel=1.0e-3)
    assert found.estimates[0].verdict == "identified"
    assert found.is_good


def test_a_jet_wider_than_its_opening_is_a_wrong_unit_where_the_other_unit_gives_the_set(tmp_path: Path) -> None:
    found = flow_of_orifice(tmp_path, 0.113, 1.0e5, "bar_a", "psi_a")
    assert found.estimates[0].value == pytest.approx(0.113 * 1.0e5 / 6894.757, rel=1.0e-3)
    assert found.estimates[0].verdict == "unit probably wrong"
    assert "bar read as psi, a factor of 14.5" in found.estimates[0].explanation
    assert not found.new_set.written
    assert not found.is_good


def test_a_jet_wider_than_its_opening_is_no_wrong_unit_where_no_unit_gives_the_set(tmp_path: Path) -> None:
    found = flow_of_orifice(tmp_path, 1.3, 1.0e5, "kPa_g", "kPa_g")
    assert found.estimates[0].verdict == "holds for this model only"


def test_an_accusation_is_not_hidden_by_another_unit_that_scatters_less() -> None:
    upstream = np.linspace(2.0e5, 3.0e5, 30)
    source = planted.source("flow", np.arange(30.0), upstream_pressure=(upstream, "Pa"), mass_flow=(upstream, "kg/s"))

    def run(sources: tuple[RecordingSource, ...]) -> BenchResult:
        """Cd 1.64 as read, the set's where bar was read as psi, and 9 with far less scatter in kPa."""
        factor = round(2.0e5 / sources[0].recording["upstream_pressure"][0], 3)
        value, scatter = {1.0: (1.64, 0.05), 0.069: (0.113, 0.05), 0.145: (9.0, 0.001)}.get(factor, (5.0, 0.05))
        path = "valves.proportional.discharge_coefficient"
        estimate = Estimate(path, value, "-", value, value, "identified", "", ())
        return BenchResult("open-valve-flow", "", (estimate,), "measured", scatter=scatter)

    result = with_tried_units(run((source,)), (source,), BenchContext(load_parameter_set("ppafo2011"), "", ""), run)
    assert result.estimates[0].verdict == "unit probably wrong"
    assert "bar read as psi" in result.estimates[0].explanation


def flow_of_orifice(folder: Path, coefficient: float, rise: float, true: str, read: str) -> Identification:
    """Identify exact readings of an orifice of 10 mm^2, air at 20 degC, from the shipped set, which has 0.113.

    ``rise`` [Pa] is the lowest difference of pressure and half of the highest.
    """
    ratio, gas = 1.4, 8.314462618 / 0.02897 * 293.15
    up = 101325.0 + np.linspace(rise, 2.0 * rise, 30)
    narrow = np.maximum(101325.0 / up, (2.0 / (ratio + 1.0)) ** (ratio / (ratio - 1.0)))
    speed = np.sqrt(2.0 * ratio / ((ratio - 1.0) * gas) * (narrow ** (2.0 / ratio) - narrow ** ((ratio + 1.0) / ratio)))
    flow = coefficient * 1.0e-5 * up * speed
    shown = [from_si(value, true, "Pa_a") for value in up.tolist()]
    down = from_si(101325.0, true, "Pa_a")
    rows = "".join(f"{pressure!r},{down!r},{mass!r}\n" for pressure, mass in zip(shown, flow.tolist(), strict=True))
    names = f"upstream_pressure [{read}],downstream_pressure [{read}],mass_flow [kg/s]"
    (folder / "flow.csv").write_text(f"{names}\n{rows}")
    (folder / "problem.toml").write_text(
        'schema_version = 1\nname = "twin"\ndevice.set = "ppafo2011"\ndevice.overrides = ["valve.area=10 mm^2"]\n'
        '[[procedure]]\nkind = "open-valve-flow"\nrecordings = ["flow.csv"]\ngas = "air"\ntemperature = "20 degC"\n'
    )
    return identify(folder / "problem.toml").found


def iso_6358(upstream: np.ndarray, downstream: float, conductance: float, ratio: float) -> np.ndarray:
    """Mass flow [kg/s] of air at 20 degC by ISO 6358, equations (1) and (2), with the density of its atmosphere."""
    subsonic = np.clip((downstream / upstream - ratio) / (1.0 - ratio), 0.0, None)
    return conductance * 1.185 * upstream * np.sqrt(1.0 - subsonic**2)


def flow_table(
    folder: Path, unit: str, gas: str, procedure: str = "", at: str = ', at = "ANR"', condition: str = ""
) -> Identification:
    """Identify C and b from a table of ANR litres of air per minute at gauge pressures in psi, stated in ``unit``."""
    gauge = np.linspace(6.0, 90.0, 15)
    flow = iso_6358(101325.0 + 6894.757 * gauge, 101325.0, 2.0e-8, 0.3)
    flow *= 1.0 + np.random.default_rng(3).normal(0.0, 0.002, gauge.size)
    rows = "".join(f"{p:.4g},{q * 60000.0 / 1.185:.5g}\n" for p, q in zip(gauge, flow, strict=True))
    (folder / "flow.csv").write_text(f"p1,q\n{rows}")
    (folder / "problem.toml").write_text(
        f"""schema_version = 1
name = "valve"
device.set = "cylinder-lever"
[columns.meter.channels]
upstream_pressure = {{ column = "p1", unit = "{unit}" }}
downstream_pressure = {{ constant = "101.325 kPa_a" }}
mass_flow = {{ column = "q", unit = "L/min{condition}"{at}{gas} }}
[[procedure]]
kind = "open-valve-flow"
recordings = ["flow.csv"]
columns = "meter"
law = "iso6358"
temperature = "20 degC"
{procedure}
"""
    )
    return identify(folder / "problem.toml").found


@pytest.mark.parametrize(
    ("at", "condition"), [(', at = "ANR"', ""), ("", " (ANR)"), (', at = "ANR"', " (ANR)"), ("", " (ANR, air)")]
)
def test_a_table_of_flow_gives_the_conductance_of_its_formula(tmp_path: Path, at: str, condition: str) -> None:
    found = flow_table(tmp_path, "psi_g", ', gas = "air"', at=at, condition=condition)
    conductance, ratio = found.estimates
    assert conductance.value == pytest.approx(2.0e-8, rel=0.01)
    assert ratio.value == pytest.approx(0.3, abs=0.03)


def test_a_pressure_in_a_unit_that_scatters_is_wrong_where_the_other_unit_gives_the_set(tmp_path: Path) -> None:
    (result,) = flow_table(tmp_path, "kPa_g", ', gas = "air"').results
    assert {estimate.verdict for estimate in result.estimates} == {"unit probably wrong"}
    assert "psi read as kPa, a factor of 6.895" in result.estimates[0].explanation


def test_a_flow_metered_as_one_gas_is_not_used_in_the_law_of_another(tmp_path: Path) -> None:
    with pytest.raises(
        IdentificationError, match=r"a flow of CO2, 0\.044 kg/mol, but .* is the set's, 0\.02897 kg/mol$"
    ):
        flow_table(tmp_path, "psi_g", ', gas = "CO2"')
    with pytest.raises(IdentificationError, match=r"is a flow of air, .* is CO2$"):
        flow_table(tmp_path, "psi_g", ', gas = "air"', 'gas = "CO2"')
    # The gas of the procedure is the gas of a flow that states none.
    litres = [flow_table(tmp_path, "psi_g", "", f'gas = "{gas}"').estimates[0].value for gas in ("air", "N2")]
    assert litres[0] == pytest.approx(2.0e-8, rel=0.01)
    # A volume of a lighter gas passes in proportion to 1/sqrt(M): C follows from the volume flow.
    assert litres[1] != litres[0]


@pytest.mark.parametrize("scale", [1.0e3, 1.0e-3])
def test_a_free_decay_in_a_wrong_unit_of_time_is_refused(scale: float, tmp_path: Path) -> None:
    time = np.arange(0.0, 2.0, 1.0e-3)
    swing = 0.3 * np.exp(-2.0 * time) * np.cos(30.0 * time)
    decay = RecordingSource(Recording("decay", scale * time, {"angle": Channel(swing, "rad")}))
    with pytest.raises(IdentificationError, match="is the unit of time"):
        solved(tmp_path, decay, 'kind = "free-decay"\ninertia = "8 g m^2"\n', {})
