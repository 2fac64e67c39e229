"""The answer of the reproduction: every claim with its verdict, figures, recordings, and the one bespoke page."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ppafo.analyses.reproduce.bench import (
    BENCH_PRESET,
    RIG_SEED,
    TASK_PRESET,
    AssumedValue,
    NoEvidence,
    SyntheticEvidence,
)
from ppafo.analyses.reproduce.claim import (
    MEANINGS,
    NOT_PUBLISHED,
    VERDICTS,
    Claim,
    Observation,
    Verdict,
    count_sentence,
    count_words,
    load_reported,
    verdict_counts,
)
from ppafo.analyses.reproduce.drawing import device_figure
from ppafo.analyses.reproduce.figures import step_response_figure, torque_task_figure
from ppafo.analyses.reproduce.publication import ALL, SEED, Study
from ppafo.analyses.reproduce.step_response import Levels, StepEvents
from ppafo.analyses.reproduce.torque_task import WITHIN_REACH, InterpretationOfU
from ppafo.identification.bench.result import synthetic_figure_3
from ppafo.metrics import Metric
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import Finding
from ppafo.parameters.publications.publication import paper_entries
from ppafo.report import Answer, Column, Figure, Section, Table
from ppafo.report.display_units import metric_level
from ppafo.report.live_parts import live_part
from ppafo.report.solved import Solved
from ppafo.report.writing import inline_figure, quantity, render_page, sentence
from ppafo.simulation.simulate import Result
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

STEP = "step-response"
SOLENOID = "torque-task-solenoid"
PROPORTIONAL = "torque-task-proportional"


@dataclass(frozen=True, slots=True, repr=False)
class Reproduction(Solved):
    """What came of it: claims in the order of the paper, what the text tells, runs, assumptions and audit findings."""

    claims: tuple[Claim, ...]
    step_observations: tuple[Observation, ...]
    torque_observations: tuple[Observation, ...]
    readings_of_u: tuple[InterpretationOfU, ...]
    step: Result
    step_events: StepEvents | None
    solenoid: Result
    proportional: Result
    synthetic: SyntheticEvidence | NoEvidence
    assumed: tuple[AssumedValue, ...]
    printed_set: str
    printed_findings: tuple[Finding, ...]
    completed_set: str
    completed_findings: tuple[Finding, ...]
    overrides: tuple[str, ...]

    @property
    def missed(self) -> tuple[Claim, ...]:
        """Claims whose number is outside the window that it has to meet."""
        return tuple(claim for claim in self.claims if claim.is_missed)


@dataclass(frozen=True, slots=True, repr=False)
class Studies(Solved):
    """Some publications with their judged claims, and the reproduction of the paper where it is among them."""

    studies: tuple[Study, ...]
    reproduction: Reproduction | None = None


TEMPLATE = "reproduction.html.jinja"
_EXPERIMENTS = {STEP: "step response", SOLENOID: "torque task, solenoid", PROPORTIONAL: "torque task, proportional"}
_SYMBOLS: dict[Verdict, str] = {
    "consistent": "✓",
    "inconsistent_as_reported": "✗",
    "met_by_fitted_settings": "≈",
    "plausible": "~",
    "undetermined": "?",
    "not_testable": "○",
}
_TASK_METRICS = (
    "rms_error",
    "rms_error_ramp",
    "rms_error_hold",
    "peak_error",
    "gas_supplied",
    "gas_vented",
    "gas_leaked",
    "switchings",
    "oscillations_ramp",
    "oscillations_hold",
    "mechanical_work",
)


def reproduction_page(reproduction: Reproduction, drawn: Mapping[str, bytes]) -> str:
    """Return the page as HTML; ``drawn`` has SVG files by the names of the figures, which become part of the page."""
    reported = reproduction.printed_findings
    groups: dict[tuple[str, ...], list[AssumedValue]] = {}
    for value in reproduction.assumed:
        groups.setdefault(value.used_by, []).append(value)
    ordered = sorted(groups.items(), key=lambda item: -len(item[0]))
    results = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    steps = sorted({1e3 * float(result.engine["step"]) for result in results})
    values = {
        **_summary(reproduction),
        "printed_set": reproduction.printed_set,
        "completed_set": reproduction.completed_set,
        "contradictions": _of_severity(reported, "error"),
        "remarks": _of_severity(reported, "warning"),
        "notes": _of_severity(reported, "note"),
        "kept": [finding for finding in reproduction.completed_findings if finding.severity != "note"],
        **_synthetic(reproduction, drawn.get(IDENTIFICATION_FIGURE)),
        "readings_of_u": [(row.name, *_reading_texts(row)) for row in reproduction.readings_of_u],
        "result_on_u": result_on_u(reproduction.readings_of_u) if reproduction.readings_of_u else (),
        "within_reach": f"{WITHIN_REACH:g}",
        "device_figure": inline_figure(drawn[DEVICE_FIGURE]),
        "step_figure": inline_figure(drawn[STEP_FIGURE]),
        "torque_figure": inline_figure(drawn[TORQUE_FIGURE]),
        "task_rows": _task_rows(reproduction.solenoid.metrics, reproduction.proportional.metrics),
        "ceiling": f"{holding_torque(reproduction.solenoid):.1f}",
        "assumed_groups": [(_users(users), values) for users, values in ordered],
        "versions": ", ".join(f"{name} {version}" for name, version in reproduction.step.versions.items()),
        "steps": f"{steps[0]:g} ms" if len(steps) == 1 else f"{steps[0]:g} to {steps[-1]:g} ms",
        "live": live_part(
            [result.scenario for result in (reproduction.solenoid, reproduction.proportional, reproduction.step)]
        ),
        "command": shlex.join(_command(reproduction.overrides)),
    }
    return render_page(TEMPLATE, values, "ppafo.analyses.reproduce")


def holding_torque(result: Result) -> float:
    """Largest torque that a result's supply can hold [N m]; equation (2) with atmosphere in the other chamber."""
    device = result.scenario.device
    return device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure)


def _summary(reproduction: Reproduction) -> dict[str, Any]:
    citation = load_parameter_set(reproduction.printed_set).citation
    counts = verdict_counts(reproduction.claims)
    return {
        "paper": citation,
        "nothing_confirmed": NOTHING_CONFIRMED,
        "count_sentence": count_sentence(reproduction.claims),
        "counts": [
            (verdict, VERDICTS[verdict], _SYMBOLS[verdict], MEANINGS[verdict], count)
            for verdict, count in counts.items()
        ],
        "claims": [_claim_row(claim) for claim in reproduction.claims],
        "not_published": [(entry.statement, entry.where) for entry in map(paper_entries().get, NOT_PUBLISHED) if entry],
        "not_read": NOT_READ,
        "missed": [claim.id for claim in reproduction.missed],
        "overrides": reproduction.overrides,
        "step_observations": reproduction.step_observations,
        "torque_observations": reproduction.torque_observations,
    }


def _claim_row(claim: Claim) -> dict[str, Any]:
    return {
        "id": claim.id,
        "statement": claim.statement,
        "source": claim.source,
        "paper": claim.published,
        "ours": claim.ours,
        "verdict": claim.verdict,
        "word": VERDICTS[claim.verdict],
        "symbol": _SYMBOLS[claim.verdict],
        "note": claim.note,
    }


def _reading_texts(row: InterpretationOfU) -> tuple[str, str, str]:
    return f"{row.error:.0f} %", f"{row.gas:.0f} %", f"{row.error_within_reach:.0f} %"


def _of_severity(findings: Sequence[Finding], severity: str) -> list[Finding]:
    return [finding for finding in findings if finding.severity == severity]


def _task_rows(solenoid: Mapping[str, Metric], proportional: Mapping[str, Metric]) -> list[tuple[str, str, str]]:
    """Return meaning and both values of each metric of the task that both runs have."""
    rows = []
    for name in _TASK_METRICS:
        if name in solenoid and name in proportional:
            both = [metric_level(metrics[name].value, metrics[name].unit) for metrics in (solenoid, proportional)]
            first, second = (quantity(value, unit, 3) for value, unit in both)
            rows.append((solenoid[name].summary, first, second))
    return rows


def _users(names: tuple[str, ...]) -> str:
    if set(names) == set(_EXPERIMENTS):
        return "All experiments"
    if set(names) == {SOLENOID, PROPORTIONAL}:
        return "Torque task, both valves"
    return sentence(" and ".join(_EXPERIMENTS.get(name, name) for name in names)).rstrip(".")


def _command(overrides: Sequence[str]) -> list[str]:
    changed = [word for override in overrides for word in ("--set", override)]
    return ["ppafo", "reproduce", "--out", "out/reproduce", *changed]


def _synthetic(reproduction: Reproduction, figure: bytes | None) -> dict[str, Any]:
    """Return what the template needs of the synthetic measurements; without them only why there are none."""
    evidence = reproduction.synthetic
    if isinstance(evidence, NoEvidence):
        return {"synthetic": None, "no_synthetic": evidence.reason}
    decay = evidence.decay
    reported = load_reported()
    return {
        "no_synthetic": "",
        "synthetic": {
            "figure": None if figure is None else inline_figure(figure),
            "preset": BENCH_PRESET,
            "task_preset": TASK_PRESET,
            "seed": RIG_SEED,
            "slope": f"{-decay['friction.viscous_damping'].value / reported.in_si('foot_plate.inertia'):.1f}",
            "reported_slope": f"{reported.number('reported.velocity_over_acceleration'):g}",
        },
    }


DEVICE_FIGURE = "device"
IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
_HEAD = ("claim", "paper", "ours", "verdict")
_PAPER = "'ppafo reproduce' without --study makes the page of these claims, with sources, figures and assumptions."
_STUDIES_HEAD = ("study", "claim", "published", "ours", "verdict")
_RULE = (
    "'Ours' is computed anew whenever this is run. "
    + " ".join(f"{VERDICTS[verdict].capitalize()}: {meaning}." for verdict, meaning in MEANINGS.items())
    + " Nothing here was measured."
)
NOTHING_CONFIRMED = "No experimental result is confirmed independently of fitted settings."
NOT_READ = (
    "Not read, and likely to settle what is open: the dissertations of K. A. Shorter (2011) and Y. Li (2013), the "
    "journal article of 2012 in Mechatronics, the volume table of the maker of the vane."
)


def answer_of(solved: Reproduction | Studies) -> Answer:
    """Return the answer of the paper's experiments, or of other publications."""
    return _studies_answer(solved) if isinstance(solved, Studies) else _paper_answer(solved)


def _studies_answer(solved: Studies) -> Answer:
    """Return the table of studies; a claim of another publication that is not met is a result, no failure."""
    rows, claims, verdicts = _paper_part(solved.reproduction)
    for study in solved.studies:
        name = study.publication.name
        rows += [
            (
                name,
                item.claim.entry.id,
                item.published or _own_sum(item.claim.entry.own),
                item.ours,
                VERDICTS[item.verdict],
            )
            for item in study.claims
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


def _own_sum(own: str) -> str | None:
    """Return a number that only own arithmetic on published ones gives, as it stands in a table."""
    return f"{own} (own sum)" if own else None


def _paper_rows(reproduction: Reproduction) -> tuple[tuple[str | None, ...], ...]:
    return tuple((claim.id, claim.published, claim.ours, VERDICTS[claim.verdict]) for claim in reproduction.claims)


def _readings_table(rows: Sequence[InterpretationOfU]) -> Section:
    """Return what each meaning of U makes of the comparison."""
    head = ("U is", "RMS error less by", "CO2 less by", f"error less by at {WITHIN_REACH:g} N m")
    cells = tuple((row.name, *_reading_texts(row)) for row in rows)
    return Section(table=Table(tuple(map(Column, head)), cells, left=1), remarks=("", *result_on_u(rows)))


def result_on_u(rows: Sequence[InterpretationOfU]) -> tuple[str, ...]:
    """Return what the readings come to in one sentence, where they come to it."""
    entries = paper_entries()
    error, saving = entries["torque_rms_improvement"], entries["co2_saving"]
    low, high, least = error.at_least or 0.0, error.at_most or 0.0, saving.at_least or 0.0
    opening, *volts = rows
    is_opening_alone = low <= opening.error <= high and not any(low <= row.error <= high for row in volts)
    is_beyond_reach = not any(low <= row.error_within_reach <= high for row in rows)
    if not (is_opening_alone and is_beyond_reach and all(row.gas >= least for row in rows)):
        return ()
    return ("15 % needs 'U is the opening' and a level beyond the supply's reach; the saving needs neither.",)


def _paper_answer(reproduction: Reproduction) -> Answer:
    """Return the answer; it has not passed where a number misses its window, unless values were changed.

    Without the simulated test bench there is no figure 3.
    """
    table = Table(tuple(map(Column, _HEAD)), _paper_rows(reproduction), left=len(_HEAD))
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    return Answer(
        name="claims",
        kicker="Reproduction",
        title="The paper's claims",
        lead=(NOTHING_CONFIRMED, *_override_remarks(reproduction.overrides)),
        sections=(
            Section(
                table=table,
                remarks=(
                    "",
                    count_sentence(reproduction.claims),
                    *_missed_claims(reproduction),
                ),
            ),
            *((_readings_table(reproduction.readings_of_u),) if reproduction.readings_of_u else ()),
            *(Section(figure=figure, is_detail=True) for figure in _figures(reproduction)),
        ),
        data={
            "counts": verdict_counts(reproduction.claims),
            "claims": [claim.document() for claim in reproduction.claims],
            "readings_of_u": [asdict(row) for row in reproduction.readings_of_u],
            "overrides": list(reproduction.overrides),
            "versions": dict(reproduction.step.versions),
        },
        passed=not reproduction.missed or bool(reproduction.overrides),
        files={f"{run.scenario.name}.csv": partial(marked_csv_bytes, run.recording) for run in runs},
        command="reproduce",
        page=lambda drawn: reproduction_page(reproduction, drawn).encode(),
    )


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
        Figure(DEVICE_FIGURE, "", device_figure),
        Figure(STEP_FIGURE, "", partial(_step_figure, reproduction)),
        Figure(TORQUE_FIGURE, "", partial(_torque_figure, reproduction)),
    ]
    evidence = reproduction.synthetic
    if not isinstance(evidence, NoEvidence):
        figure = partial(synthetic_figure_3, evidence.torque, evidence.decay)
        figures.append(Figure(IDENTIFICATION_FIGURE, "", figure))
    return figures


def _step_figure(reproduction: Reproduction) -> "Drawing":
    supply = reproduction.step.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    evidence = reproduction.synthetic
    measured = None if isinstance(evidence, NoEvidence) else evidence.step
    return step_response_figure(reproduction.step.recording, levels, reproduction.step_events, measured)


def _torque_figure(reproduction: Reproduction) -> "Drawing":
    stated = {claim.id: claim.paper for claim in reproduction.claims}
    evidence = reproduction.synthetic
    return torque_task_figure(
        reproduction.solenoid.recording,
        reproduction.proportional.recording,
        holding_torque(reproduction.solenoid),
        (stated["co2_solenoid"] or 0.0, stated["co2_proportional"] or 0.0),
        None if isinstance(evidence, NoEvidence) else (evidence.solenoid, evidence.proportional),
    )
