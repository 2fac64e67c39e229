"""Runs the paper's experiments and judges what the paper claims of them."""

from collections.abc import Iterable, Mapping, Sequence

from ppafo.analyses.reproduce.answer import (
    PROPORTIONAL,
    SOLENOID,
    STEP,
    Reproduction,
)
from ppafo.analyses.reproduce.bench import AssumedValue, assumed_values, synthetic_evidence
from ppafo.analyses.reproduce.claim import (
    Claim,
    Observation,
    arithmetic_claims,
    load_reported,
    not_published_claim,
    told_claim,
)
from ppafo.analyses.reproduce.decision_phases import phased_runs
from ppafo.analyses.reproduce.meaning_of_u import readings_of_u
from ppafo.analyses.reproduce.other_settings import control_claims
from ppafo.analyses.reproduce.step_response import Levels, step_events, step_observations
from ppafo.analyses.reproduce.torque_task import torque_task_claims, torque_task_observations
from ppafo.errors import ScenarioError, SimulationError
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import audit
from ppafo.parameters.overrides import Override, override_set, read_overrides
from ppafo.progress import Progress, Report, report_nothing
from ppafo.simulation.declaration import OF_A_VANE, value_at
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.overrides import apply_overrides, chosen_by, is_of_device, unknown_value
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, simulate

EXPERIMENTS = (STEP, SOLENOID, PROPORTIONAL)
"""Shipped scenarios that stand for the paper's experiments."""
ORDER = (
    "orifice_constants",
    "step_percentages",
    "damping_and_friction",
    "discharge_coefficient",
    "swept_volume",
    "figure_7_words",
    "torque_rms_improvement",
    "co2_solenoid",
    "co2_proportional",
    "co2_saving",
    "oscillation_words",
    "limited_by_switching",
    "gains_minimise_error",
    "dead_zone_amplifies_delay",
    "beyond_improved_control",
    "not_published",
)
"""Every claim: what the reported numbers decide, what is simulated, what is left."""


def reproduce_paper(overrides: Sequence[str] = (), report: Report = report_nothing) -> Reproduction:
    """Return what came of the paper's own experiments.

    ``overrides`` are texts such as ``supply.pressure=60 psi_g``, each for the experiments that have its value;
    ``report`` hears what is being done. ScenarioError for a value that none has, SimulationError for a run that fails.
    """
    scenarios = _scenarios(overrides)
    step, solenoid, proportional = _runs(scenarios, report)
    report(Progress("measuring on the simulated test bench (synthetic)"))
    # The rig records with the overrides of the simulations.
    own = {name: scenario.origin.overrides for name, scenario in scenarios.items()}
    synthetic = synthetic_evidence({"solenoid": own[SOLENOID], "proportional": own[PROPORTIONAL]}, own[STEP])
    report(Progress("checking the paper's own numbers"))
    reported = load_reported()
    completed = load_parameter_set(step.scenario.origin.parameter_set)
    assumed = assumed_values(scenarios)
    events, supply = step_events(step.recording), step.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    step_observed = tuple(step_observations(step.recording, levels, events))
    torque_observed = tuple(torque_task_observations(solenoid, proportional))
    report(Progress(f"simulating {SOLENOID} over the phase of its decisions"))
    claims = (
        *arithmetic_claims(reported),
        told_claim(
            "figure_7_words",
            "What the text tells of the pressures and the angle of the step response.",
            step_observed,
            _used_by(assumed, STEP),
        ),
        *_task_claims(solenoid, proportional, torque_observed, _used_by(assumed, SOLENOID, PROPORTIONAL)),
        not_published_claim(),
    )
    return Reproduction(
        claims=tuple(sorted(claims, key=lambda claim: ORDER.index(claim.id))),
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
        printed_findings=tuple(audit(reported.parameter_set)),
        completed_set=completed.name,
        completed_findings=tuple(audit(completed)),
        overrides=tuple(overrides),
    )


def _runs(scenarios: Mapping[str, Scenario], report: Report) -> list[Result]:
    """Return the run of each experiment, in the order of ``EXPERIMENTS``; SimulationError for one that fails."""
    runs = []
    for name in EXPERIMENTS:
        report(Progress(f"simulating {name}"))
        run = simulate(scenarios[name])
        if not run.status.is_completed:
            raise SimulationError(f"{name}: {run.status.message}")
        runs.append(run)
    return runs


def _used_by(assumed: Iterable[AssumedValue], *experiments: str) -> tuple[str, ...]:
    """Return what any of some experiments rests on beside the paper, a sentence each."""
    return tuple(value.sentence() for value in assumed if not set(experiments).isdisjoint(value.used_by))


def _task_claims(
    solenoid: Result, proportional: Result, observed: Sequence[Observation], rests_on: tuple[str, ...]
) -> list[Claim]:
    """Return the claims on the torque task, over the unknown phase of the solenoid pair's decisions."""
    phased = phased_runs(solenoid)
    return [
        *torque_task_claims(phased, proportional, rests_on),
        told_claim(
            "oscillation_words",
            "What the text tells of the oscillation with both valves.",
            observed,
            rests_on,
        ),
        *control_claims(solenoid, proportional, phased),
    ]


def _scenarios(overrides: Sequence[str]) -> dict[str, Scenario]:
    """Return the experiments, each with the overrides that are meant for it."""
    meant: dict[str, list[Override]] = {name: [] for name in EXPERIMENTS}
    given = override_set(read_overrides(overrides, ScenarioError), ScenarioError)
    # Kinds come first, outer ones before inner ones: they decide which numbers there are.
    kinds = [path for path in given if path.endswith(".kind")]
    for path in sorted(given, key=lambda path: (path not in kinds, path.count("."), path)):
        documents = {
            name: apply_overrides(load_scenario(name).origin.content, earlier, name).document
            for name, earlier in meant.items()
        }
        known = tuple(dict.fromkeys(known for document in documents.values() for known in OF_A_VANE.paths(document)))
        if path not in known and not is_of_device(path) and not chosen_by(path, kinds):
            raise unknown_value(given[path], known, f"{', '.join(EXPERIMENTS)} have")
        # A scenario that has a section for the value; the device is in all of them.
        section = path.rpartition(".")[0]
        having = [
            name
            for name, document in documents.items()
            if (not section or value_at(document, section) is not None) and path in OF_A_VANE.paths(document)
        ]
        for name in having or EXPERIMENTS:
            meant[name].append(given[path])
    return {name: load_scenario(name, map(str, chosen)) for name, chosen in meant.items()}
