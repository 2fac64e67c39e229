"""The paper run again: its experiments, verdicts on its claims, assumed values, and synthetic recordings.

A synthetic recording contains no information on the paper's device, so no claim rests on it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ppafo.analyses.reproduce.claims import Claim, Verdict, verdict_counts
from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.errors import DataError, ParameterError, ScenarioError, SimulationError
from ppafo.identification.bench.law import BenchContext, BenchResult
from ppafo.identification.procedures import LAWS
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import Tolerances
from ppafo.model.plant import actuator_torque
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import findings_of
from ppafo.parameters.audit.evidence import Evidence, ReportedRange, digits
from ppafo.parameters.declared import value_at
from ppafo.parameters.device import Supply
from ppafo.parameters.overrides import Override, override_set, read_overrides, with_overrides
from ppafo.parameters.parameter_set import SOURCE as OVERRIDE
from ppafo.parameters.parameter_set import ParameterSet, entry_text, with_followers
from ppafo.parameters.publications.publication import paper_entries
from ppafo.parameters.records import record_from
from ppafo.progress import Progress, Report, report_nothing
from ppafo.rig import record
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.declaration import OF_A_VANE, quantities
from ppafo.simulation.loading import load_scenario, request_again
from ppafo.simulation.overrides import deciding_kinds, is_of_device, override_document, unknown_value
from ppafo.simulation.scenario import Initial, PrescribedMotion, Scenario
from ppafo.simulation.simulate import Result, simulate
from ppafo.wording import count_of

STEP, SOLENOID, PROPORTIONAL = EXPERIMENTS = ("step-response", "torque-task-solenoid", "torque-task-proportional")
"""Shipped scenarios of the paper's experiments."""
REPORTED_SET = "ppafo2011-printed"
PLANTED_SET = "ppafo2011"
RIG_SEED = 1
BENCH_PRESET = "paper-bench"
"""Preset of a bench similar to the paper's, for figures 3 and 7."""
TASK_PRESET = "ideal-laboratory"
"""Preset with the paper's physics and noisy sensors for the torque tasks."""
_NOT_OF_THE_PAPER = ("assumed", "derived")
_ONLY_FOR_A_FREE_VANE = ("actuator.restitution", "foot_plate.gravity_torque")

_STEP_RANGES = {"position": 110.0, "pressure_1": 55.0, "pressure_2": 55.0, "pressure_difference": 110.0}
"""Reported errors of the step response, and the full ranges [deg, psi] by which the paper divides them."""
_AUDITED = {
    "orifice_constants": (("choked-flow-constant", "subsonic-flow-constant", "critical-pressure-ratio"), 1, 0),
    "damping_and_friction": (("damping-against-inertia", "dynamic-friction-against-inertia"), 1, 0),
    "discharge_coefficient": (("flow-of-solenoid", "flow-of-proportional"), 3, 1),
    "swept_volume": (("virtual-work",), 0, 1),
}
"""Claims that findings of the audit decide: which of the compared numbers is ours, and which value has its unit."""

_SMALLEST_TRAVEL = 1.0e-3
_RESOLUTION = 1.0e-6
"""Smallest fraction of the travel that counts as motion in a simulated recording; measured recordings need more."""
_SAME_ANGLE = 0.5
"""Tolerance for the first and last angle of figure 7 [deg]."""
# Fractions of the pressure range: smallest clear change, and tolerance for a level that is reached or kept.
_CLEAR = 0.05
_SAME = 0.01
_NOTABLE_TIME = 2.0
"""Shortest time [ms] between a full chamber 1 and breakaway that is noted as a difference."""
_SLOWED = 0.5
"""Largest ratio of the slowest rate of fall to the steepest rates before and after that counts as slowed [-]."""
_SETS_OFF = 0.02
"""Fraction of the travel within which pressure 1 peaks, since the chamber still fills while the vane starts."""
PHASES = 20
"""Number of phases of the decisions, evenly spaced over one period; each with valve A and with valve B first."""
_TIE = 1.0e-3
"""Reference [N m] that is large enough to determine the first decision."""
_FINE_STEP = 0.5e-3
"""Time step and output interval of the runs [s], which divide every phase."""
READINGS_OF_U = (("the opening, -1 to 1", 1.0), ("volts, 5 open the valve", 5.0), ("volts, 10 open the valve", 10.0))
"""Interpretations of U of equation (13), each with the U that opens the proportional valve fully."""
WITHIN_REACH = 4.0
"""Reference level [N m] within the reach of the supply."""


class AssumedValue(NamedTuple):
    """Value of a simulation that is assumed or derived, because the paper does not print it in this form.

    ``path``, ``meaning``, ``value``: dotted path, description, and value with unit
    ``origin``: kind of origin
    ``reason``: reason for the value
    ``source``: source of the reason; empty if the reason needs none
    """

    path: str
    meaning: str
    value: str
    origin: str
    reason: str
    source: str


class InterpretationOfU(NamedTuple):
    """Interpretation of U, with the advantage of the proportional valve over the solenoid pair.

    ``error``, ``gas``: reduction of RMS error and of gas [%]
    ``error_within_reach``: reduction of RMS error [%] with a reference level within the reach of the supply
    """

    name: str
    error: float
    gas: float
    error_within_reach: float


class SyntheticEvidence(NamedTuple):
    """Synthetic recordings: both procedures of figure 3 (the paper's values), step response, and both torque tasks."""

    torque: BenchResult
    decay: BenchResult
    step: Recording
    solenoid: Recording
    proportional: Recording


@dataclass(frozen=True, slots=True)
class Reproduction:
    """Result of a reproduction: claims in the paper's order, statements of the text, runs and assumptions.

    ``synthetic`` is the synthetic recordings, or a sentence with the reason if there are none; ``assumed`` has the
    experiments that use each value.
    """

    claims: tuple[Claim, ...]
    step_observations: tuple[Claim, ...]
    torque_observations: tuple[Claim, ...]
    readings_of_u: tuple[InterpretationOfU, ...]
    step: Result
    solenoid: Result
    proportional: Result
    synthetic: SyntheticEvidence | str
    assumed: Mapping[AssumedValue, Sequence[str]]
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
            "readings_of_u": [row._asdict() for row in self.readings_of_u],
            "overrides": list(self.overrides),
            "versions": dict(self.step.versions),
        }


def reproduce_paper(overrides: Sequence[str] = (), report: Report = report_nothing) -> Reproduction:
    """Return the reproduction of the paper's own experiments.

    ``overrides`` are texts such as ``supply.pressure=60 psi_g``, each for the experiments that have this path;
    ``report`` receives the progress. Raises ScenarioError for a path that no experiment has, SimulationError if a run
    fails.
    """
    scenarios = _scenarios(overrides)
    runs = []
    for name, scenario in scenarios.items():
        report(Progress(f"simulating {name}"))
        runs.append(simulate(scenario))
        if not runs[-1].status.is_completed:
            raise SimulationError(f"simulation of scenario '{name}' failed: {runs[-1].status.message}")
    step, solenoid, proportional = runs
    report(Progress("measuring on the simulated test bench (synthetic)"))
    synthetic: SyntheticEvidence | str
    changes = {name: scenario.origin.overrides for name, scenario in scenarios.items()}
    try:
        recorded = [
            record("torque-task", TASK_PRESET, RIG_SEED, PLANTED_SET, changes[name], valve).recording
            for name, valve in ((SOLENOID, "solenoid"), (PROPORTIONAL, "proportional"))
        ]
        results = _bench_figure()
        started = record("step-response", BENCH_PRESET, RIG_SEED, PLANTED_SET, changes[STEP]).recording
        synthetic = SyntheticEvidence(*results, started, *recorded)
    # No claim rests on a recording: without them the figures show less, and the report says why.
    except (SimulationError, DataError) as error:
        synthetic = str(error)
    report(Progress("checking the paper's own numbers"))
    assumed: dict[AssumedValue, list[str]] = {}
    for name, scenario in scenarios.items():
        for value in _assumed_in(scenario):
            assumed.setdefault(value, []).append(name)
    task_assumptions = _used_by(assumed, SOLENOID, PROPORTIONAL)
    step_observed = tuple(step_observations(step.recording, step.scenario.device.supply))
    torque_observed = tuple(torque_task_observations(solenoid, proportional))
    report(Progress(f"simulating {SOLENOID} over the phase of its decisions"))
    pair_errors, pair_gas = phased_runs(solenoid)
    unpublished = paper_entries()["not_published"]
    # In the order of the report: decided by reported numbers, simulated, and remaining.
    claims = (
        *arithmetic_claims(load_parameter_set(REPORTED_SET)),
        _claim_on_text("figure_7_words", step_observed, _used_by(assumed, STEP)),
        *torque_task_claims(pair_errors, pair_gas, proportional, task_assumptions),
        _claim_on_text("oscillation_words", torque_observed, task_assumptions),
        *_control_claims(solenoid, proportional, pair_errors),
        Claim(unpublished, note=unpublished.not_testable),
    )
    return Reproduction(
        claims=claims,
        step_observations=step_observed,
        torque_observations=torque_observed,
        readings_of_u=readings_of_u(solenoid, proportional),
        step=step,
        solenoid=solenoid,
        proportional=proportional,
        synthetic=synthetic,
        assumed=assumed,
        overrides=tuple(overrides),
    )


def _scenarios(overrides: Sequence[str]) -> dict[str, Scenario]:
    """Load the scenarios of the paper's experiments, each with the overrides that apply to it."""
    applied: dict[str, list[Override]] = {name: [] for name in EXPERIMENTS}
    by_path = override_set(read_overrides(overrides, ScenarioError), ScenarioError)
    # Kinds come first, outer ones before inner ones: they decide which numbers there are.
    kinds = [path for path in by_path if path.endswith(".kind")]
    for path in sorted(by_path, key=lambda path: (path not in kinds, path.count("."), path)):
        documents = {
            name: override_document(
                replace(request_again(load_scenario(name).origin), overrides=tuple(earlier))
            ).document
            for name, earlier in applied.items()
        }
        known = {name: OF_A_VANE.paths(document) for name, document in documents.items()}
        paths = tuple(dict.fromkeys(each for of_one in known.values() for each in of_one))
        if path not in paths and not is_of_device(path) and not deciding_kinds(path, kinds):
            raise unknown_value(by_path[path], paths, f"{', '.join(EXPERIMENTS)} have")
        # A scenario that has a section for the value; the device is in all of them.
        section = path.rpartition(".")[0]
        with_section = [
            name
            for name, document in documents.items()
            if path in known[name] and (not section or value_at(document, section) is not None)
        ]
        for name in with_section or EXPERIMENTS:
            applied[name].append(by_path[path])
    return {name: load_scenario(name, map(str, changes)) for name, changes in applied.items()}


# Values beyond the paper.


def _used_by(assumed: Mapping[AssumedValue, Sequence[str]], *experiments: str) -> tuple[str, ...]:
    """Return the assumptions beyond the paper that the named experiments use, a sentence for each."""
    used = (value for value, users in assumed.items() if not set(experiments).isdisjoint(users))
    return tuple(f"{path} = {value}: {why}{source and f' ({source})'}" for path, _, value, _, why, source in used)


def _assumed_in(scenario: Scenario) -> Iterator[AssumedValue]:
    """Yield the assumed values of a scenario: those that it states, then those of its parameter set in force."""
    origin = scenario.origin
    assert origin.parameters is not None, "read from a file"
    changed = override_document(request_again(origin))
    in_force = with_followers(origin.parameters)
    written = read_overrides(origin.content["device"].get("overrides", ()))
    file_set = with_overrides(load_parameter_set(origin.parameter_set), written, origin.valve)
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


@cache
def _bench_figure() -> tuple[BenchResult, BenchResult]:
    """Identify torque constant and damping as in figure 3, from synthetic recordings.

    Raises SimulationError if a run of the rig fails.
    """
    # Kept: it takes seconds, and no override reaches it.
    planted = load_parameter_set(PLANTED_SET)
    inertia = "foot_plate.inertia"
    # The inertia is exact, and nothing is known of the friction.
    known = replace(planted, numbers={inertia: planted.numbers[inertia]})
    context = BenchContext(known, "", "figure 3", Tolerances(held=0.0))
    results = []
    for kind in ("static-torque", "free-decay"):
        source = RecordingSource(record(kind, BENCH_PRESET, RIG_SEED, PLANTED_SET).recording, user=kind)
        table = record_from(LAWS[kind], {"kind": kind, "recordings": [source.name]})
        results.append(table.run((source,), context))
    return results[0], results[1]


# Claims that the reported numbers decide.


def arithmetic_claims(reported: ParameterSet) -> list[Claim]:
    """Return the claims that the paper's numbers alone decide: what the audit of its set finds, and percentages."""
    entries = paper_entries()
    evidence = Evidence(reported)
    found = {finding.id: finding for finding in findings_of(reported)}
    claims = []
    tested = {}
    for identifier, (ids, side, value) in _AUDITED.items():
        findings = [found[name] for name in ids if name in found]
        ours = [(finding.sides[side], finding.values[value].path) for finding in findings]
        numbers = [evidence.in_set_unit(path, own.value) if own.unit else f"{own.value:.4g}" for own, path in ours]
        tested[identifier] = all(finding.severity == "note" for finding in findings), numbers
    holds = True
    percentages = []
    for name, full in _STEP_RANGES.items():
        error, percent = (entries[f"step_{kind}_{name}"].published or 0.0 for kind in ("rms", "percent"))
        # Both numbers are rounded: their ranges have to meet.
        holds &= ReportedRange(*(100.0 * end / full for end in digits(error))).meets(digits(percent))
        percentages.append(f"{100.0 * error / full:.2f}")
    tested["step_percentages"] = holds, [f"{', '.join(percentages)} %"]
    # In the order of the file.
    for entry in (entry for name, entry in entries.items() if name in tested):
        holds, numbers = tested[entry.id]
        verdict: Verdict = "consistent" if holds else "inconsistent_as_reported"
        claims.append(Claim(entry, verdict, None, entry.note, entry.assumed, ", ".join(numbers)))
    return claims


# Statements of the text on the recordings.


def _observed(identifier: str, holds: bool | np.bool, evidence: str, reservation: str = "") -> Claim:
    """Return the verdict of a simulation on a statement of the text; a reservation is what the text does not tell."""
    verdict: Verdict = "met_by_fitted_settings" if holds else "undetermined"
    return Claim(paper_entries()[identifier], verdict, note=reservation, found=evidence)


def _claim_on_text(identifier: str, observed: Sequence[Claim], assumptions: tuple[str, ...]) -> Claim:
    """Return a claim that summarises the paper's statements on a recording."""
    missing = [claim.entry.id for claim in observed if claim.verdict == "undetermined"]
    reserved = [claim for claim in observed if claim.verdict != "undetermined" and claim.note]
    plain = len(observed) - len(missing) - len(reserved)
    notes = [f"Not shown: {', '.join(missing)}."] if missing else []
    notes += [f"With a reservation: {claim.entry.id}, {claim.note}." for claim in reserved]
    return Claim(
        paper_entries()[identifier],
        "undetermined" if missing else "met_by_fitted_settings",
        float(plain),
        " ".join((*notes, "Each statement with its numbers is listed below.")),
        assumptions,
        f"{plain} shown, {len(reserved)} with a reservation" if reserved else f"{plain} shown",
    )


def step_events(recording: Recording, resolution: float = _RESOLUTION) -> tuple[int, int] | None:
    """Return the samples at which the vane breaks away and stops; None if it does not move from rest to rest.

    Breakaway is the last sample at the initial angle, stop the first sample after which the angle stays at its final
    value, both within ``resolution`` times the travel.
    """
    angle = recording["angle"]
    travel = abs(float(angle[-1] - angle[0]))
    if travel < _SMALLEST_TRAVEL:
        return None
    # The last sample at rest, not the first in motion.
    breakaway = int(np.flatnonzero(np.abs(angle - angle[0]) > resolution * travel)[0]) - 1
    stop = int(np.flatnonzero(np.abs(angle - angle[-1]) > resolution * travel)[-1]) + 1
    # Without a sample of rest at either end, and of motion between, nothing can be determined.
    return None if stop >= len(recording) - 1 or stop - breakaway < 2 or breakaway < 1 else (breakaway, stop)


def step_observations(recording: Recording, supply: Supply) -> list[Claim]:
    """Return the verdict of a simulated recording on each statement of the text on the step response.

    The text (section 'PPAFO Model Validation', figure 7): pressure 1 rises until the vane breaks away, falls while the
    vane moves, then approaches the supply pressure; pressure 2 falls, more slowly while chamber 2 is compressed, then
    approaches the atmosphere. No statement holds if the vane does not move.
    """
    entries = paper_entries()
    events = step_events(recording)
    if events is None:
        statements = (name for name, entry in entries.items() if entry.computation == "figure_7")
        return [_observed(name, False, "the vane does not move from rest to rest") for name in statements]
    start, stop = events
    observed = list[Claim]()
    # Gauge pressures [psi], and times [ms].
    time = 1e3 * recording.time
    angle = np.degrees(recording["angle"])
    atmosphere = supply.atmospheric_pressure
    first, second = ((recording[f"pressure_{chamber}"] - atmosphere) / PASCALS_PER_PSI for chamber in (1, 2))
    top = (supply.pressure - atmosphere) / PASCALS_PER_PSI
    clear = _CLEAR * top
    same = _SAME * top

    def only_rises(pressure: Floats) -> bool:
        return bool(pressure[-1] > pressure[0] and np.max(np.maximum.accumulate(pressure) - pressure) < same)

    ends = [entries[name].published or 0.0 for name in ("smallest_angle", "largest_angle")]
    turns = abs(angle[0] - ends[0]) < _SAME_ANGLE and abs(angle[-1] - ends[1]) < _SAME_ANGLE
    evidence = f"from {angle[0]:.1f} to {angle[-1]:.1f} deg in {time[stop] - time[start]:.0f} ms"
    observed.append(_observed("vane_turns_through_its_range", turns, evidence))

    before = first[: start + 1]
    torque = f", at a torque of {recording['torque'][start]:.2f} N m" if "torque" in recording else ""
    evidence = f"from {before[0]:.1f} to {before[-1]:.1f} psig, {100.0 * before[-1] / top:.0f} % of the supply; "
    evidence += f"the vane breaks away after {time[start]:.0f} ms{torque}"
    # Chamber 1 stands at the supply before the vane leaves: then it is chamber 2 that decides when.
    full = int(np.argmax(before > top - same))
    waits = before[full] > top - same and time[start] - time[full] >= _NOTABLE_TIME
    early = (
        f"it reaches the supply pressure already after {time[full]:.0f} ms because the volume at the stop is small, "
    )
    early += "so the falling pressure in chamber 2 starts the vane"
    rises = only_rises(before) and before[-1] - before[0] > clear
    observed.append(_observed("pressure_1_rises_until_breakaway", rises, evidence, early if waits else ""))

    # From the peak near breakaway to the minimum: chamber 1 still fills while the vane sets off.
    gone = np.abs(angle - angle[0]) > _SETS_OFF * np.abs(angle[-1] - angle[0])
    peak = int(np.argmax(first[: int(np.argmax(gone)) + 1]))
    lowest = peak + int(np.argmin(first[peak : stop + 1]))
    further = first[peak] - first[start]
    again = first[stop] - first[lowest]
    rises_on = f"after breakaway it still rises for {time[peak] - time[start]:.0f} ms, by {further:.1f} psi"
    rises_again = f"it rises again by {again:.1f} psi before the stop"
    beyond = (text for rise, text in ((further, rises_on), (again, rises_again)) if rise >= same)
    evidence = f"from {first[peak]:.1f} psig down to {first[lowest]:.1f} psig at {time[lowest]:.0f} ms"
    falls = first[peak] - first[lowest] > clear
    observed.append(_observed("pressure_1_falls_in_motion", falls, evidence, ", and ".join(beyond)))

    evidence = f"from {first[stop]:.1f} psig at the stop ({time[stop]:.0f} ms) to {first[-1]:.1f} psig; "
    fills = only_rises(first[stop:]) and abs(first[-1] - top) < same
    observed.append(_observed("pressure_1_goes_to_supply", fills, f"{evidence}the supply is {top:.1f} psig"))

    falls = abs(second[0] - top) < same and np.all(np.diff(second[: start + 1]) < 0.0)
    evidence = f"from {second[0]:.1f} to {second[start]:.1f} psig until breakaway"
    observed.append(_observed("pressure_2_falls_from_supply", falls, evidence))

    observed.append(_slowing_of_second(second, time, start, stop, same))

    empties = abs(second[-1]) < same
    evidence = f"{second[-1]:.2f} psig at the end"
    observed.append(_observed("pressure_2_goes_to_atmosphere", empties, evidence))

    # From full pressure one way to full pressure the other way: the range twice.
    begins = first[0] - second[0]
    ended = first[-1] - second[-1]
    builds_up = abs(ended - begins - 2.0 * top) < 2.0 * same
    evidence = f"from {begins:.1f} to {ended:.1f} psi"
    return [*observed, _observed("difference_builds_up", builds_up, evidence)]


def _slowing_of_second(second: Floats, time: Floats, start: int, stop: int, same: float) -> Claim:
    """Verdict on the fall of pressure 2 [psi] over times [ms], slower while the vane moves from ``start`` to ``stop``.

    ``same`` is the difference of pressures that counts as none [psi].
    """
    # Gas that only vents would fall at an ever slower rate; gas that is strongly compressed would rise. The rate is of
    # falling [psi/ms], so that a rise is negative and slower than any fall.
    rate = -np.diff(second) / np.diff(time)
    moving = second[start : stop + 1]
    slowest = start + int(np.argmin(rate[start:stop]))
    fast = np.max(rate[: slowest + 1])
    least = rate[slowest]
    later = np.max(rate[slowest:])
    rise = np.max(moving - np.minimum.accumulate(moving))
    most = paper_entries()["pressure_2_slows_in_motion"].at_most or 0.0
    slows = least <= _SLOWED * min(fast, later) and rise <= most
    evidence = f"falls by {fast:.2f} psi/ms at first, {'rises' if least < 0.0 else 'falls'} by {abs(least):.2f} psi/ms "
    evidence += f"at {time[slowest]:.0f} ms, falls by up to {later:.1f} psi/ms later"
    instead = f"instead of only falling more slowly it rises by {rise:.1f} psi" if rise >= same else ""
    return _observed("pressure_2_slows_in_motion", slows, evidence, instead)


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Claim]:
    """Return the verdict of both torque tasks on each statement of the text on their oscillation and error."""
    (pair_ramp, on_pair_ramp), (pair_hold, on_pair_hold) = (_reversals(solenoid, phase) for phase in ("ramp", "hold"))
    (ramp, on_ramp), (hold, on_hold) = (_reversals(proportional, phase) for phase in ("ramp", "hold"))
    fewest = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0
    swings = f"{on_pair_ramp} that swing over 5 % of the largest reference"
    errors = [[run.metrics.get(f"rms_error_{phase}") for run in (solenoid, proportional)] for phase in ("ramp", "hold")]
    tracks_better = False
    evidence = "this reference has no ramp and hold"
    if len(known := [metric.value for pair in errors for metric in pair if metric]) == 4:
        # The proportional valve has the lower error on the ramp, by more than on the hold.
        tracks_better = known[0] - known[1] > max(0.0, known[2] - known[3])
        evidence = f"RMS error on the ramp {known[1]:.2f} against {known[0]:.2f} N m, "
        evidence += f"on the hold {known[3]:.2f} against {known[2]:.2f} N m"
    return [
        _observed("solenoid_oscillates_on_ramp", pair_ramp is not None and pair_ramp >= fewest, swings),
        _observed("solenoid_quiet_on_hold", pair_hold == 0, on_pair_hold),
        _observed("proportional_does_not_oscillate", ramp == 0 and hold == 0, f"{on_ramp}, {on_hold}"),
        _observed("proportional_tracks_better_on_ramp", tracks_better, evidence),
    ]


def _reversals(result: Result, phase: str) -> tuple[int | None, str]:
    """Return the number of torque reversals on the ramp or the hold, None without such a part, and it in words."""
    metric = result.metrics.get(f"oscillations_{phase}")
    if metric is None:
        return None, f"this reference has no {phase}"
    return round(metric.value), f"{count_of(round(metric.value), 'torque reversal')} on the {phase}"


# Torque task: it starts with an error of exactly 0, so that the first decision is undefined and the phase of the pair's
# decisions unknown. The pair is simulated for each phase, with either valve first.


def phased_runs(solenoid: Result) -> tuple[Floats, Floats]:
    """Return RMS torque error [N m] and supplied gas [g] of the solenoid pair's task for each phase of its decisions.

    Both have shape (runs,), with valve A first and then with valve B first. Run number ``PHASES``, a whole period with
    A first, is the scenario as written. If the task has no undefined phase, there is only the given run.
    """
    scenario = solenoid.scenario
    reference = solenoid.scenario.reference
    period = solenoid.scenario.controller.period
    # Two runs are joined by their pressures, which are the whole state only of a locked vane at constant temperature
    # without lines; and a tie is only where reference and torque both begin at 0.
    has_tie = (
        scenario.controller.kind == "on_off"
        and isinstance(scenario.motion, PrescribedMotion)
        and scenario.motion.kind == "locked"
        and scenario.gas_model is None
        and scenario.supply_lines is None
        and reference.kind == "ramp_hold"
        and reference.ramp_start == 0.0
        and reference.start_level == 0.0
        and reference.ramp_time > period
        and scenario.run.duration > period
    )
    if not has_tie:
        gas = GRAMS_PER_KILOGRAM * solenoid.metrics["gas_supplied"].value
        return np.array([solenoid.metrics["rms_error"].value]), np.array([gas])
    fine = replace(scenario.run, step=_FINE_STEP, output_interval=_FINE_STEP)
    duration = scenario.run.duration
    slope = reference.settings["level"] / reference.settings["ramp_time"]
    runs = []
    for tie in (_TIE, -_TIE):
        # Until the first decision, a constant reference just off 0 calls one valve at once and holds it on.
        constant = _with_reference(scenario, start_level=tie, level=tie)
        start = simulate(replace(constant, run=replace(fine, duration=period))).recording
        for number in range(1, PHASES + 1):
            phase = period * number / PHASES
            last = round(phase / _FINE_STEP)
            # After it the task continues from the pressures at this time.
            onward = _with_reference(
                scenario, start_level=slope * phase, ramp_time=reference.settings["ramp_time"] - phase
            )
            initial = Initial(float(start["pressure_1"][last]), float(start["pressure_2"][last]))
            run = replace(fine, duration=duration - phase)
            continued = simulate(replace(onward, run=run, initial=initial)).metrics
            error_before = slope * start.time[: last + 1] - start["torque"][: last + 1]
            # Mean squares of both parts, each with its time.
            square = phase * float(np.mean(error_before**2)) + (duration - phase) * continued["rms_error"].value ** 2
            gas = float(start["supplied_mass"][last]) + continued["gas_supplied"].value
            runs.append((float(np.sqrt(square / duration)), GRAMS_PER_KILOGRAM * gas))
    errors, gas_masses = np.array(runs).T
    return errors, gas_masses


def _with_reference(scenario: Scenario, **settings: float) -> Scenario:
    """Return a scenario with changed settings [SI] of its reference."""
    reference = scenario.reference
    return replace(scenario, reference=replace(reference, settings={**reference.settings, **settings}))


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
    follows = "Follows from the two amounts of gas and is not independent evidence."
    # Where the pair makes no error, or takes no gas, there is nothing to save from.
    with np.errstate(divide="ignore", invalid="ignore"):
        better = 100.0 * (1.0 - error / pair_errors)
        saved = 100.0 * (1.0 - gas / pair_gas)
    # No decimals of what varies by several percent over the phases.
    return [
        _claim_over_phases("torque_rms_improvement", better, over, rests_on),
        _claim_over_phases("co2_solenoid", pair_gas, over, rests_on, 1),
        _claim_over_phases("co2_proportional", np.array([gas]), every, rests_on, 2),
        _claim_over_phases("co2_saving", saved, f"{over} {follows}", rests_on),
    ]


def _claim_over_phases(
    identifier: str, values: Floats, note: str, rests_on: tuple[str, ...], decimals: int = 0, words: str = ""
) -> Claim:
    """Return a claim on the median of values (runs,) in the unit of the claim, judged by its range, if it has one."""
    entry = paper_entries()[identifier]
    if not np.isfinite(values).all():
        return Claim(entry, "undetermined", None, note, rests_on)
    median, low, high = (float(value) for value in (np.median(values), values.min(), values.max()))
    ends = f" ({low:.{decimals}f} to {high:.{decimals}f})" if high > low else ""
    found = f"{median:.{decimals}f} {words or entry.unit}{ends}"
    if entry.at_least is not None:
        note = f"{note} Accepted from {entry.at_least:g} to {entry.at_most:g} {entry.unit}."
    claim = Claim(entry, "undetermined", median, note, rests_on, found, (low, high))
    is_met = entry.at_least is not None and not claim.is_missed
    return replace(claim, verdict="met_by_fitted_settings") if is_met else claim


def _control_claims(solenoid: Result, proportional: Result, pair_errors: Floats) -> list[Claim]:
    """Return the claims on switching rate, gains, dead zone and improved control, all with the verdict undetermined.

    Runs with the settings of each are compared with the experiments; ``pair_errors`` are the RMS errors [N m] of the
    solenoid pair over the unknown phase of its decisions.
    """
    claims = []
    faster = "limited_by_switching"
    rests_on = ("the torque task as completed here",)
    runs = {faster: solenoid, "gains_minimise_error": proportional, "dead_zone_amplifies_delay": solenoid}
    for identifier, run in runs.items():
        entry = paper_entries()[identifier]
        own = run.scenario.origin.overrides
        # Another law takes nothing that was set for this one.
        overrides = [override for override in own if not override.startswith("controller.")]
        overrides += [f"{path}={value}" for path, value in entry.arguments.items()]
        try:
            changed = simulate(load_scenario(run.scenario.name, overrides)).metrics["rms_error"].value
        except (ParameterError, ScenarioError, SimulationError) as failure:
            claims.append(Claim(entry, "undetermined", note=f"{entry.note} {failure}."))
            continue
        if identifier == faster:
            less = 100.0 * (1.0 - changed / pair_errors)
            words = "% less error at 100 Hz"
            claims.append(_claim_over_phases(faster, less, entry.note, rests_on, words=words))
            continue
        error = run.metrics["rms_error"].value
        value = 100.0 * (changed / error - 1.0)
        found = f"{abs(value):.0f} % {'more' if value > 0.0 else 'less'} error"
        note = f"{entry.note} In this task {changed:.3f} instead of {error:.3f} N m."
        claims.append(Claim(entry, "undetermined", value, note, rests_on, found))
    beyond = paper_entries()["beyond_improved_control"]
    return [*claims, Claim(beyond, "undetermined", note=beyond.not_testable)]


def readings_of_u(solenoid: Result, proportional: Result) -> tuple[InterpretationOfU, ...]:
    """Return the comparison of the valves for each interpretation of U, the command of equation (13).

    The result is empty if another control law or reference is used.
    """
    pair = solenoid.scenario
    spool = proportional.scenario
    if spool.controller.kind != "pid" or {pair.reference.kind, spool.reference.kind} != {"ramp_hold"}:
        return ()

    def both(scenario: Scenario) -> list[float]:
        """RMS error and gas of a task, and RMS error within the reach of the supply."""
        metrics, within = (simulate(run).metrics for run in (scenario, _with_reference(scenario, level=WITHIN_REACH)))
        return [metrics["rms_error"].value, metrics["gas_supplied"].value, within["rms_error"].value]

    readings = []
    against = both(pair)
    for name, full in READINGS_OF_U:
        # Volts times a gain for volts give the same opening.
        own = spool.controller.settings
        gains = ("proportional_gain", "integral_gain", "derivative_gain")
        settings = {**own, **{gain: own[gain] / full for gain in gains}}
        read = replace(spool, controller=replace(spool.controller, settings=settings))
        less = (100.0 * (1.0 - value / other) for value, other in zip(both(read), against, strict=True))
        readings.append(InterpretationOfU(name, *less))
    return tuple(readings)


def result_on_u(rows: Sequence[InterpretationOfU]) -> tuple[str, ...]:
    """Return the conclusion from the interpretations of U as a sentence; empty if the numbers do not support it."""
    entries = paper_entries()
    error = entries["torque_rms_improvement"]
    saving = entries["co2_saving"]
    low = error.at_least or 0.0
    high = error.at_most or 0.0
    least = saving.at_least or 0.0
    # The first reading is the opening itself, the others are voltages.
    agrees = [low <= row.error <= high for row in rows]
    is_beyond_reach = not any(low <= row.error_within_reach <= high for row in rows)
    if agrees != [True, False, False] or not is_beyond_reach or any(row.gas < least for row in rows):
        return ()
    return ("15 % less error needs U as the opening and a reference above the torque ceiling; less gas needs neither.",)


def holding_torque(result: Result) -> float:
    """Largest static torque for the supply of a result [N m]; equation (2), other chamber at atmosphere."""
    device = result.scenario.device
    supply = device.supply
    return actuator_torque(supply.pressure, supply.atmospheric_pressure, device.actuator.torque_constant)
