"""The torque task: what the paper claims of it in numbers, of its control, and what its text tells of both valves.

The task starts in a tie: the error is exactly 0, and the decisions of the solenoid pair have an unknown phase. So the
pair runs once for each phase, with either valve first.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ppafo.analyses.reproduce.claim import Claim, Observation, Verdict, observation, stated_claim
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import ParameterError, ScenarioError, SimulationError, count_of
from ppafo.parameters.publications.publication import paper_entries
from ppafo.signals.recording import Floats
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Initial, PrescribedMotion, Scenario
from ppafo.simulation.simulate import Result, simulate

_PERCENT = 100.0
FEWEST_REVERSALS = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0
PHASES = 20
"""Phases of the decisions, evenly over one period; each with valve A and with valve B first."""
_TIE = 1.0e-3
"""N m: a reference this far from 0 decides the tie at the start."""
_FINE = 0.5e-3
"""Time [s] between two samples, which divides every phase."""


@dataclass(frozen=True, slots=True)
class PhasedRuns:
    """The pair's RMS torque error [N m] and gas from the supply [g] for each phase of its decisions, A or B first.

    The last phase, a whole period with A first, is the run as its scenario has it.
    """

    errors: Floats
    gas: Floats


def phased_runs(solenoid: Result) -> PhasedRuns:
    """Return the pair's task with its decisions at each phase; its own run alone where the task has no such phase.

    Until the first decision one valve is held on. What follows is the task from that time on, from those pressures.
    """
    scenario = solenoid.scenario
    if not _has_phase(scenario):
        gas = GRAMS_PER_KILOGRAM * solenoid.metrics["gas_supplied"].value
        return PhasedRuns(np.array([solenoid.metrics["rms_error"].value]), np.array([gas]))
    fine = replace(scenario, run=replace(scenario.run, step=_FINE, output_interval=_FINE))
    runs = [run for tie in (_TIE, -_TIE) for run in _with_first_valve(fine, tie)]
    errors, gas = np.array(runs).T
    return PhasedRuns(errors, gas)


def _has_phase(scenario: Scenario) -> bool:
    # Two runs are joined by their pressures, which are the whole state only of a locked vane at constant temperature
    # without lines; and a tie is only where reference and torque both begin at 0.
    reference, period = scenario.reference, scenario.controller.period
    return (
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


def _with_first_valve(scenario: Scenario, tie: float) -> Iterator[tuple[float, float]]:
    """Yield RMS error [N m] and gas [g] for each phase, with the valve that a tie calls held on until the first."""
    period, whole = scenario.controller.period, scenario.run.duration
    ramp = scenario.reference.settings
    slope = ramp["level"] / ramp["ramp_time"]
    # A constant reference just off 0 calls one valve at once and holds it on.
    same = {**ramp, "start_level": tie, "level": tie}
    held = simulate(
        replace(
            scenario, run=replace(scenario.run, duration=period), reference=replace(scenario.reference, settings=same)
        )
    ).recording
    for number in range(1, PHASES + 1):
        phase = period * number / PHASES
        last = round(phase / _FINE)
        start = slope * phase
        later = {**ramp, "start_level": start, "ramp_time": ramp["ramp_time"] - phase}
        rest = simulate(
            replace(
                scenario,
                run=replace(scenario.run, duration=whole - phase),
                reference=replace(scenario.reference, settings=later),
                initial=Initial(float(held["pressure_1"][last]), float(held["pressure_2"][last])),
            )
        )
        before = slope * held.time[: last + 1] - held["torque"][: last + 1]
        # Mean squares of both parts, each with its time.
        square = phase * float(np.mean(before**2)) + (whole - phase) * rest.metrics["rms_error"].value ** 2
        gas = float(held["supplied_mass"][last]) + rest.metrics["gas_supplied"].value
        yield float(np.sqrt(square / whole)), GRAMS_PER_KILOGRAM * gas


def torque_task_claims(runs: PhasedRuns, proportional: Result, rests_on: tuple[str, ...]) -> list[Claim]:
    """Return the claims on tracking error and gas over all phases; gas is what the supply gave.

    Each median has the window that the task as completed here has to meet. Without decimals: the range over the phases
    is wider than any.
    """
    error = proportional.metrics["rms_error"].value
    gas = GRAMS_PER_KILOGRAM * proportional.metrics["gas_supplied"].value
    over = f"Median and range of {runs.errors.size} runs over the unknown phase of the decisions, either valve first."

    def claim(identifier: str, values: Floats, decimals: int, note: str) -> Claim:
        entry = paper_entries()[identifier]
        assert entry.at_least is not None, f"{identifier} has a window"
        assert entry.at_most is not None, f"{identifier} has a window"
        window = entry.at_least, entry.at_most
        # Where there is nothing to save from, nothing can be said.
        if not np.isfinite(values).all():
            return stated_claim(identifier, None, "undetermined", note, rests_on, window)
        median, low, high = (float(end) for end in (np.median(values), values.min(), values.max()))
        median_text = f"{median:.{decimals}f} {entry.unit}"
        if high > low:
            median_text = f"{median_text} ({low:.{decimals}f} to {high:.{decimals}f})"
        verdict: Verdict = "met_by_fitted_settings" if window[0] <= median <= window[1] else "undetermined"
        note = f"{note} Accepted from {window[0]:g} to {window[1]:g} {entry.unit}."
        return replace(
            stated_claim(identifier, median, verdict, note, rests_on, window, median_text), range=(low, high)
        )

    with np.errstate(divide="ignore", invalid="ignore"):
        better, saved = (_PERCENT * (1.0 - own / pair) for own, pair in ((error, runs.errors), (gas, runs.gas)))
    return [
        claim("torque_rms_improvement", better, 0, over),
        claim("co2_solenoid", runs.gas, 1, over),
        claim("co2_proportional", np.array([gas]), 2, "Decided every millisecond, so that no phase matters."),
        claim("co2_saving", saved, 0, f"{over} It follows from the two amounts: no evidence of its own."),
    ]


READINGS_OF_U = (("the opening, -1 to 1", 1.0), ("volts, 5 open the valve", 5.0), ("volts, 10 open the valve", 10.0))
"""What U of equation (13) may be, and the U that opens the proportional valve fully."""
_GAINS = ("proportional_gain", "integral_gain", "derivative_gain")
WITHIN_REACH = 4.0
"""A level [N m] that the supply can hold."""


@dataclass(frozen=True, slots=True)
class InterpretationOfU:
    """One meaning of U: by how much the proportional valve lowers RMS error and gas [%], and the error within reach."""

    name: str
    error: float
    gas: float
    error_within_reach: float


def readings_of_u(solenoid: Result, proportional: Result) -> tuple[InterpretationOfU, ...]:
    """Return what each meaning of U makes of the comparison; none where another law or reference runs."""
    pair, spool = solenoid.scenario, proportional.scenario
    if spool.controller.kind != "pid" or {pair.reference.kind, spool.reference.kind} != {"ramp_hold"}:
        return ()

    def better(full: float, level: float | None) -> tuple[float, float]:
        # Volts times a gain for volts give the same opening.
        gains = {**spool.controller.settings, **{name: spool.controller.settings[name] / full for name in _GAINS}}
        both = [pair, replace(spool, controller=replace(spool.controller, settings=gains))]
        if level is not None:
            both = [
                replace(
                    scenario,
                    reference=replace(scenario.reference, settings={**scenario.reference.settings, "level": level}),
                )
                for scenario in both
            ]
        first, second = (simulate(scenario).metrics for scenario in both)
        names = ("rms_error", "gas_supplied")
        error, gas = (_PERCENT * (1.0 - second[name].value / first[name].value) for name in names)
        return error, gas

    return tuple(
        InterpretationOfU(name, *better(full, None), better(full, WITHIN_REACH)[0]) for name, full in READINGS_OF_U
    )


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return what the text tells of the torque task, each with our numbers."""

    def count(result: Result, part: str) -> int | None:
        metric = result.metrics.get(f"oscillations_{part}")
        return None if metric is None else round(metric.value)

    def reversals(number: int | None, part: str) -> str:
        if number is None:
            return f"this reference has no {part}"
        return f"{count_of(number, 'torque reversal')} on the {part}"

    ramp, hold = count(solenoid, "ramp"), count(solenoid, "hold")
    own_ramp, own_hold = count(proportional, "ramp"), count(proportional, "hold")
    tracks_better, errors = False, "this reference has no ramp and hold"
    parts = [(run.metrics.get("rms_error_ramp"), run.metrics.get("rms_error_hold")) for run in (solenoid, proportional)]
    (on_ramp, on_hold), (own_on_ramp, own_on_hold) = parts
    if on_ramp and on_hold and own_on_ramp and own_on_hold:
        gains = on_ramp.value - own_on_ramp.value, on_hold.value - own_on_hold.value
        tracks_better = gains[0] > 0.0 and gains[0] > gains[1]
        errors = (
            f"RMS error on the ramp {own_on_ramp.value:.2f} against {on_ramp.value:.2f} N m, "
            f"on the hold {own_on_hold.value:.2f} against {on_hold.value:.2f} N m"
        )
    return [
        observation(
            "solenoid_oscillates_on_ramp",
            ramp is not None and ramp >= FEWEST_REVERSALS,
            f"{reversals(ramp, 'ramp')} that swing over 5 % of the largest reference",
        ),
        observation("solenoid_quiet_on_hold", hold == 0, reversals(hold, "hold")),
        observation(
            "proportional_does_not_oscillate",
            own_ramp == 0 and own_hold == 0,
            f"{reversals(own_ramp, 'ramp')}, {reversals(own_hold, 'hold')}",
        ),
        observation("proportional_tracks_better_on_ramp", tracks_better, errors),
    ]


TUNED = (
    "controller.kind=pid",
    "controller.rate=1 kHz",
    "controller.proportional_gain=1.2 1/(N m)",
    "controller.integral_gain=23 1/(N m s)",
    "controller.derivative_gain=0.0095 s/(N m)",
    "controller.derivative_filter=3.1 ms",
    "controller.anti_windup=4.8 1/s",
)
"""Gains of a PID that were searched for the least error and gas, on an ideal and on a slow, late and noisy valve."""
DEAD_ZONE = (
    "controller.kind=on_off_dead_zone",
    "controller.rate=20 Hz",
    "controller.dead_zone=0.2 N m",
    "controller.release=0.05 N m",
    "controller.opening=1",
)
"""Narrower than what the solenoid pair can hold within one sample."""
FASTER = ("controller.rate=100 Hz", "valve.switching_interval=10 ms")
"""Both: the set has the printed 20 Hz of the component as the shortest time between two switchings."""


def control_claims(solenoid: Result, proportional: Result, runs: PhasedRuns) -> list[Claim]:
    """Return what the paper says of switching rate, gains, dead zone and improved control."""
    spool, pair = proportional.metrics["rms_error"].value, solenoid.metrics["rms_error"].value
    beyond = paper_entries()["beyond_improved_control"]
    return [
        _limited_by_switching(solenoid, runs),
        _undetermined("gains_minimise_error", spool, _with(proportional, TUNED)),
        _undetermined("dead_zone_amplifies_delay", pair, _with(solenoid, DEAD_ZONE)),
        stated_claim(beyond.id, None, "undetermined", beyond.not_testable),
    ]


def _with(run: Result, overrides: tuple[str, ...]) -> float | str:
    """Return the RMS error [N m] of a run's task with another law, or why there is none."""
    origin = run.scenario.origin
    try:
        # Another law takes nothing that was set for this one.
        own = [override for override in origin.overrides if not override.startswith("controller.")]
        return simulate(load_scenario(run.scenario.name, [*own, *overrides])).metrics["rms_error"].value
    except (ParameterError, ScenarioError, SimulationError) as error:
        return str(error)


def _limited_by_switching(solenoid: Result, runs: PhasedRuns) -> Claim:
    """Return by how much less error the same rule makes with valves that switch five times as often."""
    entry, faster = paper_entries()["limited_by_switching"], _with(solenoid, FASTER)
    if isinstance(faster, str):
        return stated_claim(entry.id, None, "undetermined", f"{entry.note} {faster}.")
    less = _PERCENT * (1.0 - faster / runs.errors)
    median, low, high = (float(end) for end in (np.median(less), less.min(), less.max()))
    sentence = f"{median:.0f} % less error at 100 Hz" + (f" ({low:.0f} to {high:.0f})" if high > low else "")
    claim = stated_claim(
        entry.id, median, "undetermined", entry.note, ("the torque task as completed here",), None, sentence
    )
    return replace(claim, range=(low, high))


def _undetermined(identifier: str, error: float, other: float | str) -> Claim:
    """Return a claim that settings which are not reported decide, with what another law's error is in this task."""
    entry = paper_entries()[identifier]
    if isinstance(other, str):
        return stated_claim(identifier, None, "undetermined", f"{entry.note} {other}.")
    value = _PERCENT * (other / error - 1.0)
    more = "more" if value > 0.0 else "less"
    sentence = f"{abs(value):.0f} % {more} error"
    note = f"{entry.note} In this task {other:.3f} instead of {error:.3f} N m."
    return stated_claim(identifier, value, "undetermined", note, ("the torque task as completed here",), None, sentence)
