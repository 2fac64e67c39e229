"""``ppafo reproduce`` from beginning to end."""

import contextlib
import dataclasses
import io
import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from ppafo.analyses.reproduce import paper
from ppafo.analyses.reproduce.claims import VERDICTS
from ppafo.analyses.reproduce.paper import Reproduction
from ppafo.cli.main import main
from ppafo.progress import Report
from ppafo.storage import read_csv

# Spelled out once more on purpose: other programs read these identifiers and this order.
IDS = [
    "orifice_constants",
    "step_percentages",
    "damping_and_friction",
    "discharge_coefficient",
    "swept_volume",
    "figure_7_words",
    "torque_rms_improvement",
    "co2_solenoid",
    "co2_proportional",
    "co2_saving",
    "oscillation_words",
    "limited_by_switching",
    "gains_minimise_error",
    "dead_zone_amplifies_delay",
    "beyond_improved_control",
    "not_published",
]
FIGURES = ("figure-3-identification", "figure-7-step-response", "figure-8-torque-task")
RECORDINGS = ("step-response", "torque-task-solenoid", "torque-task-proportional")


@dataclasses.dataclass
class FinishedRun:
    """One run: its folder, and what it printed."""

    folder: Path
    said: str
    progress: str


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    """A run that the tests below only read."""
    folder = tmp_path_factory.mktemp("reproduce") / "out"
    said = io.StringIO()
    progress = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(progress):
        assert main(["reproduce", "--out", str(folder)]) == 0
    return FinishedRun(folder, said.getvalue(), progress.getvalue())


@pytest.fixture
def out(ran: FinishedRun) -> Path:
    """The folder of that run."""
    return ran.folder


def test_the_folder_holds_report_claims_figures_and_recordings_and_nothing_else(out: Path) -> None:
    expected = {"report.html", "claims.json", "device.svg", *(f"{name}.csv" for name in RECORDINGS)}
    expected |= {f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")}
    assert {entry.name for entry in out.iterdir()} == expected | {"ppafo.json", "claims.txt"}


def test_the_claims_file_has_every_claim_in_the_agreed_form(out: Path) -> None:
    claims = json.loads((out / "claims.json").read_text(encoding="utf-8"))["claims"]
    assert [claim["id"] for claim in claims] == IDS
    for claim in claims:
        assert {"statement", "paper", "value", "unit", "verdict", "assumptions", "source"} <= set(claim)
        assert claim["verdict"] in VERDICTS
        assert claim["source"]
        assert claim["statement"]


def test_the_recordings_can_be_read_again(out: Path) -> None:
    for name in RECORDINGS:
        recording = read_csv(out / f"{name}.csv")
        assert len(recording) > 100
        assert {"angle", "pressure_1", "pressure_2", "torque", "supplied_mass"} <= set(recording.names)


def test_a_missed_window_is_named_and_fails_unless_values_were_changed(
    reproduction: Reproduction, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # As if the solenoid valves took three times the gas.
    claims = tuple(
        dataclasses.replace(claim, value=3.3, verdict="undetermined") if claim.entry.id == "co2_solenoid" else claim
        for claim in reproduction.claims
    )

    def missing(overrides: Sequence[str], _report: Report) -> Reproduction:
        return dataclasses.replace(reproduction, claims=claims, overrides=tuple(overrides))

    monkeypatch.setattr(paper, "reproduce_paper", missing)
    assert main(["reproduce"]) == 1
    assert "missed: co2_solenoid is outside 1 to 1.2 g" in capsys.readouterr().out
    changed = ["--set", "valves.solenoid.area=31.6 mm^2"]
    assert main(["reproduce", *changed, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["overrides"] == changed[1:]
