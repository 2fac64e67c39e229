"""The answer of the reproduction: every claim with its verdict, figures, recordings, and the one bespoke page."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.typesetting import format_printed_quantity, quantity
from ppafo.identification.bench_figures import synthetic_figure_3
from ppafo.questions.reproduce.claim import count_sentence, verdict_counts
from ppafo.questions.reproduce.page import holding_torque, reproduction_page
from ppafo.questions.reproduce.solve import Reproduction
from ppafo.questions.reproduce.step_response import Levels
from ppafo.questions.reproduce.step_response_figure import step_response_figure
from ppafo.questions.reproduce.synthetic import NoEvidence
from ppafo.questions.reproduce.torque_task_figure import torque_task_figure
from ppafo.questions.unreported.figure import unreported_figure
from ppafo.storage.comma_separated import marked_csv_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
UNSAID_FIGURE = "unreported-settings"
_HEAD = ("claim", "paper", "ours", "verdict")


def answer_of(reproduction: Reproduction) -> Answer:
    """Return the answer; it has not passed where a number misses its window, unless values were changed.

    Without the virtual rig there is no figure 3, with changed values no figure of what the paper leaves unsaid.
    """
    rows = tuple(
        (
            claim.id,
            format_printed_quantity(claim.paper, claim.unit),
            None if claim.value is None else quantity(claim.value, claim.unit),
            claim.verdict_words,
        )
        for claim in reproduction.claims
    )
    table = Table(tuple(map(Column, _HEAD)), rows, left=len(_HEAD))
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    return Answer(
        name="claims",
        kicker="Reproduction",
        title="The paper's claims",
        lead=_override_remarks(reproduction.overrides),
        sections=(
            Section(table=table, remarks=("", count_sentence(reproduction.claims), *_missed_claims(reproduction))),
            *(Section(figure=figure, is_detail=True) for figure in _figures(reproduction)),
        ),
        data={
            "counts": verdict_counts(reproduction.claims),
            "claims": [claim.document() for claim in reproduction.claims],
            "overrides": list(reproduction.overrides),
            "versions": dict(reproduction.step.versions),
        },
        passed=not reproduction.missed or bool(reproduction.overrides),
        files={f"{run.scenario.name}.csv": partial(marked_csv_bytes, run.recording) for run in runs},
        command="reproduce",
        page=lambda drawn: _page(reproduction, drawn),
    )


def _page(reproduction: Reproduction, drawn: Mapping[str, bytes]) -> bytes:
    identification, unsaid = drawn.get(IDENTIFICATION_FIGURE), drawn.get(UNSAID_FIGURE)
    return reproduction_page(reproduction, drawn[STEP_FIGURE], drawn[TORQUE_FIGURE], identification, unsaid).encode()


def _override_remarks(overrides: tuple[str, ...]) -> tuple[str, ...]:
    """Return whose device the verdicts are about, where something was changed."""
    if not overrides:
        return ()
    words = f"not the paper's device: values changed with --set {', '.join(overrides)}"
    return (f"{words}; the verdicts compare it with the paper all the same",)


def _missed_claims(reproduction: Reproduction) -> list[str]:
    return [
        f"missed: {claim.id} is outside {claim.window[0]:g} to {claim.window[1]:g} {claim.unit}"
        for claim in reproduction.missed
        if claim.window is not None
    ]


def _figures(reproduction: Reproduction) -> list[Figure]:
    figures = [
        Figure(STEP_FIGURE, "", partial(_step_figure, reproduction)),
        Figure(TORQUE_FIGURE, "", partial(_torque_figure, reproduction)),
    ]
    evidence, family = reproduction.synthetic, reproduction.family
    if not isinstance(evidence, NoEvidence):
        bench = evidence.bench
        figures.append(Figure(IDENTIFICATION_FIGURE, "", partial(synthetic_figure_3, bench.torque, bench.decay)))
    if family is not None:
        figures.append(Figure(UNSAID_FIGURE, "", partial(unreported_figure, family)))
    return figures


def _step_figure(reproduction: Reproduction) -> "Drawing":
    supply = reproduction.step.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    evidence = reproduction.synthetic
    measured = None if isinstance(evidence, NoEvidence) else evidence.step.measured
    return step_response_figure(reproduction.step.recording, levels, reproduction.step_events, measured)


def _torque_figure(reproduction: Reproduction) -> "Drawing":
    stated = {claim.id: claim.paper for claim in reproduction.claims}
    evidence = reproduction.synthetic
    return torque_task_figure(
        reproduction.solenoid.recording,
        reproduction.proportional.recording,
        holding_torque(reproduction.solenoid),
        (stated["co2_solenoid"], stated["co2_proportional"]),
        None if isinstance(evidence, NoEvidence) else (evidence.solenoid, evidence.proportional),
    )
