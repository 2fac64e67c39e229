"""The gait map and the OpenSim command of the page on walking are read."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.gait.recorded.mapping import GaitMap
from ppafo.parameters.records import record_from

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "walk.md").read_text(encoding="utf-8")


def test_the_gait_map_of_the_page_is_read() -> None:
    (text,) = [
        block for block in re.findall(r"^```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE) if "terms" in block
    ]
    given = record_from(GaitMap, tomllib.loads(text))
    assert given.shank_angle.terms is not None
    assert given.knee is not None
    assert given.knee.thigh_length == "0.42 m"


def test_the_opensim_command_of_the_page_runs_on_the_real_files(
    shared_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = next(line.strip() for line in PAGE.splitlines() if line.startswith("    ppafo gait import"))
    folder = shared_data / "gait" / "opensim_subject01"
    names = {"walk_ik.mot": "subject01_walk1_ik.mot", "walk_grf.mot": "subject01_walk1_grf_15s.mot"}
    monkeypatch.chdir(tmp_path)
    assert main([str(folder / names[word]) if word in names else word for word in shlex.split(command)[1:]]) == 0
    assert "stride time  1.229 s" in capsys.readouterr().out
