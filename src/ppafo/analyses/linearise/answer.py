"""A linear model and what is said of it: the point, the poles, the matrices, the sides taken, how far it holds."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.engine.lanes import Floats, StepInputs, replay
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.errors import ScenarioError, nearest_name, one_line
from ppafo.report.display_units import quantity_of_unit
from ppafo.report.finding import Column, Finding, Part, columns_of, facts
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, BLUE, GREY, VERMILION
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Initial, PrescribedMotion, Scenario
from ppafo.units.shown import in_units
from ppafo.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MISSING_CONTROL = "a system for python-control needs the package control: pip install ppafo[control]"
ON_THE_EDGE = 1.0e-6
"""Two sides of a comparison that differ by less than this, over the larger one, lie on an edge of the model."""


@dataclass(frozen=True, slots=True)
class Variable:
    """A state, input or output: its name, unit in SI, and value at the point."""

    name: str
    unit: str
    value: float


@dataclass(frozen=True, slots=True)
class Edge:
    """A comparison whose two numbers are equal at the point: where it stands, and whether it counts as true.

    On the other side of it the plant may have another linear model.
    """

    place: str
    is_true: bool


@dataclass(frozen=True, slots=True)
class Delays:
    """What the linear model leaves out [s]: dead time of the valve, age of measurements, sample period."""

    command: float
    signals: float
    period: float


@dataclass(frozen=True, slots=True, eq=False)
class LinearModel:
    """The plant of a scenario near one point, x' = A x + B u, y = C x + D u, for differences from the point in SI.

    ``a`` (states, states), ``b`` (states, inputs), ``c`` (outputs, states), ``d`` (outputs, inputs); ``rates``
    (states,) are x' at the point itself, 0 in a steady state. ``time`` [s] is None for a steady state. ``sides`` say in
    words which side of each limit of the plant was taken, ``edges`` where the point lies on one.
    """

    scenario: Scenario
    time: float | None
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    a: Floats
    b: Floats
    c: Floats
    d: Floats
    rates: Floats
    sides: Mapping[str, str]
    edges: tuple[Edge, ...]
    delays: Delays

    @property
    def is_steady(self) -> bool:
        """True for a model about a steady state."""
        return self.time is None

    @property
    def poles(self) -> "np.ndarray[Any, np.dtype[np.complex128]]":
        """Poles [1/s], the slowest first."""
        eigenvalues = np.linalg.eigvals(self.a).astype(np.complex128)
        return eigenvalues[np.argsort(np.abs(eigenvalues))]

    def response(self, frequencies: Floats, output: str = "torque", source: str = "command") -> Any:
        """Frequency response (frequencies,) of an output to an input, complex, in SI; frequencies [Hz].

        ScenarioError for a name that is no output or input, and for a frequency at which the model has a pole.
        """
        row, column = _place(output, self.outputs, "output"), _place(source, self.inputs, "input")
        eye, responses = np.eye(len(self.states)), []
        for frequency in np.asarray(frequencies, dtype=np.float64).ravel().tolist():
            matrix = scaled = 2.0j * np.pi * frequency * eye - self.a
            # States and their rates differ by powers of ten in SI: rank is taken with rows and columns of one size.
            for axis in (1, 0):
                largest = np.max(np.abs(scaled), axis=axis, keepdims=True, initial=0.0)
                scaled = scaled / np.where(largest > 0.0, largest, 1.0)
            if np.linalg.cond(scaled) > _SINGULAR:
                raise ScenarioError(
                    f"{self.scenario.name}: the linear model has a pole at {frequency:g} Hz, where its response has no "
                    "end; give another frequency"
                )
            responses.append(self.c[row] @ np.linalg.solve(matrix, self.b[:, column]) + self.d[row, column])
        return np.array(responses)

    def json_document(self) -> dict[str, Any]:
        """Return point, matrices, poles and sides as plain data in SI."""
        rates = self.rates.tolist()
        return {
            "format": "ppafo linear model",
            "schema_version": 1,
            "ppafo": __version__,
            "scenario": self.scenario.name,
            "overrides": list(self.scenario.origin.overrides),
            "at": "equilibrium" if self.time is None else self.time,
            "states": [{**asdict(variable), "rate": rate} for variable, rate in zip(self.states, rates, strict=True)],
            "inputs": [asdict(variable) for variable in self.inputs],
            "outputs": [asdict(variable) for variable in self.outputs],
            "A": self.a.tolist(),
            "B": self.b.tolist(),
            "C": self.c.tolist(),
            "D": self.d.tolist(),
            "poles": [{"real": pole.real, "imaginary": pole.imag} for pole in self.poles.tolist()],
            "sides": dict(self.sides),
            "edges": [asdict(edge) for edge in self.edges],
            "left_out": {
                "command_delay": self.delays.command,
                "signal_delay": self.delays.signals,
                "sample_period": self.delays.period,
            },
        }

    def to_control(self) -> Any:
        """Return the model as a ``control.StateSpace`` with its names; ScenarioError without the extra ``control``."""
        if find_spec("control") is None:
            raise ScenarioError(MISSING_CONTROL)
        import control

        names = {kind: [variable.name for variable in getattr(self, kind)] for kind in ("states", "inputs", "outputs")}
        return control.ss(self.a, self.b, self.c, self.d, name=self.scenario.name.replace("-", "_"), **names)


_SINGULAR = 1.0e13
"""Condition number from which what a matrix says is rounding."""


def _place(name: str, items: Sequence[Variable], kind: str) -> int:
    """Number of a variable; ScenarioError for a name that is none."""
    names = [variable.name for variable in items]
    if name not in names:
        hint = nearest_name(name, names)
        raise ScenarioError(f"the linear model has no {kind} '{one_line(name)}'{hint}; there are: {', '.join(names)}")
    return names.index(name)


DURATION = 1.0
INTERVAL = 1.0e-3
SHARES = tuple(np.geomspace(3.0e-4, 0.3, 13).tolist())
"""Steps of the command over the command of the steady state [-]: three decades."""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Torque [N m] after steps of the command, less the steady one: (steps, times) on the runs and linear.

    ``amplitudes`` (steps,) of the command [-], ``times`` [s] after the step.
    """

    amplitudes: Floats
    times: Floats
    runs: Floats
    linear: Floats

    @property
    def errors(self) -> Floats:
        """Largest difference of the torque of each step [N m]."""
        return np.asarray(np.max(np.abs(self.runs - self.linear), axis=1))

    @property
    def sizes(self) -> Floats:
        """Largest change of the torque in each step [N m]."""
        return np.asarray(np.max(np.abs(self.runs), axis=1))


def steps_of(model: LinearModel, shares: tuple[float, ...] = SHARES) -> Steps:
    """Steps of the command by some shares of the command of the steady state."""
    command = _value(model, "command")
    times: Floats = INTERVAL * np.arange(round(DURATION / INTERVAL) + 1, dtype=np.float64)
    still, *runs = (_torque(model, command * (1.0 + share)) for share in (0.0, *shares))
    amplitudes: Floats = command * np.array(shares, dtype=np.float64)
    from scipy.signal import StateSpace, step

    column = [variable.name for variable in model.inputs].index("command")
    row = [variable.name for variable in model.outputs].index("torque")
    system = StateSpace(model.a, model.b[:, [column]], model.c[[row]], model.d[[row]][:, [column]])
    linear = amplitudes[:, None] * step(system, T=times)[1]
    return Steps(amplitudes, times, np.array(runs) - still, linear)


def _value(model: LinearModel, name: str) -> float:
    return next(variable.value for variable in (*model.states, *model.inputs) if variable.name == name)


def _torque(model: LinearModel, command: float) -> Floats:
    """Torque [N m] on the runs, from the steady state on, with another command."""
    scenario = replace(
        model.scenario,
        controller=Control(PYTHON_CONTROLLER, {}, INTERVAL),
        run=replace(model.scenario.run, duration=DURATION, step=INTERVAL, output_interval=INTERVAL),
        initial=Initial(_value(model, "pressure_1"), _value(model, "pressure_2")),
    )
    run = plan_run(scenario)
    record = replay(batch_of(run), StepInputs(np.full(run.step_count, command), {})).record[:, :, 0]
    rows = state_row_numbers(run)
    angle, *masses = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    actuator, every = run.program.actuator, max(1, run.steps_per_sample)
    pressures = pressures_of(actuator, run.plant, angle, *masses)
    return np.asarray(torque_of(actuator, run.plant, angle, *pressures))[::every]


_POINTS = 400
_DECADES = (0.1, 10.0)
_FASTEST = 100.0
"""Largest frequency [Hz] that is shown, unless the poles lie higher."""
_SHOWN = (-5, -1)
"""Which of the steps are drawn over time: one in the middle of the three decades, and the largest."""


def frequency_panels(model: LinearModel) -> list[Panel]:
    """Return the response of the torque to the command: size and phase, and the phase with what is left out."""
    poles = np.abs(model.poles) / (2.0 * np.pi)
    lowest = min(float(np.min(poles[poles > 0.0], initial=1.0)), 1.0)
    frequencies = np.geomspace(_DECADES[0] * lowest, _FASTEST, _POINTS)
    response = model.response(frequencies)
    late = model.delays.command + model.delays.signals + 0.5 * model.delays.period
    phase = np.degrees(np.unwrap(np.angle(response)))
    delayed = f"with {1.0e3 * late:.3g} ms of dead time, late measurements and half a sample"

    def set_phase(axes: "Axes") -> None:
        from matplotlib.ticker import MultipleLocator

        axes.set(xscale="log", ylim=(max(-360.0, float(np.min(phase)) - 90.0), float(np.max(phase)) + 20.0))
        axes.yaxis.set_major_locator(MultipleLocator(45.0))

    return [
        Panel(
            _FREQUENCY,
            Kind("Torque per command", "N m"),
            [Mark("line", frequencies, np.abs(response))],
            then=lambda axes: axes.set(xscale="log", yscale="log"),
            shares_x=True,
        ),
        Panel(
            _FREQUENCY,
            Kind("Phase", "deg"),
            [
                Mark("line", frequencies, phase, label="plant"),
                Mark("line", frequencies, phase - 360.0 * frequencies * late, (), delayed, VERMILION, _DASHED),
            ],
            legend="inside",
            then=set_phase,
            shares_x=True,
        ),
    ]


def steps_panels(model: LinearModel) -> list[Panel]:
    """Return steps of the command on the runs and of the linear model, and their difference over the amplitude."""
    steps = steps_of(model)
    shares = 0.3 * steps.amplitudes / steps.amplitudes[-1]
    over_time = []
    for at, colour in zip(_SHOWN, (BLUE, VERMILION), strict=True):
        change = steps.runs[at] / steps.amplitudes[at]
        label = f"command {100.0 * shares[at]:+.3g} %"
        over_time.append(Mark("line", steps.times, change, label=label, colour=colour))
    linear = Mark("line", steps.times, steps.linear[-1] / steps.amplitudes[-1], (), "linear", BLACK, _DASHED)
    square = steps.errors[0] * (steps.sizes / steps.sizes[0]) ** 2
    dots = {"linestyle": "", "marker": "o", "markersize": 4}
    return [
        Panel(
            replace(TIME, words="Time after the step"),
            Kind("Change of torque per command", "N m"),
            [*over_time, linear],
            legend="inside",
        ),
        Panel(
            Kind("Largest change of torque in a step", "N m"),
            Kind("Runs less linear model", "N m"),
            [
                Mark("line", steps.sizes, steps.errors, label="largest difference", style=dots),
                Mark("line", steps.sizes, square, (), "square of the amplitude", GREY, _DASHED),
            ],
            legend="inside",
            then=lambda axes: axes.set(xscale="log", yscale="log"),
        ),
    ]


_FREQUENCY = Kind("Frequency", "Hz")
_DASHED = {"linestyle": "--"}
_FREQUENCY_CAPTION = (
    "The torque for a small sine of the command; dashed: with the dead time, the age of the measurements and half a "
    "sample period, which are not in the model."
)
_STEPS_CAPTION = (
    "Steps of the command from the steady state, on the runs and of the linear model, in which the difference grows "
    "with the square of the amplitude."
)
_SEVERAL = 1.0e-6
"""Imaginary part of a pole, over its size, below which it is real."""


@in_units(lambda model: model.scenario.device.shown)
def finding_of(model: LinearModel) -> Finding[LinearModel]:
    """Return a linear model in words, tables and panels."""
    responds = bool(np.any(model.b[:, 0]) or np.any(model.d[:, 0]))
    states = {variable.name for variable in model.states}
    kinds = (("state", model.states), ("input", model.inputs), ("output", model.outputs))
    # An output that is a state is in the table once.
    shown = [
        (kind, variable)
        for kind, items in kinds
        for variable in items
        if kind != "output" or variable.name not in states
    ]
    point = []
    for kind, variable in shown:
        of_item = Kind("", "" if variable.unit == "1" else variable.unit, quantity_of_unit(variable.unit), ".5g")
        point.append((kind, variable.name, variable.unit, of_item.text(variable.value)))
    edges = []
    for edge in model.edges:
        function, _, comparison = edge.place.partition(": ")
        taken = "true" if edge.is_true else "false"
        edges.append(
            f"the point lies on an edge, with another linear model beyond: `{comparison}` in {function} was taken to "
            f"be {taken}"
        )
    parts = [
        Part("The point", columns_of(("", "name", "unit in the model", "at the point"), point), left=3),
        Part("Which side was taken", facts(model.sides.items()), remarks=edges),
        Part(
            "Poles",
            _poles(model),
            panels=partial(frequency_panels, model),
            name="frequency-response" if responds else "",
            caption=_FREQUENCY_CAPTION,
            size=(7.0, 2.4),
        ),
    ]
    matrices = (
        ("A", model.a, model.states, model.states),
        ("B", model.b, model.states, model.inputs),
        ("C", model.c, model.outputs, model.states),
        ("D", model.d, model.outputs, model.inputs),
    )
    for name, values, rows, columns in matrices:
        cells = zip(columns, values.T.tolist(), strict=True)
        own = [Column(variable.name, column, Kind(form=".5g")) for variable, column in cells]
        table = [Column("", [variable.name for variable in rows]), *own]
        parts.append(Part(f"Matrix {name} (SI)", table, is_detail=name in "CD"))
    # For a steady state of a locked ankle whose valve follows at once and is open: the runs can begin there.
    motion = model.scenario.motion
    is_locked = isinstance(motion, PrescribedMotion) and motion.profile.kind == "constant"
    is_gas_alone = all(variable.name.startswith("pressure") for variable in model.states)
    if model.is_steady and is_locked and is_gas_alone and 0.0 < abs(_value(model, "command")) < 0.7:
        steps = Part("How far it holds", panels=partial(steps_panels, model), name="steps", caption=_STEPS_CAPTION)
        parts.append(replace(steps, across=2, size=(4.4, 3.4)))
    size = f"{len(model.states)} states, {len(model.inputs)} inputs, {len(model.outputs)} outputs"
    said = [f"the plant without controller and sensors: {size}; differences from the point, SI units"]
    if model.time is not None:
        said.append(
            "the point is no steady state: the model is of small differences from the run itself, and holds only as "
            "long as the run stays near the point"
        )
    late = (
        ("dead time of the valve", model.delays.command),
        ("age of the measurements", model.delays.signals),
        ("sample period", model.delays.period),
    )
    left_out = ", ".join(f"{name} {1.0e3 * value:g} ms" for name, value in late if value > 0.0)
    when = "in its steady state" if model.time is None else f"at {model.time:g} s"
    return Finding(
        name="linearise",
        kicker="Linear model",
        title=f"Linear model of {model.scenario.name}, {when}",
        said=(*said, f"not in the model: {left_out}, noise, resolution and bandwidth of sensors"),
        parts=parts,
        found=model,
        files={"linearise.npz": partial(_arrays, model)},
    )


def _poles(model: LinearModel) -> list[Column]:
    """Poles with their time constants; a pair of complex ones is one row with its frequency and damping."""
    rows: list[tuple[str | float | None, ...]] = []
    for pole in model.poles.tolist():
        size = abs(pole)
        if abs(pole.imag) <= _SEVERAL * size:
            rows.append((f"{pole.real:.5g}", None if pole.real == 0.0 else -1.0 / pole.real, None, None))
        elif pole.imag > 0.0:
            pair = f"{pole.real:.5g} ± {pole.imag:.5g}i"
            rows.append((pair, None, size / (2.0 * np.pi), -pole.real / size))
    constant, frequency = (Kind(quantity=quantity) for quantity in ("time", "frequency"))
    ratio = ("damping ratio", Kind(form=".3f"))
    return columns_of(("pole (1/s)", ("time constant", constant), ("frequency", frequency), ratio), rows)


def _arrays(model: LinearModel) -> bytes:
    """The matrices, names, units and values at the point as a NumPy archive."""
    arrays: dict[str, Any] = {"A": model.a, "B": model.b, "C": model.c, "D": model.d, "rates": model.rates}
    for kind in ("states", "inputs", "outputs"):
        items = getattr(model, kind)
        arrays[kind] = np.array([variable.name for variable in items])
        arrays[f"{kind}_units"] = np.array([variable.unit for variable in items])
        arrays[f"{kind}_values"] = np.array([variable.value for variable in items])
    written = io.BytesIO()
    np.savez(written, allow_pickle=False, **arrays)
    return written.getvalue()
