"""Page of the reproduction: claims, statements, assumptions, findings and figures as HTML."""

import shlex
from collections.abc import Mapping
from typing import Any

from ppafo.analyses.reproduce.bench import BENCH_PRESET, RIG_SEED, TASK_PRESET, AssumedValue, SyntheticEvidence
from ppafo.analyses.reproduce.claim import MEANINGS, VERDICTS, Verdict, count_sentence, verdict_counts
from ppafo.analyses.reproduce.meaning_of_u import WITHIN_REACH
from ppafo.analyses.reproduce.reported_numbers import NOT_PUBLISHED, load_reported
from ppafo.analyses.reproduce.result import (
    NOTHING_CONFIRMED,
    PROPORTIONAL,
    SOLENOID,
    STEP,
    Reproduction,
    holding_torque,
    reading_rows,
    result_on_u,
)
from ppafo.documents.json_text import fields_of
from ppafo.parameters import load_parameter_set
from ppafo.parameters.publications.publication import paper_entries
from ppafo.report.display_units import metric_level
from ppafo.report.writing import inline_figure, quantity, render_page, sentence

TEMPLATE = "reproduction.html.jinja"
DEVICE_FIGURE = "device"
IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
NOT_READ = (
    "Sources not consulted that are likely to settle the open points: the dissertations of K. A. Shorter (2011) and "
    "Y. Li (2013), the journal article of 2012 in Mechatronics, the volume table of the vane's manufacturer."
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
    """Return the page of a reproduction as HTML.

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
        **fields_of(reproduction, "overrides", "claims", "step_observations", "torque_observations"),
        "count_sentence": count_sentence([claim.verdict for claim in reproduction.claims]),
        "counts": [(name, VERDICTS[name], _SYMBOLS[name], MEANINGS[name], count) for name, count in counts],
        "words": VERDICTS,
        "symbols": _SYMBOLS,
        "not_published": [(entry.statement, entry.where) for entry in map(paper_entries().get, NOT_PUBLISHED) if entry],
        "not_read": NOT_READ,
        **_set_values(reproduction),
        **_synthetic(reproduction.synthetic, drawn.get(IDENTIFICATION_FIGURE)),
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
        "device_figure": inline_figure(drawn[DEVICE_FIGURE]),
        "step_figure": inline_figure(drawn[STEP_FIGURE]),
        "torque_figure": inline_figure(drawn[TORQUE_FIGURE]),
        "command": shlex.join(["ppafo", "reproduce", "--out", "out/reproduce", *changed]),
    }
    return render_page(TEMPLATE, values, "ppafo.analyses.reproduce").encode()


def _set_values(reproduction: Reproduction) -> dict[str, Any]:
    """Return template values on both parameter sets: findings of the printed set, remaining findings of the other."""
    severities = {"error": "contradictions", "warning": "remarks", "note": "notes"}
    groups: dict[tuple[str, ...], list[AssumedValue]] = {}
    for value in reproduction.assumed:
        groups.setdefault(value.used_by, []).append(value)
    headings = {
        users: sentence(" and ".join(_EXPERIMENTS.get(name, name) for name in users)).rstrip(".") for users in groups
    } | {tuple(_EXPERIMENTS): "All experiments", (SOLENOID, PROPORTIONAL): "Torque task, both valves"}
    ordered = sorted(groups.items(), key=lambda group: -len(group[0]))
    return {
        **fields_of(reproduction, "printed_set", "completed_set"),
        **{
            name: [finding for finding in reproduction.printed_findings if finding.severity == severity]
            for severity, name in severities.items()
        },
        "kept": [finding for finding in reproduction.completed_findings if finding.severity != "note"],
        "assumed_groups": [(headings[users], values) for users, values in ordered],
    }


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
