"""From a parameter set to a device in SI units."""

import math

import pytest

from ppafo.errors import ParameterError
from ppafo.parameters import load_device
from ppafo.parameters.device import Orifice, SonicOrifice


def problem_of(*overrides: str, valve: str | None = None) -> str:
    with pytest.raises(ParameterError) as caught:
        load_device("ppafo2011", valve=valve, overrides=overrides)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_the_completed_set_is_a_device_in_si_units() -> None:
    device = load_device("ppafo2011")
    assert device.gas.specific_gas_constant == pytest.approx(188.95, abs=0.01)
    assert device.actuator.torque_constant == 1.451e-5
    assert device.actuator.displacement_per_radian == 1.451e-5
    assert device.actuator.angle_max - device.actuator.angle_min == pytest.approx(math.radians(110.0))
    assert device.actuator.leak == Orifice(0.3e-6, 0.113)
    assert device.friction.viscous_damping == 0.032
    assert device.foot_plate.inertia == 0.0084
    assert device.supply.pressure == pytest.approx(446062.86, abs=0.01)
    assert (device.valve_name, device.valve.kind) == ("proportional", "proportional")
    assert device.valve.orifice == Orifice(31.6e-6, 0.113)


def test_the_valve_can_be_chosen_by_name() -> None:
    device = load_device("ppafo2011", valve="solenoid")
    assert device.valve.kind == "solenoid"
    assert device.valve.orifice == Orifice(12.6e-6, 0.113)
    assert device.valve.switching_interval == 0.05


def test_settings_that_the_set_leaves_out_take_their_declared_defaults() -> None:
    settings = load_device("ppafo2011").valve.settings
    assert settings["spool_damping_ratio"] == 0.7
    assert settings["dead_band"] == 0.0


def test_the_printed_set_says_what_is_missing_and_where_it_is_completed() -> None:
    with pytest.raises(ParameterError) as caught:
        load_device("ppafo2011-printed")
    message = str(caught.value)
    for path in ("actuator.dead_volume_1", "actuator.leak.discharge_coefficient", "supply.atmospheric_pressure"):
        assert path in message
    assert "use the completed set 'ppafo2011'" in message


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("valve.area=-1mm^2", "must be at least 0"),
        ("valve.discharge_coefficient=0", "must be more than 0 and at most 2"),
        ("actuator.dead_volume_1=0cm^3", "must be at least 1e-12 cm^3"),
        ("actuator.dead_volume_2=1e-300 m^3", "must be at least 1e-18 m^3"),
        ("actuator.restitution=1.5", "must be at least 0 and at most 1"),
        ("foot_plate.inertia=0 g m^2", "must be more than 0"),
        ("gas.heat_capacity_ratio=1", "at least 1.01"),
        ("flow.linear_ratio=1", "at most 0.9999"),
        ("valve.dead_band=1", "at most 0.99"),
        ("actuator.angle_min=130deg", "must be below actuator.angle_max = 130 deg"),
        ("friction.dynamic_torque=1 N m", "must be at most friction.static_torque = 0.45 N m"),
        ("supply.pressure=-1.01bar_g", "must be at least 0.01 bar_a"),
        ("supply.dorsiflexion_pressure=50kPa_a", "must be at least supply.atmospheric_pressure"),
    ],
)
def test_a_value_out_of_range_names_key_value_and_what_is_allowed(override: str, reason: str) -> None:
    message = problem_of(override)
    path = override.partition("=")[0].replace("valve.", "valves.proportional.")
    assert message.startswith(f"ppafo2011: {path} = ")
    assert reason in message


def test_an_orifice_can_have_the_form_of_iso_6358() -> None:
    overrides = ("valve.sonic_conductance=0.5 L/(s bar)", "valve.critical_ratio=0.4")
    orifice = load_device("ppafo2011", overrides=overrides).valve.orifice
    assert isinstance(orifice, SonicOrifice)
    assert orifice.sonic_conductance == pytest.approx(5e-9)
    assert orifice.critical_ratio == 0.4


def test_a_critical_ratio_beyond_its_range_is_refused() -> None:
    message = problem_of("valve.sonic_conductance=0.5 L/(s bar)", "valve.critical_ratio=1.2")
    assert "critical_ratio = 1.2: " in message
    assert "at most 0.95" in message


def test_half_of_the_form_of_iso_6358_is_incomplete() -> None:
    assert "valves.proportional.critical_ratio" in problem_of("valve.sonic_conductance=0.5 L/(s bar)")


def test_the_atmosphere_of_the_set_is_the_zero_of_its_gauge_pressures() -> None:
    device = load_device("ppafo2011", overrides=("supply.atmospheric_pressure=90 kPa_a",))
    assert device.supply.pressure == pytest.approx(90e3 + 50.0 * 6894.757293)
