"""The paper's parameters identified once more, from synthetic bench recordings with the paper's values planted.

Two presets of the rig record each experiment. `ideal-laboratory` has the paper's physics and shows whether a procedure
returns what was planted. `paper-bench` adds effects that the paper's laws do not know, and shows what they do to it.

What a synthetic recording shows is that the procedure works. It says nothing about the paper's device, so that none of
these claims is ever plainly reproduced.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import DataError, ParameterError, SimulationError
from ppafo.identification.bench import (
    BenchResult,
    FreeDecaySettings,
    OpenValveFlowSettings,
    VaneLeakSettings,
    free_decay,
    open_valve_flow,
    static_torque,
    vane_leak,
)
from ppafo.identification.bench.flow_laws import GasAt
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source
from ppafo.parameters import ParameterSet, load_device, load_parameter_set
from ppafo.parameters import apply_overrides as apply_to_set
from ppafo.parameters.audit.evidence import Interval, digits
from ppafo.parameters.parameter_set import SOURCE as OVERRIDE
from ppafo.parameters.parameter_set import Entry, number_in_si, number_text
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.reproduce.claim import PRINTED_DIGITS, Claim, Printed, Verdict, stated_claim
from ppafo.rig import record
from ppafo.signals import Recording
from ppafo.simulation.declaration import quantities
from ppafo.simulation.overrides import apply_overrides
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, Scenario
from ppafo.validation import RecordingAgreement, ReplaySettings, compare_recording
from ppafo.validation.measured import check_recording

_NOT_OF_THE_PAPER = ("assumed", "derived")
_ONLY_FOR_A_FREE_VANE = frozenset({"actuator.restitution", "foot_plate.gravity_torque"})


@dataclass(frozen=True, slots=True)
class AssumedValue:
    """A value that the paper does not print as it is used: path, meaning, value with unit, reason, and who uses it.

    ``source`` is what the reason goes by, empty where the reason says it all.
    """

    path: str
    meaning: str
    value: str
    origin: str
    reason: str
    source: str
    used_by: tuple[str, ...]

    def sentence(self) -> str:
        """Return the value and its reason on one line."""
        return f"{self.path} = {self.value}: {self.reason}{f' ({self.source})' if self.source else ''}"


def assumed_values(scenarios: Mapping[str, Scenario]) -> tuple[AssumedValue, ...]:
    """Return what the scenarios rest on, by the name that a reader knows them by; the same value is listed once."""
    merged: dict[tuple[str, str, str], AssumedValue] = {}
    for name, scenario in scenarios.items():
        changed = apply_overrides(scenario.origin.content, scenario.origin.overrides, scenario.name)
        origin = scenario.origin
        written = origin.content["device"].get("overrides", ())
        of_file = apply_to_set(load_parameter_set(origin.parameter_set), written, origin.valve)
        in_force = apply_to_set(of_file, changed.device, scenario.origin.valve)
        summaries = {path: quantity.summary for path, quantity in quantities(changed.document).items()}
        summaries |= {path: quantity.summary for path, quantity in in_force.declarations().items()}
        own = [
            AssumedValue(item.path, summaries.get(item.path, ""), item.value, "assumed", item.note, "", (name,))
            for item in scenario.assumptions
        ]
        settled = {item.path for item in own} | _without_effect(scenario, in_force)
        from_set = [
            AssumedValue(path, summaries[path], number_text(entry), entry.origin, *_reason(entry), (name,))
            for path, entry in in_force.numbers.items()
            if path not in settled
            and entry.origin in _NOT_OF_THE_PAPER
            and not (entry.source == OVERRIDE and of_file.numbers.get(path) == entry)
        ]
        for value in [*own, *from_set]:
            key = (value.path, value.value, value.reason)
            earlier = merged.get(key)
            merged[key] = value if earlier is None else replace(earlier, used_by=(*earlier.used_by, name))
    return tuple(merged.values())


def values_used_by(values: Sequence[AssumedValue], *names: str) -> tuple[AssumedValue, ...]:
    """Return the values that at least one of the named experiments uses."""
    return tuple(value for value in values if set(names) & set(value.used_by))


def _without_effect(scenario: Scenario, parameter_set: ParameterSet) -> set[str]:
    """Return the paths of the set that the run does not use."""
    reported = {path for path in parameter_set.numbers if path.startswith("reported.")}
    valve = f"valves.{scenario.origin.valve}."
    others = {path for path in parameter_set.numbers if path.startswith("valves.") and not path.startswith(valve)}
    return reported | others | (_ONLY_FOR_A_FREE_VANE if isinstance(scenario.motion, PrescribedMotion) else frozenset())


def _reason(entry: Entry) -> tuple[str, str]:
    """Return reason and source; what was set for this run says what it replaces."""
    return (f"set for this run; {entry.note}", "") if entry.source == OVERRIDE else (entry.note, entry.source)


PLANTED_SET = "ppafo2011"
IDEAL, REALISTIC = "ideal-laboratory", "paper-bench"
RIG_SEED = 1
VALVES = ("proportional", "solenoid")


@dataclass(frozen=True, slots=True)
class IdentifiedValue:
    """A parameter of the paper: the planted value [SI] and what the procedure makes of both presets."""

    path: str
    experiment: str
    planted: float
    ideal: Estimate
    realistic: Estimate


@dataclass(frozen=True, slots=True)
class BenchStudy:
    """Every identified value, and both procedures of figure 3 on ``paper-bench``."""

    values: tuple[IdentifiedValue, ...]
    torque: BenchResult
    decay: BenchResult

    def __getitem__(self, path: str) -> IdentifiedValue:
        """Return the value at a path of the parameter set; KeyError where none was identified."""
        for value in self.values:
            if value.path == path:
                return value
        raise KeyError(path)


@cache
def bench_study() -> BenchStudy:
    """Identify the paper's parameters from synthetic recordings; SimulationError where the rig gives up."""
    planted, gas = load_parameter_set(PLANTED_SET), load_device(PLANTED_SET).gas
    gas_at = GasAt(gas.molar_mass, gas.heat_capacity_ratio, gas.temperature)

    def number(path: str) -> float:
        value = number_in_si(planted, path)
        if value is None:
            raise ParameterError(f"{planted.file}: '{path}' is missing; the identification from the rig needs it")
        return value

    def on_both(
        experiment: str, procedure: Callable[[tuple[Source, ...]], BenchResult], valve: str | None = None
    ) -> tuple[BenchResult, BenchResult]:
        ideal, realistic = (
            procedure((Source(record(experiment, preset, RIG_SEED, PLANTED_SET, valve=valve).recording),))
            for preset in (IDEAL, REALISTIC)
        )
        return ideal, realistic

    def identified(path: str, experiment: str, results: tuple[BenchResult, BenchResult]) -> IdentifiedValue:
        return IdentifiedValue(path, experiment, number(path), results[0][path], results[1][path])

    torque = on_both("static-torque", static_torque)
    inertia = FreeDecaySettings(inertia=number("foot_plate.inertia"), inertia_source="as planted")
    decay = on_both("free-decay", partial(free_decay, settings=inertia))
    opening = VaneLeakSettings(gas_at, discharge_coefficient=number("actuator.leak.discharge_coefficient"))
    leak = on_both("vane-leak-steady", partial(vane_leak, settings=opening))
    values = [
        identified("actuator.torque_constant", "static-torque", torque),
        identified("friction.static_torque", "static-torque", torque),
        identified("friction.viscous_damping", "free-decay", decay),
        identified("friction.dynamic_torque", "free-decay", decay),
    ]
    for valve in VALVES:
        path = f"valves.{valve}"
        of_valve = OpenValveFlowSettings(gas_at, area=number(f"{path}.area"), path=path)
        flow = on_both("open-valve-flow", partial(open_valve_flow, settings=of_valve), valve)
        values.append(identified(f"{path}.discharge_coefficient", "open-valve-flow", flow))
    values.append(identified("actuator.leak.area", "vane-leak-steady", leak))
    return BenchStudy(tuple(values), torque[1], decay[1])


STEP_PRESET = REALISTIC
"""The bench as it may have been: a validation against the model's own physics would show nothing."""
TASK_PRESET = IDEAL
"""The paper's physics behind noisy sensors: on ``paper-bench`` the proportional valve's task alone takes 6 s."""


@dataclass(frozen=True, slots=True)
class SyntheticEvidence:
    """Parameters identified on the rig, the step response compared with the model, and both torque tasks."""

    bench: BenchStudy
    step: RecordingAgreement
    solenoid: Recording
    proportional: Recording


@dataclass(frozen=True, slots=True)
class NoEvidence:
    """Why there is no synthetic measurement, in one sentence."""

    reason: str


def synthetic_evidence(
    step: Scenario, tasks: Mapping[str, tuple[str, ...]], step_overrides: Sequence[str]
) -> SyntheticEvidence | NoEvidence:
    """Return what the rig records, or why it cannot: the extra is missing, or it cannot follow the overrides.

    ``tasks`` has the overrides of the torque task by valve, ``solenoid`` and ``proportional``. The bench keeps the
    paper's values whatever is overridden.
    """
    try:
        recorded = {
            valve: record("torque-task", TASK_PRESET, RIG_SEED, PLANTED_SET, overrides, valve).recording
            for valve, overrides in tasks.items()
        }
        recording = record("step-response", STEP_PRESET, RIG_SEED, PLANTED_SET, step_overrides).recording
        measured = check_recording(recording, step.device, "step-response on the virtual rig (synthetic)")
        return SyntheticEvidence(
            bench=bench_study(),
            step=compare_recording(measured, step.device, replay_of(step)),
            solenoid=recorded["solenoid"],
            proportional=recorded["proportional"],
        )
    except (SimulationError, DataError) as error:
        return NoEvidence(str(error))


def replay_of(step: Scenario) -> ReplaySettings:
    """How a recording of the step response is replayed: with the leg that the scenario has."""
    leg = step.motion.leg if isinstance(step.motion, FreeMotion) else None
    return ReplaySettings() if leg is None else ReplaySettings(motion="leg", leg=leg)


ACCEPTABLE = 0.10
"""Fraction of the full range [-] that the paper calls an acceptable RMS error."""
_NO_CURVES = "Needs the measured curves of figure 7; only a picture of them is published."
_ONLY_THE_PROCEDURE = "The measurement is synthetic: it shows that the procedure works, not that the paper's device"


@dataclass(frozen=True, slots=True)
class _Parameter:
    """A printed parameter that the bench gives: what the paper says, why it stays open without one, which preset."""

    id: str
    path: str
    statement: str
    reason: str
    preset: str
    why: str


@dataclass(frozen=True, slots=True)
class _StepError:
    """A printed root-mean-square difference between simulation and measurement.

    ``full_range`` is the paper's, ``scale`` the unit in SI.
    """

    id: str
    full_range: float
    channel: str
    scale: float


_PARAMETERS = (
    _Parameter(
        "k_actuator",
        "actuator.torque_constant",
        "The actuator's torque per pressure difference is the slope of figure 3.",
        "Needs the recording of static torque over rising and falling pressure; only a picture of it is published.",
        REALISTIC,
        "with every effect of a bench on",
    ),
    _Parameter(
        "static_friction",
        "friction.static_torque",
        "The largest static friction is half the difference between falling and rising pressure in figure 3.",
        "Needs the same recording of static torque as the torque constant.",
        IDEAL,
        "for on paper-bench friction grows with the pressure and is not one number",
    ),
    _Parameter(
        "leak_area",
        "actuator.leak.area",
        "The leak across the vane passes as much as an opening of this area.",
        "Needs the measured flow across the vane, its pressures and its discharge coefficient; none is legible.",
        IDEAL,
        "for on paper-bench a part of the leak is laminar and has no area",
    ),
)
_STEP_ERRORS = (
    _StepError("step_rms_position", 110.0, "angle", math.pi / 180.0),
    _StepError("step_rms_pressure_1", 55.0, "pressure_1", PASCALS_PER_PSI),
    _StepError("step_rms_pressure_2", 55.0, "pressure_2", PASCALS_PER_PSI),
    _StepError("step_rms_pressure_difference", 110.0, "pressure_difference", PASCALS_PER_PSI),
)


def measured_claims(
    printed: Printed, evidence: SyntheticEvidence | NoEvidence, assumed: Sequence[AssumedValue]
) -> list[Claim]:
    """Return the claims that need a measurement: torque constant, static friction, leak and the step response.

    ``assumed`` is what the simulated step response rests on.
    """
    if isinstance(evidence, NoEvidence):
        no_rig = f"No synthetic measurement stands in for it: {evidence.reason}."
        return [
            *(
                Claim(
                    id=item.id,
                    statement=item.statement,
                    paper=printed.number(item.path),
                    value=None,
                    unit=printed.unit(item.path),
                    verdict="not_testable",
                    source=printed.source(item.path),
                    note=f"{item.reason} {no_rig}",
                )
                for item in _PARAMETERS
            ),
            *(
                stated_claim(identifier, None, "not_testable", f"{_NO_CURVES} {no_rig}")
                for identifier in (*(item.id for item in _STEP_ERRORS), "step_error_correlation")
            ),
            *_step_percentages(),
        ]
    rests_on = tuple(value.sentence() for value in assumed)
    return [
        *(_identification_claim(printed, item, evidence.bench) for item in _PARAMETERS),
        *(_step_error(item, evidence.step, rests_on) for item in _STEP_ERRORS),
        *_step_percentages(),
        _error_correlation(evidence.step),
    ]


def _identification_claim(printed: Printed, item: _Parameter, bench: BenchStudy) -> Claim:
    """Ask whether the identified interval holds the planted value, which is the paper's, to its printed digits."""
    found = bench[item.path].ideal if item.preset == IDEAL else bench[item.path].realistic
    holds = printed.range(item.path).meets(Interval(found.low, found.high))
    value, low, high = (printed.in_printed_unit(item.path, number) for number in (found.value, found.low, found.high))
    unit = printed.unit(item.path)
    note = (
        f"{_ONLY_THE_PROCEDURE} has this value. The paper's value was planted in the virtual rig "
        f"(preset {item.preset}, {item.why}); the {100.0 * found.confidence:g}% interval, "
        f"{low:.4g} to {high:.4g} {unit}, "
        f"{'holds' if holds else 'does not hold'} it."
    )
    return Claim(
        id=item.id,
        statement=item.statement,
        paper=printed.number(item.path),
        value=value,
        unit=unit,
        verdict=_verdict(holds),
        source=printed.source(item.path),
        note=note,
        assumptions=(_rig(item.preset),),
        is_synthetic=True,
        left_open=(low, high),
        open_by="the interval of the identification",
    )


def _step_error(item: _StepError, agreement: RecordingAgreement, rests_on: tuple[str, ...]) -> Claim:
    """Judge an RMS error by the range that the paper calls acceptable."""
    channel = next(channel for channel in agreement.channels if channel.channel == item.channel)
    value, plain = channel.rms / item.scale, channel.rms_unaligned / item.scale
    unit = paper_entries()[item.id].unit
    fraction, plain_fraction = value / item.full_range, plain / item.full_range
    holds = fraction <= ACCEPTABLE
    delay = f"{1e3 * agreement.delay.correction:.1f} ms"
    note = (
        f"{_ONLY_THE_PROCEDURE} behaved so. Model against the virtual rig (preset {STEP_PRESET}): {fraction:.1%} of "
        f"the full range of {item.full_range:g} {unit}, {'within' if holds else 'beyond'} the {ACCEPTABLE:.0%} "
        f"that the paper calls acceptable. The rig's delay of {delay} was removed; with it the error is {plain:.2g} "
        f"{unit}, {plain_fraction:.1%}{'' if plain_fraction <= ACCEPTABLE else ', which is beyond'}."
    )
    return stated_claim(
        item.id,
        value,
        _verdict(holds),
        note,
        (
            _rig(STEP_PRESET),
            f"the delay of {delay} is removed: the paper does not state whether it shifted its curves",
            f"the error is taken over {agreement.measured.duration:g} s: the paper does not state over which time",
            *rests_on,
        ),
        is_synthetic=True,
    )


def _step_percentages() -> list[Claim]:
    """Return the printed percentages beside the printed errors over the printed ranges."""
    claims = []
    for item in _STEP_ERRORS:
        identifier = item.id.replace("step_rms", "step_percent")
        error, percent = (paper_entries()[name].published or 0.0 for name in (item.id, identifier))
        value = 100.0 * error / item.full_range
        low, high = (100.0 * end / item.full_range for end in digits(error))
        holds = Interval(low, high).meets(digits(percent))
        note = f"{error:g} over {item.full_range:g} is {value:.2f} %."
        claim = stated_claim(identifier, value, "reproduced" if holds else "contradicted", note)
        claims.append(replace(claim, left_open=(low, high), open_by=PRINTED_DIGITS))
    return claims


def _error_correlation(agreement: RecordingAgreement) -> Claim:
    """Return the correlation of the errors of both pressures on the rig, by the same arithmetic as the paper's."""
    entries, rms = paper_entries(), {channel.channel: channel.rms for channel in agreement.channels}
    first, second, difference = (rms[name] for name in ("pressure_1", "pressure_2", "pressure_difference"))
    value = (first**2 + second**2 - difference**2) / (2.0 * first * second)
    entry = entries["step_error_correlation"]
    holds = (entry.at_least or -1.0) <= value <= (entry.at_most or 1.0)
    printed = [entries[f"step_rms_pressure_{number}"].published or 0.0 for number in (1, 2)]
    ours, theirs = ("larger" if one > other else "smaller" for one, other in ((first, second), printed))
    note = (
        f"{entry.note} {_ONLY_THE_PROCEDURE} has such errors: the rig's error in chamber 1 is {ours} than that in "
        f"chamber 2, the paper's is {theirs}."
    )
    return stated_claim(entry.id, value, _verdict(holds), note, (_rig(STEP_PRESET),), is_synthetic=True)


def _verdict(holds: bool) -> Verdict:
    return "shown_on_synthetic" if holds else "contradicted"


def _rig(preset: str) -> str:
    return f"the measurement is synthetic: virtual rig, preset {preset}, seed {RIG_SEED}, the paper's values planted"
