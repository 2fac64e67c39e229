"""Report of the reproduction: tables of claims with verdicts, of one study or of several, figures, and the page."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING

from ppafo.analyses.reproduce.claim import MEANINGS, VERDICTS, Claim, count_sentence, verdict_counts
from ppafo.analyses.reproduce.figures import step_response_figure, torque_task_figure
from ppafo.analyses.reproduce.publication import SEED, Studies
from ppafo.analyses.reproduce.reported_numbers import INERTIA, NOT_PUBLISHED, known, load_reported
from ppafo.analyses.reproduce.solve import (
    BENCH_PRESET,
    EXPERIMENTS,
    PROPORTIONAL,
    RIG_SEED,
    SOLENOID,
    TASK_PRESET,
    AssumedValue,
    Reproduction,
    SyntheticEvidence,
)
from ppafo.analyses.reproduce.torque_task import WITHIN_REACH, holding_torque, reading_rows, result_on_u
from ppafo.identification.bench.law import figure_3
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import findings_of
from ppafo.parameters.publications.publication import paper_entries
from ppafo.report.finding import Cell, Finding, Section, columns_of
from ppafo.report.kind import metric_level
from ppafo.report.writing import inline_figure, quantity, render_page, sentence
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.wording import override_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

NOTHING_CONFIRMED = "No experimental result is confirmed independently of fitted settings."
_HEAD = ("claim", "paper", "ours", "verdict")
_PAPER = "'ppafo reproduce' without --study writes the page of these claims, with sources, figures and assumptions."
_STUDIES_HEAD = ("study", "claim", "published", "ours", "verdict")
_DETAILS_HEAD = ("claim", "statement and source", "agrees", "rests on", "note")
_RULE = (
    "'Ours' is recomputed by every run of the command. "
    + " ".join(f"{VERDICTS[verdict].capitalize()}: {meaning}." for verdict, (_, meaning) in MEANINGS.items())
    + " Nothing here was measured."
)
TEMPLATE = "reproduction.html.jinja"
DEVICE = files("ppafo.analyses.reproduce") / "templates" / "device.svg"
"""Drawing of the gas circuit with ISO 1219-1 symbols, and of the leg with the device."""
IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
_EXPERIMENTS = dict(
    zip(EXPERIMENTS, ("step response", "torque task, solenoid", "torque task, proportional"), strict=True)
)
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


def finding_of_studies(solved: Studies) -> Finding[Studies]:
    """Return the table of studies as a finding.

    A claim of another publication that is not met counts as a result, not as a failure.
    """
    reproduction = solved.reproduction
    rows: list[Sequence[Cell]] = [(study, *_row(claim)) for study, claim in solved.claims]
    details = [] if reproduction is None else [Section(f"{SEED}: the paper", said=(_PAPER,), is_detail=True)]
    for publication in solved.studies:
        stated_claims: list[Sequence[Cell]] = []
        for claim in publication.claims:
            entry = claim.entry
            stated = f"{entry.statement} ({claim.source})"
            agrees = _agrees(entry.at_least, entry.at_most, entry.unit)
            stated_claims.append((entry.id, stated, agrees, "; ".join(entry.assumed) or None, claim.note or None))
        heading, sentences = f"{publication.name}: {publication.title}", (publication.citation,)
        columns = columns_of(_DETAILS_HEAD, stated_claims)
        details.append(Section(heading, columns, sentences, left=len(_DETAILS_HEAD), is_detail=True))
    name = solved.studies[0].name
    return Finding(
        name="claims",
        kicker="Reproduction",
        title=f"{name}, run again" if reproduction is None else "Published studies, run again",
        said=(),
        parts=(
            Section(
                columns=columns_of(_STUDIES_HEAD, rows),
                remarks=("", count_sentence([claim for _, claim in solved.claims])),
                left=len(_STUDIES_HEAD),
            ),
            Section("How to read it", said=(_RULE,), is_detail=True),
            *details,
        ),
        found=solved,
        passed=reproduction is None or not reproduction.missed,
        command="reproduce",
    )


def _row(claim: Claim) -> tuple[str, str | None, str, str]:
    """Return the row of a claim in the table of claims."""
    entry = claim.entry
    # A number that only own arithmetic on published ones gives.
    published = claim.published or (f"{entry.own} (own sum)" if entry.own else None)
    return entry.id, published, claim.ours, VERDICTS[claim.verdict]


def _agrees(low: float | None, high: float | None, unit: str) -> str | None:
    """Format the range of values that agrees with a claim as text."""
    if low is None and high is None:
        return None
    text = f"at most {high:g}" if low is None else f"at least {low:g}" if high is None else f"{low:g} to {high:g}"
    return f"{text} {unit}".rstrip()


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
        f"missed: {claim.entry.id} is outside {claim.entry.at_least:g} to {claim.entry.at_most:g} {claim.entry.unit}"
        for claim in missed
    ]
    claims = Section(
        columns=columns_of(_HEAD, map(_row, reproduction.claims)),
        remarks=("", count_sentence(reproduction.claims), *remarks),
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
        files={
            **{f"{run.scenario.name}.csv": partial(marked_csv_bytes, run.recording) for run in runs},
            DEVICE.name: DEVICE.read_bytes,
        },
        command="reproduce",
        page=partial(reproduction_page, reproduction),
    )


def _figures(reproduction: Reproduction) -> list[Section]:
    """Return the figures of the reproduction page as sections, each drawn on demand."""
    atmosphere = reproduction.step.scenario.device.supply.atmospheric_pressure
    stated = {claim.entry.id: claim.entry.published or 0.0 for claim in reproduction.claims}
    # Without the bench figures 7 and 8 have the simulation alone.
    step, tasks, synthetic = None, None, reproduction.synthetic
    if isinstance(synthetic, SyntheticEvidence):
        step, tasks = synthetic.step, (synthetic.solenoid, synthetic.proportional)
    drawn: dict[str, Callable[[], Drawing]] = {
        STEP_FIGURE: partial(
            step_response_figure, reproduction.step.recording, atmosphere, reproduction.step_events, step
        ),
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


def reproduction_page(reproduction: Reproduction, drawn: Mapping[str, bytes]) -> bytes:
    """Return the page of a reproduction as HTML.

    ``drawn`` are the figures as SVG by file name; they become part of the page.
    """
    changed = [word for override in reproduction.overrides for word in ("--set", override)]
    solenoid, proportional, evidence = reproduction.solenoid, reproduction.proportional, reproduction.synthetic
    steps = sorted({1e3 * float(run.engine["step"]) for run in (solenoid, proportional, reproduction.step)})
    reported, readings = load_reported(), reproduction.readings_of_u
    completed = load_parameter_set(reproduction.step.scenario.origin.parameter_set)
    found = findings_of(reported.parameter_set)
    counts, slope = verdict_counts(reproduction.claims).items(), 0.0
    if isinstance(evidence, SyntheticEvidence):
        slope = -evidence.decay["friction.viscous_damping"].value / known(reported.number(INERTIA))
    values = {
        "reproduction": reproduction,
        "paper": reported.parameter_set.citation,
        "statements": paper_entries(),
        "not_published": NOT_PUBLISHED,
        "nothing_confirmed": NOTHING_CONFIRMED,
        "count_sentence": count_sentence(reproduction.claims),
        "counts": [(name, VERDICTS[name], *MEANINGS[name], count) for name, count in counts],
        "words": VERDICTS,
        "symbols": {name: symbol for name, (symbol, _) in MEANINGS.items()},
        "printed_set": reported.parameter_set.name,
        "completed_set": completed.name,
        **{
            name: [finding for finding in found if finding.severity == severity]
            for severity, name in (("error", "contradictions"), ("warning", "remarks"), ("note", "notes"))
        },
        "kept": [finding for finding in findings_of(completed) if finding.severity != "note"],
        "assumed_groups": _assumed_groups(reproduction.assumed),
        "bench": {"preset": BENCH_PRESET, "task_preset": TASK_PRESET, "seed": RIG_SEED, "slope": f"{slope:.1f}"},
        "is_measured": isinstance(evidence, SyntheticEvidence),
        "readings_of_u": reading_rows(readings),
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
        "device": inline_figure(DEVICE.read_bytes()),
        "figures": {name: inline_figure(content) for name, content in drawn.items()},
        "command": shlex.join(["ppafo", "reproduce", "--out", "out/reproduce", *changed]),
    }
    return render_page(TEMPLATE, values, "ppafo.analyses.reproduce").encode()


def _assumed_groups(assumed: Sequence[AssumedValue]) -> list[tuple[str, list[AssumedValue]]]:
    """Return the assumed values by the experiments that use them, under a heading; those of most experiments first."""
    groups: dict[tuple[str, ...], list[AssumedValue]] = {}
    for value in assumed:
        groups.setdefault(value.used_by, []).append(value)
    own = {EXPERIMENTS: "All experiments", (SOLENOID, PROPORTIONAL): "Torque task, both valves"}
    return [
        (own.get(users) or sentence(" and ".join(_EXPERIMENTS[name] for name in users)).rstrip("."), values)
        for users, values in sorted(groups.items(), key=lambda group: -len(group[0]))
    ]
