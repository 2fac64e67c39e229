"""Report of a sizing study: valves with pressure and bottle, margins, suggestion, figures to check."""

import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.design.problem import CandidateValve, SizingProblem
from ppafo.analyses.design.search import LIMITS, Limit, ceiling
from ppafo.control.catalog import CONTROLLERS
from ppafo.documents.json_text import fields_of
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.report import finding
from ppafo.report.finding import Cell, Finding, columns_of
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, REFERENCE, VERMILION
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units.shown import in_units
from ppafo.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9", BLACK, GREY)
"""Colours of the curves of the valves, in the order of the valves."""
_RING = {"linestyle": "", "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4}
"""Marker style of the ring around the suggested device."""
PRESSURE = Kind("Supply pressure", "Pa_a", "pressure", ".3g")
TORQUE = Kind("Torque", "N m", "torque", ".3g")
_GAS = Kind("Gas per repetition", "kg", "gas mass", ".3g")
REACHED = 0.95
"""Fraction of a peak torque from which it counts as reached [-]."""
_MAXIMUM_OF_LIMIT = 4.0
"""Upper end of the error axis divided by the error limit; larger errors are not plotted."""
_DOTTED = {"marker": ".", "markersize": 4}
_HEAD = (
    "valve",
    ("pressure", PRESSURE),
    ("lowest", PRESSURE),
    ("RMS error", TORQUE),
    ("gas per repetition", _GAS),
    ("total gas", _GAS),
    "bottle",
    "limited by",
)
_WHOLE_PEAK = 0.005
"""Largest fraction of the peak torque that may be cut off without a word [-]: half of the last digit of a pressure."""
_MARGINS = ("error", "torque", "flow", "gas")
_ORIGINS = {
    "typed": "typed, not measured",
    "gait": "a share of the ankle moment of a gait",
    "measured": "recorded",
    "simulated": "simulated, not measured",
    "synthetic": "synthetic, not measured",
}
_CAPTION = (
    "Every valve over supply pressure; each dot has the gains that use least gas within the error limit. Rings mark "
    "the chosen pressures."
)
_READING = (
    "The chosen pressure is the lowest with which the smallest bottle suffices; the table also has the lowest pressure "
    "that keeps the error limit.",
    "Error margin: RMS error below its limit. Torque margin: torque at this pressure above the largest torque of the "
    "profile; below 0 the peak is cut off, as far as the error limit allows. "
    "Flow margin: possible reduction of the opening at a gauge pressure 10 % higher. Gas margin: usable gas in the "
    "bottle above the gas used, reserve included.",
)


@dataclass(frozen=True, slots=True)
class SizingMargins:
    """Reserves of a sized valve to its limits, as fractions [-].

    ``error``: reserve of the RMS error to its limit
    ``torque``: reserve of the largest possible torque over the peak of the profile; below 0 if the peak is cut off
    ``flow``: possible reduction of the valve opening at a gauge pressure one tenth higher
    ``gas``: reserve of gas in the bottle over the gas that is used; None without a bottle
    """

    error: float
    torque: float
    flow: float
    gas: float | None


@dataclass(frozen=True, slots=True, eq=False)
class SizedValve:
    """Sizing result of a valve, at the supply pressure that keeps the error limit with the smallest bottle.

    ``works``: False if no pressure keeps the error limit
    ``pressure``: chosen supply pressure [Pa absolute]; if none works, the pressure with the smallest error
    ``lowest_pressure``: lowest pressure that works [Pa absolute]
    ``gains``: gains of the controller [SI] by path
    ``error``: RMS torque error [N m]
    ``gas``, ``gas_in_all``: gas per repetition and total gas with the reserve [kg]
    ``bottle``: smallest bottle that lasts; None if none does
    ``limit``: quantity that limits the lowest pressure
    ``remark``: note for the reader; empty if there is none
    ``curve``: pressures [Pa absolute], errors [N m] and gas per repetition [kg], with the best gains at each pressure
    """

    valve: CandidateValve
    works: bool
    pressure: float
    lowest_pressure: float | None
    gains: Mapping[str, float]
    error: float
    gas: float
    gas_in_all: float
    bottle: Bottle | None
    margins: SizingMargins | None
    limit: Limit
    remark: str
    curve: tuple[Floats, Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Sizing:
    """Result of a sizing study: every valve, and the index of the valve with the smallest bottle.

    ``suggested``: index of the suggested valve; None if there is none
    ``recording``: run of the suggested valve on the profile; None without a suggestion
    ``failures``: number of failed runs by reason
    ``streams``: number of noise streams of every trial, whose error is the largest over the streams; 0 without noise
    """

    problem: SizingProblem
    valves: tuple[SizedValve, ...]
    suggested: int | None
    recording: Recording | None
    runs: int
    failures: Mapping[str, int]
    seconds: float
    streams: int = 0

    @property
    def choice(self) -> SizedValve | None:
        """Sizing result of the suggested valve; None without a suggestion."""
        return None if self.suggested is None else self.valves[self.suggested]

    def json_document(self) -> dict[str, Any]:
        """Return the sized valves and the suggestion as plain data in SI."""
        problem = self.problem
        found = ("works", "pressure", "lowest_pressure", "error", "gas_in_all", "remark")
        return {
            "format": "ppafo sizing",
            "schema_version": 1,
            **fields_of(problem, "name", "description", "file", "repetitions", "hours", "reserve", "largest_error"),
            "units": "SI; pressures absolute, errors in N m, gas and mass in kg, margins as fractions",
            "scenario": problem.scenario.name,
            "profile": {
                **fields_of(problem.profile, "kind", "period", "largest", "table_error"),
                "times": problem.profile.knot_times.tolist(),
                "torques": problem.profile.knot_values.tolist(),
            },
            "suggested": None if self.choice is None else self.choice.valve.name,
            "summary": suggestion_sentence(self),
            "valves": [
                {
                    "valve": sized.valve.name,
                    **fields_of(sized, *found),
                    "gains": dict(sized.gains),
                    "gas_per_repetition": sized.gas,
                    "bottle": None if sized.bottle is None else sized.bottle.name,
                    "margins": None if sized.margins is None else asdict(sized.margins),
                    "limited_by": sized.limit,
                    "limit": LIMITS[sized.limit],
                }
                for sized in self.valves
            ],
            "noise_streams": self.streams,
            "runs": self.runs,
            "failures": [{"reason": reason, "runs": count} for reason, count in self.failures.items()],
            "versions": {"ppafo": __version__},
        }


def pressure_panels(sizing: Sizing) -> list[Panel]:
    """Return panels of error and gas over supply pressure, with a ring at the pressure chosen for each valve."""
    limit = sizing.problem.largest_error
    errors, gases = [Mark("level", (), limit, colour=BLACK, style={"linewidth": 1.0, "linestyle": "--"})], []
    for number, sized in enumerate(sizing.valves):
        pressure, error, gas = sized.curve
        keeps, colour = error <= limit, _COLOURS[number % len(_COLOURS)]
        errors.append(Mark("line", pressure, error, (), sized.valve.name, colour, _DOTTED))
        gases.append(Mark("line", pressure[keeps], gas[keeps], colour=colour, style=_DOTTED))
        if sized.works:
            ring = "" if any(mark.label == "chosen pressure" for mark in errors) else "chosen pressure"
            errors.append(Mark("line", [sized.pressure], [sized.error], (), ring, colour, _RING))
            gases.append(Mark("line", [sized.pressure], [sized.gas], colour=colour, style=_RING))

    error_kind = replace(TORQUE, words="RMS error")
    highest = float(error_kind.values(_MAXIMUM_OF_LIMIT * limit))

    def set_gas(axes: "Axes") -> None:
        # Valves differ by some per cent: an axis from 0 would lay their curves on each other.
        axes.margins(y=0.15)
        if not any(sized.works for sized in sizing.valves):
            axes.text(0.5, 0.5, "no valve keeps the limit", transform=axes.transAxes, ha="center", color=GREY)

    return [
        Panel(
            PRESSURE,
            error_kind,
            errors,
            "RMS error, limit dashed",
            legend="figure",
            then=lambda axes: axes.set_ylim(0.0, highest),
        ),
        Panel(PRESSURE, _GAS, gases, "Gas, within the limit", then=set_gas),
    ]


@in_units(lambda sizing: sizing.problem.scenario.device.shown)
def finding_of(sizing: Sizing) -> Finding[Sizing]:
    """Return a sizing study as a finding; not passed if there is no suggestion."""
    problem, profile, recording = sizing.problem, sizing.problem.profile, sizing.recording
    table_error = profile.table_error
    knots = f", {profile.knot_times.size} knots, to {TORQUE.text(table_error)}" if table_error else ""
    requirements = (
        f"profile of {TIME.text(profile.period, '.3g')} with up to {TORQUE.text(profile.largest)} "
        f"({_ORIGINS[profile.kind]}{knots}); {problem.repetitions:.0f} repetitions ({problem.hours:.2g} h), RMS error "
        f"at most {TORQUE.text(problem.largest_error)}, {100 * problem.reserve:.0f} % of the gas as reserve"
    )
    method = (
        f"{problem.simulated} repetitions of the profile were simulated from the initial state of the scenario; "
        "error and gas cover all of them, including the first filling of the chambers. What the file does not say of a "
        "valve, friction, leak, dead volumes and sensors are the scenario's.",
    )
    failed = sum(sizing.failures.values())
    most = f"; most often: {max(sizing.failures, key=sizing.failures.__getitem__)}" if failed else ""
    asked = f" --profile {shlex.quote(problem.asked_profile)}" if problem.asked_profile else ""
    noisy = (
        f"sensors are noisy: every trial was run in the same {sizing.streams} noise streams; the error is the "
        "largest over the streams, the gas the mean"
    )
    return Finding(
        name="design",
        kicker="Sizing study",
        title=problem.name,
        said=(*([problem.description] if problem.description and not problem.asked_profile else []), requirements),
        parts=(
            *_tables(sizing),
            finding.Section(
                remarks=(
                    suggestion_sentence(sizing),
                    *(f"{sized.valve.name}: {sized.remark}" for sized in sizing.valves if sized.remark),
                    *([noisy] if sizing.streams else []),
                    f"{sizing.runs:,} trial runs in {sizing.seconds:.0f} s, {failed:,} of them rejected{most}",
                    f"made with: ppafo design {problem.file}{asked}",
                )
            ),
            finding.Section(
                "Error and gas over pressure",
                panels=partial(pressure_panels, sizing),
                name="profile",
                caption=_CAPTION,
                across=2,
                size=(3.0, 2.7),
                is_detail=True,
            ),
            finding.Section(
                "The torque",
                panels=partial(_torque_panels, sizing),
                name="torque",
                caption="The prescribed torque and the suggestion's.",
                size=(5.8, 2.5),
                is_detail=True,
            ),
            finding.Section("How to read it", said=(*_READING, *method), is_detail=True),
        ),
        found=sizing,
        passed=sizing.choice is not None,
        files={} if recording is None else {"suggested.csv": partial(marked_csv_bytes, recording)},
    )


def _torque_panels(sizing: Sizing) -> list[Panel]:
    times = np.linspace(0.0, sizing.problem.scenario.run.duration, 3001)
    prescribed = {"linestyle": REFERENCE.line, "linewidth": 1.2}
    profile = sizing.problem.profile.at(times)
    marks = [Mark("line", times, profile, (), "prescribed", REFERENCE.colour, prescribed)]
    recording, choice = sizing.recording, sizing.choice
    if recording is not None and choice is not None:
        label = f"{choice.valve.name} at {PRESSURE.number(choice.pressure, '.3g')} {PRESSURE.axis_unit}"
        colour = _COLOURS[sizing.valves.index(choice) % len(_COLOURS)]
        marks.append(Mark("line", recording.time, recording["torque"], label=label, colour=colour))
    return [Panel(TIME, TORQUE, marks, then=lambda axes: axes.margins(x=0.0))]


def _tables(sizing: Sizing) -> tuple[finding.Section, finding.Section]:
    """Return the table of all valves, and the table of margins and gains of the valves that work."""
    rows: list[tuple[Cell, ...]] = []
    margins: list[tuple[Cell, ...]] = []
    marked = []
    quantities = CONTROLLERS[sizing.problem.scenario.controller.kind].quantities
    units = {f"controller.{quantity.name}": quantity.unit for quantity in quantities}
    for sized in sizing.valves:
        name = sized.valve.name
        if not sized.works:
            rows.append((name, None, None, f"{TORQUE.number(sized.error)} at best", *(None,) * 3, sized.limit))
            continue
        bottle, lowest = "none" if sized.bottle is None else sized.bottle.name, sized.lowest_pressure or sized.pressure
        gas = (sized.gas, sized.gas_in_all)
        rows.append((name, sized.pressure, lowest, sized.error, *gas, bottle, sized.limit))
        gains = (
            f"{path.rpartition('.')[2].replace('_', ' ')} {value:.3g} {units[path]}"
            for path, value in sized.gains.items()
        )
        if sized is sizing.choice:
            marked.append(len(margins))
        fractions = [None if sized.margins is None else getattr(sized.margins, margin) for margin in _MARGINS]
        margins.append((name, *fractions, ", ".join(gains) or "none to choose"))
    fraction = Kind(quantity="fraction", form=".0f")
    head: list[str | tuple[str, Kind]] = ["valve", *((f"{name} margin", fraction) for name in _MARGINS), "gains"]
    return (
        finding.Section(
            "Valves", columns_of(_HEAD, rows), marked=() if sizing.suggested is None else (sizing.suggested,)
        ),
        finding.Section("Margins" if margins else "", columns_of(head, margins), marked=marked),
    )


def suggestion_sentence(sizing: Sizing) -> str:
    """Return a sentence with the suggestion and its reason, or the reason why there is none."""
    choice, recording, profile = sizing.choice, sizing.recording, sizing.problem.profile
    if choice is None or recording is None:
        working = [sized for sized in sizing.valves if sized.works]
        kept = "valves keep the error limit, but no bottle lasts for the requested use"
        near = min(sizing.valves, key=lambda sized: np.nan_to_num(sized.error, nan=np.inf))
        nearest = f"{TORQUE.text(near.error)} with {near.valve.name} at {PRESSURE.text(near.pressure)}"
        reasons = [kept if working else f"no valve keeps the error limit; the smallest error is {nearest}"]
        reasons += [f"{each.valve.name}{cut}" for each in working or sizing.valves if (cut := _cut_peak(sizing, each))]
        return f"no suggestion: {'; '.join(reasons)}"
    bottle = "" if choice.bottle is None else f" and {choice.bottle.name}"
    short = [
        f"{TORQUE.number(sign * reached)} of {TORQUE.text(sign * peak)}"
        for sign in (1.0, -1.0)
        if (peak := np.max(sign * profile.knot_values)) > _WHOLE_PEAK * profile.largest
        and (reached := np.max(sign * recording["torque"])) < REACHED * peak
    ]
    # The error limit accepts such a peak; a run with a smaller error may have more of the peak.
    more = f"for more, lower limits.rms_error below '{TORQUE.text(choice.error)}' (not tried)"
    reaches = f"; reaches {' and '.join(short)} in the simulated run: {more}" if short else ""
    return (
        f"suggested: {choice.valve.name} at {PRESSURE.text(choice.pressure)}{bottle}, the smallest that lasts "
        f"and keeps the error limit{_cut_peak(sizing, choice)}{reaches}; a lower pressure is prevented by "
        f"{LIMITS[choice.limit]}"
    )


def _cut_peak(sizing: Sizing, sized: SizedValve) -> str:
    """Return the fraction of the peak torque that a valve's pressure cuts off, with a remedy; "" for a whole peak."""
    problem, largest = sizing.problem, sizing.problem.profile.largest
    most = ceiling(problem, sized.pressure)
    if (cut := 1.0 - most / largest) <= _WHOLE_PEAK or np.isnan(sized.error):
        return ""
    whole = problem.atmosphere + largest / problem.torque_constant
    higher = " and a higher pressure.highest" * bool(whole >= problem.highest_pressure)
    needs = f"pressure.lowest = '{PRESSURE.text(whole)}'{higher}"
    at_most = f"at most {TORQUE.text(most)} of {TORQUE.text(largest)}; the whole peak statically needs {needs}"
    return f", with {100.0 * cut:.0f} % of the peak cut off ({at_most})"
