"""The plant alone in C: driven step by step from outside it moves as in Python, and people can read it."""

import ctypes
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ppafo.exports.c_library.plant import plant_library
from ppafo.exports.fmu.platforms import FLAGS
from ppafo.simulation.loading import load_scenario

LED = "torque-task-proportional", ()
"""A locked ankle, which inputs lead."""
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-fsanitize=address,undefined", "-static-libasan")


def built(folder: Path, name: str, overrides: tuple[str, ...]) -> tuple[ctypes.CDLL, str, list[str]]:
    """A plant as a shared library, its name in C, and its outputs."""
    own = f"{name.replace('-', '_')}_plant"
    for file, content in plant_library(load_scenario(name, overrides)).items():
        (folder / file).write_bytes(content)
    line = ["cc", *FLAGS, "-shared", "-fPIC", f"{own}.c", "-o", "plant.so", "-lm"]
    subprocess.run(line, cwd=folder, check=True)
    header = (folder / f"{own}.h").read_text(encoding="utf-8")
    outputs = re.search(r"/\* The plant at one time. \*/\ntypedef struct \{\n(.*?)\}", header, re.DOTALL)
    assert outputs is not None
    return ctypes.CDLL(str(folder / "plant.so")), own, re.findall(r"double (\w+);", outputs[1])


class Run:
    """A run of a plant in C."""

    def __init__(self, folder: Path, scenario: tuple[str, tuple[str, ...]], inputs: int) -> None:
        self.library, self.own, self.outputs = built(folder, *scenario)
        self.numbers = (ctypes.c_double * len(self.outputs))()
        settings = (ctypes.c_double * 200)()
        self.call("defaults")(settings)
        size = self.call("size")
        size.restype, size.argtypes = ctypes.c_size_t, [ctypes.c_void_p]
        self.memory = (ctypes.c_double * (size(settings) // 8 + 1))()
        self.given = [ctypes.c_double] * inputs
        self.call("initialise").argtypes = [ctypes.c_void_p, ctypes.c_void_p, *self.given]
        self.call("step").argtypes = [ctypes.c_void_p, *self.given]
        self.settings = settings

    def call(self, name: str) -> ctypes._CFuncPtr:
        """One of its functions."""
        return getattr(self.library, f"{self.own}_{name}")

    def seen(self) -> dict[str, float]:
        """Its outputs now."""
        self.call("read_outputs")(self.memory, self.numbers)
        return dict(zip(self.outputs, self.numbers, strict=True))


def test_an_input_that_is_no_number_leaves_the_run_as_it_was(tmp_path: Path) -> None:
    run = Run(tmp_path, LED, 3)
    assert run.call("initialise")(run.memory, run.settings, 0.5, 1.5, 0.0) == 0
    before = bytes(run.memory)
    assert run.call("step")(run.memory, float("nan"), 1.5, 0.0) == 1
    assert bytes(run.memory) == before
    assert run.call("step")(run.memory, 0.5, 1.5, 0.0) == 0
    assert bytes(run.memory) != before


@pytest.mark.parametrize(("angle", "rate"), [(-3.43, 0.0), (90.0, 0.0), (-2.2, 0.0), (4.7, 1.0e3), (1.5, float("inf"))])
def test_an_angle_at_which_a_chamber_has_no_volume_is_refused(angle: float, rate: float, tmp_path: Path) -> None:
    run = Run(tmp_path, LED, 3)
    assert run.call("initialise")(run.memory, run.settings, 0.5, angle, rate) == 1
    assert run.call("initialise")(run.memory, run.settings, 0.5, 1.5, 0.0) == 0
    before = bytes(run.memory)
    assert run.call("step")(run.memory, 0.5, angle, rate) == 1
    assert bytes(run.memory) == before


def test_knots_out_of_order_are_refused_by_name(tmp_path: Path) -> None:
    knots = ("period=0.2 s", "value_01=0 deg", "time_02=20 ms", "value_02=3 deg", "time_03=0.1 s", "value_03=1 deg")
    path = ("motion.kind=prescribed", "motion.profile.kind=tabulated", "motion.profile.level=80 deg")
    texts = (*path, *(f"motion.profile.{knot}" for knot in knots))
    run = Run(tmp_path, ("torque-task-proportional", texts), 1)
    header = (tmp_path / f"{run.own}.h").read_text(encoding="utf-8")
    place = re.findall(r"^    double (\w+);", header, re.MULTILINE).index("motion_profile_time_03")
    bad = run.call("bad_setting")
    bad.restype = ctypes.c_char_p
    assert bad(run.settings) is None
    run.settings[place] = 0.01
    assert bad(run.settings) == b"motion_profile_time_03"


@pytest.mark.parametrize("name", ["cylinder-servo", "pressure-loop"])
def test_the_plant_of_a_loop_whose_gains_follow_other_numbers_has_neither_gains_nor_reference(name: str) -> None:
    header = next(text for file, text in plant_library(load_scenario(name)).items() if file.endswith(".h")).decode()
    assert "actuator_" in header
    assert not re.search(r"double (controller_\w*(gain|stiffness)|reference_\w+);", header)


@pytest.mark.long
@pytest.mark.parametrize(
    "module", ["ppafo.exports.c_library import c_library", "ppafo.exports.c_library.plant import plant_library"]
)
def test_the_c_of_a_run_is_the_same_in_every_process(module: str) -> None:
    code = (
        f"import hashlib\nfrom {module} as made\nfrom ppafo.simulation.loading import load_scenario\n"
        "files = made(load_scenario('step-response'))\n"
        "print(hashlib.sha256(b''.join(files[name] for name in sorted(files))).hexdigest())"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(found) == 1


@pytest.mark.parametrize("name", ["torque-task-proportional", "proportional"])
def test_the_plant_in_c_has_no_warning_and_its_example_no_fault(name: str, tmp_path: Path) -> None:
    from ppafo.loading import load_scenario as any_scenario

    for file, content in plant_library(any_scenario(name)).items():
        (tmp_path / file).write_bytes(content)
    own = f"{name.replace('-', '_')}_plant"
    line = ["gcc", "-std=c99", "-O1", "-ffp-contract=off", *STRICT, f"{own}.c", "main.c", "-o", "example", "-lm"]
    subprocess.run(line, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "example"], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) > 100
    torque = lines[0].split(",").index("torque")
    assert float(lines[-1].split(",")[torque]) > 1.0
