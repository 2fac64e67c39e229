"""Proportions of a device: a slip by powers of ten is named, and plausible devices of every kind are not."""

import random
from pathlib import Path

import pytest

import ppafo
from ppafo.cli.new import new
from ppafo.parameters import apply_overrides, load_parameter_set
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.proportions import USUAL, unusual
from ppafo.parameters.parameter_set import ParameterSet
from scripts.drawn_joints import KINDS, draw_joint

BLADDER = str(Path(__file__).parents[3] / "actuators" / "measured-bladder.toml")
FINGER = (
    "actuator.torque_constant=0.1 cm^3",
    "actuator.displacement_per_radian=0.1 cm^3/rad",
    "actuator.dead_volume_1=0.4 cm^3",
    "actuator.dead_volume_2=0.4 cm^3",
    "supply.pressure=2 bar_g",
    "supply.dorsiflexion_pressure=1 bar_g",
    "friction.static_torque=1 N mm",
    "friction.dynamic_torque=0.5 N mm",
    "friction.viscous_damping=0.01 N mm s/rad",
    "foot_plate.inertia=10 kg mm^2",
    "valve.sonic_conductance=0.01 L/(s bar)",
    "valve.critical_ratio=0.3",
    "actuator.leak.area=0 mm^2",
)
LEG = (
    "actuator.bore=40 mm",
    "actuator.rod_diameter=16 mm",
    "actuator.lever_length=80 mm",
    "actuator.base_distance=300 mm",
    "actuator.dead_volume_1=20 cm^3",
    "actuator.dead_volume_2=20 cm^3",
    "foot_plate.inertia=0.3 kg m^2",
    "foot_plate.gravity_torque=20 N m",
)
VACUUM = ("supply.pressure=20 kPa_a", "supply.dorsiflexion_pressure=40 kPa_a", "friction.static_torque=0.1 N m")


def named(parameter_set: ParameterSet) -> list[str]:
    """What the audit names of the proportions of a set, by path of their main number."""
    return [finding.id.removeprefix("proportion-of-") for finding in unusual(Evidence(parameter_set))]


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("ppafo2011", ()),
        ("ppafo2011-printed", ()),
        ("cylinder-lever", ()),
        (BLADDER, ()),
        ("ppafo2011", FINGER),
        ("ppafo2011", VACUUM),
        ("cylinder-lever", LEG),
        (BLADDER, ("supply.pressure=15 kPa_g", "actuator.dead_volume_1=150 cm^3")),
    ],
)
def test_a_plausible_device_has_no_unusual_proportion(name: str, overrides: tuple[str, ...]) -> None:
    assert named(apply_overrides(load_parameter_set(name), overrides)) == []


@pytest.mark.parametrize("kind", KINDS)
def test_drawn_joints_have_no_unusual_proportion(kind: str, tmp_path: Path) -> None:
    draw = random.Random(f"proportions of {kind}")
    for number in range(5):
        assert named(load_parameter_set(str(draw_joint(draw, kind, tmp_path, number)))) == []


@pytest.mark.parametrize(
    ("path", "overrides", "slip"),
    [
        ("supply-atmospheric-pressure", (), "supply.atmospheric_pressure=1013 Pa_a"),
        ("supply-pressure", (), "supply.pressure=5000 psi_g"),
        ("supply-dorsiflexion-pressure", FINGER, "supply.dorsiflexion_pressure=1 mbar_g"),
        ("actuator-dead-volume-1", (), "actuator.dead_volume_1=3600 cm^3"),
        ("actuator-dead-volume-2", FINGER, "actuator.dead_volume_2=0.04 mm^3"),
        ("actuator-torque-constant", FINGER, "actuator.torque_constant=0.01 cm^3"),
        ("actuator-displacement-per-radian", FINGER, "actuator.displacement_per_radian=10 cm^3/rad"),
        ("friction-static-torque", VACUUM, "friction.static_torque=10 N m"),
        ("friction-viscous-damping", FINGER, "friction.viscous_damping=100 N mm s/rad"),
        ("foot-plate-inertia", VACUUM, "foot_plate.inertia=10 kg m^2"),
        ("foot-plate-gravity-torque", (), "foot_plate.gravity_torque=100 N m"),
        ("actuator-leak", (), "actuator.leak.area=30 mm^2"),
        ("valves-proportional", FINGER, "valve.sonic_conductance=1e-6 L/(s bar)"),
        ("valves-solenoid-switching-interval", (), "valves.solenoid.switching_interval=5 us"),
    ],
)
def test_a_slip_by_powers_of_ten_is_named(path: str, overrides: tuple[str, ...], slip: str) -> None:
    slips = [*(text for text in overrides if text.partition("=")[0] != slip.partition("=")[0]), slip]
    assert path in named(apply_overrides(load_parameter_set("ppafo2011"), slips))


def test_audit_new_set_and_the_second_line_of_a_run_say_it_with_range_and_source(tmp_path: Path) -> None:
    slip = "friction.static_torque=4500 N m"
    said = "static friction over torque ceiling 900 (usual 0 to 0.5)"
    result = ppafo.simulate("torque-task-proportional", {"run.duration": "10 ms", "friction.static_torque": "4500 N m"})
    assert str(result).splitlines()[1] == f"unusual device (ppafo sets audit has the sources): {said}"
    finding = next(iter(unusual(Evidence(apply_overrides(load_parameter_set("ppafo2011"), [slip])))))
    assert (finding.severity, finding.title) == ("warning", said)
    assert finding.why == f"Usual range: {USUAL['friction.static_torque'].source}"
    assert [value.path for value in finding.values] == ["friction.static_torque"]
    copied = tmp_path / "mine.toml"
    new("set", "mine", source="ppafo2011", out=copied)
    text = copied.read_text(encoding="utf-8")
    copied.write_text(text.replace("value = 0.45\n", "value = 4500.0\n", 1), encoding="utf-8")
    assert "[copied-sources]" in str(ppafo.audit(copied))
    assert new("set", "next", source=str(copied), out=tmp_path / "next.toml").text.endswith(f"\nwarning: {said}")
