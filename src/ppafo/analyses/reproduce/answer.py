"""Report of the reproduction: tables of claims with verdicts, of one study or of several, and figures."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ppafo.analyses.reproduce.bench import SyntheticEvidence
from ppafo.analyses.reproduce.claim import MEANINGS, VERDICTS, count_sentence
from ppafo.analyses.reproduce.drawing import device_figure
from ppafo.analyses.reproduce.figures import step_response_figure, torque_task_figure
from ppafo.analyses.reproduce.meaning_of_u import WITHIN_REACH
from ppafo.analyses.reproduce.page import (
    DEVICE_FIGURE,
    IDENTIFICATION_FIGURE,
    STEP_FIGURE,
    TORQUE_FIGURE,
    reproduction_page,
)
from ppafo.analyses.reproduce.publication import SEED
from ppafo.analyses.reproduce.result import (
    NOTHING_CONFIRMED,
    Reproduction,
    Studies,
    holding_torque,
    reading_rows,
    result_on_u,
)
from ppafo.analyses.reproduce.step_response import SupplyLevels
from ppafo.identification.bench.result import figure_3
from ppafo.report.finding import Cell, Finding, Section, columns_of
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.wording import override_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

_HEAD = ("claim", "paper", "ours", "verdict")
_PAPER = "'ppafo reproduce' without --study writes the page of these claims, with sources, figures and assumptions."
_STUDIES_HEAD = ("study", "claim", "published", "ours", "verdict")
_DETAILS_HEAD = ("claim", "statement and source", "agrees", "rests on", "note")
_RULE = (
    "'Ours' is recomputed by every run of the command. "
    + " ".join(f"{VERDICTS[verdict].capitalize()}: {meaning}." for verdict, meaning in MEANINGS.items())
    + " Nothing here was measured."
)


def finding_of_studies(solved: Studies) -> Finding[Studies]:
    """Return the table of studies as a finding.

    A claim of another publication that is not met counts as a result, not as a failure.
    """
    reproduction = solved.reproduction
    of_paper = () if reproduction is None else reproduction.claims
    rows: list[Sequence[Cell]] = [
        (SEED, claim.id, claim.published, claim.ours, VERDICTS[claim.verdict]) for claim in of_paper
    ]
    details = [] if reproduction is None else [Section(f"{SEED}: the paper", said=(_PAPER,), is_detail=True)]
    for publication, claims in solved.studies:
        stated_claims: list[Sequence[Cell]] = []
        for claim in claims:
            entry = claim.claim.entry
            # A number that only own arithmetic on published ones gives.
            published = claim.published or (f"{entry.own} (own sum)" if entry.own else None)
            rows.append((publication.name, entry.id, published, claim.ours, VERDICTS[claim.verdict]))
            stated = f"{entry.statement} ({claim.claim.source})"
            agrees = _agrees(entry.at_least, entry.at_most, entry.unit)
            stated_claims.append((entry.id, stated, agrees, "; ".join(entry.assumed) or None, claim.note or None))
        heading, sentences = f"{publication.name}: {publication.title}", (publication.citation,)
        columns = columns_of(_DETAILS_HEAD, stated_claims)
        details.append(Section(heading, columns, sentences, left=len(_DETAILS_HEAD), is_detail=True))
    name = solved.studies[0][0].name
    return Finding(
        name="claims",
        kicker="Reproduction",
        title=f"{name}, run again" if reproduction is None else "Published studies, run again",
        said=(),
        parts=(
            Section(
                columns=columns_of(_STUDIES_HEAD, rows),
                remarks=("", count_sentence(solved.verdicts)),
                left=len(_STUDIES_HEAD),
            ),
            Section("How to read it", said=(_RULE,), is_detail=True),
            *details,
        ),
        found=solved,
        passed=reproduction is None or not reproduction.missed,
        command="reproduce",
    )


def _agrees(low: float | None, high: float | None, unit: str) -> str | None:
    """Format the range of values that agrees with a claim as text."""
    if low is not None and high is not None:
        return f"{low:g} to {high:g} {unit}".rstrip()
    if low is not None:
        return f"at least {low:g} {unit}".rstrip()
    return None if high is None else f"at most {high:g} {unit}".rstrip()


def finding_of(reproduction: Reproduction) -> Finding[Reproduction]:
    """Return the paper's claims as a finding.

    The finding has not passed if a value is outside its window although no value was overridden. Figure 3 needs the
    simulated test bench.
    """
    sentences, missed, rows = [NOTHING_CONFIRMED], reproduction.missed, reproduction.readings_of_u
    if reproduction.overrides:
        words = f"not the paper's device: values changed with {override_text(reproduction.overrides)}"
        sentences.append(f"{words}; the verdicts still compare this device with the paper")
    # On the page a claim has its window in its note; at the command line only what misses it is said.
    remarks = [
        f"missed: {claim.id} is outside {claim.window[0]:g} to {claim.window[1]:g} {claim.unit}"
        for claim in missed
        if claim.window is not None
    ]
    rows_of_claims = [(claim.id, claim.published, claim.ours, VERDICTS[claim.verdict]) for claim in reproduction.claims]
    claims = Section(
        columns=columns_of(_HEAD, rows_of_claims),
        remarks=("", count_sentence([claim.verdict for claim in reproduction.claims]), *remarks),
        left=len(_HEAD),
    )
    head = ("U is", "RMS error less by", "CO2 less by", f"error at {WITHIN_REACH:g} N m less by")
    of_u = [Section(columns=columns_of(head, reading_rows(rows)), remarks=("", *result_on_u(rows)))] if rows else []
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    return Finding(
        name="claims",
        kicker="Reproduction",
        title="The paper's claims",
        said=sentences,
        parts=(claims, *of_u, *_figures(reproduction)),
        found=reproduction,
        # A changed device may leave the windows of the paper: that is a result, no failure.
        passed=not missed or bool(reproduction.overrides),
        files={f"{run.scenario.name}.csv": partial(marked_csv_bytes, run.recording) for run in runs},
        command="reproduce",
        page=partial(reproduction_page, reproduction),
    )


def _figures(reproduction: Reproduction) -> list[Section]:
    """Return the figures of the reproduction page as sections, each drawn on demand."""
    supply = reproduction.step.scenario.device.supply
    levels = SupplyLevels(supply.pressure, supply.atmospheric_pressure)
    stated = {claim.id: claim.paper or 0.0 for claim in reproduction.claims}
    # Without the bench figures 7 and 8 have the simulation alone.
    step, tasks, synthetic = None, None, reproduction.synthetic
    if isinstance(synthetic, SyntheticEvidence):
        step, tasks = synthetic.step, (synthetic.solenoid, synthetic.proportional)
    drawn: dict[str, Callable[[], Drawing]] = {
        DEVICE_FIGURE: device_figure,
        STEP_FIGURE: partial(step_response_figure, reproduction.step.recording, levels, reproduction.step_events, step),
        TORQUE_FIGURE: partial(
            torque_task_figure,
            reproduction.solenoid.recording,
            reproduction.proportional.recording,
            holding_torque(reproduction.solenoid),
            (stated["co2_solenoid"], stated["co2_proportional"]),
            tasks,
        ),
    }
    if isinstance(synthetic, SyntheticEvidence):
        drawn[IDENTIFICATION_FIGURE] = partial(figure_3, synthetic.torque, synthetic.decay)
    return [Section(name=name, draw=draw, is_detail=True) for name, draw in drawn.items()]
