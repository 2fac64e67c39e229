"""Open valve, valve map and vane leak: planted values come back, tolerances are named, a wrong law is said once."""

import math

import numpy as np
import pytest

from ppafo.errors import DataError, IdentificationError
from ppafo.identification.bench.flow import GasAt, Opening, iso6358_shape, orifice_shape
from ppafo.identification.bench.vane_leak import pressures_of_fall
from ppafo.identification.noise import burg
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import Tolerances
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from tests.unit.identification import planted
from tests.unit.identification.planted import open_valve_flow, valve_map, vane_leak

VOLUME = 60e-6
EXACT = Tolerances(gas_temperature=0.0, gas_law=0.0, zero_of_pressure=0.0, gain=0.0, zero_of_flow=0.0, held=0.0)
EFFECTIVE = 0.3e-6 * 0.113
AREA = "actuator.leak.area"


def changed(source: RecordingSource, name: str, values: np.ndarray) -> RecordingSource:
    return RecordingSource(source.recording.with_channel(name, values, source.recording.unit(name)))


def test_the_shapes_of_flow_are_the_flow_functions_of_the_model_and_antisymmetric() -> None:
    first, second = np.array([5e5, 5e5, 3e5, 1.1e5]), np.array([1e5, 2.8e5, 2.9e5, 1e5])
    ratios = (second / first).tolist()
    orifice = first * [isentropic_flow_function(ratio, 1.3) for ratio in ratios]
    standard = first * [iso6358_flow_function(ratio, 0.3) for ratio in ratios]
    assert np.allclose(orifice_shape(first, second, 1.3), orifice, rtol=1e-12)
    assert np.allclose(iso6358_shape(first, second, 0.3), standard, rtol=1e-12)
    assert np.array_equal(orifice_shape(second, first, 1.3), -orifice_shape(first, second, 1.3))


def test_a_planted_discharge_coefficient_lies_inside_its_interval_which_names_the_temperature() -> None:
    gas = GasAt(0.044, 1.3, 298.0, 15.0 / math.sqrt(3.0))
    result = open_valve_flow((planted.flow(),), gas, area=31.6e-6)
    found = result["valves.proportional.discharge_coefficient"]
    assert found.low <= 3.57 / 31.6 <= found.high
    assert 0.025 < found.wider_half_width / found.value < 0.06
    assert "variance from gas temperature" in found.explanation
    assert (found.verdict, result.conflict) == ("identified", "")


def test_a_gas_that_is_colder_than_stated_stays_inside_the_default_tolerance() -> None:
    source = planted.flow()
    cold = changed(source, "mass_flow", source.recording["mass_flow"] * np.sqrt(298.0 / 290.0))
    found = open_valve_flow((cold,), GasAt(0.044, 1.3, 298.0, 15.0 / math.sqrt(3.0)))
    area = found["open_valve_flow.effective_area"]
    assert area.low <= 3.57e-6 <= area.high
    exact = open_valve_flow((cold,), planted.CO2, tolerances=EXACT)
    assert exact["open_valve_flow.effective_area"].low > 3.57e-6


def test_flow_of_the_standard_gives_back_its_two_numbers_and_an_orifice_law_holds_for_this_model_only() -> None:
    source = planted.flow()
    pressures = source.recording["upstream_pressure"], source.recording["downstream_pressure"]
    flow = 7.0e-9 * planted.CO2.flow_per_sonic_conductance * iso6358_shape(*pressures, 0.2)
    noisy = changed(source, "mass_flow", flow * (1.0 + np.random.default_rng(1).normal(0.0, 0.003, flow.size)))
    result = open_valve_flow((noisy,), planted.CO2, law="iso6358", tolerances=EXACT)
    curve = next(mark for mark in result.panels[0].marks if mark.label == "ISO 6358")
    # ISO 6358: sqrt(1 - ((r - b) / (1 - b))^2) above b, 1 below it, at more ratios than were measured.
    shape = np.sqrt(1.0 - np.clip((curve.x - 0.2) / 0.8, 0.0, 1.0) ** 2)
    assert curve.x.size > 2 * noisy.recording.time.size
    assert np.allclose(curve.y / curve.y[0], shape, atol=0.02)
    assert result["valves.proportional.sonic_conductance"].value == pytest.approx(7.0e-9, rel=0.01)
    assert result["valves.proportional.critical_ratio"].value == pytest.approx(0.2, abs=0.03)
    assert result.conflict == ""
    wrong = open_valve_flow((noisy,), planted.CO2)
    assert wrong.conflict
    assert wrong.estimates[0].verdict == "holds for this model only"


def test_the_drawn_curve_has_the_zero_of_the_meter_as_the_residuals_have() -> None:
    source = planted.flow()
    upstream, downstream = source.recording["upstream_pressure"], source.recording["downstream_pressure"]
    flow = 7.0e-9 * planted.CO2.flow_per_sonic_conductance * iso6358_shape(upstream, downstream, 0.2)
    shown = changed(source, "mass_flow", flow + 0.04 * flow.max())
    tolerances = Tolerances(gas_temperature=0.0, gas_law=0.0, zero_of_pressure=0.0, gain=0.0)
    result = open_valve_flow((shown,), planted.CO2, law="iso6358", tolerances=tolerances)
    curve = next(mark for mark in result.panels[0].marks if mark.label == "ISO 6358")
    order = np.argsort(downstream / upstream)
    first = np.interp(curve.x, (downstream / upstream)[order], upstream[order])
    law = 7.0e-9 * planted.CO2.flow_per_sonic_conductance * iso6358_shape(first, curve.x * first, 0.2)
    assert np.allclose(curve.y, 1.0e8 * (law + 0.04 * flow.max()) / first, rtol=2e-3)


def test_a_laminar_valve_gives_back_its_coefficient() -> None:
    source = planted.flow()
    pressures = source.recording["upstream_pressure"], source.recording["downstream_pressure"]
    flow = Opening(planted.CO2, "laminar").flow({"size": 3.0e-14}, *pressures)
    laminar = changed(source, "mass_flow", flow * (1.0 + np.random.default_rng(1).normal(0.0, 0.003, flow.size)))
    found = open_valve_flow((laminar,), planted.CO2, law="laminar")
    assert found["open_valve_flow.laminar_coefficient"].value == pytest.approx(3.0e-14, rel=0.01)


def test_choked_flow_alone_is_refused_for_the_critical_ratio() -> None:
    with pytest.raises(IdentificationError, match="C and b need readings with choked and with subsonic flow"):
        open_valve_flow((planted.flow(ratios=(0.2, 0.3)),), planted.CO2, law="iso6358")


def test_gauge_pressures_passed_for_absolute_are_refused() -> None:
    source = planted.flow()
    gauge = changed(source, "downstream_pressure", np.minimum(source.recording["downstream_pressure"] - 4e5, 0.0))
    with pytest.raises(IdentificationError, match="at sample 1, which is impossible for an absolute pressure"):
        open_valve_flow((gauge,), planted.CO2)


def test_a_valve_that_was_never_open_is_told() -> None:
    half = changed(planted.flow(), "command", np.full(60, 0.5))
    with pytest.raises(IdentificationError, match="fully open"):
        open_valve_flow((half,), planted.CO2)


def test_planted_dead_band_saturation_and_hysteresis_come_back() -> None:
    result = valve_map((planted.sweep(),), planted.CO2)
    for path, truth, near in (
        ("valves.proportional.dead_band", 0.12, 0.003),
        ("valve_map.hysteresis", 0.04, 0.003),
        ("valve_map.saturation_command", 0.9, 0.01),
    ):
        assert result[path].value == pytest.approx(truth, abs=near)
        assert result[path].low <= truth <= result[path].high
    assert result["valve_map.gain"].value == pytest.approx(4.2e-6, rel=0.01)
    assert result.conflict == ""
    assert len({mark.colour for mark in result.panels[1].marks}) == 3


def round_hole(noise: float, is_both_ways: bool, seed: int) -> RecordingSource:
    """Readings of a spool that uncovers a round hole from its first step on, with noise relative to the whole flow."""
    command = np.arange(-40 if is_both_ways else 0, 41) / 40.0
    half_angle = np.arccos(1.0 - 1.9 * np.abs(command))
    share = np.sign(command) * (half_angle - 0.5 * np.sin(2.0 * half_angle)) / math.pi
    flow = 3.6e-3 * (share + np.random.default_rng(seed).normal(0.0, noise, command.size))
    pressures = {
        "upstream_pressure": (np.full(command.size, 7.0e5), "Pa"),
        "downstream_pressure": (np.full(command.size, 1.0e5), "Pa"),
    }
    return planted.source(
        "hole", np.arange(command.size), command=(command, "-"), mass_flow=(flow, "kg/s"), **pressures
    )


@pytest.mark.parametrize("is_both_ways", [False, True])
@pytest.mark.parametrize(("noise", "seed"), [(0.0, 1), (0.002, 2), (0.01, 3), (0.01, 4)])
def test_a_round_hole_has_no_dead_band_that_is_identified(noise: float, seed: int, is_both_ways: bool) -> None:
    result = valve_map((round_hole(noise, is_both_ways, seed),), planted.CO2)
    assert result["valves.proportional.dead_band"].value == pytest.approx(0.09, abs=0.02)
    assert not any(estimate.is_identified for estimate in result.estimates)
    assert "have a shape that the law has not" in result.conflict or "fitted alone" in result.conflict


def test_the_table_of_a_round_hole_has_its_openings_inside_their_intervals_and_no_dead_band() -> None:
    nodes = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
    half_angle = np.arccos(1.0 - 1.9 * np.array([*nodes, 1.0]))
    shares = half_angle - 0.5 * np.sin(2.0 * half_angle)
    inside = 0
    for seed in range(6):
        result = valve_map((round_hole(0.003, True, seed),), planted.CO2, nodes=nodes)
        found = [result[f"effects.opening.opening_{number:02}"] for number in range(1, len(nodes) + 1)]
        # Straight lines between the nodes miss the curve by up to a third of the noise.
        inside += sum(
            item.low - 1e-3 <= share <= item.high + 1e-3
            for item, share in zip(found, (shares[:-1] / shares[-1]).tolist(), strict=True)
        )
        assert all(item.is_identified for item in found)
        assert found[0].beside == {"effects.opening.command_01": 0.05, "valves.proportional.dead_band": 0.0}
    assert inside >= 54
    with pytest.raises(IdentificationError, match=r"nodes = \[0.5, 0.4\]: must rise"):
        valve_map((round_hole(0.0, True, 1),), planted.CO2, nodes=(0.5, 0.4))


def test_the_zero_of_the_flow_meter_does_not_move_the_dead_band() -> None:
    source = planted.sweep()
    off = changed(source, "mass_flow", source.recording["mass_flow"] + 4e-5)
    found = valve_map((off,), planted.CO2)["valves.proportional.dead_band"]
    assert found.low <= 0.12 <= found.high


def test_a_valve_that_opens_more_in_one_direction_holds_for_this_model_only() -> None:
    source = planted.sweep()
    flow = source.recording["mass_flow"]
    result = valve_map((changed(source, "mass_flow", np.where(flow > 0.0, 1.2 * flow, flow)),), planted.CO2)
    assert result.conflict.startswith("commands to chamber 2, fitted alone, would have other values")


def test_a_command_that_only_rises_leaves_hysteresis_out() -> None:
    up = RecordingSource(planted.sweep().recording.between(0.0, 10.0))
    result = valve_map((up,), planted.CO2)
    assert "valve_map.hysteresis" not in [item.path for item in result.estimates]
    assert any("the dead band includes half the width of any hysteresis" in remark for remark in result.remarks)


def test_flow_with_the_wrong_sign_is_told() -> None:
    with pytest.raises(IdentificationError, match="a wrong sign of 'mass_flow'"):
        valve_map((planted.sweep(sign=-1.0),), planted.CO2)


def test_a_valve_that_is_open_at_command_zero_is_told() -> None:
    source = planted.sweep()
    command, flow = source.recording["command"].copy(), source.recording["mass_flow"].copy()
    nearest = np.argsort(np.abs(command))[:8]
    command[nearest], flow[nearest] = 0.0, flow.max()
    with pytest.raises(IdentificationError, match="at command 0, the valve has more than half of its largest flow"):
        valve_map((changed(changed(source, "command", command), "mass_flow", flow),), planted.CO2)


def test_a_command_in_percent_is_told() -> None:
    source = planted.sweep()
    percent = changed(source, "command", 100.0 * source.recording["command"])
    with pytest.raises(DataError, match="must be from -1 to 1"):
        valve_map((percent,), planted.CO2)


@pytest.mark.parametrize("turned", [False, True])
def test_a_planted_orifice_leak_gives_its_area_whichever_chamber_empties(turned: bool) -> None:
    source, volumes = planted.leak("orifice", EFFECTIVE), (VOLUME, VOLUME / 1.3)
    if turned:
        first, second = (source.recording[name] for name in ("pressure_1", "pressure_2"))
        source, volumes = changed(changed(source, "pressure_1", second), "pressure_2", first), volumes[::-1]
    area = vane_leak(
        (source,),
        planted.CO2,
        *volumes,
        discharge_coefficient=0.113,
        tolerances=Tolerances(held=0.01 * math.sqrt(3.0)),
    )[AREA]
    assert area.low <= 0.3e-6 <= area.high
    assert area.wider_half_width < 0.05 * area.value
    assert area.verdict == "identified"


def test_a_leak_without_a_volume_is_an_area_over_it() -> None:
    found = vane_leak((planted.leak("orifice", EFFECTIVE),), planted.CO2)
    assert len({mark.colour for mark in found.panels[0].marks}) == 3
    area = found["vane_leak.area_over_volume"]
    assert area.low <= EFFECTIVE / VOLUME <= area.high
    assert "volume of chamber 1, which is not known" in area.explanation


def test_gas_that_is_lost_outside_holds_for_this_model_only() -> None:
    source = planted.leak("orifice", EFFECTIVE, lost=5000.0)
    result = vane_leak((source,), planted.CO2, VOLUME, VOLUME / 1.3, discharge_coefficient=0.113)
    assert result.conflict
    assert result[AREA].verdict == "holds for this model only"


@pytest.mark.parametrize("kind", ["leak", "steady"])
def test_a_laminar_leak_gives_its_coefficient_and_an_orifice_holds_for_this_model_only(kind: str) -> None:
    source = getattr(planted, kind)("laminar", 2.0e-16)
    found = vane_leak((source,), planted.CO2, VOLUME, VOLUME / 1.3, law="laminar")
    coefficient = found["vane_leak.laminar_coefficient"]
    assert coefficient.low <= 2.0e-16 <= coefficient.high
    assert found.conflict == ""
    wrong = vane_leak((source,), planted.CO2, VOLUME, VOLUME / 1.3, discharge_coefficient=0.113)
    assert wrong.conflict


def test_a_tight_chamber_gives_an_upper_end_and_no_area() -> None:
    time = np.arange(0.0, 20.0, 0.05)
    first = 4e5 + np.random.default_rng(2).normal(0.0, 300.0, time.size)
    tight = planted.source("tight", time, pressure_1=(first, "Pa"), pressure_2=(np.full(time.size, 1e5), "Pa"))
    area = vane_leak((tight,), planted.CO2, VOLUME)["vane_leak.effective_area"]
    assert not area.is_usable
    assert area.low == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < area.high < 1e-8


def test_gas_that_comes_to_rest_with_its_walls_is_no_leak() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    first = 4e5 * (1.0 + 0.01 * np.exp(-time / 12.0)) + np.random.default_rng(2).normal(0.0, 100.0, time.size)
    rests = planted.source("rests", time, pressure_1=(first, "Pa"), pressure_2=(np.full(time.size, 1e5), "Pa"))
    assert not vane_leak((rests,), planted.CO2, VOLUME).estimates[0].is_identified


def test_decays_that_empty_different_chambers_are_refused() -> None:
    source = planted.leak("orifice", EFFECTIVE)
    first, second = source.recording["pressure_1"], source.recording["pressure_2"]
    turned = changed(changed(source, "pressure_1", second), "pressure_2", first)
    with pytest.raises(IdentificationError, match="chamber 1 empties in some recordings and chamber 2 in others"):
        vane_leak((source, turned), planted.CO2, VOLUME, VOLUME)


def test_a_steady_orifice_leak_gives_its_area_beside_the_zero_of_the_meter() -> None:
    for zero in (0.0, 2.0e-6):
        area = vane_leak((planted.steady("orifice", EFFECTIVE, zero),), planted.CO2, discharge_coefficient=0.113)[AREA]
        assert area.low <= 0.3e-6 <= area.high
        assert area.verdict == "identified"
    with pytest.raises(IdentificationError, match=r"'mass_flow': .* of procedure vane-leak-steady"):
        planted.in_gas("vane-leak", (planted.steady("orifice", EFFECTIVE),), planted.CO2, EXACT, {})


def test_a_leak_in_the_form_of_the_standard_gives_its_conductance() -> None:
    first, second = np.linspace(1.3e5, 6.0e5, 24), np.full(24, planted.ROOM)
    flow = Opening(planted.CO2, "iso6358", critical_ratio=0.25).flow({"size": 7.0e-11}, first, second)
    flow *= 1.0 + np.random.default_rng(3).normal(0.0, 0.003, 24)
    channels = {"pressure_1": (first, "Pa"), "pressure_2": (second, "Pa"), "mass_flow": (flow, "kg/s")}
    source = planted.source("steady", np.arange(24.0), **channels)
    found = vane_leak((source,), planted.CO2, critical_ratio=0.25)["actuator.leak.sonic_conductance"]
    assert found.value == pytest.approx(7.0e-11, rel=0.02)
    assert found.low <= 7.0e-11 <= found.high


def test_choked_outflow_of_one_chamber_into_a_room_is_an_exponential_of_the_pressure() -> None:
    opening = Opening(planted.CO2, "orifice", known=1.0 / planted.CO2.choked_flow_constant)
    time = np.linspace(0.0, 3.0, 50)
    first, _ = pressures_of_fall(opening, {"size": 0.2}, 1e6, 1e5, 0.0, 1.0, time)
    assert np.allclose(first, 1e6 * np.exp(-0.2 * time), rtol=1e-4)


def test_a_hundred_readings_with_white_noise_have_hardly_any_memory() -> None:
    orders = [len(burg([np.random.default_rng(seed).standard_normal((100, 1))])) for seed in range(100)]
    assert max(orders) <= 1
    assert sum(orders) <= 30
