"""Runs a scenario and collects its results."""

import platform
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ppafo.engine.actuator_values import pressures_of, torque_of
from ppafo.engine.lane_source import SAME_MOMENT
from ppafo.engine.lanes import BatchResult, Floats, load_program, load_programs
from ppafo.engine.links import python_place
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, batch_of, run_together
from ppafo.metrics.catalog import evaluate
from ppafo.metrics.metric import Metric
from ppafo.model.places import friction_in_motion
from ppafo.model.regulator import LineState, line_pressures
from ppafo.model.thermal import energy_per_content
from ppafo.model.vane import gravity_torque, sliding_friction
from ppafo.parameters.device import Gas
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import scenario_or_load
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.result import Result, Status
from ppafo.simulation.sampled import run_sampled, state_row_numbers
from ppafo.simulation.scenario import PrescribedMotion, Scenario, worn_kind
from ppafo.version import __version__

OPEN_LOOP = "constant"
"""The controller that follows no reference: its recordings have none, so that no tracking error is made of it."""

REMEDY = (
    "the step may be too long for this device, or a value unrealistic: try a smaller run.step, "
    "and check the inertia, the volumes and the valve area (ppafo audit)"
)


def simulate(scenario: Scenario | str | Path, overrides: Sequence[str] = ()) -> Result:
    """Run one scenario: an object, or the name of a shipped one or a file, with ``overrides`` as on the command line.

    A run that diverges is a Result with that status, up to the time of failure. ScenarioError or ParameterError for
    bad input.
    """
    chosen = scenario_or_load(scenario, overrides)
    return results_of(chosen, [plan_run(chosen)])[0]


def results_of(scenario: Scenario, runs: Sequence[Run]) -> list[Result]:
    """Results of runs of one scenario, as planned or with other numbers; a Python controller has them in turn."""
    custom = scenario.control.custom
    outcomes = run_together(runs) if custom is None else [run_sampled(batch_of(run), custom) for run in runs]
    return [result_of(scenario, run, outcome) for run, outcome in zip(runs, outcomes, strict=True)]


def simulate_many(scenarios: Sequence[Scenario], threads: int | None = None) -> list[Result]:
    """Run many scenarios side by side, each exactly as if it ran alone."""
    runs = [plan_run(scenario) for scenario in scenarios]
    inside = [index for index, scenario in enumerate(scenarios) if scenario.control.custom is None]
    outcomes = dict(zip(inside, run_together([runs[index] for index in inside], threads), strict=True))
    return [
        result_of(scenario, run, outcomes[index]) if index in outcomes else simulate(scenario)
        for index, (scenario, run) in enumerate(zip(scenarios, runs, strict=True))
    ]


def result_of(scenario: Scenario, run: Run, outcome: BatchResult) -> Result:
    """The result of what a run came to; one that was stopped has the records up to there."""
    rows = state_row_numbers(run)
    times: Floats = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    record = outcome.record[:, :, 0]
    status = _status(outcome, record, rows, times)
    kept = times < (np.inf if status.time is None else status.time)
    kept[0] = True
    by_path = {path: record[kept, row] for path, row in rows.items()}
    worn = worn_kind(scenario)
    if worn is None:
        recording = _recording(scenario, run, times[kept], by_path)
        metrics: Mapping[str, Metric] = evaluate(recording)
    else:
        recording, metrics = worn.measured(scenario, run, times[kept], by_path)
    return Result(
        scenario=scenario,
        recording=recording,
        metrics=metrics,
        status=status,
        versions={"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__},
        engine={"step": run.step, "steps": run.step_count, "steps_per_sample": run.steps_per_sample},
    )


def _status(outcome: BatchResult, record: Floats, rows: dict[str, int], times: Floats) -> Status:
    """Completed, or diverged with time, the last good state and what to do."""
    failed = float(outcome.states[rows["result.failure_time"], 0])
    if failed >= NEVER_FAILED and bool(np.isfinite(outcome.states).all()):
        return Status("completed", None, "completed")
    time = failed if failed < NEVER_FAILED else float(times[-1])
    last = record[max(0, int(np.searchsorted(times, time)) - 1)]
    state = ", ".join(
        f"{name.replace('_', ' ')} {last[rows[f'state.{name}']]:.4g} {unit}"
        for name, unit in (("angle", "rad"), ("angular_velocity", "rad/s"), ("mass_1", "kg"), ("mass_2", "kg"))
    )
    remedy = TOO_MANY_PARTS if outcome.states[rows["result.too_many_parts"], 0] else REMEDY
    return Status("diverged", time, f"diverged at t = {time:.6g} s (before that: {state}); {remedy}")


def _recording(scenario: Scenario, run: Run, times: Floats, rows: Mapping[str, Floats]) -> Recording:
    angle, rate = rows["state.angle"], rows["state.angular_velocity"]
    actuator = run.program.actuator
    pressure_1, pressure_2 = pressures_of(actuator, run.plant, angle, rows["state.mass_1"], rows["state.mass_2"])
    torque = np.asarray(torque_of(actuator, run.plant, angle, pressure_1, pressure_2))
    channels = {
        "angle": (angle, "rad"),
        "angular_velocity": (rate, "rad/s"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (torque, "N m"),
        "command": (rows["result.command"], "-"),
        "supplied_mass": (rows["state.supplied_mass"], "kg"),
        "vented_mass": (rows["state.vented_mass"], "kg"),
        "leaked_mass": (rows["state.leaked_mass"], "kg"),
        "external_torque": (_external_torque(scenario, run, times, rows, torque), "N m"),
        "mass_1": (rows["state.mass_1"], "kg"),
        "mass_2": (rows["state.mass_2"], "kg"),
    }
    if scenario.control.kind != OPEN_LOOP:
        channels["reference"] = (profile_values(scenario.reference, _moments(run, times.size))[0], "N m")
    channels |= gas_channels(scenario.device.gas, run, rows)
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(scenario.name, times, values, kind="simulated")


def _moments(run: Run, count: int) -> Floats:
    """Times of the first samples [s], shape (count,), rounded as the engine does, so that a reference has its bits."""
    steps = np.arange(count, dtype=np.float64) * run.record_every
    whole = np.round(steps)
    moments: Floats = np.where(np.abs(steps - whole) <= SAME_MOMENT, whole, steps) * run.step
    return moments


def gas_channels(gas: Gas, run: Run, rows: Mapping[str, Floats]) -> dict[str, tuple[Floats, str]]:
    """Return what a run records of its gas beside pressures, in SI with the unit, from rows (samples,) by path.

    Line pressures and the gas through the bottle's regulator where there are lines; true masses, temperatures and
    energies where the gas has an energy balance.
    """
    found: dict[str, tuple[Floats, str]] = {}
    if run.lines is not None:
        lines = rebuilt(LineState, [rows[path] for path in leaf_paths(LineState, "line_state")])
        line_1, line_2 = line_pressures(run.lines.parameters, run.plant.gas_product, lines)
        found |= {"line_pressure_1": (np.asarray(line_1), "Pa"), "line_pressure_2": (np.asarray(line_2), "Pa")}
        found["regulated_mass"] = (np.asarray(lines.regulated_mass), "kg")
    if not run.program.is_thermal:
        return found
    for chamber in (1, 2):
        mass = rows[f"masses.mass_{chamber}"]
        warmth = rows[f"state.mass_{chamber}"] / mass
        found[f"mass_{chamber}"] = (mass, "kg")
        found[f"temperature_{chamber}"] = (gas.temperature * warmth, "K")
    per_content = energy_per_content(run.plant.gas_product, gas.heat_capacity_ratio)
    found["gas_energy"] = (per_content * (rows["state.mass_1"] + rows["state.mass_2"]), "J")
    for name, row in (("supplied_enthalpy", "supplied"), ("vented_enthalpy", "vented"), ("wall_heat", "heat")):
        found[name] = (per_content * rows[f"masses.{row}_content"], "J")
    found["gas_work"] = (rows["masses.gas_work"], "J")
    return found


def _external_torque(scenario: Scenario, run: Run, times: Floats, rows: Mapping[str, Floats], torque: Floats) -> Floats:
    """T_ex of equation (1) [N m]: the constant of a free vane, or what keeps a prescribed one on its path."""
    plant = run.plant
    if not isinstance(scenario.motion, PrescribedMotion):
        return np.full(times.size, plant.external_torque)
    acceleration = profile_values(scenario.motion.profile, times)[2]
    angle, rate = rows["state.angle"], rows["state.angular_velocity"]
    friction = np.array([sliding_friction(float(value), 1.0) for value in rate]) * _sizes_of_friction(run, rows)
    gravity = gravity_torque(angle, plant.gravity_torque)
    return np.asarray(torque - gravity - friction - plant.viscous_damping * rate - plant.inertia * acceleration)


def _sizes_of_friction(run: Run, rows: Mapping[str, Floats]) -> Floats | float:
    """Size of the friction torque in motion [N m] at each sample, with the effects of a run."""
    law = python_place(friction_in_motion, run.program.effects, run.effects)
    if law is None:
        return run.plant.dynamic_torque
    angle, masses = rows["state.angle"], (rows["state.mass_1"], rows["state.mass_2"])
    pressures = pressures_of(run.program.actuator, run.plant, angle, *masses)
    states = {
        name: [rebuilt(row, values) for values in zip(*(rows[path] for path in leaf_paths(row, name)), strict=True)]
        for name, row in run.program.effect_states.items()
    }
    return np.array(
        [
            law({name: of_samples[sample] for name, of_samples in states.items()}, run.plant.dynamic_torque, *given)
            for sample, given in enumerate(zip(rows["state.angular_velocity"], *pressures, strict=True))
        ]
    )


def compile_models(scenarios: Iterable[Scenario | str | Path]) -> None:
    """Compile the models of scenarios into the cache, unless they are there; nothing is run."""
    chosen = [scenario_or_load(item) for item in scenarios]
    programs = [plan_run(item).program for item in chosen]
    load_programs(programs)
    for program in programs:
        load_program(program)
