"""The answer of the reproduction: every claim with its verdict, figures, recordings, and the one bespoke page."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.typesetting import format_printed_quantity, quantity
from ppafo.identification.bench.result import synthetic_figure_3
from ppafo.questions.reproduce.claim import VERDICTS, Verdict, count_sentence, count_words, verdict_counts
from ppafo.questions.reproduce.page import holding_torque, reproduction_page
from ppafo.questions.reproduce.solve import Reproduction, Studies
from ppafo.questions.reproduce.step_response import Levels
from ppafo.questions.reproduce.step_response_figure import step_response_figure
from ppafo.questions.reproduce.studies import ALL, SEED, Study
from ppafo.questions.reproduce.synthetic import NoEvidence
from ppafo.questions.reproduce.torque_task_figure import torque_task_figure
from ppafo.questions.unreported.figure import unreported_figure
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
UNSAID_FIGURE = "unreported-settings"
_HEAD = ("claim", "paper", "ours", "verdict")
_PAPER = "'ppafo reproduce' without --study makes the page of these claims, with sources, figures and assumptions."
_STUDIES_HEAD = ("study", "claim", "published", "ours", "verdict")
_RULE = (
    "'Ours' is computed anew whenever this is run. 'Reproduced' follows from printed numbers alone; 'with assumptions' "
    "rests on values and experiments that the publication does not print; 'contradicted' lies outside what is listed "
    "as agreeing; 'not testable' has no number of ours, for the reason in its note. Nothing here was measured."
)


def answer_of(solved: Reproduction | Studies) -> Answer:
    """Return the answer of the paper's experiments, or of other publications."""
    return _studies_answer(solved) if isinstance(solved, Studies) else _paper_answer(solved)


def _studies_answer(solved: Studies) -> Answer:
    """Return the table of studies; a contradicted claim of another publication is a result, no failure."""
    rows, claims, verdicts = _paper_part(solved.reproduction)
    for study in solved.studies:
        name = study.publication.name
        rows += [
            (name, item.claim.entry.id, item.published, item.ours, VERDICTS[item.verdict]) for item in study.claims
        ]
        claims += [item.document(name) for item in study.claims]
        verdicts += [item.verdict for item in study.claims]
    table = Table(tuple(map(Column, _STUDIES_HEAD)), tuple(rows), left=len(_STUDIES_HEAD))
    only = solved.studies[0].publication.name
    is_all = solved.reproduction is not None
    return Answer(
        name="claims",
        kicker="Reproduction",
        title="Published studies, run again" if is_all else f"{only}, run again",
        lead=(),
        sections=(
            Section(table=table, remarks=("", count_words(verdicts))),
            Section("How to read it", (_RULE,), is_detail=True),
            *((Section(f"{SEED}: the paper", (_PAPER,), is_detail=True),) if is_all else ()),
            *(_study_section(study) for study in solved.studies),
        ),
        data={
            "study": ALL if is_all else only,
            "counts": {verdict: verdicts.count(verdict) for verdict in VERDICTS},
            "claims": claims,
            "versions": {"ppafo": __version__},
        },
        passed=solved.reproduction is None or not solved.reproduction.missed,
        command="reproduce",
    )


def _paper_part(
    reproduction: Reproduction | None,
) -> tuple[list[tuple[str | None, ...]], list[dict[str, Any]], list[Verdict]]:
    """Return rows, plain data and verdicts of the paper's own claims; none without them."""
    if reproduction is None:
        return [], [], []
    return (
        [(SEED, *row) for row in _paper_rows(reproduction)],
        [{"study": SEED, **claim.document()} for claim in reproduction.claims],
        [claim.verdict for claim in reproduction.claims],
    )


def _study_section(study: Study) -> Section:
    """Return what each claim of a publication says, where it stands, what it rests on, and why its verdict."""
    head = (Column("claim"), Column("statement and source"), Column("agrees"), Column("rests on"), Column("note"))
    rows = tuple(
        (
            item.claim.entry.id,
            f"{item.claim.entry.statement} ({item.claim.source})",
            _agrees(item.claim.entry.at_least, item.claim.entry.at_most, item.claim.entry.unit),
            "; ".join(item.claim.entry.assumed) or None,
            item.note or None,
        )
        for item in study.claims
    )
    heading = f"{study.publication.name}: {study.publication.title}"
    return Section(heading, (study.publication.citation,), table=Table(head, rows, left=len(head)), is_detail=True)


def _agrees(low: float | None, high: float | None, unit: str) -> str | None:
    """Return the range that agrees with a claim, in words."""
    if low is not None and high is not None:
        return f"{low:g} to {high:g} {unit}".rstrip()
    if low is None and high is None:
        return None
    return f"at least {low:g} {unit}".rstrip() if high is None else f"at most {high:g} {unit}".rstrip()


def _paper_rows(reproduction: Reproduction) -> tuple[tuple[str, str, str | None, str], ...]:
    return tuple(
        (
            claim.id,
            format_printed_quantity(claim.paper, claim.unit),
            None if claim.value is None else quantity(claim.value, claim.unit),
            claim.verdict_words,
        )
        for claim in reproduction.claims
    )


def _paper_answer(reproduction: Reproduction) -> Answer:
    """Return the answer; it has not passed where a number misses its window, unless values were changed.

    Without the virtual rig there is no figure 3, with changed values no figure of what the paper leaves unsaid.
    """
    table = Table(tuple(map(Column, _HEAD)), _paper_rows(reproduction), left=len(_HEAD))
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
