"""The cells of the tutorial are run in order, as a notebook would run them, and give what the page says of them."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text(encoding="utf-8")
CELLS = re.findall(r"^```\{code-cell\} ipython3\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Any]:
    """All names after the last cell, the working folder and what the shell printed."""
    if shutil.which("sh") is None:
        pytest.skip("there is no sh")
    found: dict[str, Any] = {"folder": tmp_path_factory.mktemp("tutorial"), "printed": ""}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(found["folder"])
        patch.setenv("PATH", path)
        for cell in CELLS:
            if cell.startswith("%%sh\n"):
                words = ["sh", "-e", "-c", cell.removeprefix("%%sh\n")]
                found["printed"] += subprocess.run(words, check=True, capture_output=True, text=True).stdout
            else:
                exec(cell.removeprefix("%matplotlib inline\n"), found)
    return found


def test_the_valves_differ_as_the_page_says(names: Mapping[str, Any]) -> None:
    import ppafo

    solenoid, proportional = (ppafo.simulate(name).metrics for name in names["names"])
    less = {name: 1.0 - proportional[name].value / solenoid[name].value for name in ("rms_error", "gas_supplied")}
    shown = "proportional valve has 15 % less error and takes 64 % less gas"
    assert shown in PAGE
    assert {name: round(100.0 * value) for name, value in less.items()} == {"rms_error": 15, "gas_supplied": 64}


def test_the_identified_set_is_closer_to_the_recording(names: Mapping[str, Any]) -> None:
    agreement = names["agreement"].found
    assert all(recording.passes for recording in agreement.recordings)  # each within 10 % of full range
    assert not agreement.causes.is_noise
    assert agreement.causes.found or agreement.causes.nearest
    assert "some twenty times as close" in PAGE
    described, identified = names["distances"]
    assert 15.0 < described["torque"] / identified["torque"] < 25.0
    assert 15.0 < described["angle"] / identified["angle"] < 25.0


def test_the_values_of_the_bench_are_found_with_the_verdicts_of_the_page(names: Mapping[str, Any]) -> None:
    verdicts = {item.path: item.verdict for item in names["identified"].found.estimates}
    assert verdicts["actuator.torque_constant"] == "holds for this model only"
    assert verdicts["valves.main.discharge_coefficient"] == "identified"
    assert "actuator.leak.area" not in verdicts


def test_tuning_walk_and_firmware_give_what_the_page_says(names: Mapping[str, Any]) -> None:
    found = names["tuning"].found
    before, after = (setting.result.metrics["rms_error"].value for setting in (found.before, found.after))
    assert "an RMS error of 0.02 N m" in PAGE
    assert before == pytest.approx(0.02, abs=0.005)
    assert "leaves less than a tenth of it" in PAGE
    assert after < 0.1 * before
    assert names["walked"].metrics["lowest_toes"].value > 0.0
    assert "some 7 % of what a healthy ankle gives" in PAGE
    assert round(100.0 * names["walked"].metrics["push_off_share"].value) == 7
    assert (names["folder"] / "firmware" / "controller.c").is_file()
    assert (
        "0 different from the fixed-point controller" in names["printed"] or "there is no mspdebug" in names["printed"]
    )
