"""The page on real recordings shows what its command prints, and the recordings are those that it names."""

import hashlib
import re
import shutil
import sys
from pathlib import Path

import pytest

from ppafo.analyses.identify import identify

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
from scripts import measured_cylinder as measured  # noqa: E402

PAGE = (ROOT / "docs" / "measured.md").read_text(encoding="utf-8")
KNOWN_AREA = 5.1875e-4


@pytest.fixture(scope="module")
def seals() -> dict[str, measured.Seal]:
    return {seal.name: seal for seal in measured.seals_in(measured.EXAMPLE)}


def test_the_page_shows_what_the_command_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["measured_cylinder.py", "--out", str(tmp_path)])
    assert measured.main() == 0
    printed = capsys.readouterr().out
    for shown in re.findall(r"^```text\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE):
        assert shown.strip() in printed
    assert {file.name for file in tmp_path.iterdir()} == {"measured.txt", "friction.png", "leak.png"}


def test_the_known_area_is_found(seals: dict[str, measured.Seal]) -> None:
    assert seals["O-ring257"].area == pytest.approx(KNOWN_AREA, rel=0.0025)


def test_page_and_identify_give_one_answer_on_friction_over_pressure(
    seals: dict[str, measured.Seal], tmp_path: Path
) -> None:
    assert {name: seal.verdict.startswith("identify: a straight line") for name, seal in seals.items()} == {
        "KDN": True, "NAPN": False, "O-ring257": True, "PK": False,
    }  # fmt: skip
    assert "downwards" in seals["NAPN"].verdict
    assert "upwards" in seals["PK"].verdict
    text = (measured.EXAMPLE / "cylinder.toml").read_text(encoding="utf-8")
    for name, seal in seals.items():
        for file in measured.EXAMPLE.glob(f"{name}_*.csv"):
            shutil.copy(file, tmp_path)
        (tmp_path / "problem.toml").write_text(text.replace('"O-ring257_', f'"{name}_'), encoding="utf-8")
        result = identify(tmp_path / "problem.toml").found.results[0]
        assert {one.is_identified for one in result.estimates} == {seal.is_line}, name
        # Where a line holds, each pressure is in the band that the others predict.
        assert seal.is_line == all(one.is_predicted for one in seal.left_out), name


def test_the_recordings_are_those_of_the_source_file() -> None:
    stated = re.findall(r"^([0-9a-f]{64})  (\S+)$", (measured.EXAMPLE / "SOURCE.txt").read_text(), re.MULTILINE)
    assert len(stated) == 18
    for digest, name in stated:
        assert hashlib.sha256((measured.EXAMPLE / name).read_bytes()).hexdigest() == digest, name
    assert sum(file.stat().st_size for file in measured.EXAMPLE.iterdir()) < 2_000_000
