"""Integer controllers as firmware: proved, built without a warning, and the same as in Python on a simulated fixed."""

import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

import ppafo.cli
from ppafo.errors import ProgramError, ScenarioError
from ppafo.processor.catalog import CATALOG
from ppafo.processor.firmware import firmware, fixed_point_controller, proof
from ppafo.processor.fixed_point import ConverterCounts
from ppafo.processor.images import Target, make_firmware, missing_tools, processor_simulator, read_image, sizes
from ppafo.processor.lock_step import PythonProcessor, compare_drawn, drawn_readings, run_on_processor
from ppafo.processor.qemu import QemuSimulator
from ppafo.processor.torque_laws.catalog import FIXED_LAWS
from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import add_files
from ppafo.translation.widths import IntegerRange

SCENARIOS = {
    "pid": ("torque-task-proportional", "controller.kind=pid_fixed_point"),
    "pid with all": (
        "torque-task-anti-windup",
        "controller.kind=pid_fixed_point",
        "controller.converter_bits=14",
        "controller.converter_range=1.2 MPa_a",
    ),
    "pid beyond a dead band": (
        "torque-task-proportional",
        "controller.kind=pid_fixed_point",
        "valve.dead_band=0.3",
    ),
    "on_off": ("torque-task-solenoid", "controller.kind=on_off_fixed_point"),
    "on_off_dead_zone": ("torque-task-proportional", "controller.kind=on_off_dead_zone_fixed_point"),
}
MSP430, CORTEX_M0, CORTEX_M4 = CATALOG.values()


def if_here(target: Target) -> pytest.MarkDecorator:
    """Skip where a tool of the target is missing."""
    missing = missing_tools(target)
    return pytest.mark.skipif(bool(missing), reason=f"not on this machine: {', '.join(missing)}")


every_target = pytest.mark.parametrize(
    "target", [pytest.param(item, marks=if_here(item), id=item.name) for item in CATALOG.values()]
)
on_cortex = pytest.mark.parametrize(
    "target", [pytest.param(item, marks=if_here(item), id=item.name) for item in (CORTEX_M0, CORTEX_M4)]
)
with_compiler = pytest.mark.skipif(
    shutil.which("make") is None or shutil.which("cc") is None, reason="no make or no cc on this machine"
)


def scenario_of(law: str, *overrides: str) -> Scenario:
    """A scenario with an integer controller."""
    name, *own = SCENARIOS[law]
    return load_scenario(name, (*own, *overrides))


@pytest.mark.parametrize("law", FIXED_LAWS.values(), ids=list(FIXED_LAWS))
def test_no_number_of_a_law_can_overflow_and_no_state_leaves_its_range(law: FixedLaw) -> None:
    command, after = proof(law).returned
    assert command == IntegerRange(-1000, 1000)
    assert after


@pytest.mark.parametrize(("name", "low", "high"), [("integral", -(2**30), 2**30), ("slope", -(2**31), 2**31 - 1)])
def test_a_state_with_a_wider_range_is_not_proved(name: str, low: int, high: int) -> None:
    law = FIXED_LAWS["pid_fixed_point"]
    with pytest.raises(ProgramError, match="does not fit in 32 bits"):
        proof(replace(law, state_ranges={**law.state_ranges, name: (low, high)}))


def test_a_state_that_may_leave_a_narrower_range_is_not_proved() -> None:
    law = FIXED_LAWS["pid_fixed_point"]
    with pytest.raises(ProgramError, match="can leave its allowed range"):
        proof(replace(law, state_ranges={**law.state_ranges, "error": (-1000, 1000)}))


def test_a_converter_of_sixteen_bits_is_not_proved() -> None:
    law = FIXED_LAWS["pid_fixed_point"]
    wider = [replace(item, maximum=item.maximum * 2.0 + 1.0) for item in law.number_quantities[:2]]
    with pytest.raises(ProgramError):
        proof(law, (*wider, *(replace(item, maximum=65535.0) for item in law.number_quantities[2:])))


def test_drawn_readings_reach_edges_saturation_and_faults() -> None:
    drawn = list(drawn_readings(4095, 20_000, 1))
    for place in range(3):
        seen = {readings[place] for readings in drawn}
        assert {0, 1, 4094, 4095} <= seen
    fixed = PythonProcessor(fixed_point_controller(scenario_of("pid with all")))
    found = [fixed.sample(readings)[0] for readings in drawn_readings(16383, 200, 3)]
    assert {-1000, 1000} <= set(found)


@with_compiler
@pytest.mark.parametrize("law", SCENARIOS)
def test_the_c_of_a_law_decides_as_python_does_under_the_sanitizer(tmp_path: Path, law: str) -> None:
    scenario = scenario_of(law)
    add_files(tmp_path, firmware(scenario))
    make_firmware(tmp_path, ("host", "checked"))
    fixed = PythonProcessor(fixed_point_controller(scenario))
    lines, wanted = [], []
    for number, readings in enumerate(drawn_readings(int(fixed_point_controller(scenario).limits.top), 20_000, 5)):
        if number % 200 == 0:
            fixed.begin()
            lines.append("begin")
        lines.append(" ".join(map(str, readings)))
        wanted.append("{} {}".format(*fixed.sample(readings)))
    for program in ("host", "checked"):
        done = subprocess.run(
            [tmp_path / program], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=120
        )
        assert done.stdout.splitlines() == wanted
        assert done.stderr == ""


@every_target
@pytest.mark.parametrize("law", SCENARIOS)
def test_the_processor_decides_as_python_does_within_its_memory_and_time(law: str, target: Target) -> None:
    scenario = scenario_of(law)
    found = compare_drawn(scenario, 600, seed=2, target=target.name)
    assert found.first_difference == ""
    assert found.differences == 0
    cost = found.cost
    assert 0 < cost.sizes.flash <= min(2048, len(target.flash))
    assert cost.stack > 0
    # The controller and its layer, without the vectors of a Cortex-M and the words that it puts on the stack at once.
    assert cost.sizes.data + cost.stack + target.interrupt_stack <= (128 if target is MSP430 else 160)
    # Instructions of a Cortex-M take up to four cycles where no block of registers is moved.
    longest = 1.0 if target.counted == "cycles" else 4.0
    assert 0 < cost.mean <= cost.worst <= 0.5 * target.clock * scenario.controller.period / longest


@every_target
@pytest.mark.parametrize("law", ["pid", "on_off"])
def test_the_torque_task_with_the_processor_in_charge_has_the_bits_of_the_lanes(law: str, target: Target) -> None:
    found = run_on_processor(scenario_of(law, "run.duration=0.3 s"), target.name)
    assert found.samples == (300 if law == "pid" else 6)
    assert found.differences == 0
    assert found.same_bits
    assert len(set(found.processor.recording["command"])) > 1 or law == "on_off"


@on_cortex
def test_instructions_are_as_many_as_single_steps(target: Target) -> None:
    scenario = scenario_of("pid")
    readings = ConverterCounts(2000, 1500, 1502)
    with processor_simulator(firmware(scenario, target.name), target) as (simulator, image):
        assert isinstance(simulator, QemuSimulator)
        counted = simulator.samples([readings, readings])[1].work
        debugger, stop = simulator.debugger, image.symbols["simulated_stop"] & ~1
        debugger.packet(f"z0,{stop:x},2")
        steps, place = 0, 0
        while place != stop:
            debugger.packet("s")
            steps += 1
            # Register 15 is the program counter.
            place = int.from_bytes(bytes.fromhex(debugger.packet("g")[120:128]), "little")
    # From the stop to the first look at the counter three instructions, from the last look to the stop two.
    assert steps - 5 == counted


@on_cortex
@pytest.mark.parametrize("compiler", ["clang", "zig"])
def test_other_compilers_build_for_a_cortex_too(target: Target, compiler: str, tmp_path: Path) -> None:
    zig = find_spec("ziglang")
    if compiler == "clang" and not (shutil.which("clang") and shutil.which("ld.lld")):
        pytest.skip("no clang or no lld on this machine")
    if compiler == "zig" and zig is None:
        pytest.skip("no zig on this machine")
    name = target.name.replace("-", "_")
    given = {
        "clang": ["COMPILER=clang --target=arm-none-eabi", "LINKER=$(COMPILER) -fuse-ld=lld"],
        "zig": [
            f"COMPILER={sys.executable} -m ziglang cc -target thumb-freestanding-eabi -mcpu={name}",
            "PROCESSOR=",
        ],
    }
    add_files(tmp_path, firmware(scenario_of("pid"), target.name))
    make_firmware(tmp_path, ["all", *given[compiler]])
    simulator = target.simulator(target, read_image(tmp_path, target))
    fixed = PythonProcessor(fixed_point_controller(scenario_of("pid")))
    for readings in drawn_readings(4095, 100, 3):
        assert simulator.samples([readings])[0][:2] == fixed.sample(readings)
    simulator.close()


@every_target
def test_a_processor_with_other_numbers_is_found_out(
    target: Target, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = scenario_of("pid")
    wrong = firmware(scenario_of("pid", "controller.proportional_gain=0.0951 1/(N m)"), target.name)
    monkeypatch.setattr("ppafo.processor.lock_step.firmware", lambda *_: wrong)
    found = compare_drawn(scenario, 400, target=target.name)
    assert found.differences > 0
    assert "on the processor" in found.first_difference
    add_files(tmp_path, wrong)
    make_firmware(tmp_path)
    assert sizes(tmp_path / "firmware.elf", target).flash > sizes(tmp_path / "simulated.elf", target).flash


def test_numbers_stand_in_a_header_with_range_and_origin() -> None:
    header = firmware(scenario_of("pid"))["parameters.h"].decode()
    assert "proportional_gain 0.095 1/(N m) (controller.proportional_gain)" in header
    assert "#define CONTROLLER_TICKS 8u" in header
    assert '#error "CONTROLLER_PROPORTIONAL is beyond its range"' in header


def test_gains_that_nobody_gives_are_the_devices_in_firmware_too(tmp_path: Path) -> None:
    plain = tmp_path / "plain.toml"
    plain.write_text((Path(ppafo.cli.__file__).parent / "templates" / "scenario.toml").read_text(encoding="utf-8"))
    texts = ("controller.kind=pid_fixed_point", "valve.delay=20 ms", "actuator.torque_constant=9 cm^3")
    shipped, own = (load_scenario(str(plain), texts[:count]) for count in (2, 3))
    gain = own.controller.proportional_gain
    assert gain != pytest.approx(shipped.controller.proportional_gain, rel=0.1)
    header = firmware(own)["parameters.h"].decode()
    assert f"proportional_gain {gain:.9g} 1/(N m) (controller.proportional_gain)" in header


@pytest.mark.parametrize(
    ("name", "overrides", "said"),
    [
        ("step-response", (), "'constant' has no fixed-point form; available: pid, on_off"),
        (
            "torque-task-solenoid",
            ("controller.rate=900 Hz",),
            r"must be a multiple of 0.125 ms on the processor, at most 2.05 s",
        ),
    ],
)
def test_what_has_no_firmware_is_refused(name: str, overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        firmware(load_scenario(name, overrides))


def test_an_unknown_target_is_refused() -> None:
    with pytest.raises(ScenarioError, match="there is no target 'avr'; available: msp430f2013, cortex-m0, cortex-m4"):
        firmware(scenario_of("pid"), "avr")
