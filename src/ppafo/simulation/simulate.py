"""Runs a scenario and gathers what came of it."""

import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import ppafo
from ppafo.engine.lanes import BatchResult, Floats, load_program
from ppafo.engine.run import NEVER_FAILED, Run, run_together
from ppafo.metrics.catalog import evaluate
from ppafo.model.friction import sliding_friction
from ppafo.model.plant import chamber_pressures
from ppafo.model.thermal import energy_per_content
from ppafo.model.vane import gravity_torque
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.result import Result, Status
from ppafo.simulation.sampled import run_sampled, state_row_numbers
from ppafo.simulation.scenario import LedMotion, Scenario

OPEN_LOOP = "constant"
"""The controller that follows no reference: its recordings have none, so that no tracking error is made of it."""

REMEDY = (
    "the step may be too long for this device, or a value far from any real one: try a smaller run.step, "
    "and look at the inertia, the volumes and the valve area (ppafo audit)"
)


def simulate(scenario: Scenario | str | Path, overrides: Sequence[str] = ()) -> Result:
    """Run one scenario: an object, the name of a shipped one, or a file; ``overrides`` as on the command line.

    A run that diverges is a Result with that status, up to the time of failure. ScenarioError or ParameterError for
    bad input.
    """
    chosen = scenario if isinstance(scenario, Scenario) else load_scenario(scenario, overrides)
    return results_of(chosen, [plan_run(chosen)])[0]


def results_of(scenario: Scenario, runs: Sequence[Run]) -> list[Result]:
    """Results of runs of one scenario, as planned or with other numbers; a Python controller has them in turn."""
    custom = scenario.control.custom
    outcomes = run_together(runs) if custom is None else [run_sampled(run, custom) for run in runs]
    return [_result(scenario, run, outcome) for run, outcome in zip(runs, outcomes, strict=True)]


def simulate_many(scenarios: Sequence[Scenario], threads: int | None = None) -> list[Result]:
    """Run many scenarios side by side, each exactly as if it ran alone."""
    runs = [plan_run(scenario) for scenario in scenarios]
    inside = [index for index, scenario in enumerate(scenarios) if scenario.control.custom is None]
    outcomes = dict(zip(inside, run_together([runs[index] for index in inside], threads), strict=True))
    return [
        _result(scenario, run, outcomes[index]) if index in outcomes else simulate(scenario)
        for index, (scenario, run) in enumerate(zip(scenarios, runs, strict=True))
    ]


def _result(scenario: Scenario, run: Run, outcome: BatchResult) -> Result:
    rows = state_row_numbers(run)
    times: Floats = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    record = outcome.record[:, :, 0]
    status = _status(outcome, record, rows, times)
    kept = times < (np.inf if status.time is None else status.time)
    kept[0] = True
    recording = _recording(scenario, run, times[kept], record[kept], rows)
    return Result(
        scenario=scenario,
        recording=recording,
        metrics=evaluate(recording),
        status=status,
        versions={"ppafo": ppafo.__version__, "python": platform.python_version(), "numpy": np.__version__},
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
    return Status("diverged", time, f"diverged at t = {time:.6g} s (before that: {state}); {REMEDY}")


def _recording(scenario: Scenario, run: Run, times: Floats, record: Floats, rows: dict[str, int]) -> Recording:
    def row(path: str) -> Floats:
        return record[:, rows[path]]

    angle, rate = row("state.angle"), row("state.angular_velocity")
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, row("state.mass_1"), row("state.mass_2"))  # type: ignore[arg-type]
    torque = run.plant.torque_constant * np.subtract(pressure_1, pressure_2)
    channels = {
        "angle": (angle, "rad"),
        "angular_velocity": (rate, "rad/s"),
        "pressure_1": (pressure_1, "Pa"),
        "pressure_2": (pressure_2, "Pa"),
        "torque": (torque, "N m"),
        "command": (row("result.command"), "-"),
        "supplied_mass": (row("state.supplied_mass"), "kg"),
        "vented_mass": (row("state.vented_mass"), "kg"),
        "leaked_mass": (row("state.leaked_mass"), "kg"),
        "external_torque": (_external_torque(scenario, run, times, angle, rate, torque), "N m"),
        "mass_1": (row("state.mass_1"), "kg"),
        "mass_2": (row("state.mass_2"), "kg"),
    }
    if scenario.control.kind != OPEN_LOOP:
        channels["reference"] = (profile_values(scenario.reference, times)[0], "N m")
    if run.program.is_thermal:
        channels |= _thermal_channels(scenario, run, record, rows)
    values = {name: Channel(np.asarray(series), unit) for name, (series, unit) in channels.items()}
    return Recording(scenario.name, times, values, kind="simulated")


def _thermal_channels(
    scenario: Scenario, run: Run, record: Floats, rows: dict[str, int]
) -> dict[str, tuple[Floats, str]]:
    """True masses, temperatures and energies of gas with an energy balance."""
    channels = {}
    for chamber in (1, 2):
        mass = record[:, rows[f"masses.mass_{chamber}"]]
        warmth = record[:, rows[f"state.mass_{chamber}"]] / mass
        channels[f"mass_{chamber}"] = (mass, "kg")
        channels[f"temperature_{chamber}"] = (scenario.device.gas.temperature * warmth, "K")
    per_content = energy_per_content(run.plant.gas_product, scenario.device.gas.heat_capacity_ratio)
    content = record[:, rows["state.mass_1"]] + record[:, rows["state.mass_2"]]
    channels["gas_energy"] = (per_content * content, "J")
    for name, row in (("supplied_enthalpy", "supplied"), ("vented_enthalpy", "vented"), ("wall_heat", "heat")):
        channels[name] = (per_content * record[:, rows[f"masses.{row}_content"]], "J")
    channels["gas_work"] = (record[:, rows["masses.gas_work"]], "J")
    return channels


def _external_torque(
    scenario: Scenario, run: Run, times: Floats, angle: Floats, rate: Floats, torque: Floats
) -> Floats:
    """T_ex of equation (1) [N m]: what was prescribed, or what holds a led vane to its path."""
    plant = run.plant
    if not isinstance(scenario.motion, LedMotion):
        return np.full(times.size, plant.external_torque)
    acceleration = profile_values(scenario.motion.profile, times)[2]
    friction = np.array([sliding_friction(float(value), plant.dynamic_torque) for value in rate])
    gravity = gravity_torque(angle, plant.gravity_torque)  # type: ignore[arg-type]
    return np.asarray(torque - gravity - friction - plant.viscous_damping * rate - plant.inertia * acceleration)


def compile_model(scenario: Scenario | str | Path) -> None:
    """Compile the model of a scenario into the cache, unless it is there; nothing is run."""
    chosen = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    load_program(plan_run(chosen).program)
