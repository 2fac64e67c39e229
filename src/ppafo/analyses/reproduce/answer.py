"""Report of the reproduction: verdict on every claim, figures, synthetic recordings, and a page of its own."""

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
    SyntheticEvidence,
)
from ppafo.analyses.reproduce.claim import (
    MEANINGS,
    VERDICTS,
    Claim,
    Observation,
    Verdict,
    count_sentence,
    verdict_counts,
)
from ppafo.analyses.reproduce.drawing import device_figure
from ppafo.analyses.reproduce.figures import step_response_figure, torque_task_figure
from ppafo.analyses.reproduce.meaning_of_u import WITHIN_REACH, InterpretationOfU
from ppafo.analyses.reproduce.publication import ALL, SEED, JudgedClaim, Publication
from ppafo.analyses.reproduce.reported_numbers import NOT_PUBLISHED, load_reported
from ppafo.analyses.reproduce.step_response import StepEvents, SupplyLevels
from ppafo.identification.bench.result import figure_3
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import AuditFinding
from ppafo.parameters.publications.publication import paper_entries
from ppafo.report.display_units import metric_level
from ppafo.report.finding import Cell, Finding, Section, columns_of
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
    """Result of a reproduction: claims in the paper's order, observations, runs, assumptions and audit findings.

    ``synthetic`` is the synthetic recordings, or a sentence with the reason if there are none.
    """

    claims: tuple[Claim, ...]
    step_observations: tuple[Observation, ...]
    torque_observations: tuple[Observation, ...]
    readings_of_u: tuple[InterpretationOfU, ...]
    step: Result
    step_events: StepEvents | None
    solenoid: Result
    proportional: Result
    synthetic: SyntheticEvidence | str
    assumed: tuple[AssumedValue, ...]
    printed_set: str
    printed_findings: tuple[AuditFinding, ...]
    completed_set: str
    completed_findings: tuple[AuditFinding, ...]
    overrides: tuple[str, ...]

    @property
    def missed(self) -> tuple[Claim, ...]:
        """Claims whose value is outside the required window."""
        return tuple(claim for claim in self.claims if claim.is_missed)

    def json_document(self) -> dict[str, Any]:
        """Return claims with verdicts, and the number of claims for each verdict, as plain data in SI."""
        return {
            "counts": verdict_counts(self.claims),
            "claims": [claim.document() for claim in self.claims],
            "readings_of_u": [asdict(row) for row in self.readings_of_u],
            "overrides": list(self.overrides),
            "versions": dict(self.step.versions),
        }


@dataclass(frozen=True, slots=True)
class Studies:
    """Publications with their judged claims, and the reproduction of the paper if it is included."""

    studies: tuple[tuple[Publication, tuple[JudgedClaim, ...]], ...]
    reproduction: Reproduction | None = None

    @property
    def verdicts(self) -> list[Verdict]:
        """Verdicts of all claims, starting with the paper's."""
        of_paper = () if self.reproduction is None else self.reproduction.claims
        return [claim.verdict for claim in of_paper] + [claim.verdict for _, claims in self.studies for claim in claims]

    def json_document(self) -> dict[str, Any]:
        """Return claims with verdicts, and the number of claims for each verdict, as plain data in SI."""
        of_paper = () if self.reproduction is None else self.reproduction.claims
        return {
            "study": self.studies[0][0].name if self.reproduction is None else ALL,
            "counts": {verdict: self.verdicts.count(verdict) for verdict in VERDICTS},
            "claims": [
                *({"study": SEED, **claim.document()} for claim in of_paper),
                *(claim.document(publication.name) for publication, claims in self.studies for claim in claims),
            ],
            "versions": {"ppafo": __version__},
        }


TEMPLATE = "reproduction.html.jinja"
DEVICE_FIGURE = "device"
IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
_HEAD = ("claim", "paper", "ours", "verdict")
_PAPER = "'ppafo reproduce' without --study makes the page of these claims, with sources, figures and assumptions."
_STUDIES_HEAD = ("study", "claim", "published", "ours", "verdict")
_DETAILS_HEAD = ("claim", "statement and source", "agrees", "rests on", "note")
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


def reproduction_page(reproduction: Reproduction, drawn: Mapping[str, bytes]) -> bytes:
    """Return the page as HTML.

    ``drawn`` are the figures as SVG by file name; they become part of the page.
    """
    changed = [word for override in reproduction.overrides for word in ("--set", override)]
    solenoid, proportional = reproduction.solenoid, reproduction.proportional
    runs = (solenoid, proportional, reproduction.step)
    steps = sorted({1e3 * float(run.engine["step"]) for run in runs})
    counts, readings = verdict_counts(reproduction.claims).items(), reproduction.readings_of_u
    values = {
        "paper": load_parameter_set(reproduction.printed_set).citation,
        "nothing_confirmed": NOTHING_CONFIRMED,
        "overrides": reproduction.overrides,
        "count_sentence": count_sentence([claim.verdict for claim in reproduction.claims]),
        "counts": [(name, VERDICTS[name], _SYMBOLS[name], MEANINGS[name], count) for name, count in counts],
        "claims": reproduction.claims,
        "words": VERDICTS,
        "symbols": _SYMBOLS,
        "not_published": [(entry.statement, entry.where) for entry in map(paper_entries().get, NOT_PUBLISHED) if entry],
        "not_read": NOT_READ,
        "step_observations": reproduction.step_observations,
        "torque_observations": reproduction.torque_observations,
        **_set_values(reproduction),
        **_synthetic(reproduction.synthetic, drawn.get(IDENTIFICATION_FIGURE)),
        "readings_of_u": _reading_rows(readings),
        "result_on_u": result_on_u(readings) if readings else (),
        "within_reach": f"{WITHIN_REACH:g}",
        "task_rows": [
            (
                solenoid.metrics[name].summary,
                *(
                    quantity(*metric_level(run.metrics[name].value, run.metrics[name].unit), 3)
                    for run in (solenoid, proportional)
                ),
            )
            for name in _TASK_METRICS
            if name in solenoid.metrics and name in proportional.metrics
        ],
        "ceiling": f"{holding_torque(solenoid):.1f}",
        "versions": ", ".join(f"{name} {version}" for name, version in reproduction.step.versions.items()),
        "steps": f"{steps[0]:g} ms" if len(steps) == 1 else f"{steps[0]:g} to {steps[-1]:g} ms",
        "device_figure": inline_figure(drawn[DEVICE_FIGURE]),
        "step_figure": inline_figure(drawn[STEP_FIGURE]),
        "torque_figure": inline_figure(drawn[TORQUE_FIGURE]),
        "live": live_part([run.scenario for run in runs]),
        "command": shlex.join(["ppafo", "reproduce", "--out", "out/reproduce", *changed]),
    }
    return render_page(TEMPLATE, values, "ppafo.analyses.reproduce").encode()


def _set_values(reproduction: Reproduction) -> dict[str, Any]:
    """Return template values on both parameter sets: findings of the printed set, and remaining ones of the other."""
    severities = {"error": "contradictions", "warning": "remarks", "note": "notes"}
    groups: dict[tuple[str, ...], list[AssumedValue]] = {}
    for value in reproduction.assumed:
        groups.setdefault(value.used_by, []).append(value)
    headings = {
        users: sentence(" and ".join(_EXPERIMENTS.get(name, name) for name in users)).rstrip(".") for users in groups
    } | {tuple(_EXPERIMENTS): "All experiments", (SOLENOID, PROPORTIONAL): "Torque task, both valves"}
    ordered = sorted(groups.items(), key=lambda group: -len(group[0]))
    return {
        "printed_set": reproduction.printed_set,
        "completed_set": reproduction.completed_set,
        **{
            name: [finding for finding in reproduction.printed_findings if finding.severity == severity]
            for severity, name in severities.items()
        },
        "kept": [finding for finding in reproduction.completed_findings if finding.severity != "note"],
        "assumed_groups": [(headings[users], values) for users, values in ordered],
    }


def holding_torque(result: Result) -> float:
    """Largest static torque for the supply of a result [N m]; equation (2), other chamber at atmosphere."""
    device = result.scenario.device
    return device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure)


def _reading_rows(rows: Sequence[InterpretationOfU]) -> list[tuple[str, str, str, str]]:
    return [(row.name, f"{row.error:.0f} %", f"{row.gas:.0f} %", f"{row.error_within_reach:.0f} %") for row in rows]


def _synthetic(evidence: SyntheticEvidence | str, figure: bytes | None) -> dict[str, Any]:
    """Return template values on the synthetic measurements, or the reason why there are none."""
    if isinstance(evidence, str):
        return {"synthetic": None, "no_synthetic": evidence}
    reported = load_reported()
    slope = -evidence.decay["friction.viscous_damping"].value / reported.in_si("foot_plate.inertia")
    return {
        "no_synthetic": "",
        "synthetic": {
            "figure": None if figure is None else inline_figure(figure),
            "preset": BENCH_PRESET,
            "task_preset": TASK_PRESET,
            "seed": RIG_SEED,
            "slope": f"{slope:.1f}",
            "reported_slope": f"{reported.entry('reported.velocity_over_acceleration').value:g}",
        },
    }


def finding_of_studies(solved: Studies) -> Finding[Studies]:
    """Return the table of studies as a finding.

    A claim of another publication that is not met counts as a result, not as a failure.
    """
    reproduction = solved.reproduction
    rows: list[Sequence[Cell]] = [] if reproduction is None else [(SEED, *row) for row in _paper_rows(reproduction)]
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
        heading, said = f"{publication.name}: {publication.title}", (publication.citation,)
        columns = columns_of(_DETAILS_HEAD, stated_claims)
        details.append(Section(heading, columns, said, left=len(_DETAILS_HEAD), is_detail=True))
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
    """Return in words the range of values that agrees with a claim."""
    if low is None and high is None:
        return None
    ends = f"{low:g} to {high:g}" if low is not None and high is not None else ""
    return f"{ends or (f'at most {high:g}' if low is None else f'at least {low:g}')} {unit}".rstrip()


def _paper_rows(reproduction: Reproduction) -> list[tuple[str, str, str, str]]:
    return [(claim.id, claim.published, claim.ours, VERDICTS[claim.verdict]) for claim in reproduction.claims]


def result_on_u(rows: Sequence[InterpretationOfU]) -> tuple[str, ...]:
    """Return the conclusion from the interpretations of U as a sentence; empty if they do not support it."""
    entries = paper_entries()
    error, saving = entries["torque_rms_improvement"], entries["co2_saving"]
    low, high, least = error.at_least or 0.0, error.at_most or 0.0, saving.at_least or 0.0
    # The first reading is the opening itself, the others are voltages.
    opening, *volts = rows
    is_opening_alone = low <= opening.error <= high and not any(low <= row.error <= high for row in volts)
    is_beyond_reach = not any(low <= row.error_within_reach <= high for row in rows)
    if not (is_opening_alone and is_beyond_reach and all(row.gas >= least for row in rows)):
        return ()
    return ("15 % needs 'U is the opening' and a level beyond the supply's reach; the saving needs neither.",)


def finding_of(reproduction: Reproduction) -> Finding[Reproduction]:
    """Return the paper's claims as a finding.

    It has not passed if a value is outside its window although no value was overridden. Figure 3 needs the simulated
    test bench.
    """
    sentences, missed, rows = [NOTHING_CONFIRMED], reproduction.missed, reproduction.readings_of_u
    if reproduction.overrides:
        words = f"not the paper's device: values changed with --set {', '.join(reproduction.overrides)}"
        sentences.append(f"{words}; the verdicts compare it with the paper all the same")
    # On the page a claim has its window in its note; at the command line only what misses it is said.
    remarks = [
        f"missed: {claim.id} is outside {claim.window[0]:g} to {claim.window[1]:g} {claim.unit}"
        for claim in missed
        if claim.window is not None
    ]
    claims = Section(
        columns=columns_of(_HEAD, _paper_rows(reproduction)),
        remarks=("", count_sentence([claim.verdict for claim in reproduction.claims]), *remarks),
        left=len(_HEAD),
    )
    head = ("U is", "RMS error less by", "CO2 less by", f"error less by at {WITHIN_REACH:g} N m")
    of_u = [Section(columns=columns_of(head, _reading_rows(rows)), remarks=("", *result_on_u(rows)))] if rows else []
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
    """Return the figures of the page, each drawn on demand."""
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
