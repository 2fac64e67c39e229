"""The page that tells a reader of the paper what came of running it again; one file, nothing to fetch."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from ppafo.answers.page import inline_figure, render_page
from ppafo.answers.shown_metrics import metric_level
from ppafo.answers.typesetting import format_printed_quantity, quantity, sentence
from ppafo.identification.estimate import Estimate
from ppafo.live.workbench import live_part
from ppafo.metrics import Metric
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import Finding
from ppafo.questions.reproduce.assumed import AssumedValue
from ppafo.questions.reproduce.bench import IDEAL, REALISTIC, SEED, IdentifiedValue
from ppafo.questions.reproduce.claim import VERDICTS, Claim, Verdict, count_sentence, verdict_counts
from ppafo.questions.reproduce.printed import Printed, load_printed
from ppafo.questions.reproduce.solve import PROPORTIONAL, SOLENOID, STEP, Reproduction
from ppafo.questions.reproduce.synthetic import STEP_PRESET, TASK_PRESET, NoEvidence
from ppafo.questions.unreported.answer import ERRORS, conclusion_rows, setting_rows
from ppafo.questions.unreported.implications import conclusions
from ppafo.simulation.result import Result
from ppafo.simulation.scenario import Scenario

TEMPLATE = "reproduction.html.jinja"

_EXPERIMENTS = {STEP: "step response", SOLENOID: "torque task, solenoid", PROPORTIONAL: "torque task, proportional"}
_SYMBOLS: dict[Verdict, str] = {
    "reproduced": "✓",
    "reproduced_with_assumptions": "≈",
    "shown_on_synthetic": "◇",
    "contradicted": "✗",
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


def reproduction_page(
    reproduction: Reproduction,
    step_figure: bytes,
    torque_figure: bytes,
    identification_figure: bytes | None = None,
    unsaid_figure: bytes | None = None,
) -> str:
    """Return the page as HTML; figures are the contents of SVG files and become part of the page."""
    values = {
        **_summary(reproduction),
        **_findings(reproduction),
        **_synthetic(reproduction, identification_figure),
        "unsaid": _unreported_data(reproduction, unsaid_figure),
        "step_figure": inline_figure(step_figure),
        "torque_figure": inline_figure(torque_figure),
        "task_rows": _task_rows(reproduction.solenoid.metrics, reproduction.proportional.metrics),
        "ceiling": f"{holding_torque(reproduction.solenoid):.1f}",
        "assumed_groups": _assumed_groups(reproduction.assumed),
        "versions": ", ".join(f"{name} {version}" for name, version in reproduction.step.versions.items()),
        "steps": _steps((reproduction.step, reproduction.solenoid, reproduction.proportional)),
        "live": live_part(_live_scenarios(reproduction)),
        "command": shlex.join(_command(reproduction.overrides)),
    }
    return render_page(TEMPLATE, values, "ppafo.questions.reproduce")


def _live_scenarios(reproduction: Reproduction) -> list[Scenario]:
    """The scenarios that the page simulates again: as they were run, with what was changed."""
    return [result.scenario for result in (reproduction.solenoid, reproduction.proportional, reproduction.step)]


def holding_torque(result: Result) -> float:
    """Largest torque that a result's supply can hold [N m]; equation (2) with atmosphere in the other chamber."""
    device = result.scenario.device
    return device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure)


def _unreported_data(reproduction: Reproduction, figure: bytes | None) -> dict[str, Any] | None:
    """Return the data of the settings that the paper does not print; None where they were not studied."""
    family = reproduction.family
    if family is None or figure is None:
        return None
    return {
        "figure": inline_figure(figure),
        "drawn": family.drawn,
        "effective": f"{family.effective:.0f}",
        "few": not family.is_enough,
        "errors": ERRORS,
        "settings": setting_rows(family),
        "conclusions": conclusion_rows(conclusions(family)),
    }


def _summary(reproduction: Reproduction) -> dict[str, Any]:
    citation = load_parameter_set(reproduction.printed_set).citation
    counts = verdict_counts(reproduction.claims)
    return {
        "paper": citation,
        "count_sentence": count_sentence(reproduction.claims),
        "counts": [(verdict, VERDICTS[verdict], _SYMBOLS[verdict], count) for verdict, count in counts.items()],
        "claims": [_claim_row(claim) for claim in reproduction.claims],
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
        "paper": format_printed_quantity(claim.paper, claim.unit),
        "ours": quantity(claim.value, claim.unit),
        "verdict": claim.verdict,
        "word": claim.verdict_words,
        "symbol": _SYMBOLS[claim.verdict],
        "note": claim.note,
        "is_assumed": claim.verdict == "reproduced_with_assumptions",
    }


def _findings(reproduction: Reproduction) -> dict[str, Any]:
    """Sort the findings: those of the printed numbers by weight, and those that the completed set keeps."""
    printed = reproduction.printed_findings
    return {
        "printed_set": reproduction.printed_set,
        "completed_set": reproduction.completed_set,
        "contradictions": _of_severity(printed, "error"),
        "remarks": _of_severity(printed, "warning"),
        "notes": _of_severity(printed, "note"),
        "kept": [finding for finding in reproduction.completed_findings if finding.severity != "note"],
    }


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


def _assumed_groups(assumed: Sequence[AssumedValue]) -> list[tuple[str, list[AssumedValue]]]:
    """Group the values by the experiments that use them, those that all use first."""
    groups: dict[tuple[str, ...], list[AssumedValue]] = {}
    for value in assumed:
        groups.setdefault(value.used_by, []).append(value)
    ordered = sorted(groups.items(), key=lambda item: -len(item[0]))
    return [(_users(users), values) for users, values in ordered]


def _users(names: tuple[str, ...]) -> str:
    if set(names) == set(_EXPERIMENTS):
        return "All experiments"
    if set(names) == {SOLENOID, PROPORTIONAL}:
        return "Torque task, both valves"
    return sentence(" and ".join(_EXPERIMENTS.get(name, name) for name in names)).rstrip(".")


def _steps(results: Sequence[Result]) -> str:
    """Return the time steps that the engine used, for example ``0.125 to 1 ms``."""
    steps = sorted({1e3 * float(result.engine["step"]) for result in results})
    return f"{steps[0]:g} ms" if len(steps) == 1 else f"{steps[0]:g} to {steps[-1]:g} ms"


def _command(overrides: Sequence[str]) -> list[str]:
    changed = [word for override in overrides for word in ("--set", override)]
    return ["ppafo", "reproduce", "--out", "out/reproduce", *changed]


_NAMES = {
    "actuator.torque_constant": "torque per pressure difference",
    "friction.static_torque": "static friction",
    "friction.viscous_damping": "rotary damping",
    "friction.dynamic_torque": "dynamic friction",
    "valves.proportional.discharge_coefficient": "Cd of the proportional valve",
    "valves.solenoid.discharge_coefficient": "Cd of the solenoid valves",
    "actuator.leak.area": "area of the leak",
}
_STEP_CLAIMS = "step_rms_"


def _synthetic(reproduction: Reproduction, figure: bytes | None) -> dict[str, Any]:
    """Return what the template needs of the synthetic measurements; without them only why there are none."""
    evidence = reproduction.synthetic
    if isinstance(evidence, NoEvidence):
        return {"synthetic": None, "no_synthetic": evidence.reason}
    printed = load_printed()
    return {
        "no_synthetic": "",
        "synthetic": {
            "figure": None if figure is None else inline_figure(figure),
            "rows": [_value_row(printed, value) for value in evidence.bench.values],
            "errors": [_error_row(claim) for claim in reproduction.claims if claim.id.startswith(_STEP_CLAIMS)],
            "ideal": IDEAL,
            "realistic": REALISTIC,
            "step_preset": STEP_PRESET,
            "task_preset": TASK_PRESET,
            "seed": SEED,
            "delay": f"{1e3 * evidence.step.delay.correction:.1f} ms",
        },
    }


def _value_row(printed: Printed, value: IdentifiedValue) -> tuple[str, str, str, str, str]:
    """Return name, experiment, planted value and what both presets gave, in the paper's unit."""
    return (
        _NAMES[value.path],
        value.experiment,
        _number_text(printed, value.path, value.planted),
        _estimate_text(printed, value.path, value.ideal),
        _estimate_text(printed, value.path, value.realistic),
    )


def _number_text(printed: Printed, path: str, number: float) -> str:
    return quantity(printed.in_printed_unit(path, number), _unit(printed, path), 4)


def _estimate_text(printed: Printed, path: str, estimate: Estimate) -> str:
    """Return value and half the width of its interval in percent; the ends would not differ within four digits."""
    half_width = 50.0 * (estimate.high - estimate.low) / abs(estimate.value)
    return f"{_number_text(printed, path, estimate.value)} \u00b1 {half_width:.2g} %"


def _unit(printed: Printed, path: str) -> str:
    """Return the printed unit; a discharge coefficient is a plain number, whatever the paper prints behind it."""
    return "-" if path.endswith("discharge_coefficient") else printed.unit(path)


def _error_row(claim: Claim) -> tuple[str, str, str, str]:
    name = claim.statement.rpartition(" of the ")[2].rstrip(".")
    return name, quantity(claim.paper, claim.unit, 2), quantity(claim.value, claim.unit, 2), claim.verdict_words
