"""A value far from the set that a unit mistake explains is not called identified; a larger device is no mistake."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify.answer import Identification
from ppafo.analyses.identify.question import identify
from ppafo.errors import DataError, IdentificationError
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import RecordingSource
from ppafo.identification.unit_check import with_wrong_units
from ppafo.signals import Channel, Recording
from ppafo.units import from_si
from tests.unit.identification import planted

STATIC = (planted.static(growth=8.0e-7), 'kind = "static-torque"\n')
FLOW = (planted.flow(), 'kind = "open-valve-flow"\n')
PRESSURES = ("upstream_pressure", "downstream_pressure")


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


@pytest.mark.parametrize(
    ("bench", "channels", "true", "read", "factor"),
    [
        (STATIC, ("pressure_difference",), "psi_d", "kPa_d", "6.895"),
        (STATIC, ("pressure_difference",), "bar_d", "psi_d", "14.5"),
        (STATIC, ("pressure_difference",), "bar_d", "kPa_d", "100"),
        (STATIC, ("pressure_difference",), "MPa_d", "bar_d", "10"),
        (STATIC, ("torque",), "N cm", "N m", "100"),
        (FLOW, PRESSURES, "psi_a", "kPa_a", "6.895"),
    ],
)
def test_a_value_off_by_a_unit_is_not_identified_and_its_verdict_names_the_factor(
    bench: tuple[RecordingSource, str],
    channels: tuple[str, ...],
    true: str,
    read: str,
    factor: str,
    tmp_path: Path,
) -> None:
    found = solved(tmp_path, *bench, dict.fromkeys(channels, (true, read)))
    wrong = found.estimates[0]
    mistake = f"{true.partition('_')[0]} read as {read.partition('_')[0]}, a factor of {factor}"
    seem = "seem" if len(channels) > 1 else "seems"
    assert wrong.verdict_text == f"unit probably wrong: {' and '.join(channels)} {seem} to be {mistake}"
    assert wrong.path not in (*found.new_set.written, *found.new_set.fitted)
    assert not found.is_good


def test_the_friction_beside_a_pressure_in_the_wrong_unit_stays_identified(tmp_path: Path) -> None:
    found = solved(tmp_path, planted.static(), STATIC[1], {"pressure_difference": ("psi_d", "kPa_d")})
    assert found.new_set.written == ("friction.static_torque",)


def test_a_value_that_the_person_expects_is_no_mistake_of_units(tmp_path: Path) -> None:
    expected = 'device.overrides = ["actuator.torque_constant=100 cm^3"]\n'
    found = solved(tmp_path, *STATIC, {"pressure_difference": ("psi_d", "kPa_d")}, expected)
    assert found.estimates[0].verdict == "identified"


@pytest.mark.parametrize("size", [1.0, 2.0, 4.0, 7.0, 8.0, 10.0, 15.0, 30.0])
def test_a_device_that_is_larger_throughout_is_no_mistake_of_units(size: float, tmp_path: Path) -> None:
    source = planted.static(noise=0.03 * size)
    channel = source.recording.channels["torque"]
    larger = source.recording.with_channel("torque", size * channel.values, "N m")
    found = solved(tmp_path, RecordingSource(larger), STATIC[1], {})
    assert {estimate.verdict for estimate in found.estimates[:2]} == {"identified"}
    assert found.is_good


def values(**factors: float) -> tuple[Estimate, ...]:
    return tuple(
        Estimate(path, factor, "N m", 0.9 * factor, 1.1 * factor, "identified", "said", ("r.csv",))
        for path, factor in factors.items()
    )


@pytest.mark.parametrize(
    ("factors", "wrong"),
    [
        ({"inertia": 103.0, "damping": 97.0}, {"inertia", "damping"}),
        ({"inertia": 103.0, "damping": 97.0, "friction": 1.2}, set()),
        ({"inertia": 103.0, "damping": 31.0}, set()),
        ({"inertia": 40.0}, set()),
        ({"inertia": 1.3, "damping": 4.0}, set()),
    ],
)
def test_values_of_a_fit_of_motion_that_are_all_off_by_one_factor_have_a_wrong_unit(
    factors: dict[str, float], wrong: set[str]
) -> None:
    torque = Recording("r", np.arange(3.0), {"external_torque": Channel(np.ones(3), "N m", stated="N m")})
    judged = with_wrong_units(values(**factors), dict.fromkeys(factors, 1.0), [torque])
    named = {item.path for item in judged if item.verdict == "unit probably wrong"}
    assert named == wrong
    assert all("N cm read as N m, a factor of 100" in item.verdict_text for item in judged if item.path in named)


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


def test_a_pressure_in_a_unit_that_scatters_is_no_conductance(tmp_path: Path) -> None:
    found = flow_table(tmp_path, "kPa_g", ', gas = "air"')
    mistake = "unit probably wrong: upstream_pressure seems to be psi read as kPa, a factor of 6.895"
    assert {estimate.verdict_text for estimate in found.estimates} == {mistake}
    assert not found.new_set.written


def test_a_flow_metered_as_one_gas_is_not_used_in_the_law_of_another(tmp_path: Path) -> None:
    with pytest.raises(
        IdentificationError, match=r"a flow of CO2, 0\.044 kg/mol, but .* is the set's, 0\.02897 kg/mol; "
    ):
        flow_table(tmp_path, "psi_g", ', gas = "CO2"')
    with pytest.raises(IdentificationError, match=r"is a flow of air, .* is CO2; give gas = 'air' in the procedure"):
        flow_table(tmp_path, "psi_g", ', gas = "air"', 'gas = "CO2"')
    # The gas of the procedure is the gas of a flow that states none.
    litres = [flow_table(tmp_path, "psi_g", "", f'gas = "{gas}"').estimates[0].value for gas in ("air", "N2")]
    assert litres[0] == pytest.approx(2.0e-8, rel=0.01)
    # A volume of a lighter gas passes in proportion to 1/sqrt(M): C follows from the volume flow.
    assert litres[1] != litres[0]


@pytest.mark.parametrize(("scale", "step", "unit"), [(1.0e3, "1 s", "ms"), (1.0e-3, "1e-06 s", "s")])
def test_a_free_decay_in_a_wrong_unit_of_time_is_refused(scale: float, step: str, unit: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 2.0, 1.0e-3)
    swing = 0.3 * np.exp(-2.0 * time) * np.cos(30.0 * time)
    decay = RecordingSource(Recording("decay", scale * time, {"angle": Channel(swing, "rad")}))
    with pytest.raises(IdentificationError, match=f"the samples are {step} apart; is the unit of time {unit}"):
        solved(tmp_path, decay, 'kind = "free-decay"\ninertia = "8 g m^2"\n', {})


@pytest.mark.parametrize(("largest", "is_wrong"), [(0.01, True), (0.5, False)])
def test_an_angle_that_would_turn_round_in_the_other_unit_has_its_own(largest: float, is_wrong: bool) -> None:
    swing = Channel(np.array([largest, -0.4 * largest, 0.0]), "rad", stated="deg")
    angle = Recording("r", np.arange(3.0), {"angle": swing})
    judged = with_wrong_units(values(friction=1.0 / 55.0), {"friction": 1.0}, [angle])
    assert (judged[0].verdict == "unit probably wrong") == is_wrong


@pytest.mark.parametrize(
    ("stated", "largest", "conductance", "supply", "is_wrong"),
    [
        # MPa read as bar would be a chamber of 60 bar on a supply of 6 bar.
        ("bar_g", 5.996e5, 0.109, 6.0e5, False),
        ("bar_g", 0.5996e5, 0.109, 6.0e5, True),
        ("bar_g", 5.996e5, 0.109, np.nan, True),
        # Read as it is, the chamber is full.
        ("MPa_g", 5.996e5, 9.2, 6.0e5, False),
        ("MPa_g", 59.96e5, 9.2, 6.0e5, True),
    ],
)
def test_a_chamber_has_no_unit_in_which_it_exceeds_its_supply_or_leaves_it(
    stated: str, largest: float, conductance: float, supply: float, is_wrong: bool
) -> None:
    pressure = Channel(101325.0 + np.array([0.0, 0.4, 1.0]) * largest, "Pa", stated=stated)
    recording = Recording("r", np.arange(3.0), {"pressure_1": pressure})
    fitted = Estimate("C", conductance, "m^3/(s Pa)", 0.9 * conductance, 1.1 * conductance, "identified", "", ("r",))
    judged = with_wrong_units((fitted,), {"C": 1.0}, [recording], supply)
    assert (judged[0].verdict == "unit probably wrong") == is_wrong


def test_a_flow_without_its_condition_is_told_every_key_that_its_gas_needs(tmp_path: Path) -> None:
    gas, at, procedure = ', gas = "air"', ', at = "ANR"', 'gas = "air"'
    remedy = r"give at = 'ANR' and gas = 'air'"
    with pytest.raises(
        DataError, match=rf"{remedy}; in a \[\[procedure\]\] where the gas is CO2, give gas = 'air' too"
    ):
        flow_table(tmp_path, "psi_g", "", 'gas = "CO2"', at="")
    # The set has air.
    with pytest.raises(DataError, match=rf"{remedy}$"):
        flow_table(tmp_path, "psi_g", "", at="")
    found = flow_table(tmp_path, "psi_g", gas, procedure, at)
    assert found.estimates[0].value == pytest.approx(2.0e-8, rel=0.01)


def test_a_channel_that_a_map_leaves_out_is_asked_for_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "flow.csv").write_text("upstream_pressure [psi_g],mass_flow [L/min (ANR, air)]\n5,125.16\n")
    (tmp_path / "problem.toml").write_text(
        """schema_version = 1
name = "valve"
device.set = "cylinder-lever"
[columns.part.channels]
downstream_pressure = { constant = "0 kPa_g" }
[[procedure]]
kind = "open-valve-flow"
recordings = ["flow.csv"]
columns = "part"
"""
    )
    line = r'upstream_pressure = { column = "HEADER", unit = "kPa_g" }'
    with pytest.raises(IdentificationError, match=f"a column map must list every channel to be read: {line}"):
        identify(tmp_path / "problem.toml")
