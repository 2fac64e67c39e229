"""The report of what was judged: its table, what was not run, and going on after an interruption."""

from pathlib import Path

import pytest

from scripts import validation_report
from scripts.validation_report import AGREES, DIFFERS, NOT_RUN, Line, main, report


def line(verdict: str, command: str = "bits.py") -> Line:
    """A line of the table with a verdict."""
    return Line("bits", "golden hashes", "the same", "", verdict, command)


def test_the_report_counts_the_verdicts_and_numbers_the_commands() -> None:
    text = report([("Bits", [line(AGREES), line(DIFFERS), line(NOT_RUN, "make bits"), line("stated")])])
    assert "Of 4 lines 1 agree, 1 differ, 1 not run here." in text
    assert "| bits | golden hashes | the same | - | agrees | 1 |" in text
    assert "| not run | 2 |" in text
    assert "1. `bits.py`\n2. `make bits`\n" in text
    assert "## What was not judged" in text


def test_a_second_call_goes_on_where_the_first_one_was_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    called: list[str] = []

    def first(long: Path) -> list[Line]:
        called.append("first")
        return [line(AGREES)]

    def second(long: Path) -> list[Line]:
        called.append("second")
        if called.count("second") == 1:
            raise KeyboardInterrupt
        return [line(DIFFERS)]

    monkeypatch.setattr(validation_report, "SECTIONS", {"Bits": {"first": first, "second": second}})
    monkeypatch.setattr("sys.argv", ["validation_report.py", "--out", str(tmp_path)])
    with pytest.raises(KeyboardInterrupt):
        main()
    assert main() == 1
    assert called == ["first", "second", "second"]
    assert "1 agree, 1 differ" in (tmp_path / "report.md").read_text()
