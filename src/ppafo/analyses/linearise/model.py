"""Linear model of a scenario's plant: record, plant by named values, point, slopes, control loop, and report.

Read downwards: ``linear_model`` takes a point of a run or the steady state, and differences of the plant's rates there.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from numbers import Real
from operator import methodcaller
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.controllers import switching
from ppafo.control.profiles import CONSTANT
from ppafo.control.torque_loop import SHARPNESS
from ppafo.documents.json_text import plain
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
from ppafo.report.panels import Mark, Panel, dots
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
from ppafo.wording import argument_text, check_known, one_line

EQUILIBRIUM = "equilibrium"
VALVE = "valve_"
"""Prefix of the names of valve states."""
_OPENINGS = (f"{VALVE}requested", f"{VALVE}opening")
_SUPPLIES = ("supply_pressure", "dorsiflexion_pressure")
_MOTION = ("angle", "angular_velocity")
_PRESSURES = ("pressure_1", "pressure_2")
_TEMPERATURES = ("temperature_1", "temperature_2")
UNITS = {
    "angle": "rad",
    "angular_velocity": "rad/s",
    **dict.fromkeys((*_PRESSURES, *_SUPPLIES), "Pa"),
    **dict.fromkeys(_TEMPERATURES, "K"),
    f"{VALVE}rate": "1/s",
    **dict.fromkeys(("external_torque", "torque"), "N m"),
    **dict.fromkeys(("supplied_flow", "vented_flow"), "kg/s"),
}
"""SI units of the signals of a linear model; others are dimensionless."""
_SIGNALS = ("states", "inputs", "outputs")
_SIZES = {"Pa": 1.0e5, "K": 300.0}
"""Reference size of values by unit [SI], else 1: for steps of differences, and to compare slopes and rates."""
# Slope over the largest of its row: above the first, a difference of both sides is a kink (of the smooth, about
# 1e-9); below the second, a slope is 0.
_ON_THE_EDGE = 1.0e-6
_ZERO = 1.0e-9
# Longest step of a difference over the reference size, ratio of steps, their number, and orders extrapolated [-].
_LONGEST = 1.0e-2
_SHORTER = 4.0
_LENGTHS = 8
_ORDERS = 5
_STEADY = 1.0e-9
"""Largest time derivative divided by the size of the state [1/s] that counts as zero."""
PID_LAWS = ("pid", "pid_feedforward")
"""Controllers whose feedback is a PID: their loop is linear while the command is not clipped."""
_INTEGRATOR = 1.0e-6
"""Magnitude [1/s] up to which a pole counts as an integrator."""
# Sample time [s] of runs after a step of the command, and the steps divided by the steady command: three decades.
_INTERVAL = 1.0e-3
_SHARES = tuple(np.geomspace(3.0e-4, 0.3, 13).tolist())
_DASHED = {"linestyle": "--"}


class OmittedDelays(NamedTuple):
    """Delays that the linear model omits [s]: dead time of the valve, age of the measurements, sample period."""

    command: float
    signals: float
    period: float


@dataclass(frozen=True, slots=True)
class LoopMargins:
    """Margins of the control loop, closed by the scenario's PID; None where a crossover does not exist.

    Angles are in rad and frequencies in Hz, as in JSON; the report has degrees.

    ``is_stable``: True if the closed loop of the linear model is stable
    ``gain_margin``: factor on all gains at which the loop becomes unstable [-]
    ``phase_crossover``: frequency of the gain margin [Hz]
    ``phase_margin``: phase margin [rad]
    ``gain_crossover``: frequency of the phase margin, at which the loop gain is 1 [Hz]
    ``bandwidth``: lowest frequency at which the closed loop follows with 0.707 of its lowest-frequency response [Hz]
    ``peak_sensitivity``: largest sensitivity abs(1 / (1 + L)) [-]
    ``frequencies``, ``loop``: frequencies [Hz] up to half the sample rate, and the open loop L at each; not in JSON
    """

    is_stable: bool
    gain_margin: float | None
    phase_crossover: float | None
    phase_margin: float | None
    gain_crossover: float | None
    bandwidth: float | None
    peak_sensitivity: float
    frequencies: Floats = field(compare=False, repr=False)
    loop: NDArray[np.complex128] = field(compare=False, repr=False)


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
        for name, names, role in ((output, self.outputs, "output"), (source, self.inputs, "input")):
            check_known(name, names, ScenarioError, f"the linear model has no {role} '{one_line(name)}'")
        row = self.outputs.index(output)
        column = self.inputs.index(source)
        poles = self.poles
        points = 2.0j * np.pi * np.asarray(frequencies, dtype=np.float64).ravel()
        away = np.min(np.abs(points[:, None] - poles), axis=1)
        # Eigenvalues are that accurate.
        for point in points[away <= 1.0e-12 * np.max(np.abs(poles))]:
            raise ScenarioError(
                f"{self.scenario.name}: the linear model has a pole at {point.imag / (2.0 * np.pi):g} Hz, where its "
                "response is infinite; give another frequency"
            )
        matrices = points[:, None, None] * np.eye(len(self.states)) - self.A
        response = np.linalg.solve(matrices, self.B[:, column, None])[:, :, 0] @ self.C[row] + self.D[row, column]
        return np.asarray(response)

    def json_document(self) -> dict[str, Any]:
        """Return operating point, matrices, poles and sides as plain data in SI."""
        signals = {
            role: [{"name": name, "unit": UNITS.get(name, "1"), "value": self.values[name]} for name in names]
            for role, names in zip(_SIGNALS, (self.states, self.inputs, self.outputs), strict=True)
        }
        for signal, rate in zip(signals["states"], self.rates.tolist(), strict=True):
            signal["rate"] = rate
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
            "margins": plain(self.margins),
        }

    def to_control(self) -> Any:
        """Return the model as a ``control.StateSpace`` with signal names.

        Raises ScenarioError if the extra ``control`` is not installed.
        """
        if find_spec("control") is None:
            raise ScenarioError("a system for python-control needs the package control: pip install ppafo[control]")
        import control

        names = {role: list(getattr(self, role)) for role in _SIGNALS}
        return control.ss(self.A, self.B, self.C, self.D, name=self.scenario.name.replace("-", "_"), **names)


def linear_model(scenario: Scenario, at: float | str) -> LinearModel:
    """Return the linear model of a scenario at a time [s] of its run, a number or a text, or at ``EQUILIBRIUM``.

    A time is rounded to the nearest step. Raises ScenarioError for regulated supplies, an on/off valve, a time outside
    the run, and an operating point that does not exist.
    """
    run = plan_run(scenario)
    fault = ""
    if scenario.supply_lines is not None:
        raise ScenarioError(f"{scenario.name}: the linear model assumes a constant supply pressure; omit [supply_line]")
    if run.program.valve.regulates:
        fault = "regulates pressures, of which there is no linear model"
    else:
        # A small change of the command changes openings or their rates somewhere; a table of openings may be flat.
        still = dict(zip(valve_states(run.program), numbers(run.program.valve.state()), strict=True))
        plant = plant_of(_without_slew_limit(run), None, still | {"command": 0.0})
        commands = np.linspace(-0.95, 0.95, 20)
        first, second = (
            [plant.valve(still | {"command": command})[1:] for command in (commands + change).tolist()]
            for change in (1.0e-4, 2.0e-4)
        )
        if first == second:
            fault = "switches on and off, so its flow has no derivative with respect to the command"
    if fault:
        valve = f"valve '{scenario.device.valve_name}'"
        raise ScenarioError(f"{scenario.name}: {valve} {fault}; set device.valve to a proportional valve")
    if at == EQUILIBRIUM:
        return model_at(scenario, run, equilibrium(scenario, run), None)
    problem = f"{scenario.name}: {argument_text('at', str(at))} must be a time, for example '1 s', or '{EQUILIBRIUM}'"
    with refused_as(ScenarioError, problem, UnitError):
        time = float(at) if isinstance(at, Real) else parse_quantity(str(at), "s")
    # Allowance for rounding: the end of the run itself is a valid time.
    if not 0.0 <= time <= scenario.run.duration * (1.0 + 1.0e-12):
        place = argument_text("at", f"{time:g} s")
        raise ScenarioError(f"{scenario.name}: {place} is outside the run, which lasts {scenario.run.duration:g} s")
    steps = min(round(time / run.step), run.step_count)
    return model_at(scenario, run, values_after(scenario, run, steps), steps * run.step)


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

    def at(self, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        """Return time derivatives and outputs for values of all states and inputs by name [SI].

        A valve state that follows the command immediately does not count as a state: its derivative is 0.
        """
        run = self.run
        program = self.run.program
        call = self.functions.of
        driven: dict[str, Any] = {name: values[name] for name in (*_SUPPLIES, "external_torque")}
        plant = run.plant._replace(**driven)
        motion = (values["angle"], values["angular_velocity"])
        pressures = (values["pressure_1"], values["pressure_2"])
        warm = run.thermal if isinstance(run.thermal, ThermalParameters) else None
        temperatures = tuple(values.get(name, 0.0) for name in _TEMPERATURES)
        _, openings, valve_rates = self.valve(values)
        gas = call(gas_rates)(plant, warm, openings, motion, pressures, temperatures, parts=program.functions)
        rates = {}
        # A vane that is held or prescribed has no acceleration: angle and velocity are no states then.
        if self.direction:
            added = program.foot.torque(program, run.leg, self.time, motion[0]) if program.foot is not None else 0.0
            moved = call(free_motion)(plant, *motion, *pressures, added, self.direction, parts=program.functions)
            rates = dict(zip(_MOTION, moved, strict=True))
        rates |= {name: getattr(gas, name) for name in (*_PRESSURES, *(() if warm is None else _TEMPERATURES))}
        outputs = {"torque": program.actuator.torque(plant, motion[0], *pressures)}
        outputs |= {name: values[name] for name in rates} | {"supplied_flow": gas.supplied, "vented_flow": gas.vented}
        return rates | valve_rates, outputs | {name: values[name] for name in valve_rates}

    def valve(self, values: Mapping[str, float]) -> tuple[Any, Openings, dict[str, float]]:
        """Return the valve state after its immediate changes, the openings [-], and rates of the states by name."""
        run = self.run
        call = self.functions.of
        valve = self.run.program.valve
        names = valve_states(self.run.program)
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


# Operating point: an instant of a run, or the steady state.


def values_after(scenario: Scenario, run: Run, steps: int) -> dict[str, float]:
    """Return the states and inputs after a number of steps of a scenario's run [SI], by name."""
    batch = batch_of(replace(run, step_count=steps))
    custom = scenario.controller.custom
    outcome = run_batch(batch) if custom is None else run_sampled(batch, custom)
    rows = {name: float(outcome.states[row, 0]) for name, row in state_row_numbers(run).items()}
    if rows["result.failure_time"] < NEVER_FAILED or not all(map(np.isfinite, rows.values())):
        raise SimulationError(
            f"{scenario.name}: the run diverges before {steps * run.step:g} s; give an earlier {argument_text('at')}, "
            "or see the cause with 'ppafo simulate'"
        )
    angle = rows["state.angle"]
    rate = rows["state.angular_velocity"]
    if run.program.angle is not None:
        angle, rate, _ = run.program.angle.value(run.path, steps * run.step)
    pressures = pressures_of(run.program.actuator, run.plant, angle, rows["state.mass_1"], rows["state.mass_2"])
    values = {"angle": angle, "angular_velocity": rate, "command": rows["result.command"]}
    values |= dict(zip(_PRESSURES, map(float, pressures), strict=True))
    values |= {name: float(getattr(run.plant, name)) for name in (*_SUPPLIES, "external_torque")}
    values |= {name: rows[path] for name, path in valve_states(run.program).items()}
    if isinstance(run.thermal, ThermalParameters):
        for side in (1, 2):
            warm = rows[f"state.mass_{side}"] / rows[f"masses.mass_{side}"]
            values[f"temperature_{side}"] = run.thermal.temperature * warm
    return values


def _direction(run: Run, values: Mapping[str, float], time: float) -> float | None:
    """Direction of a free vane at a time [s], 0 if it is stuck; None if the ankle is prescribed."""
    if run.program.angle is not None:
        return None
    if values["angular_velocity"] != 0.0:
        return 1.0 if values["angular_velocity"] > 0.0 else -1.0
    angle, *pressures = (values[name] for name in ("angle", *_PRESSURES))
    limit = in_program(friction_at_rest, run.program, run.effects)({}, run.plant.static_torque, *pressures)
    torque = torque_at_rest(run)({}, time, angle, *pressures)
    return mode_at_rest(run.plant._replace(static_torque=limit), angle, torque)


def equilibrium(scenario: Scenario, run: Run) -> dict[str, float]:
    """Return states and inputs in the steady state of a scenario [SI], by name; ScenarioError if there is none.

    The ankle rests at its angle at the end of the run, and all states of chambers and valve are constant. The actuator
    torque, or the pressure that is controlled, is the last value of the reference; for a constant command, the command
    is given instead.
    """

    def refusal(reason: str) -> ScenarioError:
        return ScenarioError(f"{scenario.name}: {reason}; give a time of the run, such as {argument_text('at', '1 s')}")

    if run.leg is not None and run.program.shank is not CONSTANT:
        raise refusal("there is no equilibrium while the shank moves")
    values = values_after(scenario, run, run.step_count) | {"angular_velocity": 0.0}
    quantity = CONTROLLED[scenario.controlled]
    level = None
    if not scenario.controller.is_open_loop:
        if quantity.name == ANGLE:
            raise refusal(f"reference.of = '{ANGLE}': an equilibrium needs a reference of torque or pressure")
        level = float(profile_values(scenario.reference, np.array([scenario.run.duration]))[0][0])
    plant = plant_of(_without_slew_limit(run), None if run.program.angle is not None else 0.0, values)
    steady = _steady(plant, values, quantity, level)
    openings = ["command", *(name for name in values if name in _OPENINGS)]
    if steady is None and level is None:
        raise refusal(f"no equilibrium was found for the command {values['command']:g}")
    if steady is None:
        assert level is not None
        full = 1.0 if (level > 0.0) != scenario.device.supply.is_vacuum else -1.0
        reached = ""
        most = _steady(plant, values | dict.fromkeys(openings, full), quantity, None)
        if most is not None and quantity.name == TORQUE:
            reached = f": with the valve fully open the actuator reaches {plant.at(most)[1]['torque']:.4g} N m"
        asked = of_path("reference.level", quantity.level.unit, ".4g").text(level)
        raise refusal(f"there is no equilibrium at {asked}, the last value of the reference{reached}")
    if _direction(run, steady, scenario.run.duration):
        degrees = np.degrees(values["angle"])
        raise refusal(f"there is no equilibrium, because the torque accelerates the vane at {degrees:.4g} deg")
    # A valve that is closed but for rounding is closed.
    steady |= {name: 0.0 for name in openings if abs(steady[name]) < _STEADY}
    # States that the valve takes from its command at once were no unknowns.
    return steady | dict(zip(valve_states(run.program), numbers(plant.valve(steady)[0]), strict=True))


def _steady(
    plant: LinearisedPlant, values: Mapping[str, float], quantity: ControlledQuantity, level: float | None
) -> dict[str, float] | None:
    """Return a steady state at a level of a quantity [SI], or at the present command; None if the search fails."""
    from scipy.optimize import least_squares

    # The unknowns are all states, and the command if a level is given.
    names = [*plant.at(values)[0], *([] if level is None else ["command"])]
    sizes = np.array([size_of(name) for name in names])
    least, most = (
        [end if name in ("command", *_OPENINGS) else other for name, other in zip(names, others, strict=True)]
        for end, others in ((-1.0, np.where(sizes > 1.0, 0.0, -np.inf)), (1.0, np.full(sizes.size, np.inf)))
    )

    def imbalance(unknowns: Floats, start: Mapping[str, float]) -> Floats:
        """Return time derivatives relative to the size of the states [1/s], and relative error of the level [-]."""
        tried = {**start, **dict(zip(names, unknowns.tolist(), strict=True))}
        rates, outputs = plant.at(tried)
        reached = quantity.value(tried["angle"], tried["pressure_1"], tried["pressure_2"], outputs["torque"])
        wrong = [] if level is None else [(reached - level) / quantity.size]
        return np.array([*(rate / size_of(name) for name, rate in rates.items()), *wrong])

    # Where the search begins: at the end of the run, then about the pressures that have the level.
    starts = [dict(values)]
    lowest = plant.run.plant.atmospheric_pressure
    target = 0.0 if level is None else level - quantity.value(values["angle"], lowest, lowest, 0.0)
    surplus = abs(target) / (plant.run.plant.torque_constant if quantity.name == TORQUE else 1.0)
    for size in (0.01, 0.1, 0.003, 0.03, 0.3, 1.0):
        command = values["command"] if level is None else size if target * quantity.sign >= 0.0 else -size
        pressures = [1.001 * lowest + (surplus if is_fed else 0.0) for is_fed in (command > 0.0, command < 0.0)]
        openings = {name: command for name in ("command", *_OPENINGS) if name in values}
        starts.append({**values, **dict(zip(_PRESSURES, pressures, strict=True)), **openings})
    for start in starts:
        # Least squares instead of a solver that refuses: in a dead band the slopes are singular. A search that fails,
        # as of a valve without area, says so by its sum.
        with np.errstate(all="ignore"):
            first = np.clip([start[name] for name in names], least, most)
            exact: dict[str, Any] = {"ftol": None, "gtol": None, "xtol": 1.0e-15}
            found = least_squares(imbalance, first, bounds=(least, most), x_scale=sizes, args=(start,), **exact)
        if np.max(np.abs(found.fun)) < _STEADY:
            return {**start, **dict(zip(names, found.x.tolist(), strict=True))}
    return None


# The model at a point: slopes by differences, towards one side where the model may have a kink.


def size_of(name: str) -> float:
    """Return the reference size of a state or an input [SI]."""
    return _SIZES.get(UNITS.get(name, ""), 1.0)


def side_of(name: str, value: float, direction: float | None) -> float:
    """Return the side of a value (1 or -1) for which a linear model holds.

    The command and the valve opening increase, or decrease from full opening. Angle, pressure 1 and its supply
    increase; the angular velocity changes in the direction of motion; all other values decrease.
    """
    if name in ("command", *_OPENINGS):
        return 1.0 if value < 1.0 else -1.0
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
    best = slopes[-1]
    errors = np.full(slopes.shape[1], np.inf)
    for order in range(1, _ORDERS + 1):
        better = slopes[1:] + np.diff(slopes, axis=0) / (_SHORTER**order - 1.0)
        error = np.maximum(np.abs(better - slopes[1:]), np.abs(better - slopes[:-1]))
        nearest = np.nanargmin(np.where(np.isfinite(error), error, np.inf), axis=0), np.arange(best.size)
        is_better = error[nearest] < errors
        best = np.where(is_better, better[nearest], best)
        errors = np.where(is_better, error[nearest], errors)
        slopes = better
    return best, errors


def model_at(scenario: Scenario, run: Run, values: Mapping[str, float], time: float | None) -> LinearModel:
    """Return the linear model of a run at given states and inputs [SI], with slopes on the sides given by ``side_of``.

    ``time`` [s] is that of the run, None for a steady state.
    """
    direction = _direction(run, values, scenario.run.duration if time is None else time)
    plant = plant_of(run, direction, values, time or 0.0)
    rates_here, outputs_here = plant.at(values)
    has_one_chamber = run.program.has_one_chamber
    inputs = ("command", *_SUPPLIES[: 1 if has_one_chamber else 2])
    inputs += _MOTION if direction is None else ("external_torque",) if direction else ()
    columns = [*rates_here, *inputs]
    sides = {name: side_of(name, values[name], direction) for name in columns}

    def rates_and_outputs(name: str, value: float) -> Floats:
        rates, outputs = plant.at({**values, name: value})
        return np.array([*rates.values(), *outputs.values()])

    def slopes(towards: float) -> Any:
        """Return the slopes of rates and outputs, and estimates of their errors, on the sides or opposite to them."""
        ends = (
            (partial(rates_and_outputs, name), values[name], towards * sides[name], size_of(name)) for name in columns
        )
        return np.stack([one_sided_slopes(*each) for each in ends], axis=-1)

    near, near_errors = slopes(1.0)
    far, far_errors = slopes(-1.0)
    # A second chamber that the actuator lacks stays at the atmosphere, without any slope. A value that the valve takes
    # from its command at once is no state: only the output that shows it needs it.
    needing = np.count_nonzero((near != 0.0) | (far != 0.0), axis=0)
    idle = OF_SECOND_CHAMBER if has_one_chamber else frozenset()
    idle |= {name for name, rows in zip(columns, needing, strict=True) if name.startswith(VALVE) and rows == 1}
    is_row = np.array([name not in idle for name in (*rates_here, *outputs_here)])
    is_column = np.array([name not in idle for name in columns])
    near, far, errors = (whole[is_row][:, is_column] for whole in (near, far, near_errors + far_errors))
    states, changed, outputs = (
        tuple(name for name in names if name not in idle) for names in (rates_here, columns, outputs_here)
    )
    sizes = np.array([size_of(name) for name in changed])
    count = len(states)
    largest = np.max(np.maximum(np.abs(near), np.abs(far)) * sizes, axis=1, keepdims=True)
    is_kink = np.any(np.abs(near - far) * sizes > _ON_THE_EDGE * largest + 10.0 * errors * sizes, axis=0)
    near = np.where(np.abs(near) * sizes > _ZERO * largest, near, 0.0)
    model = LinearModel(
        scenario=scenario,
        time=time,
        states=states,
        inputs=inputs,
        outputs=outputs,
        values={name: ({**values, **outputs_here})[name] for name in (*states, *inputs, *outputs)},
        A=near[:count, :count],
        B=near[:count, count:],
        C=near[count:, :count],
        D=near[count:, count:],
        rates=np.array([rates_here[name] for name in states]),
        # The command is the first input.
        sides=limits_of(scenario, plant, values, has_effect=bool(np.any(near[:, count]))),
        edges={
            name: "above" if sides[name] > 0.0 else "below" for name, kink in zip(changed, is_kink, strict=True) if kink
        },
        delays=OmittedDelays(run.command_delay, run.signal_delay, run.period),
    )
    sent_per_opening = 1.0
    if run.program.inverts_valve:
        opening, sent = (in_program(port, run.program, run.effects) for port in (at_valve, sent_command))
        wanted = opening({}, values["command"])
        sent_per_opening = float(one_sided_slopes(lambda at: np.array([sent({}, at)]), wanted, 1.0, 1.0)[0][0])
    return replace(model, margins=loop_margins(model, sent_per_opening))


def limits_of(
    scenario: Scenario, linearised: LinearisedPlant, at: Mapping[str, float], *, has_effect: bool
) -> dict[str, str]:
    """Return the side of each limit at given states and inputs, in words, by component.

    ``has_effect``: False if a small change of the command has no effect
    """
    joint = scenario.device.joint
    plant = linearised.run.plant
    direction = linearised.direction
    openings = linearised.valve(at)[1]
    room = plant.atmospheric_pressure
    pressure_1, pressure_2, supply_1, supply_2 = (at[name] for name in (*_PRESSURES, *_SUPPLIES))
    chamber = 1 if openings.source_1 > 0.0 else 2
    verb = "evacuates" if min(supply_1, supply_2) < room else "feeds"
    valve = f"{verb} chamber {chamber}, open by {max(openings):.4g}" if any(openings) else "closed"
    if not has_effect:
        valve += "; a small change of the command has no effect (dead band, slew limit, saturation): the column of the "
        valve += "command is 0"
    vane = "locked" if scenario.motion.locked_angle is not None else "prescribed"
    if direction == 0.0:
        is_at_stop = not plant.angle_min < at["angle"] < plant.angle_max
        vane = "against a stop" if is_at_stop else "sticks by static friction"
    elif direction is not None:
        vane = f"slides in {joint.positive if direction > 0.0 else joint.negative}"
    paths = [
        ("source to chamber 1", plant.valve_curve, supply_1, pressure_1, openings.source_1),
        ("chamber 1 to atmosphere", plant.valve_curve, pressure_1, room, openings.vent_1),
        ("source to chamber 2", plant.valve_curve, supply_2, pressure_2, openings.source_2),
        ("chamber 2 to atmosphere", plant.valve_curve, pressure_2, room, openings.vent_2),
        ("leak from chamber to chamber", plant.leak_curve, pressure_1, pressure_2, 1.0),
    ]
    sides = {"valve": valve, joint.name: vane}
    for name, curve, pressure_a, pressure_b, opening in paths[: 2 if linearised.run.program.has_one_chamber else 5]:
        ratio = min(pressure_a, pressure_b) / max(pressure_a, pressure_b)
        near = ", on the straight line near equal pressures" if ratio > curve.linear_ratio else ""
        flows = f"below choking, pressure ratio {ratio:.4f}{near}"
        flows = f"choked, pressure ratio {ratio:.3f}" if ratio <= curve.critical_ratio else flows
        sides[name] = flows if opening else "closed"
    return sides


# Control loop with the scenario's own PID.


def loop_margins(model: LinearModel, sent_per_opening: float = 1.0) -> LoopMargins | None:
    """Return the margins of the sampled loop that the scenario's PID closes around a linear model.

    The loop is one linear system from sample to sample: PID with rectangular integration and filtered difference,
    command held for a period, the delays that the model omits and the bandwidths of the sensors, but no noise or
    resolution. Its return difference is the product of z - closed pole over z - open pole: 1 + L = det(z - closed) /
    det(z - open). ``sent_per_opening`` is the slope of an inverted table of openings.

    None for a controller without PID, a command that is clipped or has no effect, or a controlled quantity at rest.
    """
    from scipy.linalg import expm

    scenario = model.scenario
    gains = model.scenario.controller.settings
    period = model.scenario.controller.period
    command = abs(model.values["command"])
    difference = {"pressure_1": 1.0, "pressure_2": -1.0}
    weights = difference if scenario.controlled == "pressure_difference" else {scenario.controlled: 1.0}
    if scenario.controller.kind not in PID_LAWS or command >= 1.0 or not weights.keys() <= set(model.outputs):
        return None
    # The readings of sensors with a bandwidth are states as well; last comes the command.
    count = len(model.states)
    sizes = np.array([size_of(name) for name in model.states])
    row = sizes * sum(weight * model.C[model.outputs.index(name)] for name, weight in weights.items())
    matrix = np.zeros((2 * count + 1, 2 * count + 1))
    shown = np.zeros(2 * count)
    matrix[:count, :count] = model.A * sizes / sizes[:, None]
    matrix[:count, -1] = model.B[:, 0] / sizes
    for index, name in enumerate(model.states):
        bandwidth = getattr(scenario.sensors, f"{name.partition('_')[0]}_bandwidth", 0.0)
        matrix[count + index, [index, count + index]] = np.array([1.0, -1.0]) * (2.0 * np.pi * bandwidth or 1.0)
        shown[index + (count if bandwidth else 0)] = row[index]
    # A command that comes within the period (but for rounding) acts on its last part; the one before on the first.
    delay, rest = divmod((model.delays.command + model.delays.signals) / period + 1.0e-9, 1.0)
    step = expm(matrix * period)[:-1]
    early = expm(matrix * period * (1.0 - rest))[:-1, -1]
    # Of the law, with the integral and the filtered difference as the last two states.
    filtered = period + gains["derivative_filter"]
    rate = gains["derivative_gain"] / filtered
    fades = gains["derivative_filter"] / filtered
    direct = gains["proportional_gain"] + gains["integral_gain"] * period + rate
    summed = gains["integral_gain"] * period
    # At any frequency, such as a quarter of the sample rate.
    if not direct * (shown @ np.linalg.solve(1.0j * np.eye(2 * count) - step[:, :-1], step[:, -1])):
        return None
    # The law skips the dead band that it assumes, within a narrow range of openings.
    band = gains.get("dead_band", 0.0)
    opened = 1.0 - band + (band / SHARPNESS if command < band + (1.0 - band) * SHARPNESS else 0.0)
    steered = error_functions(scenario.controlled, scenario.device.supply.is_vacuum).steered(opened * sent_per_opening)
    # States: plant and sensors, the commands of the samples before, and those of the law.
    past = 2 * count
    plant = np.s_[: 2 * count]
    whole = int(delay)
    law = past + int(delay) + 1

    def poles_of(factor: float) -> NDArray[np.complex128]:
        """Return the poles [-] of the loop with a factor on the command."""
        commands = np.eye(law + 2)[past - 1 : law]
        commands[0] = factor * np.concatenate([shown * direct, np.zeros(whole + 1), [summed, rate * (fades - 1.0)]])
        system = np.zeros((law + 2, law + 2))
        system[plant, plant] = step[:, :-1]
        system[plant] += np.outer(early, commands[whole]) + np.outer(step[:, -1] - early, commands[whole + 1])
        system[past:law] = commands[:-1]
        system[law:, plant] = shown
        system[law:, law:] = np.diag([1.0, fades])
        return np.asarray(np.linalg.eigvals(system), dtype=np.complex128)

    opens = poles_of(0.0)
    closed = poles_of(-steered)
    rates = np.array([1.0 / period, *np.abs(model.poles), *np.abs(closed - 1.0) / period])
    slowest = np.min(rates[rates > _INTEGRATOR]) / (2.0 * np.pi)
    frequencies = np.geomspace(1.0e-3 * slowest, 0.5 / period, 20_000)
    z = np.exp(2.0j * np.pi * frequencies * period)[:, None]
    returned = np.prod((z - closed) / (z - opens), axis=1)
    loop = returned - 1.0
    log_gain = np.log(np.abs(loop))
    follows = np.abs(loop / returned)

    # At half the sample rate, where the curve ends, the loop is real.
    lags = np.where(loop.real < 0.0, loop.imag, np.nan)
    lags[-1] = np.nan
    end = [(float(frequencies[-1]), float(log_gain[-1]))] if loop[-1].real < 0.0 else []
    phase_crossover, log_margin = _crossings(frequencies, lags, log_gain, *end)[0]
    gain_crossover, phase_margin = _crossings(frequencies, log_gain, np.angle(-loop))[0]
    return LoopMargins(
        is_stable=bool(np.max(np.abs(closed)) < 1.0 + _INTEGRATOR * period),
        gain_margin=None if log_margin is None else float(np.exp(-log_margin)),
        phase_crossover=phase_crossover,
        phase_margin=phase_margin,
        gain_crossover=gain_crossover,
        bandwidth=_crossings(frequencies, follows - np.sqrt(0.5) * follows[0], frequencies)[0][0],
        peak_sensitivity=float(np.max(1.0 / np.abs(returned))),
        frequencies=frequencies,
        loop=loop,
    )


def _crossings(
    frequencies: Floats, values: Floats, others: Floats, *ends: tuple[float, float]
) -> list[tuple[Any, Any]]:
    """Frequencies [Hz] at which ``values`` change sign, with the value of ``others`` there, the ones nearest 0 first.

    ``ends`` are further pairs of a frequency and a value; (None, None) where there is no crossing.
    """
    before = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    share = values[before] / (values[before] - values[before + 1])
    at, there = (each[before] + share * np.diff(each)[before] for each in (frequencies, others))
    pairs = [*zip(at.tolist(), there.tolist(), strict=True), *ends]
    return sorted(pairs, key=lambda pair: abs(pair[1])) or [(None, None)]


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
    for name, highest in zip(_PRESSURES, (supply.pressure, supply.dorsiflexion_pressure), strict=True):
        share = (model.values.get(name, zero) - zero) / (float(highest) - zero) if highest > zero else 0.0
        if share > 0.99:
            sentences.append(
                f"{name} is {100.0 * share:.4g} % of its supply pressure, at the limit of the actuator: hardly any "
                "flow into the chamber is left, and gains and margins hold for very small changes only"
            )
    point = []
    poles = []
    outputs = tuple(name for name in model.outputs if name not in model.states)
    for role, names in (("state", model.states), ("input", model.inputs), ("output", outputs)):
        for name in names:
            unit = UNITS.get(name, "1")
            kind = Kind("", "" if unit == "1" else unit, quantity_of_unit(unit), ".5g")
            point.append((role, name, unit, kind.text(model.values[name])))
    # A complex pair is one row.
    for pole in model.poles.tolist():
        size = abs(pole)
        row = []
        if abs(pole.imag) <= 1.0e-6 * size:
            row = [f"{pole.real:.5g}", None if pole.real == 0.0 else -1.0 / pole.real, None, None]
        elif pole.imag > 0.0:
            row = [f"{pole.real:.5g} ± {pole.imag:.5g}i", None, size / (2.0 * np.pi), -pole.real / size]
        poles += [row] if row else []
    constant, frequency = (Kind(quantity=quantity) for quantity in ("time", "frequency"))
    ratio = ("damping ratio", Kind(form=".3f"))
    matrices = []
    for name in "ABCD":
        rows = model.states if name in "AB" else model.outputs
        columns = model.states if name in "AC" else model.inputs
        cells = [(row, *values) for row, values in zip(rows, getattr(model, name).tolist(), strict=True)]
        titles: list[str | tuple[str, Kind]] = ["", *((column, Kind(form=".5g")) for column in columns)]
        matrices.append(Section(f"Matrix {name} (SI)", columns_of(titles, cells)))
    # Runs can start there: gas alone is in motion, and the largest step stays below full opening.
    has_gas_alone = all(name.startswith("pressure") for name in model.states)
    is_small = 0.0 < abs(model.values["command"]) < 0.7
    can_step = model.time is None and model.scenario.motion.locked_angle is not None and has_gas_alone and is_small
    validity = Section(
        "Range of validity",
        panels=partial(steps_panels, model),
        name="steps",
        caption="Steps of the command from the steady state, simulated and by the linear model; their difference grows "
        "with the square of the amplitude.",
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
            Section(
                "Side of the kink",
                facts(model.sides.items()),
                remarks=[
                    f"the plant is not differentiable at this point: the column of `{name}` is valid only {side} its "
                    "value"
                    for name, side in model.edges.items()
                ],
            ),
            Section(
                "Poles",
                columns_of(("pole (1/s)", ("time constant", constant), ("frequency", frequency), ratio), poles),
                panels=partial(frequency_panels, model),
                # The command, which is the first input, may have no effect.
                name="frequency-response" if np.any(model.B[:, 0]) or np.any(model.D[:, 0]) else "",
                caption="Open loop, if it has margins: each margin extends from its dot to the dashed line. Torque for "
                "a small sinusoidal command; dashed: with the dead time, the age of the measurements and half a sample "
                "period, which the model does not include.",
                size=(5.4, 2.2),
                title=title,
            ),
            _loop(model),
            *matrices,
            *([validity] if can_step else []),
        ],
        found=model,
        overrides=changes_in(model.scenario),
    )


def _loop(model: LinearModel) -> Section:
    """Return the table of the margins of the loop with the scenario's PID, or the reason why there is none."""
    margins = model.margins
    controller = model.scenario.controller
    if margins is None:
        is_pid = controller.kind in PID_LAWS
        reason = (
            "the command is clipped, or has no effect" if is_pid else f"controller '{controller.kind}' is not a PID"
        )
        return Section(remarks=[f"no stability margins: {reason}"])
    frequency = Kind(quantity="frequency", form=".3g")
    angle = Kind(quantity="angle", form=".3g")
    gain = margins.gain_margin or 1.0
    rows = [("closed loop", "stable" if margins.is_stable else "unstable")]
    for name, text, at in (
        ("gain margin", f"{gain:.3g} ({20.0 * np.log10(gain):.3g} dB) at ", margins.phase_crossover),
        ("phase margin", f"{angle.text(margins.phase_margin or 0.0)} at ", margins.gain_crossover),
        ("bandwidth (-3 dB)", "", margins.bandwidth),
    ):
        found = "none below half the sample rate" if at is None else f"{text}{frequency.text(at)}"
        # A sampled loop is real at half the sample rate: its phase may meet -180 deg there alone.
        if at == margins.frequencies[-1]:
            found += ", half the sample rate: the phase reaches -180 deg only there"
        rows.append((name, found))
    rows.append(("peak sensitivity", f"{margins.peak_sensitivity:.3g}"))
    return Section("Loop with the PID of the scenario for small changes, sampled and with its delays", facts(rows))


def frequency_panels(model: LinearModel) -> list[Panel]:
    """Return panels of the open loop with its margins, if any, and of the frequency response of torque to command."""
    poles = np.abs(model.poles) / (2.0 * np.pi)
    margins = model.margins
    delays = model.delays
    found = () if margins is None else (margins.gain_crossover, margins.phase_crossover, margins.bandwidth)
    # All frequencies that the report names, and half the sample rate, where a loop ends.
    lowest = 0.1 * min((1.0, *poles[poles > 0.0].tolist(), *filter(None, found)))
    highest = max(100.0, 0.0 if margins is None else 0.5 / delays.period)
    frequencies = np.geomspace(lowest, highest, 400)
    response = model.response(frequencies)
    delay = delays.command + delays.signals + 0.5 * delays.period

    def panel(kind: Kind, marks: list[Mark], **scales: Any) -> Panel:
        limits = {"xscale": "log", "xlim": (lowest, 1.1 * highest), **scales}
        frequency = Kind("Frequency", "Hz")
        then = methodcaller("set", **limits)
        return Panel(frequency, kind, marks, then=then, shares_x=True)

    panels = []
    if margins is not None:
        at = margins.frequencies[::-20][::-1]
        at, loop = at[at >= lowest], margins.loop[::-20][::-1][at >= lowest]
        phases = np.degrees(np.unwrap(np.angle(loop)))
        # Where a margin is read: from the dot to the dashed line, the nearest of the whole turns.
        turned = np.interp(margins.phase_crossover or at[-1], at, phases)
        critical = -180.0 + 360.0 * round((turned + 180.0) / 360.0)
        for kind, curve, level, scale in (
            (Kind("Open-loop gain"), np.abs(loop), 1.0, "log"),
            (Kind("Open-loop phase", "deg"), phases, critical, "linear"),
        ):
            marks = [Mark("line", at, curve), Mark("level", (), level, colour=GREY, style=_DASHED)]
            for crossover, name, colour, marker in (
                (margins.gain_crossover, "phase margin", VERMILION, "o"),
                (margins.phase_crossover, "gain margin", BLACK, "s"),
            ):
                if crossover is not None:
                    place = np.array([crossover])
                    label = f"{name} at {crossover:.3g} Hz"
                    marks.append(dots(place, np.interp(place, at, curve), marker, label, colour, markersize=5))
            panels.append(panel(kind, marks, yscale=scale))
    phase = np.degrees(np.unwrap(np.angle(response)))
    delayed = f"with {1.0e3 * delay:.3g} ms of delays"
    late = Mark("line", frequencies, phase - 360.0 * frequencies * delay, (), delayed, VERMILION, _DASHED)
    shown = (max(-360.0, phase.min() - 90.0), phase.max() + 20.0)
    degrees = np.arange(-360.0, 181.0, 45.0)
    return [
        *panels,
        panel(Kind("Torque per command", "N m"), [Mark("line", frequencies, np.abs(response))], yscale="log"),
        panel(
            Kind("Phase", "deg"), [Mark("line", frequencies, phase, label="plant"), late], yticks=degrees, ylim=shown
        ),
    ]


# Range of validity: steps of the command from the steady state, on the runs and of the model.


def steps_of(model: LinearModel, shares: tuple[float, ...] = _SHARES) -> tuple[Floats, Floats, Floats]:
    """Return step heights of the command [-] (steps,), and torque changes of runs and model [N m] (steps, times).

    The steps are fractions of the steady command; the ankle must be locked, and gas pressures the only states.
    """
    from scipy.signal import StateSpace, step

    command = model.values["command"]
    run = model.scenario.run
    held = replace(
        model.scenario,
        run=replace(run, duration=1.0, step=_INTERVAL, output_interval=_INTERVAL),
        initial=replace(model.scenario.initial, **{name: model.values[name] for name in model.states}),
    )
    laws = (
        Control(switching.CONSTANT.name, {"command": command * (1.0 + share)}, _INTERVAL) for share in (0.0, *shares)
    )
    results = simulate_many([with_control(held, law) for law in laws])
    still, *runs = (result.recording["torque"] for result in results)
    amplitudes: Floats = command * np.array(shares, dtype=np.float64)
    # The command is the first input, the torque the first output.
    plant = StateSpace(model.A, model.B[:, :1], model.C[:1], model.D[:1, :1])
    return amplitudes, np.array(runs) - still, amplitudes[:, None] * step(plant, T=_INTERVAL * np.arange(still.size))[1]


def steps_panels(model: LinearModel) -> list[Panel]:
    """Return panels of step responses, nonlinear and linear, and of their difference divided by the amplitude."""
    amplitudes, runs, linear = steps_of(model)
    times = _INTERVAL * np.arange(runs.shape[1])
    # The middle of the three decades, and the largest step.
    over_time = [
        Mark("line", times, runs[row] / amplitudes[row], (), f"command {100.0 * _SHARES[row]:+.3g} %", colour)
        for row, colour in ((-5, BLUE), (-1, VERMILION))
    ]
    over_time.append(Mark("line", times, linear[-1] / amplitudes[-1], (), "linear", BLACK, _DASHED))
    errors, sizes = (np.max(np.abs(changes), axis=1) for changes in (runs - linear, runs))
    square = Mark("line", sizes, errors[0] * (sizes / sizes[0]) ** 2, (), "square of the amplitude", GREY, _DASHED)
    return [
        Panel(replace(TIME, words="Time after the step"), Kind("Change of torque per command", "N m"), over_time),
        Panel(
            Kind("Largest change of torque in a step", "N m"),
            Kind("Runs less linear model", "N m"),
            [dots(sizes, errors, "o", "largest difference", markersize=4), square],
            then=methodcaller("set", xscale="log", yscale="log"),
        ),
    ]
