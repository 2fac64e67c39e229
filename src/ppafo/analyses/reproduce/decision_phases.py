"""Torque task of the solenoid pair for all phases of the sampled controller decisions.

The task starts with an error of exactly 0, so the first decision is undefined and the phase of the decisions is
unknown. The pair is therefore simulated for each phase, with either valve first.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Initial, PrescribedMotion, Scenario
from ppafo.simulation.simulate import Result, simulate

PHASES = 20
"""Number of phases of the decisions, evenly spaced over one period; each with valve A and with valve B first."""
_TIE = 1.0e-3
"""Reference [N m] that is large enough to determine the first decision."""
_STEP = 0.5e-3
"""Time step and output interval of the runs [s], which divide every phase."""


def phased_runs(solenoid: Result) -> tuple[Floats, Floats]:
    """Return RMS torque error [N m] and supplied gas [g] of the solenoid pair's task for each phase of its decisions.

    Both have shape (runs,), with valve A first and then with valve B first. Run number ``PHASES``, a whole period with
    A first, is the scenario as written. If the task has no undefined phase, there is only the given run.
    """
    scenario = solenoid.scenario
    # Two runs are joined by their pressures, which are the whole state only of a locked vane at constant temperature
    # without lines; and a tie is only where reference and torque both begin at 0.
    reference, period = scenario.reference, scenario.controller.period
    if (
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
    ):
        fine = replace(scenario, run=replace(scenario.run, step=_STEP, output_interval=_STEP))
        runs = [run for tie in (_TIE, -_TIE) for run in _runs_with_first_valve(fine, tie)]
    else:
        gas = GRAMS_PER_KILOGRAM * solenoid.metrics["gas_supplied"].value
        runs = [(solenoid.metrics["rms_error"].value, gas)]
    errors, gas_masses = np.array(runs).T
    return errors, gas_masses


def _runs_with_first_valve(scenario: Scenario, tie: float) -> Iterator[tuple[float, float]]:
    """Yield RMS torque error [N m] and gas [g] of the run for each phase of the decisions.

    Until the first decision, a constant reference ``tie`` [N m] keeps one valve on. After it the task continues from
    the pressures at this time.
    """
    period, duration = scenario.controller.period, scenario.run.duration
    ramp = scenario.reference.settings
    slope = ramp["level"] / ramp["ramp_time"]
    # A constant reference just off 0 calls one valve at once and holds it on.
    constant = with_reference(scenario, start_level=tie, level=tie)
    start = simulate(replace(constant, run=replace(scenario.run, duration=period))).recording
    for number in range(1, PHASES + 1):
        phase = period * number / PHASES
        last = round(phase / _STEP)
        onward = with_reference(scenario, start_level=slope * phase, ramp_time=ramp["ramp_time"] - phase)
        continued = simulate(
            replace(
                onward,
                run=replace(scenario.run, duration=duration - phase),
                initial=Initial(float(start["pressure_1"][last]), float(start["pressure_2"][last])),
            )
        )
        error_before = slope * start.time[: last + 1] - start["torque"][: last + 1]
        # Mean squares of both parts, each with its time.
        error_after = continued.metrics["rms_error"].value
        square = phase * float(np.mean(error_before**2)) + (duration - phase) * error_after**2
        gas = float(start["supplied_mass"][last]) + continued.metrics["gas_supplied"].value
        yield float(np.sqrt(square / duration)), GRAMS_PER_KILOGRAM * gas


def with_reference(scenario: Scenario, **settings: float) -> Scenario:
    """Return a scenario with changed settings [SI] of its reference."""
    reference = scenario.reference
    return replace(scenario, reference=replace(reference, settings={**reference.settings, **settings}))
