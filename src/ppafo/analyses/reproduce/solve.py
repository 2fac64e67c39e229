"""Runs the paper's experiments and judges what the paper claims of them."""

from collections.abc import Sequence

from ppafo.analyses.reproduce.answer import (
    PROPORTIONAL,
    SOLENOID,
    STEP,
    Reproduction,
)
from ppafo.analyses.reproduce.bench import assumed_values, synthetic_evidence
from ppafo.analyses.reproduce.claim import arithmetic_claims, load_reported, not_published_claim, told_claim
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
    """Return what came of the paper's own experiments."""
    scenarios = _scenarios(overrides)
    runs: list[Result] = []
    for name in EXPERIMENTS:
        report(Progress(f"simulating {name}"))
        runs.append(simulate(scenarios[name]))
        if not runs[-1].status.is_completed:
            raise SimulationError(f"{name}: {runs[-1].status.message}")
    step, solenoid, proportional = runs
    report(Progress("measuring on the simulated test bench (synthetic)"))
    # The rig records with the overrides of the simulations.
    meant = {name: scenario.origin.overrides for name, scenario in scenarios.items()}
    tasks = {"solenoid": meant[SOLENOID], "proportional": meant[PROPORTIONAL]}
    synthetic = synthetic_evidence(tasks, meant[STEP])
    report(Progress("checking the paper's own numbers"))
    reported = load_reported()
    completed = load_parameter_set(step.scenario.origin.parameter_set)
    assumed = assumed_values(scenarios)
    of_step = tuple(value.sentence() for value in assumed if STEP in value.used_by)
    of_task = tuple(value.sentence() for value in assumed if {SOLENOID, PROPORTIONAL} & set(value.used_by))
    events, supply = step_events(step.recording), step.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    step_observed = tuple(step_observations(step.recording, levels, events))
    torque_observed = tuple(torque_task_observations(solenoid, proportional))
    report(Progress(f"simulating {SOLENOID} over the phase of its decisions"))
    phased = phased_runs(solenoid)
    claims = [
        *arithmetic_claims(reported),
        told_claim(
            "figure_7_words",
            "What the text tells of the pressures and the angle of the step response.",
            step_observed,
            of_step,
        ),
        *torque_task_claims(phased, proportional, of_task),
        told_claim(
            "oscillation_words",
            "What the text tells of the oscillation with both valves.",
            torque_observed,
            of_task,
        ),
        *control_claims(solenoid, proportional, phased),
        not_published_claim(),
    ]
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
