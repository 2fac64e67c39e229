"""Linear model of a scenario's plant: record, plant by named values, point, slopes, control loop, and report.

Read downwards: ``linear_model`` takes a point of a run or the steady state, and differences of the plant's rates there.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.util import find_spec
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.controllers import switching
from ppafo.control.profiles import CONSTANT
from ppafo.control.torque_loop import SHARPNESS
from ppafo.engine.continuous_time import free_motion, gas_rates, mode_at_rest, torque_at_rest
from ppafo.engine.in_python import PythonFunctions, functions_of, in_program
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.errors import ScenarioError, SimulationError, UnitError, refused_as
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE, ControlledQuantity, error_functions
from ppafo.model.plant import Openings, ThermalParameters
from ppafo.model.ports import at_valve, friction_at_rest, sent_command
from ppafo.model.valves.proportional import NO_SLEW_LIMIT
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import TIME, Kind, of_path
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, BLUE, GREY, VERMILION
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.plan import plan_run
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.python_controller import run_sampled
from ppafo.simulation.scenario import Control, Scenario, with_control
from ppafo.simulation.simulate import simulate_many
from ppafo.units import parse_quantity
from ppafo.units.shown import in_units, quantity_of_unit
from ppafo.version import __version__
from ppafo.wording import argument_text, known_names, one_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EQUILIBRIUM = "equilibrium"
DEAF = "a small change of the command has no effect (dead band, slew limit, saturation): the column of the command is 0"
MISSING_CONTROL = "a system for python-control needs the package control: pip install ppafo[control]"
VALVE = "valve_"
"""Prefix of the names of valve states."""
_OPENINGS = (f"{VALVE}requested", f"{VALVE}opening")
_SUPPLIES, _MOTION = ("supply_pressure", "dorsiflexion_pressure"), ("angle", "angular_velocity")
_DRIVEN = (*_SUPPLIES, "external_torque")
"""Inputs of a linear model that are fields of ``PlantParameters``."""
UNITS = {
    "angle": "rad",
    "angular_velocity": "rad/s",
    **dict.fromkeys(("pressure_1", "pressure_2", *_SUPPLIES), "Pa"),
    **dict.fromkeys(("temperature_1", "temperature_2"), "K"),
    **dict.fromkeys((*_OPENINGS, "command"), "1"),
    f"{VALVE}rate": "1/s",
    **dict.fromkeys(("external_torque", "torque"), "N m"),
    **dict.fromkeys(("supplied_flow", "vented_flow"), "kg/s"),
}
"""SI units of all signals of a linear model."""
_SIGNALS = ("states", "inputs", "outputs")
_SIZES = {"Pa": 1.0e5, "K": 300.0}
"""Reference size for values with a unit [SI]; 1 for any other unit."""
_SINGULAR = 1.0e13
"""Condition number of a scaled matrix above which its solution has no correct digit (64-bit floats: 1e16)."""
_ON_THE_EDGE = 1.0e-6
"""Difference of the slopes on both sides, divided by the largest slope of the row, above which there is a kink.

Without a kink, the finite differences agree to about 1e-9.
"""
_ZERO = 1.0e-9
"""Slope divided by the largest slope of its row, below which the slope counts as 0 (rounding)."""
_LONGEST, _SHORTER, _LENGTHS, _ORDERS = 1.0e-2, 4.0, 8, 5
"""Longest step of a difference over the reference size, ratio of steps, their number, and orders extrapolated [-]."""
_STEADY = 1.0e-9
"""Largest time derivative divided by the size of the state [1/s] that counts as zero."""
_FIRST_COMMANDS = (0.01, 0.1, 0.003, 0.03, 0.3, 1.0)
"""Magnitudes of the command [-] from which the search for the steady state starts."""
_TRIED_COMMANDS = tuple(np.linspace(-0.95, 0.95, 20).tolist())
"""Commands [-] at which a proportional valve moves; a table of openings may be flat at some of them."""
PID_LAWS = ("pid", "pid_feedforward")
"""Controllers whose feedback is a PID: their loop is linear while the command is not clipped."""
_POINTS, _POINTS_BELOW = 20_000, 2_000
"""Number of frequencies of a loop, on a logarithmic scale, and of those added below for a loop with an integrator."""
_BELOW_POLES = 1.0e-3
"""Lowest frequency of a loop, relative to the frequency of the slowest pole or corner that is no integrator [-]."""
_LEAST_START = 1.0e3
"""Least magnitude [-] at the lowest frequency of a loop with an integrator: there the integrator decides."""
_INTEGRATOR = 1.0e-9
"""Magnitude [1/s] up to which a pole counts as an integrator."""
_ROUNDING = 1.0e-9
"""Tolerance for the rounding of a delay in sample periods [-]."""
DURATION, INTERVAL = 1.0, 1.0e-3
"""Duration of a run after a step of the command, and sample time of its output [s]."""
SHARES = tuple(np.geomspace(3.0e-4, 0.3, 13).tolist())
"""Step heights of the command divided by the steady command [-]: three decades."""
_DRAWN_STEPS = (-5, -1)
"""Indices of the steps plotted over time: the middle of the three decades, and the largest step."""
_FULL = 0.99
"""Ratio of gauge pressures, chamber to supply, above which the chamber counts as full [-]."""
_LARGEST_COMMAND = 0.7
"""Steady command [-] above which the largest step comes too close to full opening, which is 1."""
_REAL = 1.0e-6
"""Imaginary part of a pole divided by its magnitude, up to which the pole counts as real."""
_DRAWN_POINTS, _LOWEST_SHARE, _HIGHEST = 400, 0.1, 100.0
"""Frequencies of the plot: their number, the lowest over the lowest reported one [-], and the highest [Hz]."""
_LOOP_POINTS = slice(None, None, -20)
"""Points of the open loop that are plotted: every twentieth, counted back from the last."""
_FREQUENCY, _DASHED = Kind("Frequency", "Hz"), {"linestyle": "--"}
_FREQUENCY_CAPTION = (
    "Open loop, if it has margins: each margin extends from its dot to the dashed line. Torque for a small sinusoidal "
    "command; dashed: with the dead time, the age of the measurements and half a sample period, which the model does "
    "not include."
)
_STEPS_CAPTION = (
    "Steps of the command from the steady state, simulated and by the linear model; their difference grows with the "
    "square of the amplitude."
)


class OmittedDelays(NamedTuple):
    """Delays that the linear model omits [s]: dead time of the valve, age of the measurements, sample period."""

    command: float
    signals: float
    period: float


@dataclass(frozen=True, slots=True, repr=False)
class LoopMargins:
    """Margins of the control loop, closed by the scenario's PID; None where a crossover does not exist.

    Angles are in rad and frequencies in Hz, as in JSON; the report has degrees.

    ``is_stable``: True if the closed loop of the linear model is stable (Nyquist criterion)
    ``gain_margin``: factor on all gains at which the loop becomes unstable [-]
    ``phase_crossover``: frequency of the gain margin [Hz]
    ``phase_margin``: phase margin [rad]
    ``gain_crossover``: frequency of the phase margin, at which the loop gain is 1 [Hz]
    ``bandwidth``: lowest frequency at which the closed loop follows with 0.707 of its lowest-frequency response [Hz]
    ``peak_sensitivity``: largest sensitivity abs(1 / (1 + L)) [-]
    """

    is_stable: bool
    gain_margin: float | None
    phase_crossover: float | None
    phase_margin: float | None
    gain_crossover: float | None
    bandwidth: float | None
    peak_sensitivity: float

    def __repr__(self) -> str:
        """Return the margins with the units of their attributes; the phase margin in degrees too, as in the report."""
        units = dict.fromkeys(("phase_crossover", "gain_crossover", "bandwidth"), " Hz")
        units["phase_margin"] = f" rad ({np.degrees(self.phase_margin or 0.0):.3g} deg)"
        values = asdict(self).items()
        texts = (
            f"{value:.4g}{units.get(key, '')}" if isinstance(value, float) else f"{value}" for key, value in values
        )
        return f"LoopMargins({', '.join(f'{name}={text}' for (name, _), text in zip(values, texts, strict=True))})"


@dataclass(frozen=True, slots=True, eq=False)
class LinearModel:
    """Linear plant model of a scenario, x' = A x + B u, y = C x + D u, for deviations from the operating point in SI.

    ``time``: time of the operating point [s]; None for a steady state
    ``states``, ``inputs``, ``outputs``: names of the signals, of which ``UNITS`` has the units
    ``values``: values of all signals at the operating point [SI], by name
    ``A`` (states, states), ``B`` (states, inputs), ``C`` (outputs, states), ``D`` (outputs, inputs): matrices
    ``rates`` (states,): x' at the operating point, 0 in a steady state
    ``sides``: side of each limit of the plant, in words
    ``edges``: side on which the model holds, "above" or "below", by name of each state or input at a kink
    ``delays``: delays that the model omits
    ``sent_per_opening``: slope of the inverted table of openings [-]; 1 without a table
    ``margins``: margins of the loop with the scenario's controller and these delays; None unless it is a PID
    """

    scenario: Scenario
    time: float | None
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    values: Mapping[str, float]
    A: Floats
    B: Floats
    C: Floats
    D: Floats
    rates: Floats
    sides: Mapping[str, str]
    edges: Mapping[str, str]
    delays: OmittedDelays
    sent_per_opening: float = 1.0
    margins: LoopMargins | None = None

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles of the linear model [1/s], the slowest first."""
        eigenvalues = np.linalg.eigvals(self.A).astype(np.complex128)
        return eigenvalues[np.argsort(np.abs(eigenvalues))]

    def response(self, frequencies: Floats, output: str = "torque", source: str = "command") -> NDArray[np.complex128]:
        """Return the complex frequency response (frequencies,) of an output to an input in SI; frequencies [Hz].

        Raises ScenarioError for an unknown output or input, and for a frequency at which the model has a pole.
        """
        for name, names, kind in ((output, self.outputs, "output"), (source, self.inputs, "input")):
            if name not in names:
                raise ScenarioError(f"the linear model has no {kind} '{one_line(name)}'{known_names(name, names)}")
        row, column = self.outputs.index(output), self.inputs.index(source)
        asked = np.asarray(frequencies, dtype=np.float64).ravel()
        matrices = scaled = 2.0j * np.pi * asked[:, None, None] * np.eye(len(self.states)) - self.A
        # States and their rates differ by powers of ten in SI: rank is taken with rows and columns of one size.
        for axis in (2, 1):
            largest = np.max(np.abs(scaled), axis=axis, keepdims=True, initial=0.0)
            scaled = scaled / np.where(largest > 0.0, largest, 1.0)
        for frequency in asked[np.linalg.cond(scaled) > _SINGULAR]:
            raise ScenarioError(
                f"{self.scenario.name}: the linear model has a pole at {frequency:g} Hz, where its response is "
                f"infinite; give another frequency"
            )
        return np.asarray(
            np.linalg.solve(matrices, self.B[:, column, None])[:, :, 0] @ self.C[row] + self.D[row, column]
        )

    def json_document(self) -> dict[str, Any]:
        """Return operating point, matrices, poles and sides as plain data in SI."""
        signals = {
            kind: [{"name": name, "unit": UNITS[name], "value": self.values[name]} for name in getattr(self, kind)]
            for kind in _SIGNALS
        }
        signals["states"] = [
            {**signal, "rate": rate} for signal, rate in zip(signals["states"], self.rates.tolist(), strict=True)
        ]
        return {
            "format": "ppafo linear model",
            "schema_version": 1,
            "ppafo": __version__,
            "scenario": self.scenario.name,
            "overrides": list(self.scenario.origin.overrides),
            "at": EQUILIBRIUM if self.time is None else self.time,
            **signals,
            **{name: getattr(self, name).tolist() for name in "ABCD"},
            "poles": [{"real": pole.real, "imaginary": pole.imag} for pole in self.poles.tolist()],
            "sides": dict(self.sides),
            "edges": [{"name": name, "is_above": side == "above"} for name, side in self.edges.items()],
            "left_out": dict(zip(("command_delay", "signal_delay", "sample_period"), self.delays, strict=True)),
            "margins": None if self.margins is None else asdict(self.margins),
        }

    def to_control(self) -> Any:
        """Return the model as a ``control.StateSpace`` with signal names.

        Raises ScenarioError if the extra ``control`` is not installed.
        """
        if find_spec("control") is None:
            raise ScenarioError(MISSING_CONTROL)
        import control

        names = {kind: list(getattr(self, kind)) for kind in _SIGNALS}
        return control.ss(self.A, self.B, self.C, self.D, name=self.scenario.name.replace("-", "_"), **names)


def linear_model(scenario: Scenario, at: float | str) -> LinearModel:
    """Return the linear model of a scenario at a time [s] of its run, a number or a text, or at ``EQUILIBRIUM``.

    Raises ScenarioError for regulated supplies, an on/off valve, and an operating point that does not exist.
    """
    run = plan_run(scenario)
    if scenario.supply_lines is not None:
        raise ScenarioError(f"{scenario.name}: the linear model assumes a constant supply pressure; omit [supply_line]")
    if run.program.valve.regulates:
        raise ScenarioError(
            f"{scenario.name}: valve '{scenario.device.valve_name}' regulates pressures, of which there is no linear "
            "model; set device.valve to a proportional valve"
        )
    # A small change of the command changes the openings or their rates somewhere.
    still = dict(zip(valve_states(run.program), numbers(run.program.valve.initial()), strict=True))
    plant = plant_of(_without_slew_limit(run), None, still | {"command": 0.0})
    first, second = (
        [plant.valve(still | {"command": command + change})[1:] for command in _TRIED_COMMANDS]
        for change in (1.0e-4, 2.0e-4)
    )
    if first == second:
        raise ScenarioError(
            f"{scenario.name}: valve '{scenario.device.valve_name}' switches on and off, so its flow has no "
            "derivative with respect to the command; set device.valve to a proportional valve"
        )
    if at == EQUILIBRIUM:
        return model_at(scenario, run, equilibrium(scenario))
    problem = f"{scenario.name}: {argument_text('at', str(at))} must be a time, for example '1 s', or '{EQUILIBRIUM}'"
    with refused_as(ScenarioError, problem, UnitError):
        time = float(at) if isinstance(at, Real) else parse_quantity(str(at), "s")
    return model_at(scenario, run, point_at(scenario, time))


# Plant without controller and sensors, as a function of named values.


@dataclass(frozen=True, slots=True)
class LinearisedPlant:
    """Plant of a run without controller and sensors, as a function of states and inputs.

    ``direction``: direction of a free vane, 0 if friction or a stop holds it; None if the ankle is prescribed, so that
        angle and angular velocity are inputs
    ``time``: time [s] for which the shank of a leg is fixed
    ``functions``: functions of the model, as used in the run
    """

    run: Run
    direction: float | None
    time: float
    functions: PythonFunctions

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs of the linear model."""
        more = _MOTION if self.direction is None else ("external_torque",) if self.direction else ()
        return ("command", *(_SUPPLIES[:1] if self.run.program.has_one_chamber else _SUPPLIES), *more)

    def at(self, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        """Return time derivatives and outputs for values of all states and inputs by name [SI].

        A valve state that follows the command immediately does not count as a state: its derivative is 0.
        """
        run, program, call = self.run, self.run.program, self.functions.of
        driven: dict[str, Any] = {name: values[name] for name in _DRIVEN}
        plant = run.plant._replace(**driven)
        motion, pressures = (values["angle"], values["angular_velocity"]), (values["pressure_1"], values["pressure_2"])
        warm = run.thermal if isinstance(run.thermal, ThermalParameters) else None
        temperatures = (values.get("temperature_1", 0.0), values.get("temperature_2", 0.0))
        _, openings, valve_rates = self.valve(values)
        gas = call(gas_rates)(plant, warm, openings, motion, pressures, temperatures, parts=program.functions)
        rates = {}
        # A vane that is held or prescribed has no acceleration: angle and velocity are no states then.
        if self.direction:
            added = program.foot.torque(program, run.leg, self.time, motion[0]) if program.foot is not None else 0.0
            moved = call(free_motion)(plant, *motion, *pressures, added, self.direction, parts=program.functions)
            rates = dict(zip(_MOTION, moved, strict=True))
        rates |= {"pressure_1": gas.pressure_1, "pressure_2": gas.pressure_2}
        rates |= {} if warm is None else {"temperature_1": gas.temperature_1, "temperature_2": gas.temperature_2}
        outputs = {"torque": program.actuator.torque(plant, motion[0], *pressures)}
        outputs |= {name: values[name] for name in rates} | {"supplied_flow": gas.supplied, "vented_flow": gas.vented}
        return rates | valve_rates, outputs | {name: values[name] for name in valve_rates}

    def valve(self, values: Mapping[str, float]) -> tuple[Any, Openings, dict[str, float]]:
        """Return the valve state after its immediate changes, the openings [-], and rates of the states by name."""
        run, call, valve, names = self.run, self.functions.of, self.run.program.valve, valve_states(self.run.program)
        command = call(at_valve)(values["command"])
        assert valve.rates is not None and valve.instant is not None, "no regulator"  # noqa: PT018
        state = call(valve.settle)(run.valve, rebuilt(valve.state, [values[name] for name in names]), command, 0.0)
        rates = numbers(call(valve.rates)(run.valve, state, command))
        return state, call(valve.instant)(run.valve, state, command), dict(zip(names, rates, strict=True))


def plant_of(run: Run, direction: float | None, values: Mapping[str, float], time: float = 0.0) -> LinearisedPlant:
    """Return the plant of a run near given states and inputs; other arguments as in ``LinearisedPlant``.

    If the valve has reached its requested opening, the slew limit is inactive: the valve follows a small command
    immediately. Raises SimulationError for an effect of the device that has a state; sensors are no part of the plant.
    """
    for effect in run.program.effects:
        if effect.state is not None and effect.is_of_device:
            raise SimulationError(
                f"effect '{effect.name}' has state variables, which the linear model does not include; switch the "
                "effect off"
            )
    rows = {effect.name: row for effect, row in zip(run.program.effects, run.effects, strict=True)}
    limited = LinearisedPlant(run, direction, time, functions_of(run.program, rows))
    limitless = replace(limited, run=_without_slew_limit(run))
    return limitless if limited.valve(values)[0] == limitless.valve(values)[0] else limited


def valve_states(program: Program) -> dict[str, str]:
    """Return the names of the valve states, each with its path in the rows of the simulation."""
    paths = leaf_paths(program.valve.state, "valve_state")
    return {VALVE + path.removeprefix("valve_state.").replace(".", "_"): path for path in paths}


def _without_slew_limit(run: Run) -> Run:
    is_limited = hasattr(run.valve, "slew_limit")
    return replace(run, valve=run.valve._replace(slew_limit=NO_SLEW_LIMIT)) if is_limited else run


# Slopes by differences, towards one side of a point, where the model may have a kink.


def size_of(name: str) -> float:
    """Return the reference size of a state or an input [SI], by which steps of finite differences are scaled."""
    return _SIZES.get(UNITS.get(name, ""), 1.0)


def side_of(name: str, values: Mapping[str, float], direction: float | None) -> float:
    """Return the side of a value (1 or -1) for which a linear model holds.

    The command and the valve opening increase, or decrease from full opening. Angle, pressure 1 and its supply
    increase; the angular velocity changes in the direction of motion; all other values decrease.
    """
    if name == "command":
        return 1.0 if abs(values[name]) < 1.0 else -float(np.sign(values[name]))
    if name in _OPENINGS:
        return 1.0 if values[name] < 1.0 else -1.0
    if name == "angular_velocity" and direction:
        return direction
    return 1.0 if name in ("pressure_1", "supply_pressure", *_MOTION) else -1.0


def one_sided_slopes(function: Callable[[float], Floats], at: float, side: float, size: float) -> tuple[Floats, Floats]:
    """Return the one-sided slopes of a function (rows,) towards ``side`` (1 or -1), and estimates of their errors.

    Finite differences on that side, with steps from a hundredth to a millionth of ``size``, are extrapolated to zero
    step by Ridders' method (Adv. Eng. Softw. 4, 1982). For each row, the extrapolation with the smallest estimated
    error is taken. The function is not evaluated at the value itself, so a jump there has no effect.
    """
    steps = at + side * _LONGEST * size / _SHORTER ** np.arange(_LENGTHS)
    values = np.array([function(step) for step in steps.tolist()])
    slopes = np.diff(values, axis=0) / np.diff(steps)[:, None]
    best, errors = slopes[-1], np.full(slopes.shape[1], np.inf)
    for order in range(1, _ORDERS + 1):
        better = slopes[1:] + np.diff(slopes, axis=0) / (_SHORTER**order - 1.0)
        error = np.maximum(np.abs(better - slopes[1:]), np.abs(better - slopes[:-1]))
        nearest = np.nanargmin(np.where(np.isfinite(error), error, np.inf), axis=0), np.arange(best.size)
        is_better = error[nearest] < errors
        best, errors = np.where(is_better, better[nearest], best), np.where(is_better, error[nearest], errors)
        slopes = better
    return best, errors


# Operating point: an instant of a run, or the steady state.


@dataclass(frozen=True, slots=True)
class Point:
    """Operating point: time [s] in the run, None if steady; values of states and inputs [SI]; direction of the vane."""

    time: float | None
    values: Mapping[str, float]
    direction: float | None


def point_at(scenario: Scenario, time: float) -> Point:
    """Return the operating point of a scenario's run at a time [s], rounded to the nearest step.

    Raises ScenarioError for a time outside the run.
    """
    # Allowance for rounding: the end of the run itself is a valid time.
    if not 0.0 <= time <= scenario.run.duration * (1.0 + 1.0e-12):
        raise ScenarioError(
            f"{scenario.name}: {argument_text('at', f'{time:g} s')} is outside the run, which lasts "
            f"{scenario.run.duration:g} s"
        )
    run = plan_run(scenario)
    steps = min(round(time / run.step), run.step_count)
    values = _after(scenario, run, steps)
    return Point(steps * run.step, values, _direction(run, values, steps * run.step))


def _after(scenario: Scenario, run: Run, steps: int) -> dict[str, float]:
    """Return the states and inputs after a number of steps of a run."""
    batch = batch_of(replace(run, step_count=steps))
    custom = scenario.controller.custom
    outcome = run_batch(batch) if custom is None else run_sampled(batch, custom)
    rows = {name: float(outcome.states[row, 0]) for name, row in state_row_numbers(run).items()}
    if rows["result.failure_time"] < NEVER_FAILED or not all(map(np.isfinite, rows.values())):
        raise SimulationError(
            f"{scenario.name}: the run diverges before {steps * run.step:g} s; give an earlier {argument_text('at')}, "
            "or see the cause with 'ppafo simulate'"
        )
    angle, rate = rows["state.angle"], rows["state.angular_velocity"]
    if run.program.angle is not None:
        angle, rate, _ = run.program.angle.value(run.path, steps * run.step)
    pressures = pressures_of(run.program.actuator, run.plant, angle, rows["state.mass_1"], rows["state.mass_2"])
    values = {"angle": angle, "angular_velocity": rate, "command": rows["result.command"]}
    values |= dict(zip(("pressure_1", "pressure_2"), map(float, pressures), strict=True))
    values |= {name: float(getattr(run.plant, name)) for name in _DRIVEN}
    values |= {name: rows[path] for name, path in valve_states(run.program).items()}
    if isinstance(run.thermal, ThermalParameters):
        warm = [rows[f"state.mass_{side}"] / rows[f"masses.mass_{side}"] for side in (1, 2)]
        values |= {f"temperature_{side}": run.thermal.temperature * warm[side - 1] for side in (1, 2)}
    return values


def _direction(run: Run, values: Mapping[str, float], time: float) -> float | None:
    """Direction of a free vane at a time [s], 0 if it is stuck; None if the ankle is prescribed."""
    if run.program.angle is not None:
        return None
    if values["angular_velocity"] != 0.0:
        return 1.0 if values["angular_velocity"] > 0.0 else -1.0
    limit, plant = in_program(friction_at_rest, run.program, run.effects), run.plant
    pressures = values["pressure_1"], values["pressure_2"]
    plant = plant._replace(static_torque=limit({}, plant.static_torque, *pressures))
    return mode_at_rest(plant, values["angle"], torque_at_rest(run)({}, time, values["angle"], *pressures))


def equilibrium(scenario: Scenario) -> Point:
    """Return the steady state of a scenario; ScenarioError if there is none.

    The ankle rests at its angle at the end of the run, and all states of chambers and valve are constant. The actuator
    torque, or the pressure that is controlled, is the last value of the reference; for a constant command, the command
    is given instead.
    """
    planned, name = plan_run(scenario), scenario.name

    def refusal(reason: str) -> ScenarioError:
        return ScenarioError(f"{name}: {reason}; give a time of the run, such as {argument_text('at', '1 s')}")

    if planned.leg is not None and planned.program.shank is not CONSTANT:
        raise refusal("there is no equilibrium while the shank moves")
    values = _after(scenario, planned, planned.step_count) | {"angular_velocity": 0.0}
    is_open_loop, quantity = scenario.controller.is_open_loop, CONTROLLED[scenario.controlled]
    if quantity.name == ANGLE and not is_open_loop:
        raise refusal(f"reference.of = '{ANGLE}': an equilibrium needs a reference of torque or pressure")
    end = np.array([scenario.run.duration])
    level = None if is_open_loop else float(profile_values(scenario.reference, end)[0][0])
    run, is_held = _without_slew_limit(planned), planned.program.angle is not None
    plant = plant_of(run, None if is_held else 0.0, values)
    steady = _steady(plant, values, quantity, level)
    if steady is None:
        if level is None:
            raise refusal(f"no equilibrium was found for the command {values['command']:g}")
        full, reached = 1.0 if (level > 0.0) != scenario.device.supply.is_vacuum else -1.0, ""
        most = _steady(plant, values | dict.fromkeys(("command", *_openings_in(values)), full), quantity, None)
        if most is not None and quantity.name == TORQUE:
            reached = f": with the valve fully open the actuator reaches {plant.at(most)[1]['torque']:.4g} N m"
        asked = of_path("reference.level", quantity.level.unit, ".4g").text(level)
        raise refusal(f"there is no equilibrium at {asked}, the last value of the reference{reached}")
    if _direction(run, steady, scenario.run.duration):
        degrees = np.degrees(values["angle"])
        raise refusal(f"there is no equilibrium, because the torque accelerates the vane at {degrees:.4g} deg")
    # A valve that is closed but for rounding is closed.
    steady |= {name: 0.0 for name in ("command", *_openings_in(steady)) if abs(steady[name]) < _STEADY}
    # States that the valve takes from its command at once were no unknowns.
    at_rest = numbers(plant.valve(steady)[0])
    return Point(None, steady | dict(zip(valve_states(run.program), at_rest, strict=True)), None if is_held else 0.0)


def _openings_in(values: Mapping[str, float]) -> list[str]:
    return [name for name in values if name in _OPENINGS]


def _steady(
    plant: LinearisedPlant, values: Mapping[str, float], quantity: ControlledQuantity, level: float | None
) -> dict[str, float] | None:
    """Return a steady state at a level of a quantity [SI], or at the present command; None if the search fails."""
    from scipy.optimize import least_squares

    # Where the search begins: at the end of the run, then about the pressures that have the level.
    starts, lowest = [dict(values)], plant.run.plant.atmospheric_pressure
    target = (level or 0.0) - (lowest if quantity.level.unit == "Pa_a" and level is not None else 0.0)
    surplus = abs(target) / (plant.run.plant.torque_constant if quantity.name == TORQUE else 1.0)
    for size in _FIRST_COMMANDS:
        command = values["command"] if level is None else size if target * quantity.sign >= 0.0 else -size
        pressures = [1.001 * lowest + (surplus if is_fed else 0.0) for is_fed in (command > 0.0, command < 0.0)]
        start = {"pressure_1": pressures[0], "pressure_2": pressures[1], "command": command}
        starts.append({**values, **start, **dict.fromkeys(_openings_in(values), command)})
    # The unknowns are all states, and the command if a level is given.
    names = [*plant.at(values)[0], *([] if level is None else ["command"])]
    sizes = np.array([size_of(name) for name in names])

    def imbalance(start: Mapping[str, float], unknowns: Floats) -> Floats:
        """Return time derivatives relative to the size of the states [1/s], and relative error of the level [-]."""
        tried = {**start, **dict(zip(names, unknowns.tolist(), strict=True))}
        rates_by_name, outputs = plant.at(tried)
        # So that pascals and openings count alike.
        rates = [rate / size_of(name) for name, rate in rates_by_name.items()]
        if level is None:
            return np.array(rates)
        reached = quantity.value(tried["angle"], tried["pressure_1"], tried["pressure_2"], outputs["torque"])
        return np.array([*rates, (reached - level) / quantity.size])

    least = [
        -1.0 if name == "command" or name in _OPENINGS else 0.0 if size_of(name) > 1.0 else -np.inf for name in names
    ]
    most = [1.0 if name == "command" or name in _OPENINGS else np.inf for name in names]
    for start in starts:
        # Least squares instead of a solver that refuses: in a dead band the slopes are singular.
        first = np.clip([start[name] for name in names], least, most)
        # A search that fails, as of a valve without area, says so by its sum.
        with np.errstate(all="ignore"):
            found = least_squares(
                partial(imbalance, start),
                first,
                bounds=(least, most),
                x_scale=sizes,
                ftol=None,
                gtol=None,
                xtol=1.0e-15,
            )
        if np.max(np.abs(found.fun)) < _STEADY:
            return {**start, **dict(zip(names, found.x.tolist(), strict=True))}
    return None


# The model at a point.


def model_at(scenario: Scenario, run: Run, point: Point) -> LinearModel:
    """Return the linear model at an operating point, with one-sided slopes on the sides given by ``side_of``."""
    values, plant = point.values, plant_of(run, point.direction, point.values, point.time or 0.0)
    rates_here, outputs_here = plant.at(values)

    def slopes(name: str, side: float) -> tuple[Floats, Floats]:
        def rates_and_outputs(value: float) -> Floats:
            rates, outputs = plant.at({**values, name: value})
            return np.array([*rates.values(), *outputs.values()])

        return one_sided_slopes(rates_and_outputs, values[name], side, size_of(name))

    columns = [*rates_here, *plant.inputs]
    sides = {name: side_of(name, values, point.direction) for name in columns}
    # Slopes of rates and outputs on the side of ``side_of`` and on the other side, and estimates of their errors.
    near, near_errors = np.stack([slopes(name, sides[name]) for name in columns], axis=-1)
    far, far_errors = np.stack([slopes(name, -sides[name]) for name in columns], axis=-1)
    # A value that the valve takes from its command at once is no state: only the output that shows it needs it.
    rows = [*(f"rate of {state}" for state in rates_here), *outputs_here]
    # A second chamber that the actuator lacks stays at the atmosphere, without any slope.
    idle = [name for name in rates_here if run.program.has_one_chamber and name in OF_SECOND_CHAMBER]
    for place, name in enumerate(columns):
        others = [row != name for row in rows]
        if name.startswith(VALVE) and not np.any(near[others, place]) and not np.any(far[others, place]):
            idle.append(name)
    is_row = np.array([name not in idle for name in (*rates_here, *outputs_here)])
    is_column = np.array([name not in idle for name in columns])
    near, far, errors = (whole[is_row][:, is_column] for whole in (near, far, near_errors + far_errors))
    states, outputs, columns = (
        [name for name in names if name not in idle] for names in (rates_here, outputs_here, columns)
    )
    sizes = np.array([size_of(name) for name in columns])
    largest = np.max(np.maximum(np.abs(near), np.abs(far)) * sizes, axis=1, keepdims=True)
    is_kink = np.any(np.abs(near - far) * sizes > _ON_THE_EDGE * largest + 10.0 * errors * sizes, axis=0)
    near = np.where(np.abs(near) * sizes > _ZERO * largest, near, 0.0)
    count = len(states)
    in_words = limits_of(scenario, plant, point)
    # The command is the first input.
    if not np.any(near[:, count]):
        in_words["valve"] += f"; {DEAF}"
    sent_per_opening = 1.0
    if run.program.inverts_valve:
        opening, sent = (in_program(port, run.program, run.effects) for port in (at_valve, sent_command))
        wanted = opening({}, values["command"])
        sent_per_opening = float(one_sided_slopes(lambda at: np.array([sent({}, at)]), wanted, 1.0, 1.0)[0][0])
    kinks = [name for name, differs in zip(columns, is_kink.tolist(), strict=True) if differs]
    model = LinearModel(
        scenario=scenario,
        time=point.time,
        states=tuple(states),
        inputs=plant.inputs,
        outputs=tuple(outputs),
        values={name: ({**values, **outputs_here})[name] for name in (*states, *plant.inputs, *outputs)},
        A=near[:count, :count],
        B=near[:count, count:],
        C=near[count:, :count],
        D=near[count:, count:],
        rates=np.array([rates_here[name] for name in states]),
        sides=in_words,
        edges={name: "above" if sides[name] > 0.0 else "below" for name in kinks},
        delays=OmittedDelays(run.command_delay, run.signal_delay, run.period),
        sent_per_opening=sent_per_opening,
    )
    return replace(model, margins=loop_margins(model))


def limits_of(scenario: Scenario, linearised: LinearisedPlant, point: Point) -> dict[str, str]:
    """Return the side of each limit at the operating point, in words, by component."""
    at, run, joint, plant = point.values, linearised.run, scenario.device.joint, linearised.run.plant
    openings = linearised.valve(at)[1]
    atmosphere, pressure_1, pressure_2 = plant.atmospheric_pressure, at["pressure_1"], at["pressure_2"]
    paths = [
        ("source to chamber 1", plant.valve_curve, at["supply_pressure"], pressure_1, openings.source_1),
        ("chamber 1 to atmosphere", plant.valve_curve, pressure_1, atmosphere, openings.vent_1),
        ("source to chamber 2", plant.valve_curve, at["dorsiflexion_pressure"], pressure_2, openings.source_2),
        ("chamber 2 to atmosphere", plant.valve_curve, pressure_2, atmosphere, openings.vent_2),
        ("leak from chamber to chamber", plant.leak_curve, pressure_1, pressure_2, 1.0),
    ]
    regimes = {}
    for name, curve, pressure_a, pressure_b, opening in paths[: 2 if run.program.has_one_chamber else None]:
        ratio = min(pressure_a, pressure_b) / max(pressure_a, pressure_b)
        near = ", on the straight line near equal pressures" if ratio > curve.linear_ratio else ""
        flows = f"below choking, pressure ratio {ratio:.4f}{near}"
        flows = f"choked, pressure ratio {ratio:.3f}" if ratio <= curve.critical_ratio else flows
        regimes[name] = flows if opening else "closed"
    vane = "locked" if scenario.motion.locked_angle is not None else "prescribed"
    if point.direction == 0.0:
        is_at_stop = not plant.angle_min < at["angle"] < plant.angle_max
        vane = "against a stop" if is_at_stop else "sticks by static friction"
    elif point.direction is not None:
        vane = f"slides in {joint.positive if point.direction > 0.0 else joint.negative}"
    valve = "closed"
    if any(openings):
        chamber = 1 if openings.source_1 > 0.0 else 2
        is_vacuum = min(at["supply_pressure"], at["dorsiflexion_pressure"]) < atmosphere
        valve = f"{'evacuates' if is_vacuum else 'feeds'} chamber {chamber}, open by {max(openings):.4g}"
    return {"valve": valve, joint.name: vane, **regimes}


# Control loop with the scenario's own PID.


def open_loop(model: LinearModel) -> tuple[Floats, NDArray[np.complex128]] | None:
    """Return frequencies [Hz] up to half the sample rate, and the open-loop response of PID and plant at each.

    The sampled loop is cut at the command. It has the PID with rectangular integration and filtered difference, a
    zero-order hold, the delays that the model omits and the bandwidths of the sensors, but no noise or resolution.
    None for a controller without PID, a command that is clipped or has no effect, or a controlled quantity at rest.
    """
    scenario, gains, period = model.scenario, model.scenario.controller.settings, model.scenario.controller.period
    command = abs(model.values["command"])
    difference = {"pressure_1": 1.0, "pressure_2": -1.0}
    weights = difference if scenario.controlled == "pressure_difference" else {scenario.controlled: 1.0}
    if scenario.controller.kind not in PID_LAWS or command >= 1.0 or not weights.keys() <= set(model.outputs):
        return None
    rates = [1.0 / period, *np.abs(model.poles).tolist(), gains["integral_gain"] / (gains["proportional_gain"] or 1.0)]
    slowest = min(rate for rate in rates if rate > _INTEGRATOR) / (2.0 * np.pi)
    frequencies = np.geomspace(_BELOW_POLES * slowest, 0.5 / period, _POINTS)
    row = np.asarray(sum(weight * model.C[model.outputs.index(name)] for name, weight in weights.items()))
    # The law skips the dead band that it assumes, within a narrow range of openings.
    band = gains.get("dead_band", 0.0)
    opened = 1.0 - band + (band / SHARPNESS if command < band + (1.0 - band) * SHARPNESS else 0.0)
    opened *= model.sent_per_opening
    steered = error_functions(scenario.controlled, scenario.device.supply.is_vacuum).steered(opened)

    def response(frequencies: Floats) -> NDArray[np.complex128]:
        z = np.exp(2.0j * np.pi * frequencies * period)
        change = 1.0 - 1.0 / z
        law = gains["proportional_gain"] + gains["integral_gain"] * period / change
        law += gains["derivative_gain"] * change / (period + gains["derivative_filter"] * change)
        return np.asarray(steered * law * _sampled_plant(model, row, z))

    loop = response(frequencies)
    if not loop.all():
        return None
    start = float(np.abs(loop[0]))
    if _integrators(frequencies, loop) > 0 and start < _LEAST_START:
        below = np.geomspace(frequencies[0] * start / _LEAST_START, frequencies[0], _POINTS_BELOW)[:-1]
        frequencies, loop = np.concatenate([below, frequencies]), np.concatenate([response(below), loop])
    return frequencies, loop


def _sampled_plant(model: LinearModel, row: Floats, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the sampled response at ``z`` of measured states, weighted by ``row``, to a command held for a period."""
    from scipy.linalg import expm

    count, period, sensors = len(model.states), model.scenario.controller.period, model.scenario.sensors
    sizes = np.array([size_of(name) for name in model.states])
    # The readings of sensors with a bandwidth are states as well; then come the command now, and the one before.
    matrix = np.zeros((2 * count + 1, 2 * count + 1))
    matrix[:count, :count] = model.A * sizes / sizes[:, None]
    matrix[:count, -1] = model.B[:, 0] / sizes
    shown = np.zeros(2 * count)
    for index, name in enumerate(model.states):
        bandwidth = getattr(sensors, f"{name.partition('_')[0]}_bandwidth", 0.0)
        matrix[count + index, [index, count + index]] = np.array([1.0, -1.0]) * (2.0 * np.pi * bandwidth or 1.0)
        shown[index + (count if bandwidth else 0)] = row[index] * sizes[index]
    whole, rest = divmod((model.delays.command + model.delays.signals) / period + _ROUNDING, 1.0)
    step, early = expm(matrix * period), expm(matrix * period * (1.0 - rest))
    # A command that comes within the period acts on its last part; the one before on the first.
    late = step[:-1, -1:] - early[:-1, -1:]
    held = early[:-1, -1:] * z[:, None, None] ** -whole + late * z[:, None, None] ** -(whole + 1.0)
    responses = np.linalg.solve(z[:, None, None] * np.eye(2 * count) - step[:-1, :-1], held)[:, :, 0]
    return np.asarray(responses @ shown, dtype=np.complex128)


def loop_margins(model: LinearModel) -> LoopMargins | None:
    """Return the margins of the loop that the scenario's PID closes around a linear model; None without a loop."""
    found = open_loop(model)
    if found is None:
        return None
    frequencies, loop = found
    sensitivity = 1.0 / (1.0 + loop)
    # Nyquist: of a stable closed loop, 1 + L turns by a quarter for each integrator, by a half for each unstable pole.
    turned = np.unwrap(np.angle(1.0 + loop))
    log_gain, closed = np.log(np.abs(loop)), np.abs(loop * sensitivity)
    quarters = _integrators(frequencies, loop) + 2 * np.count_nonzero(model.poles.real > _INTEGRATOR)
    at_gain = _crossings(log_gain, frequencies, np.angle(-loop))
    # At half the sample rate, where the curve ends, the loop is real.
    at_phase = _crossings(np.where(loop.real < 0.0, loop.imag, np.nan)[:-1], frequencies, log_gain)
    at_phase += [(float(frequencies[-1]), float(log_gain[-1]))] if loop[-1].real < 0.0 else []
    falls = _crossings(closed - np.sqrt(0.5) * closed[0], frequencies, closed)
    gain_crossover, phase_margin = min(at_gain, key=lambda pair: abs(pair[1]), default=(None, None))
    phase_crossover, log_margin = min(at_phase, key=lambda pair: abs(pair[1]), default=(None, None))
    return LoopMargins(
        is_stable=bool(round(float(turned[-1] - turned[0]) / (0.5 * np.pi)) == quarters),
        gain_margin=None if log_margin is None else float(np.exp(-log_margin)),
        phase_crossover=phase_crossover,
        phase_margin=phase_margin,
        gain_crossover=gain_crossover,
        bandwidth=falls[0][0] if falls else None,
        peak_sensitivity=float(np.max(np.abs(sensitivity))),
    )


def _integrators(frequencies: Floats, loop: NDArray[np.complex128]) -> int:
    """Return the number of integrators of a loop, by its slope at the lowest frequency.

    Two sealed chambers are two integrators of one command, of which the loop has one.
    """
    return round(float(np.log(np.abs(loop[0] / loop[1])) / np.log(frequencies[1] / frequencies[0])))


def _crossings(values: Floats, frequencies: Floats, others: Floats) -> list[tuple[float, float]]:
    """Frequencies [Hz] at which ``values`` change their sign, each with ``others`` there, by linear interpolation."""
    found: list[tuple[float, float]] = []
    for before in np.flatnonzero(values[:-1] * values[1:] < 0.0).tolist():
        share = values[before] / (values[before] - values[before + 1])
        frequency, other = (each[before] + share * (each[before + 1] - each[before]) for each in (frequencies, others))
        found.append((float(frequency), float(other)))
    return found


# Report: operating point, side of each limit, poles, margins, matrices and range of validity.


@in_units(lambda model: model.scenario.device.shown)
def finding_of(model: LinearModel) -> Finding[LinearModel]:
    """Return a linear model as a finding with sentences, tables and panels."""
    when = "in its steady state" if model.time is None else f"at {model.time:g} s"
    title = f"Linear model of {model.scenario.name}, {when}"
    sentences = ["plant without controller and sensors: deviations from the operating point in SI units"]
    if model.time is not None:
        sentences.append(
            "the operating point is not a steady state: the model describes small deviations from the run and is valid "
            "only while the run stays near this point"
        )
    delays = zip(("dead time of the valve", "age of the measurements", "sample period"), model.delays, strict=True)
    omitted = ", ".join(f"{name} {1.0e3 * delay:g} ms" for name, delay in delays if delay > 0.0)
    sentences.append(f"not in the model: {omitted}, noise, resolution and bandwidth of sensors")
    supply = model.scenario.device.supply
    zero = float(supply.atmospheric_pressure)
    for name, highest in (("pressure_1", supply.pressure), ("pressure_2", supply.dorsiflexion_pressure)):
        share = (model.values.get(name, zero) - zero) / (float(highest) - zero) if highest > zero else 0.0
        if share > _FULL:
            sentences.append(
                f"{name} is {100.0 * share:.4g} % of its supply pressure, at the limit of the actuator: hardly any "
                "flow into the chamber is left, and gains and margins hold for very small changes only"
            )
    kinks = [
        f"the plant is not differentiable at this point: the column of `{name}` is valid only {side} its value"
        for name, side in model.edges.items()
    ]
    matrices = []
    for name, values, rows, columns in (
        ("A", model.A, model.states, model.states),
        ("B", model.B, model.states, model.inputs),
        ("C", model.C, model.outputs, model.states),
        ("D", model.D, model.outputs, model.inputs),
    ):
        titles: list[str | tuple[str, Kind]] = ["", *((name, Kind(form=".5g")) for name in columns)]
        cells = [(name, *row) for name, row in zip(rows, values.tolist(), strict=True)]
        matrices.append(Section(f"Matrix {name} (SI)", columns_of(titles, cells)))
    point = []
    outputs = tuple(name for name in model.outputs if name not in model.states)
    for role, names in (("state", model.states), ("input", model.inputs), ("output", outputs)):
        for name in names:
            unit = UNITS[name]
            kind = Kind("", "" if unit == "1" else unit, quantity_of_unit(unit), ".5g")
            point.append((role, name, unit, kind.text(model.values[name])))
    # Runs can start there: gas alone is in motion, and the largest step stays below full opening.
    has_gas_alone = all(name.startswith("pressure") for name in model.states)
    is_small = 0.0 < abs(model.values["command"]) < _LARGEST_COMMAND
    can_step = model.time is None and model.scenario.motion.locked_angle is not None and has_gas_alone and is_small
    validity = Section(
        "Range of validity",
        panels=partial(steps_panels, model),
        name="steps",
        caption=_STEPS_CAPTION,
        across=2,
        size=(3.0, 2.8),
        title=title,
    )
    return Finding(
        name="linearise",
        kicker="Linear model",
        title=title,
        said=sentences,
        parts=[
            Section("The point", columns_of(("", "name", "unit in the model", "at the point"), point), left=3),
            Section("Side of the kink", facts(model.sides.items()), remarks=kinks),
            _poles(model, title),
            _loop(model),
            *matrices,
            *([validity] if can_step else []),
        ],
        found=model,
        overrides=changes_in(model.scenario),
    )


def _poles(model: LinearModel, title: str) -> Section:
    """Return the table of poles with time constants; a complex pair is one row with frequency and damping.

    The frequency response, under ``title``, is drawn if the command, which is the first input, has any effect.
    """
    rows: list[tuple[str | float | None, ...]] = []
    for pole in model.poles.tolist():
        size = abs(pole)
        if abs(pole.imag) <= _REAL * size:
            rows.append((f"{pole.real:.5g}", None if pole.real == 0.0 else -1.0 / pole.real, None, None))
        elif pole.imag > 0.0:
            pair = f"{pole.real:.5g} ± {pole.imag:.5g}i"
            rows.append((pair, None, size / (2.0 * np.pi), -pole.real / size))
    constant, frequency = (Kind(quantity=quantity) for quantity in ("time", "frequency"))
    ratio = ("damping ratio", Kind(form=".3f"))
    return Section(
        "Poles",
        columns_of(("pole (1/s)", ("time constant", constant), ("frequency", frequency), ratio), rows),
        panels=partial(frequency_panels, model),
        name="frequency-response" if np.any(model.B[:, 0]) or np.any(model.D[:, 0]) else "",
        caption=_FREQUENCY_CAPTION,
        size=(5.4, 2.2),
        title=title,
    )


def _loop(model: LinearModel) -> Section:
    """Return the table of the margins of the loop with the scenario's PID, or the reason why there is none."""
    margins, controller = model.margins, model.scenario.controller
    if margins is None:
        reason = "the command is clipped, or has no effect"
        if controller.kind not in PID_LAWS:
            reason = f"controller '{controller.kind}' is not a PID"
        return Section(remarks=[f"no stability margins: {reason}"])
    frequency, angle = Kind(quantity="frequency", form=".3g"), Kind(quantity="angle", form=".3g")
    gain = margins.gain_margin or 1.0
    values = (
        ("gain margin", f"{gain:.3g} ({20.0 * np.log10(gain):.3g} dB) at ", margins.phase_crossover),
        ("phase margin", f"{angle.text(margins.phase_margin or 0.0)} at ", margins.gain_crossover),
        ("bandwidth (-3 dB)", "", margins.bandwidth),
    )
    # A sampled loop is real at half the sample rate: its phase may meet -180 deg there alone.
    end = (1.0 - _REAL) * 0.5 / controller.period
    only = ", half the sample rate: the phase reaches -180 deg only there"
    none = "none below half the sample rate"
    rows = [("closed loop", "stable" if margins.is_stable else "unstable")]
    rows += [
        (name, none if at is None else f"{text}{frequency.text(at)}{only if at >= end else ''}")
        for name, text, at in values
    ]
    rows.append(("peak sensitivity", f"{margins.peak_sensitivity:.3g}"))
    return Section("Loop with the PID of the scenario for small changes, sampled and with its delays", facts(rows))


def frequency_panels(model: LinearModel) -> list[Panel]:
    """Return panels of the open loop with its margins, if any, and of the frequency response of torque to command."""
    poles, margins = np.abs(model.poles) / (2.0 * np.pi), model.margins
    found = () if margins is None else (margins.gain_crossover, margins.phase_crossover, margins.bandwidth)
    # All frequencies that the report names, and half the sample rate, where a loop ends.
    lowest = _LOWEST_SHARE * min((1.0, *poles[poles > 0.0].tolist(), *(at for at in found if at)))
    highest = max(_HIGHEST, 0.0 if margins is None else 0.5 / model.delays.period)
    frequencies = np.geomspace(lowest, highest, _DRAWN_POINTS)
    response, delay = (
        model.response(frequencies),
        model.delays.command + model.delays.signals + 0.5 * model.delays.period,
    )
    phase = np.degrees(np.unwrap(np.angle(response)))
    delayed = f"with {1.0e3 * delay:.3g} ms of dead time, late measurements and half a sample"

    def panel(kind: Kind, marks: list[Mark], legend: str = "above", **scales: Any) -> Panel:
        def set_axes(axes: "Axes") -> None:
            from matplotlib.ticker import MultipleLocator

            axes.set(xscale="log", xlim=(lowest, 1.1 * highest), **scales)
            if "ylim" in scales:
                axes.yaxis.set_major_locator(MultipleLocator(45.0))

        return Panel(_FREQUENCY, kind, marks, legend=legend, then=set_axes, shares_x=True)

    panels, loop = [], open_loop(model)
    if loop is not None and margins is not None:
        is_drawn = loop[0] >= lowest
        at_loop, drawn = (values[is_drawn][_LOOP_POINTS][::-1] for values in loop)
        phases = np.degrees(np.unwrap(np.angle(drawn)))
        # Where a margin is read: from the dot to the dashed line, the nearest of the whole turns.
        critical = -180.0 + 360.0 * round((phases[-1] + 180.0) / 360.0)
        crossovers = (
            (margins.gain_crossover, "phase margin", VERMILION, "o"),
            (margins.phase_crossover, "gain margin", BLACK, "s"),
        )
        for kind, curve, level, scale in (
            (Kind("Open-loop gain"), np.abs(drawn), 1.0, "log"),
            (Kind("Open-loop phase", "deg"), phases, critical, "linear"),
        ):
            ends = Mark("line", at_loop[[0, -1]], np.full(2, level), (), "", GREY, _DASHED)
            dots = [
                Mark(
                    "line",
                    np.array([at]),
                    np.array([np.interp(at, at_loop, curve)]),
                    label=f"{name} at {at:.3g} Hz",
                    colour=colour,
                    style={"linestyle": "", "marker": marker, "markersize": 5},
                )
                for at, name, colour, marker in crossovers
                if at is not None and at >= lowest
            ]
            panels.append(panel(kind, [Mark("line", at_loop, curve), ends, *dots], "inside", yscale=scale))
    late = Mark("line", frequencies, phase - 360.0 * frequencies * delay, (), delayed, VERMILION, _DASHED)
    ends_of_phase = (max(-360.0, float(np.min(phase)) - 90.0), float(np.max(phase)) + 20.0)
    return [
        *panels,
        panel(Kind("Torque per command", "N m"), [Mark("line", frequencies, np.abs(response))], yscale="log"),
        panel(
            Kind("Phase", "deg"), [Mark("line", frequencies, phase, label="plant"), late], "inside", ylim=ends_of_phase
        ),
    ]


# Range of validity: steps of the command from the steady state, on the runs and of the model.


def steps_of(model: LinearModel, shares: tuple[float, ...] = SHARES) -> tuple[Floats, Floats, Floats]:
    """Return step heights of the command [-] (steps,), and torque changes of runs and model [N m] (steps, times).

    The steps are fractions of the steady command; the ankle must be locked, and gas pressures the only states.
    """
    from scipy.signal import StateSpace, step

    command, run = model.values["command"], model.scenario.run
    held = replace(
        model.scenario,
        run=replace(run, duration=DURATION, step=INTERVAL, output_interval=INTERVAL),
        initial=replace(model.scenario.initial, **{name: model.values[name] for name in model.states}),
    )
    laws = (
        Control(switching.CONSTANT.name, {"command": command * (1.0 + share)}, INTERVAL) for share in (0.0, *shares)
    )
    results = simulate_many([with_control(held, law) for law in laws])
    still, *runs = (result.recording["torque"] for result in results)
    amplitudes: Floats = command * np.array(shares, dtype=np.float64)
    # The command is the first input, the torque the first output.
    plant = StateSpace(model.A, model.B[:, :1], model.C[:1], model.D[:1, :1])
    return amplitudes, np.array(runs) - still, amplitudes[:, None] * step(plant, T=INTERVAL * np.arange(still.size))[1]


def steps_panels(model: LinearModel) -> list[Panel]:
    """Return panels of step responses, nonlinear and linear, and of their difference divided by the amplitude."""
    amplitudes, runs, linear = steps_of(model)
    times, over_time = INTERVAL * np.arange(runs.shape[1]), []
    for number, colour in zip(_DRAWN_STEPS, (BLUE, VERMILION), strict=True):
        label = f"command {100.0 * SHARES[number]:+.3g} %"
        over_time.append(Mark("line", times, runs[number] / amplitudes[number], label=label, colour=colour))
    over_time.append(Mark("line", times, linear[-1] / amplitudes[-1], (), "linear", BLACK, _DASHED))
    errors, sizes = (np.max(np.abs(changes), axis=1) for changes in (runs - linear, runs))
    square = errors[0] * (sizes / sizes[0]) ** 2
    dots = {"linestyle": "", "marker": "o", "markersize": 4}
    per_command = Kind("Change of torque per command", "N m")
    return [
        Panel(replace(TIME, words="Time after the step"), per_command, over_time),
        Panel(
            Kind("Largest change of torque in a step", "N m"),
            Kind("Runs less linear model", "N m"),
            [
                Mark("line", sizes, errors, label="largest difference", style=dots),
                Mark("line", sizes, square, (), "square of the amplitude", GREY, _DASHED),
            ],
            then=lambda axes: axes.set(xscale="log", yscale="log"),
        ),
    ]
