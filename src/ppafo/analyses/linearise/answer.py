"""Report of a linear model: operating point, side of each limit, poles, matrices and range of validity."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from operator import methodcaller
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.linearise.loop import PID_LAWS, open_loop
from ppafo.analyses.linearise.model import LinearModel
from ppafo.engine.lanes import Floats
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, BLUE, GREY, VERMILION
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, with_control
from ppafo.units.shown import in_units, quantity_of_unit
from ppafo.wording import count_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Range of validity of a linear model: steps of the command from the steady state, on the runs and of the model.

DURATION, INTERVAL = 1.0, 1.0e-3
"""Duration of a run after a step of the command, and sample time of its output [s]."""
SHARES = tuple(np.geomspace(3.0e-4, 0.3, 13).tolist())
"""Step heights of the command divided by the steady command [-]: three decades."""
_FULL = 0.99
"""Ratio of gauge pressures, chamber to supply, above which the chamber counts as full [-]."""
_LARGEST_COMMAND = 0.7
"""Steady command [-] above which the largest step comes too close to full opening, which is 1."""


@dataclass(frozen=True, slots=True, eq=False)
class _StepResponses:
    """Torque responses to steps of the command, of the nonlinear runs and of the linear model.

    ``amplitudes`` (steps,): step heights of the command [-]
    ``times``: time after the step [s]
    ``runs``, ``linear`` (steps, times): torque change from the steady state [N m]
    ``errors`` (steps,): largest torque difference between runs and linear model [N m]
    ``sizes`` (steps,): largest torque change of the runs [N m]
    """

    amplitudes: Floats
    times: Floats
    runs: Floats
    linear: Floats
    errors: Floats
    sizes: Floats


def can_step(model: LinearModel) -> bool:
    """True if runs can start at the operating point: steady gas states, locked ankle, valve state equal to the command.

    The command must also stay below full opening for the largest step, 0.3 times the steady command.
    """
    is_locked = model.scenario.motion.locked_angle is not None
    has_gas_alone = all(variable.name.startswith("pressure") for variable in model.states)
    if not (model.is_steady and is_locked and has_gas_alone):
        return False
    return 0.0 < abs(_value_at_point(model, "command")) < _LARGEST_COMMAND


def steps_of(model: LinearModel, shares: tuple[float, ...] = SHARES) -> _StepResponses:
    """Return the torque responses to steps of the command by fractions of its steady value [-].

    The model must satisfy ``can_step``.
    """
    command = _value_at_point(model, "command")
    times: Floats = INTERVAL * np.arange(round(DURATION / INTERVAL) + 1, dtype=np.float64)
    still, *runs = (_torque(model, command * (1.0 + share)) for share in (0.0, *shares))
    amplitudes: Floats = command * np.array(shares, dtype=np.float64)
    from scipy.signal import StateSpace, step

    column = [variable.name for variable in model.inputs].index("command")
    row = [variable.name for variable in model.outputs].index("torque")
    system = StateSpace(model.a, model.b[:, [column]], model.c[[row]], model.d[[row]][:, [column]])
    linear = amplitudes[:, None] * step(system, T=times)[1]
    changes = np.array(runs) - still
    errors, sizes = (np.max(np.abs(difference), axis=1) for difference in (changes - linear, changes))
    return _StepResponses(amplitudes, times, changes, linear, errors, sizes)


def _value_at_point(model: LinearModel, name: str) -> float:
    return next(variable.value for variable in (*model.states, *model.inputs) if variable.name == name)


def _torque(model: LinearModel, command: float) -> Floats:
    """Torque [N m] (times,) of a run from the steady state under another constant command [-]."""
    start = {state.name: state.value for state in model.states if state.name.startswith("pressure")}
    scenario = replace(
        with_control(model.scenario, Control(PYTHON_CONTROLLER, {}, INTERVAL)),
        run=replace(model.scenario.run, duration=DURATION, step=INTERVAL, output_interval=INTERVAL),
        initial=replace(model.scenario.initial, **start),
    )
    run = plan_run(scenario)
    record = replay(batch_of(run), StepInputs(np.full(run.step_count, command), {})).record[:, :, 0]
    rows = state_row_numbers(run)
    angle, *masses = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    actuator = run.program.actuator
    pressures = pressures_of(actuator, run.plant, angle, *masses)
    # The record has every step of the engine, of which a sample may take several.
    return np.asarray(torque_of(actuator, run.plant, angle, *pressures))[:: max(1, run.steps_per_sample)]


_POINTS = 400
_LOWEST_SHARE = 0.1
"""Lowest frequency of the frequency response plot, divided by the lowest reported frequency [-]."""
_HIGHEST_FREQUENCY = 100.0
"""Highest frequency of the frequency response plot [Hz]."""
_LOOP_POINTS = slice(None, None, -20)
"""Points of the open loop that are plotted: every twentieth, counted back from the last."""
_DRAWN_STEPS = (-5, -1)
"""Indices of the steps plotted over time: the middle of the three decades, and the largest step."""
_REAL = 1.0e-6
"""Imaginary part of a pole divided by its magnitude, up to which the pole counts as real."""
_FREQUENCY = Kind("Frequency", "Hz")
_DASHED = {"linestyle": "--"}
_FREQUENCY_CAPTION = (
    "Open loop, if it has margins: each margin extends from its dot to the dashed line. Torque for a small sinusoidal "
    "command; dashed: with the dead time, the age of the measurements and half a sample period, which the model does "
    "not include."
)
_STEPS_CAPTION = (
    "Steps of the command from the steady state, simulated and by the linear model; their difference grows with the "
    "square of the amplitude."
)


@in_units(lambda model: model.scenario.device.shown)
def finding_of(model: LinearModel) -> Finding[LinearModel]:
    """Return a linear model as a finding with sentences, tables and panels."""
    when = "in its steady state" if model.time is None else f"at {model.time:g} s"
    title = f"Linear model of {model.scenario.name}, {when}"
    validity = Section(
        "Range of validity",
        panels=partial(steps_panels, model),
        name="steps",
        caption=_STEPS_CAPTION,
        across=2,
        size=(3.0, 2.8),
        title=title,
    )
    counts = (("state", model.states), ("input", model.inputs), ("output", model.outputs))
    size = ", ".join(count_of(len(signals), noun) for noun, signals in counts)
    sentences = [f"plant without controller and sensors: {size}; deviations from the operating point in SI units"]
    if not model.is_steady:
        sentences.append(
            "the operating point is not a steady state: the model describes small deviations from the run and is valid "
            "only while the run stays near this point"
        )
    delays = (
        ("dead time of the valve", model.delays.command),
        ("age of the measurements", model.delays.signals),
        ("sample period", model.delays.period),
    )
    omitted = ", ".join(f"{name} {1.0e3 * delay:g} ms" for name, delay in delays if delay > 0.0)
    sentences.append(f"not in the model: {omitted}, noise, resolution and bandwidth of sensors")
    sentences += _limit_sentences(model)
    remarks = []
    for edge in model.edges:
        side, other = ("above", "below") if edge.is_above else ("below", "above")
        remarks.append(
            f"the plant is not differentiable at this point: the column of `{edge.name}` is valid only {side} "
            f"{_value_at_point(model, edge.name):.5g}; the derivative {other} this value differs"
        )
    matrices = []
    for name, values, rows, columns in (
        ("A", model.a, model.states, model.states),
        ("B", model.b, model.states, model.inputs),
        ("C", model.c, model.outputs, model.states),
        ("D", model.d, model.outputs, model.inputs),
    ):
        titles: list[str | tuple[str, Kind]] = ["", *((variable.name, Kind(form=".5g")) for variable in columns)]
        cells = [(variable.name, *row) for variable, row in zip(rows, values.tolist(), strict=True)]
        matrices.append(Section(f"Matrix {name} (SI)", columns_of(titles, cells)))
    return Finding(
        name="linearise",
        kicker="Linear model",
        title=title,
        said=sentences,
        parts=[
            _point(model),
            Section("Side of the kink", facts(model.sides.items()), remarks=remarks),
            _poles(model, title),
            _loop(model),
            *matrices,
            *([validity] if can_step(model) else []),
        ],
        found=model,
        files={"linearise.npz": partial(_arrays, model)},
        overrides=changes_in(model.scenario),
    )


def _limit_sentences(model: LinearModel) -> list[str]:
    """Return a sentence for each chamber that is so near to its supply pressure that hardly any flow is left."""
    supply, values = model.scenario.device.supply, {each.name: each.value for each in (*model.states, *model.outputs)}
    zero, sentences = float(supply.atmospheric_pressure), list[str]()
    for name, highest in (("pressure_1", supply.pressure), ("pressure_2", supply.dorsiflexion_pressure)):
        share = (values.get(name, zero) - zero) / (float(highest) - zero) if highest > zero else 0.0
        if share > _FULL:
            sentences.append(
                f"{name} is {100.0 * share:.4g} % of its supply pressure, at the limit of the actuator: hardly any "
                "flow into the chamber is left, and gains and margins hold for very small changes only"
            )
    return sentences


def _point(model: LinearModel) -> Section:
    """Return the table of states, inputs and outputs at the operating point; states are not repeated as outputs."""
    states = {variable.name for variable in model.states}
    outputs = [variable for variable in model.outputs if variable.name not in states]
    rows = []
    for role, variables in (("state", model.states), ("input", model.inputs), ("output", outputs)):
        for variable in variables:
            unit = "" if variable.unit == "1" else variable.unit
            value = Kind("", unit, quantity_of_unit(variable.unit), ".5g").text(variable.value)
            rows.append((role, variable.name, variable.unit, value))
    return Section("The point", columns_of(("", "name", "unit in the model", "at the point"), rows), left=3)


def _poles(model: LinearModel, title: str) -> Section:
    """Return the table of poles with time constants; a complex pair is one row with frequency and damping.

    The frequency response, under ``title``, is drawn if the command has any effect.
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
    # The command is the first input.
    responds = bool(np.any(model.b[:, 0]) or np.any(model.d[:, 0]))
    return Section(
        "Poles",
        columns_of(("pole (1/s)", ("time constant", constant), ("frequency", frequency), ratio), rows),
        panels=partial(frequency_panels, model),
        name="frequency-response" if responds else "",
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
    """Return panels of the frequency response of torque to command, and of the open loop with its margins if any."""
    poles, margins = np.abs(model.poles) / (2.0 * np.pi), model.margins
    found = () if margins is None else (margins.gain_crossover, margins.phase_crossover, margins.bandwidth)
    # All frequencies that the report names: poles, crossovers and bandwidth.
    lowest = min((1.0, *poles[poles > 0.0].tolist(), *(at for at in found if at)))
    # Half the sample rate, where the loop ends, is in the plot of a loop.
    highest = max(_HIGHEST_FREQUENCY, 0.0 if margins is None else 0.5 / model.delays.period)
    frequencies = np.geomspace(_LOWEST_SHARE * lowest, highest, _POINTS)
    scales = {"xscale": "log", "xlim": (float(frequencies[0]), 1.1 * highest)}
    response = model.response(frequencies)
    delay = model.delays.command + model.delays.signals + 0.5 * model.delays.period
    phase = np.degrees(np.unwrap(np.angle(response)))
    delayed = f"with {1.0e3 * delay:.3g} ms of dead time, late measurements and half a sample"

    def set_phase(axes: "Axes") -> None:
        from matplotlib.ticker import MultipleLocator

        axes.set(**scales, ylim=(max(-360.0, float(np.min(phase)) - 90.0), float(np.max(phase)) + 20.0))
        axes.yaxis.set_major_locator(MultipleLocator(45.0))

    panel = partial(Panel, _FREQUENCY, shares_x=True)
    gains = [Mark("line", frequencies, np.abs(response))]
    late = Mark("line", frequencies, phase - 360.0 * frequencies * delay, (), delayed, VERMILION, _DASHED)
    phases = [Mark("line", frequencies, phase, label="plant"), late]
    set_gain = methodcaller("set", **scales, yscale="log")
    return [
        *_open_loop_panels(model, scales),
        panel(Kind("Torque per command", "N m"), gains, then=set_gain),
        panel(Kind("Phase", "deg"), phases, legend="inside", then=set_phase),
    ]


def _open_loop_panels(model: LinearModel, scales: Mapping[str, Any]) -> list[Panel]:
    """Return panels of gain and phase of the open loop, with the margins at its crossovers; none without margins.

    ``scales`` are settings of the axis of frequencies.
    """
    found, margins = open_loop(model), model.margins
    if found is None or margins is None:
        return []
    is_drawn = found[0] >= scales["xlim"][0]
    frequencies, loop = (values[is_drawn][_LOOP_POINTS][::-1] for values in found)
    curves = np.abs(loop), np.degrees(np.unwrap(np.angle(loop)))
    crossovers = (
        (margins.gain_crossover, "phase margin", VERMILION, "o"),
        (margins.phase_crossover, "gain margin", BLACK, "s"),
    )
    levels = (Kind("Open-loop gain"), 1.0), (Kind("Open-loop phase", "deg"), -180.0)
    panels = []
    for curve, (kind, critical) in zip(curves, levels, strict=True):
        # Where a margin is read: from the dot to the dashed line.
        nearest = critical + (0.0 if critical > 0.0 else 360.0 * round((curve[-1] - critical) / 360.0))
        marks = [
            Mark("line", frequencies, curve),
            Mark("line", frequencies[[0, -1]], np.full(2, nearest), (), "", GREY, _DASHED),
        ]
        for at, name, colour, marker in crossovers:
            if at is not None and at >= scales["xlim"][0]:
                place = np.array([np.interp(at, frequencies, curve)])
                dot = {"linestyle": "", "marker": marker, "markersize": 5}
                marks.append(Mark("line", np.array([at]), place, (), f"{name} at {at:.3g} Hz", colour, dot))
        every = {**scales, "yscale": "log" if critical > 0.0 else "linear"}
        panels.append(Panel(_FREQUENCY, kind, marks, legend="inside", then=methodcaller("set", **every), shares_x=True))
    return panels


def steps_panels(model: LinearModel) -> list[Panel]:
    """Return panels of step responses, nonlinear and linear, and of their difference divided by the amplitude."""
    steps = steps_of(model)
    over_time = []
    for number, colour in zip(_DRAWN_STEPS, (BLUE, VERMILION), strict=True):
        change = steps.runs[number] / steps.amplitudes[number]
        label = f"command {100.0 * SHARES[number]:+.3g} %"
        over_time.append(Mark("line", steps.times, change, label=label, colour=colour))
    linear = Mark("line", steps.times, steps.linear[-1] / steps.amplitudes[-1], (), "linear", BLACK, _DASHED)
    square = steps.errors[0] * (steps.sizes / steps.sizes[0]) ** 2
    dots = {"linestyle": "", "marker": "o", "markersize": 4}
    per_command = Kind("Change of torque per command", "N m")
    return [
        Panel(replace(TIME, words="Time after the step"), per_command, [*over_time, linear]),
        Panel(
            Kind("Largest change of torque in a step", "N m"),
            Kind("Runs less linear model", "N m"),
            [
                Mark("line", steps.sizes, steps.errors, label="largest difference", style=dots),
                Mark("line", steps.sizes, square, (), "square of the amplitude", GREY, _DASHED),
            ],
            then=lambda axes: axes.set(xscale="log", yscale="log"),
        ),
    ]


def _arrays(model: LinearModel) -> bytes:
    """Matrices, names, units and operating point as a NumPy archive."""
    arrays: dict[str, Any] = {"A": model.a, "B": model.b, "C": model.c, "D": model.d, "rates": model.rates}
    for kind in ("states", "inputs", "outputs"):
        variables = getattr(model, kind)
        arrays[kind] = np.array([variable.name for variable in variables])
        arrays[f"{kind}_units"] = np.array([variable.unit for variable in variables])
        arrays[f"{kind}_values"] = np.array([variable.value for variable in variables])
    archive = io.BytesIO()
    np.savez(archive, allow_pickle=False, **arrays)
    return archive.getvalue()
