"""Report of a linear model: operating point, side of each limit, poles, margins, matrices and range of validity."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.linearise.model import PID_LAWS, UNITS, LinearModel, open_loop
from ppafo.control.controllers.switching import CONSTANT
from ppafo.engine.lanes import Floats
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, BLUE, GREY, VERMILION
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.scenario import Control, with_control
from ppafo.simulation.simulate import simulate_many
from ppafo.units.shown import in_units, quantity_of_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
_POINTS, _LOWEST_SHARE, _HIGHEST = 400, 0.1, 100.0
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
    frequencies = np.geomspace(lowest, highest, _POINTS)
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
    laws = (Control(CONSTANT.name, {"command": command * (1.0 + share)}, INTERVAL) for share in (0.0, *shares))
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
