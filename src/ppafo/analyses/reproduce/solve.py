"""Runs of the paper's experiments and verdicts on its claims."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ppafo.analyses.reproduce.bench import AssumedValue, assumed_values, synthetic_evidence
from ppafo.analyses.reproduce.claim import Claim, Observation, Verdict, claim_on_text, observation, stated_claim
from ppafo.analyses.reproduce.decision_phases import phased_runs
from ppafo.analyses.reproduce.meaning_of_u import readings_of_u
from ppafo.analyses.reproduce.reported_numbers import NOT_PUBLISHED_CLAIM, arithmetic_claims, load_reported
from ppafo.analyses.reproduce.result import PROPORTIONAL, SOLENOID, STEP, Reproduction
from ppafo.analyses.reproduce.step_response import SupplyLevels, step_events, step_observations
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import findings_of
from ppafo.parameters.declared import value_at
from ppafo.parameters.overrides import Override, override_set, read_overrides
from ppafo.parameters.publications.publication import paper_entries
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import Floats
from ppafo.simulation.declaration import OF_A_VANE
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.overrides import deciding_kinds, is_of_device, override_document, unknown_value
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, simulate
from ppafo.wording import count_of

# Torque task: the paper's claims on tracking error and gas, and statements of its text on both valves.

FEWEST_REVERSALS = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0
"""Smallest number of torque reversals on the ramp that counts as the oscillation of the text."""


def torque_task_claims(
    pair_errors: Floats, pair_gas: Floats, proportional: Result, rests_on: tuple[str, ...]
) -> list[Claim]:
    """Return the claims on tracking error and supplied gas, over all phases of the solenoid pair's decisions.

    ``pair_errors`` [N m] and ``pair_gas`` [g] are the result of ``phased_runs``, ``rests_on`` the assumptions of the
    task beyond the paper.
    """
    error = proportional.metrics["rms_error"].value
    gas = GRAMS_PER_KILOGRAM * proportional.metrics["gas_supplied"].value
    over = f"Median and range of {pair_errors.size} runs over the unknown phase of the decisions, either valve first."
    every = "The controller decides every millisecond, so the phase does not matter."
    # Where the pair makes no error, or takes no gas, there is nothing to save from.
    with np.errstate(divide="ignore", invalid="ignore"):
        better, saved = 100.0 * (1.0 - error / pair_errors), 100.0 * (1.0 - gas / pair_gas)
    claim = partial(_claim_over_phases, rests_on=rests_on)
    # No decimals of what varies by several percent over the phases.
    return [
        claim("torque_rms_improvement", better, 0, over),
        claim("co2_solenoid", pair_gas, 1, over),
        claim("co2_proportional", np.array([gas]), 2, every),
        claim("co2_saving", saved, 0, f"{over} Follows from the two amounts of gas and is not independent evidence."),
    ]


def _claim_over_phases(identifier: str, values: Floats, decimals: int, note: str, rests_on: tuple[str, ...]) -> Claim:
    """Return a claim on the median of values (runs,), in the unit of the claim, judged by the window of the claim."""
    entry = paper_entries()[identifier]
    assert entry.at_least is not None, f"{identifier} has a window"
    assert entry.at_most is not None, f"{identifier} has a window"
    window = entry.at_least, entry.at_most
    if not np.isfinite(values).all():
        return stated_claim(identifier, None, "undetermined", note, rests_on, window)
    median, low, high = float(np.median(values)), float(values.min()), float(values.max())
    text = f"{median:.{decimals}f} {entry.unit}"
    if high > low:
        text = f"{text} ({low:.{decimals}f} to {high:.{decimals}f})"
    verdict: Verdict = "met_by_fitted_settings" if window[0] <= median <= window[1] else "undetermined"
    note = f"{note} Accepted from {window[0]:g} to {window[1]:g} {entry.unit}."
    return replace(stated_claim(identifier, median, verdict, note, rests_on, window, text), range=(low, high))


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return the paper's statements on the torque task, each with our numbers."""
    pair_on_ramp, pair_on_hold = _reversals(solenoid, "ramp"), _reversals(solenoid, "hold")
    spool_on_ramp, spool_on_hold = _reversals(proportional, "ramp"), _reversals(proportional, "hold")
    return [
        observation(
            "solenoid_oscillates_on_ramp",
            pair_on_ramp is not None and pair_on_ramp >= FEWEST_REVERSALS,
            f"{_reversals_text(pair_on_ramp, 'ramp')} that swing over 5 % of the largest reference",
        ),
        observation("solenoid_quiet_on_hold", pair_on_hold == 0, _reversals_text(pair_on_hold, "hold")),
        observation(
            "proportional_does_not_oscillate",
            spool_on_ramp == 0 and spool_on_hold == 0,
            f"{_reversals_text(spool_on_ramp, 'ramp')}, {_reversals_text(spool_on_hold, 'hold')}",
        ),
        _tracks_better_on_ramp(solenoid, proportional),
    ]


def _reversals(result: Result, phase: str) -> int | None:
    """Return the number of torque reversals on the ramp or the hold; None if the reference has no such part."""
    metric = result.metrics.get(f"oscillations_{phase}")
    return None if metric is None else round(metric.value)


def _reversals_text(reversals: int | None, phase: str) -> str:
    if reversals is None:
        return f"this reference has no {phase}"
    return f"{count_of(reversals, 'torque reversal')} on the {phase}"


def _tracks_better_on_ramp(solenoid: Result, proportional: Result) -> Observation:
    """Return the observation on the tracking advantage of the proportional valve on the ramp.

    The statement holds if its RMS error on the ramp is lower, by more than on the hold.
    """
    (pair_ramp, pair_hold), (spool_ramp, spool_hold) = (
        (run.metrics.get("rms_error_ramp"), run.metrics.get("rms_error_hold")) for run in (solenoid, proportional)
    )
    identifier = "proportional_tracks_better_on_ramp"
    if not (pair_ramp and pair_hold and spool_ramp and spool_hold):
        return observation(identifier, False, "this reference has no ramp and hold")
    lower_on_ramp = pair_ramp.value - spool_ramp.value
    lower_on_hold = pair_hold.value - spool_hold.value
    return observation(
        identifier,
        lower_on_ramp > 0.0 and lower_on_ramp > lower_on_hold,
        f"RMS error on the ramp {spool_ramp.value:.2f} against {pair_ramp.value:.2f} N m, "
        f"on the hold {spool_hold.value:.2f} against {pair_hold.value:.2f} N m",
    )


# Statements of the paper on switching rate, gains, dead zone and improved control, against runs with such settings.

TUNED = (
    "controller.kind=pid",
    "controller.rate=1 kHz",
    "controller.proportional_gain=1.2 1/(N m)",
    "controller.integral_gain=23 1/(N m s)",
    "controller.derivative_gain=0.0095 s/(N m)",
    "controller.derivative_filter=3.1 ms",
    "controller.anti_windup=4.8 1/s",
)
"""PID gains found by a search for least error and gas, on an ideal valve and on a slow, delayed and noisy valve."""
DEAD_ZONE = (
    "controller.kind=on_off_dead_zone",
    "controller.rate=20 Hz",
    "controller.dead_zone=0.2 N m",
    "controller.release=0.05 N m",
    "controller.opening=1",
)
"""Overrides for an on-off law with a dead zone narrower than the torque change of the solenoid pair in one sample."""
FASTER = ("controller.rate=100 Hz", "valve.switching_interval=10 ms")
"""Overrides for five times the printed switching rate of 20 Hz, which limits the switching interval in the set."""
_RESTS_ON = ("the torque task as completed here",)


def control_claims(solenoid: Result, proportional: Result, pair_errors: Floats) -> list[Claim]:
    """Return the claims on switching rate, gains, dead zone and improved control, all with the verdict undetermined.

    ``pair_errors`` are the RMS errors [N m] of the solenoid pair over the unknown phase of its decisions.
    """
    limited, beyond = paper_entries()["limited_by_switching"], paper_entries()["beyond_improved_control"]
    faster_error = _error_with(solenoid, FASTER)
    if isinstance(faster_error, str):
        faster = stated_claim(limited.id, None, "undetermined", f"{limited.note} {faster_error}.")
    else:
        less = 100.0 * (1.0 - faster_error / pair_errors)
        median, low, high = float(np.median(less)), float(less.min()), float(less.max())
        found = f"{median:.0f} % less error at 100 Hz" + (f" ({low:.0f} to {high:.0f})" if high > low else "")
        faster = stated_claim(limited.id, median, "undetermined", limited.note, _RESTS_ON, None, found)
        faster = replace(faster, range=(low, high))
    return [
        faster,
        _undetermined("gains_minimise_error", proportional, TUNED),
        _undetermined("dead_zone_amplifies_delay", solenoid, DEAD_ZONE),
        stated_claim(beyond.id, None, "undetermined", beyond.not_testable),
    ]


def _error_with(run: Result, overrides: tuple[str, ...]) -> float | str:
    """Return the RMS torque error [N m] of a run's task with overrides, or the error message if the run fails."""
    # Another law takes nothing that was set for this one.
    remaining = [override for override in run.scenario.origin.overrides if not override.startswith("controller.")]
    try:
        return simulate(load_scenario(run.scenario.name, [*remaining, *overrides])).metrics["rms_error"].value
    except (ParameterError, ScenarioError, SimulationError) as error:
        return str(error)


def _undetermined(identifier: str, run: Result, overrides: tuple[str, ...]) -> Claim:
    """Return a claim that depends on unreported settings, with the error of the task under other settings."""
    entry, error = paper_entries()[identifier], run.metrics["rms_error"].value
    changed_error = _error_with(run, overrides)
    if isinstance(changed_error, str):
        return stated_claim(identifier, None, "undetermined", f"{entry.note} {changed_error}.")
    change = 100.0 * (changed_error / error - 1.0)
    sentence = f"{abs(change):.0f} % {'more' if change > 0.0 else 'less'} error"
    note = f"{entry.note} In this task {changed_error:.3f} instead of {error:.3f} N m."
    return stated_claim(identifier, change, "undetermined", note, _RESTS_ON, None, sentence)


EXPERIMENTS = (STEP, SOLENOID, PROPORTIONAL)
"""Shipped scenarios of the paper's experiments."""


def reproduce_paper(overrides: Sequence[str] = (), report: Report = report_nothing) -> Reproduction:
    """Return the reproduction of the paper's own experiments.

    ``overrides`` are texts such as ``supply.pressure=60 psi_g``, each for the experiments that have this path;
    ``report`` receives the progress. Raises ScenarioError for a path that no experiment has, SimulationError if a run
    fails.
    """
    scenarios, runs = _scenarios(overrides), []
    for name, scenario in scenarios.items():
        report(Progress(f"simulating {name}"))
        runs.append(simulate(scenario))
        if not runs[-1].status.is_completed:
            raise SimulationError(f"simulation of scenario '{name}' failed: {runs[-1].status.message}")
    step, solenoid, proportional = runs
    report(Progress("measuring on the simulated test bench (synthetic)"))
    # The rig records with the overrides of the simulations.
    changes = {name: scenario.origin.overrides for name, scenario in scenarios.items()}
    tasks = {"solenoid": changes[SOLENOID], "proportional": changes[PROPORTIONAL]}
    synthetic = synthetic_evidence(tasks, changes[STEP])
    report(Progress("checking the paper's own numbers"))
    reported = load_reported()
    completed = load_parameter_set(step.scenario.origin.parameter_set)
    assumed = assumed_values(scenarios)
    events, supply = step_events(step.recording), step.scenario.device.supply
    levels = SupplyLevels(supply.pressure, supply.atmospheric_pressure)
    step_observed = tuple(step_observations(step.recording, levels, events))
    torque_observed = tuple(torque_task_observations(solenoid, proportional))
    report(Progress(f"simulating {SOLENOID} over the phase of its decisions"))
    (pair_errors, pair_gas), task_assumptions = phased_runs(solenoid), _used_by(assumed, SOLENOID, PROPORTIONAL)
    # In the order of the report: decided by reported numbers, simulated, and remaining.
    claims = (
        *arithmetic_claims(reported),
        claim_on_text(
            "figure_7_words",
            "Statements of the text on pressures and angle of the step response.",
            step_observed,
            _used_by(assumed, STEP),
        ),
        *torque_task_claims(pair_errors, pair_gas, proportional, task_assumptions),
        claim_on_text(
            "oscillation_words",
            "Statements of the text on the oscillation with both valves.",
            torque_observed,
            task_assumptions,
        ),
        *control_claims(solenoid, proportional, pair_errors),
        NOT_PUBLISHED_CLAIM,
    )
    return Reproduction(
        claims=claims,
        step_observations=step_observed,
        torque_observations=torque_observed,
        readings_of_u=readings_of_u(solenoid, proportional),
        step=step,
        step_events=events,
        solenoid=solenoid,
        proportional=proportional,
        synthetic=synthetic,
        assumed=assumed,
        printed_set=reported.parameter_set.name,
        printed_findings=tuple(findings_of(reported.parameter_set)),
        completed_set=completed.name,
        completed_findings=tuple(findings_of(completed)),
        overrides=tuple(overrides),
    )


def _used_by(assumed: Iterable[AssumedValue], *experiments: str) -> tuple[str, ...]:
    """Return the assumptions beyond the paper that the named experiments use, a sentence for each."""
    return tuple(value.sentence() for value in assumed if not set(experiments).isdisjoint(value.used_by))


def _scenarios(overrides: Sequence[str]) -> dict[str, Scenario]:
    """Load the scenarios of the paper's experiments, each with the overrides that apply to it."""
    applied: dict[str, list[Override]] = {name: [] for name in EXPERIMENTS}
    by_path = override_set(read_overrides(overrides, ScenarioError), ScenarioError)
    # Kinds come first, outer ones before inner ones: they decide which numbers there are.
    kinds = [path for path in by_path if path.endswith(".kind")]
    for path in sorted(by_path, key=lambda path: (path not in kinds, path.count("."), path)):
        documents = {
            name: override_document(load_scenario(name).origin.content, earlier, name).document
            for name, earlier in applied.items()
        }
        known = tuple(dict.fromkeys(known for document in documents.values() for known in OF_A_VANE.paths(document)))
        if path not in known and not is_of_device(path) and not deciding_kinds(path, kinds):
            raise unknown_value(by_path[path], known, f"{', '.join(EXPERIMENTS)} have")
        # A scenario that has a section for the value; the device is in all of them.
        section = path.rpartition(".")[0]
        with_section = [
            name
            for name, document in documents.items()
            if (not section or value_at(document, section) is not None) and path in OF_A_VANE.paths(document)
        ]
        for name in with_section or EXPERIMENTS:
            applied[name].append(by_path[path])
    return {name: load_scenario(name, map(str, changes)) for name, changes in applied.items()}
