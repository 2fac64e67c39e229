"""The reproduction: every claim with its verdict, figures, recordings, and the one bespoke page."""

import shlex
from collections.abc import Callable, Mapping, Sequence
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
from ppafo.identification.bench.result import figure_3
from ppafo.metrics import Metric
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import Finding as AuditFinding
from ppafo.parameters.publications.publication import paper_entries
from ppafo.report.display_units import metric_level
from ppafo.report.finding import Cell, Finding, Part, columns_of
from ppafo.report.live_parts import live_part
from ppafo.report.writing import inline_figure, quantity, render_page, sentence
from ppafo.simulation.simulate import Result
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

STEP = "step-response"
SOLENOID = "torque-task-solenoid"
PROPORTIONAL = "torque-task-proportional"


@dataclass(frozen=True, slots=True)
class Reproduction:
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
    printed_findings: tuple[AuditFinding, ...]
    completed_set: str
    completed_findings: tuple[AuditFinding, ...]
    overrides: tuple[str, ...]

    @property
    def missed(self) -> tuple[Claim, ...]:
        """Claims whose number is outside the window that it has to meet."""
        return tuple(claim for claim in self.claims if claim.is_missed)

    def json_document(self) -> dict[str, Any]:
        """Return claims with their verdicts, and how many there are of each, as plain data in SI."""
        return {
            "counts": verdict_counts(self.claims),
            "claims": [claim.document() for claim in self.claims],
            "readings_of_u": [asdict(row) for row in self.readings_of_u],
            "overrides": list(self.overrides),
            "versions": dict(self.step.versions),
        }


@dataclass(frozen=True, slots=True)
class Studies:
    """Some publications with their judged claims, and the reproduction of the paper where it is among them."""

    studies: tuple[Study, ...]
    reproduction: Reproduction | None = None

    @property
    def verdicts(self) -> list[Verdict]:
        """The verdicts of all claims, the paper's first."""
        own = [] if self.reproduction is None else [claim.verdict for claim in self.reproduction.claims]
        return own + [item.verdict for study in self.studies for item in study.claims]

    def json_document(self) -> dict[str, Any]:
        """Return claims with their verdicts, and how many there are of each, as plain data in SI."""
        own = () if self.reproduction is None else self.reproduction.claims
        return {
            "study": self.studies[0].publication.name if self.reproduction is None else ALL,
            "counts": {verdict: self.verdicts.count(verdict) for verdict in VERDICTS},
            "claims": [
                *({"study": SEED, **claim.document()} for claim in own),
                *(item.document(study.publication.name) for study in self.studies for item in study.claims),
            ],
            "versions": {"ppafo": __version__},
        }


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


def _of_severity(findings: Sequence[AuditFinding], severity: str) -> list[AuditFinding]:
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


def finding_of_studies(solved: Studies) -> Finding[Studies]:
    """Return the table of studies; a claim of another publication that is not met is a result, no failure."""
    reproduction = solved.reproduction
    rows: list[Sequence[Cell]] = [] if reproduction is None else [(SEED, *row) for row in _paper_rows(reproduction)]
    for study in solved.studies:
        rows += [
            (
                study.publication.name,
                item.claim.entry.id,
                # A number that only own arithmetic on published ones gives.
                item.published or (f"{item.claim.entry.own} (own sum)" if item.claim.entry.own else None),
                item.ours,
                VERDICTS[item.verdict],
            )
            for item in study.claims
        ]
    name = solved.studies[0].publication.name
    return Finding(
        name="claims",
        kicker="Reproduction",
        title=f"{name}, run again" if reproduction is None else "Published studies, run again",
        said=(),
        parts=(
            Part(
                columns=columns_of(_STUDIES_HEAD, rows),
                remarks=("", count_words(solved.verdicts)),
                left=len(_STUDIES_HEAD),
            ),
            Part("How to read it", said=(_RULE,), is_detail=True),
            *([] if reproduction is None else [Part(f"{SEED}: the paper", said=(_PAPER,), is_detail=True)]),
            *(_study_part(study) for study in solved.studies),
        ),
        found=solved,
        passed=reproduction is None or not reproduction.missed,
        command="reproduce",
    )


def _study_part(study: Study) -> Part:
    """Return what each claim of a publication says, where it stands, what it rests on, and why its verdict."""
    head = ("claim", "statement and source", "agrees", "rests on", "note")
    rows = [
        (
            item.claim.entry.id,
            f"{item.claim.entry.statement} ({item.claim.source})",
            _agrees(item.claim.entry.at_least, item.claim.entry.at_most, item.claim.entry.unit),
            "; ".join(item.claim.entry.assumed) or None,
            item.note or None,
        )
        for item in study.claims
    ]
    heading = f"{study.publication.name}: {study.publication.title}"
    return Part(heading, columns_of(head, rows), (study.publication.citation,), left=len(head), is_detail=True)


def _agrees(low: float | None, high: float | None, unit: str) -> str | None:
    """Return the range that agrees with a claim, in words."""
    if low is not None and high is not None:
        return f"{low:g} to {high:g} {unit}".rstrip()
    if low is None and high is None:
        return None
    return f"at least {low:g} {unit}".rstrip() if high is None else f"at most {high:g} {unit}".rstrip()


def _paper_rows(reproduction: Reproduction) -> tuple[tuple[str | None, ...], ...]:
    return tuple((claim.id, claim.published, claim.ours, VERDICTS[claim.verdict]) for claim in reproduction.claims)


def _readings_part(rows: Sequence[InterpretationOfU]) -> Part:
    """Return what each meaning of U makes of the comparison."""
    head = ("U is", "RMS error less by", "CO2 less by", f"error less by at {WITHIN_REACH:g} N m")
    cells = [(row.name, *_reading_texts(row)) for row in rows]
    return Part(columns=columns_of(head, cells), remarks=("", *result_on_u(rows)))


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


def finding_of(reproduction: Reproduction) -> Finding[Reproduction]:
    """Return the paper's claims; it has not passed where a number misses its window, unless values were changed.

    Without the simulated test bench there is no figure 3.
    """
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    return Finding(
        name="claims",
        kicker="Reproduction",
        title="The paper's claims",
        said=(NOTHING_CONFIRMED, *_override_remarks(reproduction.overrides)),
        parts=(
            Part(
                columns=columns_of(_HEAD, _paper_rows(reproduction)),
                remarks=("", count_sentence(reproduction.claims), *_missed_claims(reproduction)),
                left=len(_HEAD),
            ),
            *([_readings_part(reproduction.readings_of_u)] if reproduction.readings_of_u else []),
            *_figures(reproduction),
        ),
        found=reproduction,
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


def _figures(reproduction: Reproduction) -> list[Part]:
    drawn: dict[str, Callable[[], Drawing]] = {
        DEVICE_FIGURE: device_figure,
        STEP_FIGURE: partial(_step_figure, reproduction),
        TORQUE_FIGURE: partial(_torque_figure, reproduction),
    }
    evidence = reproduction.synthetic
    if not isinstance(evidence, NoEvidence):
        drawn[IDENTIFICATION_FIGURE] = partial(figure_3, evidence.torque, evidence.decay)
    return [Part(name=name, draw=draw, is_detail=True) for name, draw in drawn.items()]


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
