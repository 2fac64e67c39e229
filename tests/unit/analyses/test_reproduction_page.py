"""The claims as a table, figures 7 and 8, and the page around them."""

import dataclasses
import html
import re

import pytest

from ppafo.analyses.reproduce.paper import Reproduction, holding_torque
from ppafo.analyses.reproduce.report import (
    IDENTIFICATION_FIGURE,
    STEP_FIGURE,
    TORQUE_FIGURE,
    finding_of,
    reproduction_page,
)
from ppafo.report.writing import typeset
from tests.unit.report.test_width_of_figures import texts_of

DRAWN = {IDENTIFICATION_FIGURE: b"<svg/>", STEP_FIGURE: b"<svg>seven</svg>", TORQUE_FIGURE: b"<svg>eight</svg>"}


@pytest.fixture(scope="module")
def page(reproduction: Reproduction) -> str:
    return reproduction_page(reproduction, DRAWN).decode()


def words(page: str) -> str:
    """The text of a page without its tags, on one line."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page)).split())


def test_figure_7_has_the_four_panels_of_the_paper_in_its_units(reproduction: Reproduction) -> None:
    figure = finding_of(dataclasses.replace(reproduction, synthetic="")).plot(STEP_FIGURE)
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


def test_figure_8_shows_torque_and_reference_of_both_valves_on_one_scale(reproduction: Reproduction) -> None:
    solenoid, proportional = reproduction.solenoid.recording, reproduction.proportional.recording
    figure = finding_of(reproduction).plot(TORQUE_FIGURE)
    top, bottom = figure.axes[0], figure.axes[2]
    assert top.get_ylim() == bottom.get_ylim()
    for axes, recording in ((top, solenoid), (bottom, proportional)):
        drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
        assert list(drawn["simulated"]) == list(recording["torque"])
        assert list(drawn["reference"]) == list(recording["reference"])


def test_figure_8_states_where_the_gas_is_in_numbers_that_add_up(reproduction: Reproduction) -> None:
    recordings = reproduction.solenoid.recording, reproduction.proportional.recording
    figure = finding_of(reproduction).plot(TORQUE_FIGURE, "84 mm")
    stated = [text.get_text() for text in figure.axes[-1].texts]
    for text, recording in zip(stated, recordings, strict=True):
        inside, vented = map(float, text.removesuffix(" g").split("+"))
        assert inside + vented == pytest.approx(1e3 * recording["supplied_mass"][-1], abs=0.011)
    legends = [legend for axes in figure.axes if (legend := axes.get_legend()) is not None]
    named = {text for legend in legends for text in legend.get_texts()} | set(figure.axes[-1].texts)
    assert max(text.get_window_extent().x1 for text in texts_of(figure) if text in named) <= figure.bbox.x1


def test_the_supply_holds_its_pressure_times_the_torque_constant(reproduction: Reproduction) -> None:
    assert holding_torque(reproduction.solenoid) == pytest.approx(5.0, abs=0.01)


def test_the_page_states_every_claim_with_both_numbers_and_the_verdict(reproduction: Reproduction, page: str) -> None:
    text = words(page)
    for claim in reproduction.claims:
        assert words(typeset(claim.entry.statement)) in text
        assert words(typeset(claim.note)) in text
    assert "No experimental result is confirmed independently of fitted settings." in text
    assert "the dissertations of K. A. Shorter (2011) and Y. Li (2013)" in text


def test_the_page_holds_its_three_figures_and_fetches_nothing(page: str) -> None:
    assert page.count("data:image/svg+xml;base64,") == 4
    assert "http" not in page
    assert "<script" not in page
    assert re.findall(r'(?:src|href)="(?!data:|#)', page) == []
