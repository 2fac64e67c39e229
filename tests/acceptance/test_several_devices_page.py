"""What the page on several devices shows is run as it stands there."""

import re
from pathlib import Path

import pytest

from ppafo.cli.main import main

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "several-devices.md").read_text(encoding="utf-8")


@pytest.mark.long
def test_the_ten_valves_of_the_page_come_to_what_it_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (planted,) = re.findall(r"^for cd in (.*); do$", PAGE, re.MULTILINE)
    (recorded,) = re.findall(
        r"^  ppafo (rig record .*) --seed \$n --set \"(.*)=\$cd\" --out valve-\$n$", PAGE, re.MULTILINE
    )
    names = []
    for number, value in enumerate(planted.split(), start=1):
        names.append(f"valve-{number}")
        words = [*recorded[0].split(), "--seed", str(number), "--set", f"{recorded[1]}={value}", "--out", names[-1]]
        assert main(words) == 0
    (problem,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    Path("valve.toml").write_text(problem)
    capsys.readouterr()
    assert "ppafo devices valve-{1..10} --problem valve.toml --out valves" in PAGE
    assert main(["devices", *names, "--problem", "valve.toml", "--out", "valves"]) == 0
    (shown,) = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    assert capsys.readouterr().out == shown
