"""Report of the reproduction: tables of claims with verdicts, figures 7 and 8 of the paper, and the page."""

import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.resources import files
from itertools import groupby
from operator import attrgetter, methodcaller
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.reproduce import paper
from ppafo.analyses.reproduce.claims import ALL, VERDICTS, Claim, Studies, count_sentence, in_words
from ppafo.analyses.reproduce.paper import Reproduction, holding_torque, result_on_u, step_events
from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.identification.bench.law import figure_3
from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import findings_of
from ppafo.parameters.parameter_set import number_in_si
from ppafo.parameters.publications.publication import PAPER, paper_entries, read_publication
from ppafo.report import style
from ppafo.report.finding import Cell, Finding, Section, columns_of
from ppafo.report.kind import TIME, Kind, metric_level
from ppafo.report.panels import Mark, Panel
from ppafo.report.writing import inline_figure, quantity, render_page
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.wording import override_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NOTHING_CONFIRMED = "No experimental result is confirmed independently of fitted settings."
_HEAD = ("study", "claim", "published", "ours", "verdict")
_DETAILS_HEAD = ("claim", "statement and source", "agrees", "rests on", "note")
_RULE = (
    "'Ours' is recomputed by every run of the command. "
    + " ".join(f"{in_words(verdict).capitalize()}: {meaning}." for verdict, (_, meaning) in VERDICTS.items())
    + " Nothing here was measured."
)
_DEVICE = files("ppafo.analyses.reproduce") / "templates" / "device.svg"
"""Drawing of the gas circuit with ISO 1219-1 symbols, and of the leg with the device."""
IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"

_MILLISECONDS = 1.0e3
_AFTER_STEP = Kind("Time after the step", "ms")
_TORQUE = Kind("Torque", "N m", "torque")
_ERROR = Kind("Error", "N m", "torque")
_GAS = Kind("CO$_2$", "kg", "gas mass")
# Fractions of the time axis before the step, where the rise within the first milliseconds stays visible, and of the
# time until the stop that is shown after the stop, when the vane rests.
_SHOWN_BEFORE_STEP = 0.03
_SHOWN_AFTER_STOP = 0.8
_ENLARGED = 40.0
"""Time after the step that is shown enlarged [ms]."""
_BIN = 3.0
"""Interval [ms] for the band from the smallest to the largest reading of a measurement."""
_EVENT: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (4, 3)), "alpha": 0.7, "zorder": 0.5}
_LEVEL: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (1, 2)), "zorder": 0.9}
_PRESSURE = Kind("Pressure", "psig")
_STEP_PANELS = (
    ("$\\bf{A}$   Vane angle", Kind("Angle", "deg"), style.ACTUAL, (0.66, 0.36, 0.31, 0.34)),
    ("$\\bf{B}$   Pressure difference, $P_1 - P_2$", Kind("Difference", "psi"), style.ACTUAL, (0.69, 0.14, 0.29, 0.34)),
    ("$\\bf{C}$   Chamber 1 (plantarflexion), $P_1$", _PRESSURE, style.CHAMBER_1, (0.22, 0.12, 0.3, 0.34)),
    ("$\\bf{D}$   Chamber 2 (dorsiflexion), $P_2$", _PRESSURE, style.CHAMBER_2, (0.69, 0.3, 0.29, 0.4)),
)
"""Panels of figure 7: title with the letter of the paper, kind, style of the model, and x, y, width and height of the
inset with the first milliseconds as fractions of the panel."""


def finding_of_studies(studies: Studies) -> Finding[Studies]:
    """Return the table of studies as a finding.

    A claim of another publication that is not met counts as a result, not as a failure.
    """
    rows: list[Sequence[Cell]] = [(claim.study, *_row(claim)) for claim in studies.claims]
    details = []
    for publication, claims in groupby(studies.claims, key=attrgetter("publication")):
        file = publication or read_publication(PAPER)[0]
        stated: list[Sequence[Cell]] = [
            (
                claim.entry.id,
                f"{claim.entry.statement} ({claim.source})",
                _agrees(claim),
                "; ".join(claim.entry.assumed) or None,
                claim.note or None,
            )
            for claim in claims
        ]
        columns = columns_of(_DETAILS_HEAD, stated)
        details.append(
            Section(f"{file.name}: {file.title}", columns, (file.citation,), left=len(columns), is_detail=True)
        )
    remarks = ("", count_sentence(studies.claims))
    return Finding(
        name="claims",
        kicker="Reproduction",
        title="Published studies, run again" if studies.study == ALL else f"{studies.study}, run again",
        said=(),
        parts=(
            Section(columns=columns_of(_HEAD, rows), remarks=remarks, left=len(_HEAD)),
            Section("How to read it", said=(_RULE,), is_detail=True),
            *details,
        ),
        found=studies,
        passed=not any(claim.is_missed for claim in studies.claims if claim.publication is None),
        command="reproduce",
    )


def _row(claim: Claim) -> tuple[str, str | None, str, str]:
    """Return the row of a claim in the table of claims."""
    # A number that only own arithmetic on published ones gives.
    own = f"{claim.entry.own} (own sum)" if claim.entry.own else None
    return claim.entry.id, claim.published or own, claim.ours, in_words(claim.verdict)


def _agrees(claim: Claim) -> str | None:
    """Format the range of values that agrees with a claim as text."""
    low = claim.entry.at_least
    high = claim.entry.at_most
    if low is None and high is None:
        return None
    text = f"at most {high:g}" if low is None else f"at least {low:g}" if high is None else f"{low:g} to {high:g}"
    return f"{text} {claim.entry.unit}".rstrip()


def finding_of(reproduction: Reproduction) -> Finding[Reproduction]:
    """Return the paper's claims as a finding.

    The finding has not passed if a value is outside its window although no value was overridden. Figure 3 needs the
    simulated test bench.
    """
    missed = reproduction.missed
    rows = reproduction.readings_of_u
    synthetic = reproduction.synthetic
    said = [NOTHING_CONFIRMED]
    parts = []
    if reproduction.overrides:
        words = f"not the paper's device: values changed with {override_text(reproduction.overrides)}"
        said.append(f"{words}; the verdicts still compare this device with the paper")
    # On the page a claim has its window in its note; at the command line only what misses it is said.
    remarks = [f"missed: {claim.entry.id} is outside {_agrees(claim)}" for claim in missed]
    claims = columns_of(("claim", "paper", "ours", "verdict"), map(_row, reproduction.claims))
    parts.append(Section(columns=claims, remarks=("", count_sentence(reproduction.claims), *remarks), left=len(claims)))
    if rows:
        head = ("U is", "RMS error less by", "CO2 less by", f"error at {paper.WITHIN_REACH:g} N m less by")
        cells = [(name, *(f"{less:.0f} %" for less in lesses)) for name, *lesses in rows]
        parts.append(Section(columns=columns_of(head, cells), remarks=("", *result_on_u(rows))))
    step = partial(_step_panels, reproduction)
    task = partial(_torque_task_panels, reproduction)
    # Its grey curves are a synthetic measurement, so that the figure is marked as synthetic.
    origin = None if isinstance(synthetic, str) else synthetic.step.kind
    parts.extend(
        (
            Section(name=STEP_FIGURE, panels=step, across=2, size=(3.15, 1.0), kind=origin, is_detail=True),
            Section(name=TORQUE_FIGURE, panels=task, size=(6.3, 1.0), is_detail=True),
        )
    )
    if not isinstance(synthetic, str):
        draw = partial(figure_3, synthetic.torque, synthetic.decay)
        parts.append(Section(name=IDENTIFICATION_FIGURE, draw=draw, is_detail=True))
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    return Finding(
        name="claims",
        kicker="Reproduction",
        title="The paper's claims",
        said=said,
        parts=parts,
        found=reproduction,
        # A changed device may leave the windows of the paper: that is a result, no failure.
        passed=not missed or bool(reproduction.overrides),
        files={
            **{f"{run.scenario.name}.csv": partial(marked_csv_bytes, run.recording) for run in runs},
            _DEVICE.name: _DEVICE.read_bytes,
        },
        command="reproduce",
        page=partial(reproduction_page, reproduction),
    )


def reproduction_page(reproduction: Reproduction, drawn: Mapping[str, bytes]) -> bytes:
    """Return the page of a reproduction as HTML.

    ``drawn`` are the figures as SVG by file name; they become part of the page.
    """
    synthetic = reproduction.synthetic
    reported = load_parameter_set(paper.REPORTED_SET)
    runs = (reproduction.solenoid, reproduction.proportional, reproduction.step)
    completed = load_parameter_set(reproduction.step.scenario.origin.parameter_set)
    changed = [word for override in reproduction.overrides for word in ("--set", override)]
    slope = 0.0
    groups = dict[tuple[str, ...], list[paper.AssumedValue]]()
    if not isinstance(synthetic, str):
        inertia = number_in_si(reported, "foot_plate.inertia") or 1.0
        slope = -synthetic.decay["friction.viscous_damping"].value / inertia
    for value, users in reproduction.assumed.items():
        groups.setdefault(tuple(users), []).append(value)
    values = {
        "reproduction": reproduction,
        "reported": reported,
        "completed": completed,
        "statements": paper_entries(),
        "nothing_confirmed": NOTHING_CONFIRMED,
        "count_sentence": count_sentence(reproduction.claims),
        "verdicts": VERDICTS,
        "findings": findings_of(reported),
        "kept": [finding for finding in findings_of(completed) if finding.severity != "note"],
        # Those of most experiments first.
        "assumed_groups": sorted(groups.items(), key=lambda group: -len(group[0])),
        "settings": paper,
        "slope": slope,
        "is_measured": not isinstance(synthetic, str),
        "result_on_u": result_on_u(reproduction.readings_of_u),
        "metric": lambda metric: quantity(*metric_level(metric.value, metric.unit), 3),
        "ceiling": f"{holding_torque(reproduction.solenoid):.1f}",
        "steps": sorted({1e3 * float(run.engine["step"]) for run in runs}),
        "device": inline_figure(_DEVICE.read_bytes()),
        "figures": {name: inline_figure(content) for name, content in drawn.items()},
        "command": shlex.join(["ppafo", "reproduce", "--out", "out/reproduce", *changed]),
    }
    return render_page("reproduction.html.jinja", values, "ppafo.analyses.reproduce").encode()


def _step_panels(reproduction: Reproduction) -> list[Panel]:
    """Return figure 7: angle, pressure difference and both pressures over time, with breakaway and stop marked.

    A recording of the simulated bench is a thin line with a band from the smallest to the largest readings; a further
    panel below each curve shows the measurement less the model.
    """
    recording = reproduction.step.recording
    at = [_MILLISECONDS * float(recording.time[index]) for index in step_events(recording) or ()]
    synthetic = None if isinstance(reproduction.synthetic, str) else reproduction.synthetic.step
    atmosphere = reproduction.step.scenario.device.supply.atmospheric_pressure
    last = _MILLISECONDS * float(recording.time[-1])
    end = min(last, at[1] * (1.0 + _SHOWN_AFTER_STOP)) if at else last
    limits = -_SHOWN_BEFORE_STEP * end, end
    lines = [Mark("at", x=time, colour=style.GREY, style=_EVENT) for time in at]
    # The first panel has the names of the events, at angles [deg] where nothing else is drawn at their time.
    small = {"fontsize": 7.5, "va": "center"}
    names = [
        Mark("text", time + 0.01 * end, angle, label=name, colour=style.GREY, style=small)
        for time, angle, name in zip(at, (120.0, 25.0), ("breaks away", "at rest"), strict=False)
    ]
    signals = []
    errors = []
    for number, (title, kind, look, inset) in enumerate(_STEP_PANELS):
        model = _step_curves(recording, atmosphere)[number]
        time = _MILLISECONDS * recording.time
        marks = [Mark("line", time, model, label="model", colour=look.colour, style={"zorder": 3})]
        if synthetic is not None:
            time = _MILLISECONDS * synthetic.time
            readings = _step_curves(synthetic, atmosphere)[number]
            starts = np.flatnonzero(np.diff(np.floor(time / _BIN), prepend=-np.inf) > 0.0)
            band = np.minimum.reduceat(readings, starts), np.maximum.reduceat(readings, starts)
            thin = {"linestyle": "-", "linewidth": 0.8, "zorder": 2}
            pale = {"alpha": 0.3, "zorder": 1}
            marks.extend(
                (
                    Mark("line", time, readings, (), "synthetic measurement", style.EXPERIMENT.colour, thin),
                    Mark("band", time[starts] + 0.5 * _BIN, band, colour=style.EXPERIMENT.colour, style=pale),
                )
            )
            error = readings - np.interp(synthetic.time, recording.time, model)
            beside = [
                Mark("line", time, error, colour=style.EXPERIMENT.colour, style={"linewidth": 0.9}),
                Mark("level", y=0.0, colour=look.colour, style={"linewidth": 1.0}),
                *lines,
            ]
            # The difference of two gauge pressures is no gauge pressure.
            change = Kind("Error", "psi" if kind == _PRESSURE else kind.unit)
            until = methodcaller("set_xlim", *limits)
            errors.append(
                Panel(_AFTER_STEP, change, beside, "Measurement less model", then=until, tall=0.85, shares_x=True)
            )
        # The first panel has the legend of all panels.
        marks += [*lines, *names] if number == 0 else lines
        legend = "" if number else "figure"
        enlarged = partial(_enlarge, inset, limits)
        signals.append(Panel(_AFTER_STEP, kind, marks, title, None, legend, enlarged, tall=2.3, shares_x=True))
    return [*signals[:2], *errors[:2], *signals[2:], *errors[2:]]


def _step_curves(recording: Recording, atmosphere: float) -> tuple[Floats, ...]:
    """Return the values (samples,) of the panels of figure 7, in the order and units of ``_STEP_PANELS``."""
    first = recording["pressure_1"]
    second = recording["pressure_2"]
    gauge = ((pressure - atmosphere) / PASCALS_PER_PSI for pressure in (first, second))
    return (np.degrees(recording["angle"]), (first - second) / PASCALS_PER_PSI, *gauge)


def _enlarge(frame: tuple[float, float, float, float], ends: tuple[float, float], axes: "Axes") -> None:
    """Limit a panel to two times [ms], and show the first milliseconds enlarged in an inset."""
    axes.margins(y=0.06)
    axes.set_xlim(*ends)
    inset = axes.inset_axes(frame)
    for line in axes.lines:
        times, values = (np.asarray(data, dtype=np.float64) for data in line.get_data())
        early = times <= _ENLARGED
        # The upright line of an event, at one time, is no curve.
        if times[0] < times[-1]:
            (copied,) = inset.plot(times[early], values[early], color=line.get_color(), zorder=line.get_zorder())
            copied.set_linewidth(line.get_linewidth())
    inset.margins(y=0.08)
    inset.set_xlim(-0.05 * _ENLARGED, _ENLARGED)
    inset.tick_params(labelsize=style.font_size(7.0), length=2.0)
    inset.set_xticks([0.0, 0.5 * _ENLARGED, _ENLARGED])
    inset.locator_params(axis="y", nbins=3)
    inset.set_title(f"first {_ENLARGED:.0f} ms", fontsize=style.font_size(7.5), color=style.GREY, loc="center", pad=2.0)


def _torque_task_panels(reproduction: Reproduction) -> list[Panel]:
    """Return figure 8: torque and reference with each valve, valve commands below, error and gas at the bottom.

    Beside the gas stands what the paper states, beside the torque that of the simulated bench. Gas that leaks past the
    vane is vented from the other chamber.
    """
    valves = {"solenoid": style.SOLENOID, "proportional": style.PROPORTIONAL}
    runs = {valve: getattr(reproduction, valve).recording for valve in valves}
    stated = {claim.entry.id: claim.entry.published or 0.0 for claim in reproduction.claims}
    in_paper = {valve: stated[f"co2_{valve}"] for valve in valves}
    ceiling = holding_torque(reproduction.solenoid)
    dashed = {"linestyle": style.REFERENCE.line, "linewidth": 1.3}

    def bar(ends: tuple[float, float], middle: float, half: float, colour: str, alpha: float, label: str = "") -> Mark:
        edges = (middle - half,) * 2, (middle + half,) * 2
        return Mark("band", ends, edges, label=label, colour=colour, style={"alpha": alpha})

    torques = []
    gas = list[Mark]()
    errors = [Mark("level", y=0.0, colour=style.GREY, style={"linewidth": 0.8})]
    # Grey in the legend, as the bars have the colours of the valves.
    places = [
        bar((0.0, 0.0), 0.0, 0.0, style.GREY, 1.0, "in chambers"),
        bar((0.0, 0.0), 0.0, 0.0, style.GREY, 0.35, "vented"),
        bar((0.0, 0.0), 0.0, 0.0, style.BLACK, 1.0, "leaked (part of vented)"),
    ]
    for (valve, run), height in zip(runs.items(), (1.0, 0.0), strict=True):
        colour = valves[valve].colour
        supplied, vented, leaked = (float(run[name][-1]) for name in ("supplied_mass", "vented_mass", "leaked_mass"))
        marks = [
            Mark("line", run.time, run["reference"], label="reference", colour=style.REFERENCE.colour, style=dashed),
            Mark("level", y=ceiling, label=f"maximum: {ceiling:.1f} N m", colour=style.GREY, style=_LEVEL),
        ]
        if not isinstance(reproduction.synthetic, str):
            # Broader than the simulated torque and darker than the grid, so that it is visible where both agree.
            experiment: Recording = getattr(reproduction.synthetic, valve)
            broad = {"linestyle": "-", "linewidth": 4.5, "alpha": 0.75}
            marks.append(
                Mark("line", experiment.time, experiment["torque"], (), "synthetic", style.EXPERIMENT.colour, broad)
            )
        torques.append([*marks, Mark("line", run.time, run["torque"], label="simulated", colour=colour)])
        errors.append(Mark("line", run.time, run["reference"] - run["torque"], colour=colour))
        label = f"{valve}: {GRAMS_PER_KILOGRAM * supplied:.2f} g, in the paper {in_paper[valve]:g} g"
        gas.extend(
            (
                Mark("line", run.time, run["supplied_mass"], label=label, colour=colour),
                Mark("level", y=in_paper[valve] / GRAMS_PER_KILOGRAM, colour=colour, style=_LEVEL),
            )
        )
        inside = supplied - vented
        label = f"   {GRAMS_PER_KILOGRAM * inside:.2f} + {GRAMS_PER_KILOGRAM * vented:.2f} g"
        places += [
            Mark("text", supplied, height, label=label, colour=style.BLACK, style={"fontsize": 8.5, "va": "center"}),
            bar((0.0, inside), height, 0.25, colour, 1.0),
            bar((inside, supplied), height, 0.25, colour, 0.35),
            bar((supplied - leaked, supplied), height - 0.36, 0.05, style.BLACK, 1.0),
        ]
    solenoid, proportional = runs.values()
    most = GRAMS_PER_KILOGRAM * max(float(run["supplied_mass"][-1]) for run in runs.values())
    limits = partial(methodcaller, "set", xlim=(float(solenoid.time[0]), float(solenoid.time[-1])))
    # All torque panels have the same limits, 5 % beyond their marks.
    drawn = [mark.y for marks in torques for mark in marks]
    low = min(float(np.min(values)) for values in drawn)
    high = max(float(np.max(values)) for values in drawn)
    torque_limits = limits(ylim=(low - 0.05 * (high - low), high + 0.05 * (high - low)))
    chambers = limits(ylim=(0.0, 2.0), yticks=(0.5, 1.5), yticklabels=("2", "1"))
    opening = Mark("line", proportional.time, proportional["command"], colour=style.PROPORTIONAL.colour)
    opening_limits = limits(ylim=(-0.08 if proportional["command"].min() >= 0.0 else -1.1, 1.08))
    gas_limits = limits(ylim=(0.0, 1.1 * max(most, *in_paper.values())))
    filling = []
    for row, side, look in ((1, 1.0, style.CHAMBER_1), (0, -1.0, style.CHAMBER_2)):
        is_on = np.sign(solenoid["command"]) == side
        # A command holds until the next sample, so that a bar reaches to the first sample at which the valve is off.
        filled = {"where": is_on | np.concatenate(([False], is_on[:-1])), "alpha": 1.0}
        edges = np.full((2, is_on.size), [[row + 0.12], [row + 0.88]])
        filling.append(Mark("band", solenoid.time, edges, colour=look.colour, style=filled))
    # To the right of the longer bar there is space for the amounts.
    places_limits = methodcaller("set", xlim=(0.0, 1.8 * most), yticks=(1.0, 0.0), yticklabels=tuple(valves))
    panel = partial(Panel, TIME, shares_x=True)
    command_panel = partial(panel, Kind(), legend="", tall=0.7)
    return [
        panel(_TORQUE, torques[0], "Torque with solenoid valves, on or off", tall=2.3, then=torque_limits),
        command_panel(filling, "Chamber that the solenoid valves fill", then=chambers),
        panel(_TORQUE, torques[1], "Torque with the proportional valve", tall=2.3, then=torque_limits),
        command_panel([opening], "Opening of the proportional valve", then=opening_limits),
        panel(_ERROR, errors, "Error: reference less torque, both valves", legend="", tall=1.3, then=limits()),
        panel(_GAS, gas, "CO$_2$ from the supply (dotted: the paper)", tall=1.3, then=gas_limits),
        Panel(_GAS, Kind(), places, "Location of this gas at the end", then=places_limits, tall=0.75),
    ]
