"""The plant as firmware: on a simulated board beside that of the controller it moves with the bits of the lanes."""

import pytest

from ppafo.control.fixed.torque_laws import PLANT_TARGETS
from ppafo.errors import ScenarioError
from ppafo.exports.firmware import plant
from ppafo.exports.firmware.catalog import CATALOG
from ppafo.exports.firmware.plant import plant_firmware, run_on_two_boards
from ppafo.exports.firmware.simulators import missing_tools
from tests.unit.exports.test_firmware import scenario_of

MISSING = missing_tools(CATALOG["cortex-m4"])
with_boards = pytest.mark.skipif(bool(MISSING), reason=f"not on this machine: {', '.join(MISSING)}")


@with_boards
@pytest.mark.parametrize(
    ("law", "target", "duration", "samples"), [("pid", "cortex-m0", "0.1 s", 100), ("on_off", "cortex-m4", "0.3 s", 6)]
)
def test_controller_and_plant_on_two_boards_have_the_bits_of_the_lanes(
    law: str, target: str, duration: str, samples: int
) -> None:
    found = run_on_two_boards(scenario_of(law, f"run.duration={duration}"), target, "cortex-m4")
    assert found.samples == samples
    assert found.first_difference == ""
    assert found.differences == 0
    assert {"pressure_1", "pressure_2", "torque", "command", "supplied_mass"} <= set(found.compared)
    assert 0 < found.mean <= found.worst
    assert found.sizes.flash + found.stack < 128 * 1024
    assert 1000 < found.stack < 8192


def test_a_run_of_one_sample_is_refused_before_anything_is_built() -> None:
    said = r"run.duration = 0.001 s: must be at least 0.002 s on two boards, 2 samples of the controller$"
    with pytest.raises(ScenarioError, match=said):
        run_on_two_boards(scenario_of("pid", "run.duration=1 ms"), "cortex-m0", "cortex-m4")


@with_boards
def test_a_plant_with_another_supply_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    duration = "run.duration=0.02 s"
    other = plant_firmware(scenario_of("pid", duration, "supply.pressure=51 psi_g"), "cortex-m4")
    monkeypatch.setattr(plant, "plant_firmware", lambda *_: other)
    found = run_on_two_boards(scenario_of("pid", duration), "cortex-m0", "cortex-m4")
    assert found.differences > 0
    assert found.first_difference.startswith("sample 2, pressure")


def test_the_plant_is_the_exported_library_and_says_what_it_is() -> None:
    files = plant_firmware(scenario_of("pid"), "cortex-m4")
    assert b"advance_steps(run, STEPS)" in files["main.c"]
    assert b"There is no wire yet" in files["README.md"]
    assert "torque_task_proportional_plant.c" in files
    assert not any(b"@" in line.replace(b"make @", b"") for line in files["main.c"].splitlines())


def test_targets_of_the_plant_are_those_that_can_compute_it() -> None:
    assert tuple(name for name, item in CATALOG.items() if item.doubles) == PLANT_TARGETS


@pytest.mark.parametrize(
    ("target", "overrides", "said"),
    [
        ("msp430f2013", (), "no plant for 'msp430f2013': floats of 64 bits need more memory: cortex-m4"),
        ("cortex-m4", ("sensors.delay=2 ms",), r"sensors without flaws: leave out \[sensors\]"),
    ],
)
def test_what_has_no_plant_is_refused(target: str, overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        plant_firmware(scenario_of("pid", *overrides), target)
