"""``supply.pressure`` is that of both regulators, unless the second is given apart: in files and overrides."""

import tomllib
from importlib import resources
from pathlib import Path

import pytest

from ppafo.parameters import apply_overrides, build_device, load_device, load_parameter_set
from ppafo.parameters.audit import findings_of
from ppafo.units import to_si

SET = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")


def psi(gauge: float) -> float:
    """Absolute pressure [Pa] of a gauge pressure [psi]."""
    return to_si(gauge, "psi_g", "Pa_a")


@pytest.mark.parametrize(
    ("overrides", "first", "second"),
    [
        ([], 50.0, 50.0),
        (["supply.pressure=70 psi_g"], 70.0, 70.0),
        (["supply.dorsiflexion_pressure=45 psi_g"], 50.0, 45.0),
        (["supply.pressure=70 psi_g", "supply.dorsiflexion_pressure=45 psi_g"], 70.0, 45.0),
        (["supply.dorsiflexion_pressure=45 psi_g", "supply.pressure=70 psi_g"], 70.0, 45.0),
        (["supply.dorsiflexion_pressure=50 psi_g", "supply.pressure=70 psi_g"], 70.0, 50.0),
    ],
)
def test_pressure_is_that_of_both_unless_the_second_is_given_apart(
    overrides: list[str], first: float, second: float
) -> None:
    supply = load_device("ppafo2011", overrides=overrides).supply
    assert supply.pressure == pytest.approx(psi(first), rel=1e-12)
    assert supply.dorsiflexion_pressure == pytest.approx(psi(second), rel=1e-12)


def test_one_pressure_in_two_units_is_one() -> None:
    alike = apply_overrides(
        load_parameter_set("ppafo2011"), ["supply.pressure=50 psi_g", "supply.dorsiflexion_pressure=446.06286 kPa_a"]
    )
    supply = build_device(apply_overrides(alike, ["supply.pressure=70 psi_g"])).supply
    assert supply.dorsiflexion_pressure == supply.pressure


def test_set_without_a_second_pressure_has_the_first_for_both(tmp_path: Path) -> None:
    lines = SET.split("[supply.dorsiflexion_pressure]")
    path = tmp_path / "mine.toml"
    path.write_text(lines[0] + "[" + lines[1].partition("\n[")[2], encoding="utf-8")
    assert "dorsiflexion_pressure" not in tomllib.loads(path.read_text())["supply"]
    supply = load_device(str(path), overrides=["supply.pressure=70 psi_g"]).supply
    assert supply.dorsiflexion_pressure == supply.pressure == pytest.approx(psi(70.0), rel=1e-12)


def test_audit_finds_an_orifice_in_two_forms_and_says_what_each_valve_passes(tmp_path: Path) -> None:
    more = "".join(
        f'\n[valves.solenoid.{name}]\nvalue = {value}\nunit = "{unit}"\norigin = "datasheet"\nsource = "sheet"\n'
        for name, value, unit in (("sonic_conductance", 1.0, "dm^3/(s bar)"), ("critical_ratio", 0.3, ""))
    )
    path = tmp_path / "mine.toml"
    path.write_text(SET + more, encoding="utf-8")
    found = {finding.id: finding for finding in findings_of(load_parameter_set(str(path)))}
    assert found["forms-of-solenoid"].severity == "error"
    assert "area, discharge_coefficient, critical_ratio, sonic_conductance" in found["forms-of-solenoid"].paragraph
    assert "open-flow-of-solenoid" not in found
    assert found["open-flow-of-proportional"].severity == "note"
