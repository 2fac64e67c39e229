"""A study with a controller of one's own resumes with that controller alone."""

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.errors import StudyError
from ppafo.studies.study import Study

LAW = """
class Law:
    def __init__(self, gain=0.2):
        self.gain, self.sum = gain, 0.0

    def reset(self):
        self.sum = 0.0

    def update(self, time, reference, measurement):
        self.sum += 0.001 * (reference - measurement.torque)
        return self.gain * (reference - measurement.torque) + 0.5 * self.sum
"""
DOCUMENT = {
    "schema_version": 1,
    "name": "mine",
    "configurations": [
        {
            "name": "own",
            "scenario": "torque-task-proportional",
            "overrides": ["run.duration=0.02 s", "reference.ramp_time=0.01 s"],
        }
    ],
    "sample": {"method": "random", "runs": 2, "seed": 1},
    "vary": [{"path": "supply.pressure", "kind": "uniform", "minimum": "40 psi_g", "maximum": "50 psi_g"}],
    "outputs": {"metrics": ["rms_error"]},
}


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], ModuleType]:
    """A module with a law, always in the same file."""

    def load(text: str) -> ModuleType:
        file = tmp_path / "my_law.py"
        file.write_text(text)
        specification = importlib.util.spec_from_file_location("my_law", file)
        assert specification is not None
        assert specification.loader is not None
        module = importlib.util.module_from_spec(specification)
        monkeypatch.setitem(sys.modules, "my_law", module)
        exec(compile(text, str(file), "exec"), module.__dict__)
        return module

    return load


def controlled_by(law: Any) -> Study:
    study = ppafo.load_study(DOCUMENT)
    (own,) = study.configurations
    return replace(study, configurations=(replace(own, scenario=own.scenario.controlled_by(law)),))


def test_a_study_goes_on_with_the_same_law_and_is_refused_with_any_other(
    written: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    out, law = tmp_path / "out", written(LAW).Law()
    first = ppafo.sweep(controlled_by(law), out=out).found.table()["rms_error"]
    assert law.sum != 0.0
    alone = replace(controlled_by(law), runs_of_chunk=1)
    with ThreadPoolExecutor(2) as pool:
        assert np.array_equal(ppafo.sweep(alone, executor=pool).found.table()["rms_error"], first)
    for note in (out / "finished").iterdir():
        note.unlink()
    for same in (law, written(LAW).Law()):
        assert np.array_equal(ppafo.sweep(controlled_by(same), out=out).found.table()["rms_error"], first)
    with pytest.raises(
        StudyError, match=r"controller\.custom\.settings\.gain was 0\.2 and is now 0\.3; undo the change"
    ):
        ppafo.sweep(controlled_by(written(LAW).Law(0.3)), out=out)
    with pytest.raises(StudyError, match=r"controller\.custom\.source was '.*' and is now '.*'; undo the change"):
        ppafo.sweep(controlled_by(written(LAW.replace("0.5 *", "0.6 *")).Law()), out=out)


COMPOSED = """
from dataclasses import replace
from ppafo.control.controllers.switching import ON_OFF

def update(parameters, state, reference, measurement, period):
    return (1.0 if reference > 0.5 * measurement.torque else -1.0), state

KIND = replace(ON_OFF, update=update)
"""


def test_a_law_that_was_edited_in_its_module_makes_another_study(tmp_path: Path) -> None:
    asked = f"""
from ppafo.study.store import manifest
from ppafo.studies.loading import load_study
document = {DOCUMENT!r}
document["configurations"][0]["overrides"] += ["controller.kind=beside:KIND"]
print(manifest(load_study(document, plugins=["beside.py"]))["programs"])
"""
    told = []
    for text in (COMPOSED, f"# A remark.\n{COMPOSED}", COMPOSED.replace("0.5 *", "0.6 *")):
        (tmp_path / "beside.py").write_text(text)
        command = [sys.executable, "-B", "-c", asked]
        told.append(subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout)
    assert told[0] == told[1] != told[2]
