"""Paper reproduced: runs of its experiments, verdicts on its claims, assumed values, and synthetic recordings.

A synthetic recording contains no information on the paper's device, so no claim rests on it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

from ppafo.analyses.reproduce.claim import Claim, Observation, claim_on_text, verdict_counts
from ppafo.analyses.reproduce.reported_numbers import arithmetic_claims, load_reported
from ppafo.analyses.reproduce.step_response import StepEvents, step_events, step_observations
from ppafo.analyses.reproduce.torque_task import (
    InterpretationOfU,
    control_claims,
    phased_runs,
    readings_of_u,
    torque_task_claims,
    torque_task_observations,
)
from ppafo.errors import DataError, ScenarioError, SimulationError
from ppafo.identification.bench.law import BenchContext, BenchResult
from ppafo.identification.procedures import LAWS
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import Tolerances
from ppafo.parameters import load_parameter_set
from ppafo.parameters.declared import value_at
from ppafo.parameters.overrides import Override, override_set, read_overrides, with_overrides
from ppafo.parameters.parameter_set import SOURCE as OVERRIDE
from ppafo.parameters.parameter_set import entry_text, with_followers
from ppafo.parameters.publications.publication import paper_entries
from ppafo.parameters.records import record_from
from ppafo.progress import Progress, Report, report_nothing
from ppafo.rig import record
from ppafo.signals import Recording
from ppafo.simulation.declaration import OF_A_VANE, quantities
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.overrides import deciding_kinds, is_of_device, override_document, unknown_value
from ppafo.simulation.scenario import PrescribedMotion, Scenario
from ppafo.simulation.simulate import Result, simulate

STEP, SOLENOID, PROPORTIONAL = EXPERIMENTS = ("step-response", "torque-task-solenoid", "torque-task-proportional")
"""Shipped scenarios of the paper's experiments."""
PLANTED_SET, RIG_SEED = "ppafo2011", 1
BENCH_PRESET = "paper-bench"
"""Preset of a bench similar to the paper's, for figures 3 and 7."""
TASK_PRESET = "ideal-laboratory"
"""Preset with the paper's physics and noisy sensors for the torque tasks."""
_NOT_OF_THE_PAPER = ("assumed", "derived")
_ONLY_FOR_A_FREE_VANE = ("actuator.restitution", "foot_plate.gravity_torque")


@dataclass(frozen=True, slots=True)
class AssumedValue:
    """Value of a simulation that is assumed or derived, because the paper does not print it in this form.

    ``path``, ``meaning``, ``value``: dotted path, description, and value with unit
    ``origin``: kind of origin
    ``reason``: reason for the value
    ``source``: source of the reason; empty if the reason needs none
    ``used_by``: experiments that use the value
    """

    path: str
    meaning: str
    value: str
    origin: str
    reason: str
    source: str
    used_by: tuple[str, ...] = ()

    def sentence(self) -> str:
        """Format the assumed value and its reason as one line."""
        source = f" ({self.source})" if self.source else ""
        return f"{self.path} = {self.value}: {self.reason}{source}"


@dataclass(frozen=True, slots=True)
class SyntheticEvidence:
    """Synthetic recordings: both procedures of figure 3, the step response, and both torque tasks."""

    torque: BenchResult
    decay: BenchResult
    step: Recording
    solenoid: Recording
    proportional: Recording


@dataclass(frozen=True, slots=True)
class Reproduction:
    """Result of a reproduction: claims in the paper's order, observations, runs and assumptions.

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
    assumed = assumed_values(scenarios)
    events, supply = step_events(step.recording), step.scenario.device.supply
    step_observed = tuple(step_observations(step.recording, supply, events))
    torque_observed = tuple(torque_task_observations(solenoid, proportional))
    report(Progress(f"simulating {SOLENOID} over the phase of its decisions"))
    (pair_errors, pair_gas), task_assumptions = phased_runs(solenoid), _used_by(assumed, SOLENOID, PROPORTIONAL)
    unpublished = paper_entries()["not_published"]
    # In the order of the report: decided by reported numbers, simulated, and remaining.
    claims = (
        *arithmetic_claims(load_reported()),
        claim_on_text("figure_7_words", step_observed, _used_by(assumed, STEP)),
        *torque_task_claims(pair_errors, pair_gas, proportional, task_assumptions),
        claim_on_text("oscillation_words", torque_observed, task_assumptions),
        *control_claims(solenoid, proportional, pair_errors),
        Claim(unpublished, note=unpublished.not_testable),
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


def assumed_values(scenarios: Mapping[str, Scenario]) -> tuple[AssumedValue, ...]:
    """Return the assumed values of the scenarios, with their displayed names and without duplicates."""
    users: dict[AssumedValue, list[str]] = {}
    for name, scenario in scenarios.items():
        for value in _assumed_in(scenario):
            users.setdefault(value, []).append(name)
    return tuple(replace(value, used_by=tuple(names)) for value, names in users.items())


def _assumed_in(scenario: Scenario) -> Iterator[AssumedValue]:
    """Yield the assumed values of a scenario: those that it states, then those of its parameter set in force."""
    origin = scenario.origin
    changed = override_document(origin.content, read_overrides(origin.overrides), scenario.name)
    written = read_overrides(origin.content["device"].get("overrides", ()))
    file_set = with_overrides(load_parameter_set(origin.parameter_set), written, origin.valve)
    in_force = with_followers(with_overrides(file_set, changed.device, origin.valve))
    declared = {**quantities(changed.document), **in_force.declarations()}
    for stated in scenario.assumptions:
        meaning = declared[stated.path].summary if stated.path in declared else ""
        yield AssumedValue(stated.path, meaning, stated.value, "assumed", stated.note, "")
    settled = {stated.path for stated in scenario.assumptions}
    settled |= set(_ONLY_FOR_A_FREE_VANE) if isinstance(scenario.motion, PrescribedMotion) else set()
    for path, entry in in_force.numbers.items():
        # Reported results are what a run is compared with; of two valves one is in the device.
        is_of_other = path.startswith("valves.") and not path.startswith(f"valves.{origin.valve}.")
        is_of_paper = path.startswith("reported.") or entry.origin not in _NOT_OF_THE_PAPER
        is_set_here = entry.source == OVERRIDE
        is_of_file = is_set_here and file_set.numbers.get(path) == entry
        if path not in settled and not (is_of_other or is_of_paper or is_of_file):
            # A number set for this run says which one it replaces.
            reason, source = (f"set for this run; {entry.note}", "") if is_set_here else (entry.note, entry.source)
            yield AssumedValue(path, declared[path].summary, entry_text(entry), entry.origin, reason, source)


def synthetic_evidence(tasks: Mapping[str, tuple[str, ...]], step_overrides: Sequence[str]) -> SyntheticEvidence | str:
    """Return the recordings of the rig, or an error message if a run fails or the rig does not support the overrides.

    ``tasks`` are the overrides of the torque task for the valves ``solenoid`` and ``proportional``. The procedures of
    figure 3 always use the paper's values, without overrides.
    """
    try:
        recorded = {
            valve: record("torque-task", TASK_PRESET, RIG_SEED, PLANTED_SET, overrides, valve).recording
            for valve, overrides in tasks.items()
        }
        torque, decay = bench_figure()
        return SyntheticEvidence(
            torque=torque,
            decay=decay,
            step=record("step-response", BENCH_PRESET, RIG_SEED, PLANTED_SET, step_overrides).recording,
            **recorded,
        )
    # No claim rests on a recording: without them the figures show less, and the report says why.
    except (SimulationError, DataError) as error:
        return str(error)


@cache
def bench_figure() -> tuple[BenchResult, BenchResult]:
    """Identify torque constant and damping as in figure 3, from synthetic recordings.

    Raises SimulationError if a run of the rig fails.
    """
    # Kept: it takes seconds, and no override reaches it.
    planted, inertia = load_parameter_set(PLANTED_SET), "foot_plate.inertia"
    # The inertia is exact, and nothing is known of the friction.
    known = replace(planted, numbers={inertia: planted.numbers[inertia]})
    context, results = BenchContext(known, "", "figure 3", Tolerances(held=0.0)), list[BenchResult]()
    for kind in ("static-torque", "free-decay"):
        source = RecordingSource(record(kind, BENCH_PRESET, RIG_SEED, PLANTED_SET).recording, user=kind)
        table = record_from(LAWS[kind], {"kind": kind, "recordings": [source.name]})
        results.append(table.run((source,), context))
    return results[0], results[1]
