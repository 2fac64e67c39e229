"""The claims as a table, figures 7 and 8, and the page around them."""

import dataclasses
import html
import re

import pytest

from ppafo.analyses.reproduce.answer import finding_of
from ppafo.analyses.reproduce.bench import SyntheticEvidence
from ppafo.analyses.reproduce.figures import step_response_figure, torque_task_figure
from ppafo.analyses.reproduce.page import (
    DEVICE_FIGURE,
    IDENTIFICATION_FIGURE,
    STEP_FIGURE,
    TORQUE_FIGURE,
    reproduction_page,
)
from ppafo.analyses.reproduce.result import Reproduction, holding_torque, result_on_u
from ppafo.analyses.reproduce.step_response import SupplyLevels
from ppafo.identification.bench.result import figure_3
from ppafo.page.html import bundled, digest
from ppafo.report.finding import text_of
from ppafo.report.style import drawn_at
from ppafo.report.writing import typeset
from tests.unit.report.test_width_of_figures import texts_of

LEVELS = SupplyLevels(480536.0, 101325.0)


DRAWN = {DEVICE_FIGURE: b"<svg>device</svg>", STEP_FIGURE: b"<svg>seven</svg>", TORQUE_FIGURE: b"<svg>eight</svg>"}


@pytest.fixture(scope="module")
def page(reproduction: Reproduction) -> str:
    return reproduction_page(reproduction, DRAWN).decode()


def words(page: str) -> str:
    """The text of a page without its tags, on one line."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page)).split())


def test_the_table_begins_with_what_it_does_not_show_and_ends_with_what_u_decides(reproduction: Reproduction) -> None:
    first, *lines = text_of(finding_of(reproduction)).splitlines()
    assert first == "No experimental result is confirmed independently of fitted settings."
    assert any(line.startswith("16 claims: ") for line in lines)
    assert lines[-1] == (
        "15 % less error needs U as the opening and a reference above the torque ceiling; less gas needs neither."
    )


def test_the_sentence_on_u_is_said_only_where_the_readings_come_to_it(reproduction: Reproduction) -> None:
    rows = reproduction.readings_of_u
    assert result_on_u(rows)
    for changed in ({"error": 2.0}, {"gas": 10.0}, {"error_within_reach": 15.0}):
        assert result_on_u((dataclasses.replace(rows[0], **changed), *rows[1:])) == ()


def test_figure_7_has_the_four_panels_of_the_paper_in_its_units(reproduction: Reproduction) -> None:
    figure = step_response_figure(reproduction.step.recording, LEVELS, reproduction.step_events)
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "Angle (deg)",
        "Difference (psi)",
        "Pressure (psig)",
        "Pressure (psig)",
    ]
    angle, difference, pressure_1, pressure_2 = (axes.lines[0].get_ydata() for axes in figure.axes)
    assert (angle[0], angle[-1]) == pytest.approx((20.0, 130.0), abs=0.1)
    assert pressure_1[-1] - pressure_2[-1] == pytest.approx(difference[-1])
    assert pressure_2[-1] == pytest.approx(0.0, abs=0.1)


def test_figure_7_marks_breakaway_and_stop_in_every_panel(reproduction: Reproduction) -> None:
    marked = step_response_figure(reproduction.step.recording, LEVELS, reproduction.step_events)
    plain = step_response_figure(reproduction.step.recording, LEVELS, None)
    assert [len(axes.lines) for axes in marked.axes] == [3] * 4
    assert [len(axes.lines) for axes in plain.axes] == [1] * 4


def test_figure_8_shows_torque_and_reference_of_both_valves_on_one_scale(reproduction: Reproduction) -> None:
    solenoid, proportional = reproduction.solenoid.recording, reproduction.proportional.recording
    figure = torque_task_figure(solenoid, proportional, 5.0, (1.1, 0.4))
    top, bottom = figure.axes[0], figure.axes[2]
    assert top.get_ylim() == bottom.get_ylim()
    for axes, recording in ((top, solenoid), (bottom, proportional)):
        drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
        assert list(drawn["simulated"]) == list(recording["torque"])
        assert list(drawn["reference"]) == list(recording["reference"])


def test_figure_8_states_where_the_gas_is_in_numbers_that_add_up(reproduction: Reproduction) -> None:
    recordings = reproduction.solenoid.recording, reproduction.proportional.recording
    with drawn_at("84 mm"):
        figure = torque_task_figure(*recordings, 5.0, (1.1, 0.4), recordings)
    stated = [text.get_text() for text in figure.axes[-1].texts]
    for text, recording in zip(stated, recordings, strict=True):
        inside, vented = map(float, text.removesuffix(" g").split("+"))
        assert inside + vented == pytest.approx(1e3 * recording["supplied_mass"][-1], abs=0.011)
    legends = [legend for axes in figure.axes if (legend := axes.get_legend()) is not None]
    named = {text for legend in legends for text in legend.get_texts()} | set(figure.axes[-1].texts)
    assert max(text.get_window_extent().x1 for text in texts_of(figure) if text in named) <= figure.bbox.x1


def test_figure_8_shows_when_each_solenoid_valve_is_on(reproduction: Reproduction) -> None:
    solenoid = reproduction.solenoid.recording
    figure = torque_task_figure(solenoid, reproduction.proportional.recording, 5.0, (1.1, 0.4))
    spans = [
        sum(path.get_extents().width for path in collection.get_paths()) for collection in figure.axes[1].collections
    ]
    assert len(spans) == 2
    assert sum(spans) == pytest.approx(solenoid.duration)


def test_the_supply_holds_its_pressure_times_the_torque_constant(reproduction: Reproduction) -> None:
    assert holding_torque(reproduction.solenoid) == pytest.approx(5.0, abs=0.01)


def test_the_page_states_every_claim_with_both_numbers_and_the_verdict(reproduction: Reproduction, page: str) -> None:
    text = words(page)
    for claim in reproduction.claims:
        assert words(typeset(claim.statement)) in text
        assert words(typeset(claim.note)) in text
    assert "No experimental result is confirmed independently of fitted settings." in text
    assert "the dissertations of K. A. Shorter (2011) and Y. Li (2013)" in text


def test_the_page_holds_its_three_figures_and_fetches_nothing(page: str) -> None:
    assert page.count("data:image/svg+xml;base64,") == 3
    outside = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL).replace("http-equiv", "")
    assert "http" not in outside
    assert re.findall(r'(?:src|href)="(?!data:|#)', page) == []


def test_the_only_script_of_the_page_is_the_one_that_its_policy_names(page: str) -> None:
    assert page.count("<script>") == 1
    assert digest(bundled("loader.js")) in page.split("</head>", maxsplit=1)[0]
    assert 'id="workbench"' in page


def test_the_page_tells_every_observation_assumption_and_finding(reproduction: Reproduction, page: str) -> None:
    text = words(page)
    for observation in (*reproduction.step_observations, *reproduction.torque_observations):
        assert words(typeset(observation.statement)) in text
        assert words(typeset(observation.evidence)) in text
    for value in reproduction.assumed:
        assert value.path in text
        assert words(typeset(value.value)) in text
    for finding in reproduction.printed_findings:
        assert words(typeset(finding.paragraph)) in text.replace(" )", ")").replace("( ", "(").replace(" ,", ",")


def test_a_run_with_overrides_says_so_and_gives_the_command(reproduction: Reproduction, page: str) -> None:
    changed = dataclasses.replace(reproduction, overrides=("reference.level=5 N m",))
    told = words(reproduction_page(changed, DRAWN).decode())
    assert "departs from the paper" in told
    assert "--set 'reference.level=5 N m'" in told
    assert "departs from the paper" not in words(page)


def test_without_the_rig_the_page_says_why_and_shows_nothing_synthetic(reproduction: Reproduction) -> None:
    bare = dataclasses.replace(reproduction, synthetic="the solver is missing")
    told = reproduction_page(bare, DRAWN).decode()
    assert "There are no synthetic measurements in this report: the solver is missing." in words(told)
    assert 'id="identification"' not in told


def test_figure_3_on_the_page_says_that_its_slope_is_not_the_reported_one(reproduction: Reproduction) -> None:
    told = words(reproduction_page(reproduction, {**DRAWN, IDENTIFICATION_FIGURE: b"<svg>three</svg>"}).decode())
    assert re.search(r"Its slope is .3\.\d 1/s where the paper reports .0\.4", told)


def test_figure_3_says_in_each_panel_that_it_is_synthetic(reproduction: Reproduction) -> None:
    evidence = reproduction.synthetic
    assert isinstance(evidence, SyntheticEvidence)
    figure = figure_3(evidence.torque, evidence.decay)
    assert all("synthetic" in axes.get_title(loc="left") for axes in figure.axes)
    figure.canvas.draw()
    for axes in figure.axes:
        # The names stand beside the readings, not on them.
        legend = axes.get_legend()
        assert legend is not None
        assert not legend.get_window_extent().overlaps(axes.get_window_extent())
    rising, falling = figure.axes[0].lines[:2]
    assert (rising.get_marker(), falling.get_marker()) == ("x", "o")


def test_figure_7_names_the_synthetic_measurement_and_shows_below_what_it_differs_by(
    reproduction: Reproduction,
) -> None:
    evidence = reproduction.synthetic
    assert isinstance(evidence, SyntheticEvidence)
    recording = reproduction.step.recording
    figure = step_response_figure(recording, LEVELS, None, evidence.step)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["model", "synthetic measurement"]
    angle, below = figure.axes[0], figure.axes[2]
    model, measured = (line.get_ydata() for line in angle.lines[:2])
    assert below.get_ylabel() == "Error (deg)"
    apart = below.lines[0].get_ydata()
    assert apart[0] == pytest.approx(measured[0] - model[0])
    assert apart[-1] == pytest.approx(measured[-1] - model[-1], abs=1e-6)
