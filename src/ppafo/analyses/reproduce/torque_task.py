"""Torque task of the paper: phases of the solenoid pair's decisions, claims, statements of the text, and meanings of U.

The task starts with an error of exactly 0, so the first decision is undefined and the phase of the decisions is
unknown. The pair is therefore simulated for each phase, with either valve first.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ppafo.analyses.reproduce.claim import Claim, Observation, observation
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.metrics import Metric
from ppafo.parameters.publications.publication import paper_entries
from ppafo.signals.recording import Floats
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Initial, PrescribedMotion, Scenario
from ppafo.simulation.simulate import Result, simulate
from ppafo.wording import count_of

PHASES = 20
"""Number of phases of the decisions, evenly spaced over one period; each with valve A and with valve B first."""
_TIE = 1.0e-3
"""Reference [N m] that is large enough to determine the first decision."""
_STEP = 0.5e-3
"""Time step and output interval of the runs [s], which divide every phase."""
FEWEST_REVERSALS = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0
"""Smallest number of torque reversals on the ramp that counts as the oscillation of the text."""
READINGS_OF_U = (("the opening, -1 to 1", 1.0), ("volts, 5 open the valve", 5.0), ("volts, 10 open the valve", 10.0))
"""Interpretations of U of equation (13), each with the U that opens the proportional valve fully."""
WITHIN_REACH = 4.0
"""Reference level [N m] within the reach of the supply."""
_GAINS = ("proportional_gain", "integral_gain", "derivative_gain")
_RESTS_ON = ("the torque task as completed here",)


# Phases of the sampled decisions.


def phased_runs(solenoid: Result) -> tuple[Floats, Floats]:
    """Return RMS torque error [N m] and supplied gas [g] of the solenoid pair's task for each phase of its decisions.

    Both have shape (runs,), with valve A first and then with valve B first. Run number ``PHASES``, a whole period with
    A first, is the scenario as written. If the task has no undefined phase, there is only the given run.
    """
    scenario, reference, period = solenoid.scenario, solenoid.scenario.reference, solenoid.scenario.controller.period
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
    fine, duration = replace(scenario.run, step=_STEP, output_interval=_STEP), scenario.run.duration
    slope, runs = reference.settings["level"] / reference.settings["ramp_time"], list[tuple[float, float]]()
    for tie in (_TIE, -_TIE):
        # Until the first decision, a constant reference just off 0 calls one valve at once and holds it on.
        constant = with_reference(scenario, start_level=tie, level=tie)
        start = simulate(replace(constant, run=replace(fine, duration=period))).recording
        for number in range(1, PHASES + 1):
            phase = period * number / PHASES
            last = round(phase / _STEP)
            # After it the task continues from the pressures at this time.
            onward = with_reference(
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


def with_reference(scenario: Scenario, **settings: float) -> Scenario:
    """Return a scenario with changed settings [SI] of its reference."""
    reference = scenario.reference
    return replace(scenario, reference=replace(reference, settings={**reference.settings, **settings}))


# Claims on tracking error and gas, and statements of the text on both valves.


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
    """Return a claim on the median of values (runs,), in the unit of the claim, judged by the range of the claim."""
    entry = paper_entries()[identifier]
    if not np.isfinite(values).all():
        return Claim(entry, "undetermined", None, note, rests_on)
    median, ends, text = _median_and_range(values, decimals, entry.unit)
    note = f"{note} Accepted from {entry.at_least:g} to {entry.at_most:g} {entry.unit}."
    claim = Claim(entry, "met_by_fitted_settings", median, note, rests_on, text, ends)
    return replace(claim, verdict="undetermined") if claim.is_missed else claim


def _median_and_range(values: Floats, decimals: int, words: str) -> tuple[float, tuple[float, float], str]:
    """Return the median of values (runs,), their smallest and largest, and both as text with ``words`` between."""
    median, low, high = float(np.median(values)), float(values.min()), float(values.max())
    ends = f" ({low:.{decimals}f} to {high:.{decimals}f})" if high > low else ""
    return median, (low, high), f"{median:.{decimals}f} {words}{ends}"


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return the paper's statements on the torque task, each with our numbers."""
    (pair_ramp, on_pair_ramp), (pair_hold, on_pair_hold) = (_reversals(solenoid, phase) for phase in ("ramp", "hold"))
    (ramp, on_ramp), (hold, on_hold) = (_reversals(proportional, phase) for phase in ("ramp", "hold"))
    oscillates = pair_ramp is not None and pair_ramp >= FEWEST_REVERSALS
    swings = f"{on_pair_ramp} that swing over 5 % of the largest reference"
    errors = [[run.metrics.get(f"rms_error_{phase}") for run in (solenoid, proportional)] for phase in ("ramp", "hold")]
    tracks_better, evidence = False, "this reference has no ramp and hold"
    if len(known := [metric.value for pair in errors for metric in pair if metric]) == 4:
        # The proportional valve has the lower error on the ramp, by more than on the hold.
        tracks_better = known[0] - known[1] > max(0.0, known[2] - known[3])
        evidence = f"RMS error on the ramp {known[1]:.2f} against {known[0]:.2f} N m, "
        evidence += f"on the hold {known[3]:.2f} against {known[2]:.2f} N m"
    return [
        observation("solenoid_oscillates_on_ramp", oscillates, swings),
        observation("solenoid_quiet_on_hold", pair_hold == 0, on_pair_hold),
        observation("proportional_does_not_oscillate", ramp == 0 and hold == 0, f"{on_ramp}, {on_hold}"),
        observation("proportional_tracks_better_on_ramp", tracks_better, evidence),
    ]


def _reversals(result: Result, phase: str) -> tuple[int | None, str]:
    """Return the number of torque reversals on the ramp or the hold, None without such a part, and it in words."""
    metric = result.metrics.get(f"oscillations_{phase}")
    if metric is None:
        return None, f"this reference has no {phase}"
    return round(metric.value), f"{count_of(round(metric.value), 'torque reversal')} on the {phase}"


# Statements of the paper on switching rate, gains, dead zone and improved control, against runs with such settings.


def control_claims(solenoid: Result, proportional: Result, pair_errors: Floats) -> list[Claim]:
    """Return the claims on switching rate, gains, dead zone and improved control, all with the verdict undetermined.

    ``pair_errors`` are the RMS errors [N m] of the solenoid pair over the unknown phase of its decisions.
    """
    claims, faster = [], "limited_by_switching"
    runs = {faster: solenoid, "gains_minimise_error": proportional, "dead_zone_amplifies_delay": solenoid}
    for identifier, run in runs.items():
        entry, own = paper_entries()[identifier], run.scenario.origin.overrides
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
            value, ends, found = _median_and_range(less, 0, "% less error at 100 Hz")
            claims.append(Claim(entry, "undetermined", value, entry.note, _RESTS_ON, found, ends))
            continue
        error = run.metrics["rms_error"].value
        value = 100.0 * (changed / error - 1.0)
        found = f"{abs(value):.0f} % {'more' if value > 0.0 else 'less'} error"
        note = f"{entry.note} In this task {changed:.3f} instead of {error:.3f} N m."
        claims.append(Claim(entry, "undetermined", value, note, _RESTS_ON, found))
    beyond = paper_entries()["beyond_improved_control"]
    return [*claims, Claim(beyond, "undetermined", note=beyond.not_testable)]


# Interpretations of U in equation (13), the command of the proportional valve, and their effect on the task.


@dataclass(frozen=True, slots=True)
class InterpretationOfU:
    """Interpretation of U, with the advantage of the proportional valve over the solenoid pair.

    ``error``, ``gas``: reduction of RMS error and of gas [%]
    ``error_within_reach``: reduction of RMS error [%] with a reference level within the reach of the supply
    """

    name: str
    error: float
    gas: float
    error_within_reach: float


def readings_of_u(solenoid: Result, proportional: Result) -> tuple[InterpretationOfU, ...]:
    """Return the comparison of the valves for each interpretation of U.

    The result is empty if another control law or reference is used.
    """
    pair, spool = solenoid.scenario, proportional.scenario
    if spool.controller.kind != "pid" or {pair.reference.kind, spool.reference.kind} != {"ramp_hold"}:
        return ()
    against, against_within_reach = (simulate(run).metrics for run in (pair, with_reference(pair, level=WITHIN_REACH)))

    def less(metrics: Mapping[str, Metric], against: Mapping[str, Metric], name: str) -> float:
        return 100.0 * (1.0 - metrics[name].value / against[name].value)

    readings = []
    for name, full in READINGS_OF_U:
        # Volts times a gain for volts give the same opening.
        gains = {gain: spool.controller.settings[gain] / full for gain in _GAINS}
        read = replace(spool, controller=replace(spool.controller, settings={**spool.controller.settings, **gains}))
        metrics, within_reach = (simulate(run).metrics for run in (read, with_reference(read, level=WITHIN_REACH)))
        error, gas = less(metrics, against, "rms_error"), less(metrics, against, "gas_supplied")
        error_within_reach = less(within_reach, against_within_reach, "rms_error")
        readings.append(InterpretationOfU(name, error, gas, error_within_reach))
    return tuple(readings)


def holding_torque(result: Result) -> float:
    """Largest static torque for the supply of a result [N m]; equation (2), other chamber at atmosphere."""
    device = result.scenario.device
    return device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure)


def reading_rows(rows: Sequence[InterpretationOfU]) -> list[tuple[str, str, str, str]]:
    """Return table rows of the interpretations of U: name, and reductions of error, gas and error within reach [%]."""
    return [(row.name, f"{row.error:.0f} %", f"{row.gas:.0f} %", f"{row.error_within_reach:.0f} %") for row in rows]


def result_on_u(rows: Sequence[InterpretationOfU]) -> tuple[str, ...]:
    """Return the conclusion from the interpretations of U as a sentence; empty if the numbers do not support it."""
    entries = paper_entries()
    error, saving = entries["torque_rms_improvement"], entries["co2_saving"]
    low, high, least = error.at_least or 0.0, error.at_most or 0.0, saving.at_least or 0.0
    # The first reading is the opening itself, the others are voltages.
    opening, *volts = rows
    is_opening_alone = low <= opening.error <= high and not any(low <= row.error <= high for row in volts)
    is_beyond_reach = not any(low <= row.error_within_reach <= high for row in rows)
    if not (is_opening_alone and is_beyond_reach and all(row.gas >= least for row in rows)):
        return ()
    return ("15 % less error needs U as the opening and a reference above the torque ceiling; less gas needs neither.",)
