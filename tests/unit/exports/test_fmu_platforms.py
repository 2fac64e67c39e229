"""Units for other computers, built here by ziglang: under an emulator they have the bits of the lanes."""

import os
import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import compiler_for
from ppafo.exports.fmu.unit import functional_unit
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

DRIVER = Path(__file__).parent / "drive_unit.c"
SHORT = ("run.duration=0.3 s", "reference.ramp_time=0.1 s")
ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")
RUNNERS = {
    "linux64": ("linux64", ()),
    "win64": ("wine", ("wine",)),
    "linux-aarch64": ("qemu-aarch64", ("qemu-aarch64", "-L", str(ARM_LIBRARIES))),
}
"""What runs a binary: a program that must be there, and the words before the binary."""


@pytest.mark.parametrize(("name", "fmi"), [("linux64", 2), ("win64", 2), ("win64", 3), ("linux-aarch64", 3)])
def test_a_unit_for_another_computer_has_the_bits_of_the_lanes(name: str, fmi: int, tmp_path: Path) -> None:
    pytest.importorskip("ziglang", reason="needs the extra 'native'")
    needed, runner = RUNNERS[name]
    if runner and shutil.which(needed) is None:
        pytest.skip(f"{needed} is not on this machine")
    if name == "linux-aarch64" and not ARM_LIBRARIES.is_dir():
        pytest.skip("the libraries of 64-bit ARM are not on this machine")
    scenario = load_scenario("torque-task-proportional", SHORT)
    ((file, content),) = functional_unit(closed_loop(scenario), fmi, [name]).items()
    (tmp_path / file).write_bytes(content)
    with zipfile.ZipFile(tmp_path / file) as archive:
        archive.extractall(tmp_path)
    description = Xml.parse(tmp_path / "modelDescription.xml").getroot()
    token = description.get("guid") or description.get("instantiationToken") or ""
    numbers = {item.get("name"): item.get("valueReference") or "" for item in description.iter() if item.get("name")}
    (library,) = (tmp_path / "binaries").rglob("torque_task_proportional.*")
    driver = tmp_path / "drive.exe"
    further = [f"-DFMI={fmi}", "-I", str(tmp_path / "sources"), str(DRIVER), "-o", str(driver)]
    loader = [] if name == "win64" else ["-ldl"]
    subprocess.run([*compiler_for(name), *further, *loader], check=True)
    given = [token, "300", "0.001", numbers["torque"], numbers["pressure_1"]]
    environment = {**os.environ, "WINEDEBUG": "-all"}
    done = subprocess.run(
        [*runner, str(driver), str(library), *given], capture_output=True, text=True, check=True, env=environment
    )
    found = np.array([line.split() for line in done.stdout.splitlines()], dtype=np.float64)
    recording = simulate(scenario).recording
    assert len(found) == len(recording) == 301
    assert np.array_equal(found, np.stack([recording["torque"], recording["pressure_1"]], axis=1))


def test_a_unit_for_linux_asks_for_no_newer_c_library_than_that_of_2012(tmp_path: Path) -> None:
    pytest.importorskip("ziglang", reason="needs the extra 'native'")
    if shutil.which("objdump") is None:
        pytest.skip("objdump is not on this machine")
    ((_, content),) = functional_unit(closed_loop(load_scenario("step-response")), 2, ["linux64"]).items()
    (tmp_path / "unit.fmu").write_bytes(content)
    with zipfile.ZipFile(tmp_path / "unit.fmu") as archive:
        member = archive.extract("binaries/linux64/step_response.so", tmp_path)
    said = subprocess.run(["objdump", "-T", member], capture_output=True, text=True, check=True).stdout
    versions = {word.strip("()").removeprefix("GLIBC_") for word in said.split() if "GLIBC_" in word}
    assert versions
    assert max(tuple(map(int, version.split("."))) for version in versions) <= (2, 17)
