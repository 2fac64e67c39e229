"""A study with a controller of one's own resumes with that controller alone."""

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.errors import StudyError
from ppafo.model.sensors import Measurement
from ppafo.studies.study import Study
from ppafo.study.controller_document import controller_document

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


class Table:
    """Settings of every kind, some in slots; it holds itself."""

    __slots__ = ("inner", "itself", "law", "names", "quiet", "values")

    def __init__(self, values: Any, quiet: Any, law: Any) -> None:
        self.values, self.quiet, self.law, self.names, self.itself = values, quiet, law, {"b", "a"}, self
        self.inner = {"limits": (1.0, float("inf")), "key": b"abc"}

    def reset(self) -> None: ...

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        return 0.0


def test_every_setting_counts_wherever_it_lies() -> None:
    found = controller_document(Table(np.arange(3.0), np.True_, abs))["settings"]
    assert found["values"] == [0.0, 1.0, 2.0]
    assert found["quiet"] is True
    assert found["names"] == ["a", "b"]
    assert found["inner"]["limits"] == [1.0, "inf"]
    assert found["itself"]["settings"]["itself"].endswith("Table")
    long = [controller_document(Table(np.full(1000, value), False, abs)) for value in (1.0, 2.0, 1.0)]
    assert long[0] == long[2] != long[1]
    laws = [controller_document(Table([], False, law))["settings"]["law"] for law in (controlled_by, Table)]
    assert laws[0]["type"].endswith("controlled_by")
    assert laws[1]["type"].endswith("Table")


def test_a_law_without_a_file_is_known_by_its_code() -> None:
    sources = []
    for text in (LAW, LAW.replace("0.5 *", "0.6 *"), LAW):
        names: dict[str, Any] = {"__name__": "__main__"}
        exec(text, names)
        names["Law"].__module__ = "nowhere"
        sources.append(controller_document(names["Law"]())["source"])
    assert sources[0] == sources[2] != sources[1]


COMPOSED = """
from dataclasses import replace
from ppafo.control.controllers.switching import ON_OFF

def update(parameters, state, reference, measurement, period):
    return (1.0 if reference > 0.5 * measurement.torque else -1.0), state

KIND = replace(ON_OFF, update=update)
"""


def test_a_law_that_was_edited_in_its_module_makes_another_study(tmp_path: Path) -> None:
    asked = f"""
from ppafo.study.manifest import manifest
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
