"""Damaged files of every format that comes with the package end in one clear line or in something that can be used."""

import json
from collections.abc import Callable
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ppafo.analyses.design.problem import load_design
from ppafo.analyses.tuning import load_tuning
from ppafo.errors import PpafoError
from ppafo.gait import Gait
from ppafo.gait.document import load_gait
from ppafo.parameters import build_device, load_parameter_set
from ppafo.parameters.audit import findings_of
from ppafo.parameters.bottles.bottle import load_bottle
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.rig.preset import load_preset
from ppafo.studies.loading import load_study
from ppafo.walking.loading import load_walk
from tests.property.damage import CHANGES, Change, damaged

PACKAGE = resources.files("ppafo")


def use_set(parameter_set: ParameterSet) -> None:
    """What every later step does with a set: its audit has a document, its valves have devices."""
    json.dumps([finding.document() for finding in findings_of(parameter_set)], allow_nan=False)
    for valve in parameter_set.valve_kinds:
        build_device(parameter_set, valve)


def use_gait(gait: Gait) -> None:
    """No curve of a gait has a value that is no number."""
    assert all(curve.value(0.3) == curve.value(0.3) for curve in gait.curves.values())


class Format(NamedTuple):
    """How a format is read, the shipped files of it, and what is done with what was read."""

    load: Callable[[str], Any]
    folder: Traversable
    use: Callable[[Any], None] = repr


FORMATS = {
    "parameters": Format(load_parameter_set, PACKAGE / "parameters" / "sets", use_set),
    "study": Format(load_study, PACKAGE / "studies" / "library"),
    "tuning": Format(load_tuning, PACKAGE / "analyses" / "tunings"),
    "design": Format(load_design, PACKAGE / "analyses" / "design" / "library"),
    "walk": Format(load_walk, PACKAGE / "walking" / "configurations"),
    "bottle": Format(load_bottle, PACKAGE / "parameters" / "bottles" / "files"),
    "rig": Format(load_preset, PACKAGE / "rig" / "presets"),
    "gait": Format(load_gait, PACKAGE / "gait" / "normative", use_gait),
}


@pytest.mark.parametrize("name", FORMATS)
def test_damaged_file_is_refused_in_one_line_or_can_be_used(name: str, tmp_path: Path) -> None:
    load, folder, use = FORMATS[name]
    originals = [item.read_text(encoding="utf-8") for item in folder.iterdir() if item.name.endswith(".toml")]
    path = tmp_path / "damaged.toml"

    @settings(max_examples=60 if name == "parameters" else 20, suppress_health_check=list(HealthCheck))
    @given(text=st.sampled_from(originals), changes=CHANGES)
    def check(text: str, changes: list[Change]) -> None:
        path.write_bytes(damaged(text, changes))
        try:
            use(load(str(path)))
        except PpafoError as error:
            assert len(str(error).splitlines()) == 1
            assert len(str(error)) < 8_000

    check()


@pytest.mark.parametrize("name", FORMATS)
def test_any_bytes_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    path = tmp_path / "bytes.toml"

    @settings(max_examples=10, suppress_health_check=list(HealthCheck))
    @given(content=st.binary(max_size=200))
    def check(content: bytes) -> None:
        path.write_bytes(content)
        with pytest.raises(PpafoError) as refused:
            FORMATS[name].load(str(path))
        assert len(str(refused.value).splitlines()) == 1

    check()
