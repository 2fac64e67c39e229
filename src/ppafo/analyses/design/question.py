"""Sizing of a device for a torque profile: valve, supply pressure, gains and bottle."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Threads, Word, checked
from ppafo.errors import StudyError
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing
from ppafo.units.shown import in_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ppafo.analyses.design.problem import SizingProblem
    from ppafo.analyses.design.search import SizedValve, Sizing
    from ppafo.report.finding import Finding, Section
    from ppafo.report.panels import Panel

DesignLike = Annotated["SizingProblem | str | Path", Word("DESIGN")]
REACHED = 0.95
"""Fraction of a peak torque from which it counts as reached [-]."""
_WHOLE_PEAK = 0.005
"""Largest fraction of the peak torque that may be cut off without a word [-]: half of the last digit of a pressure."""
_MAXIMUM_OF_LIMIT = 4.0
"""Upper end of the error axis divided by the error limit; larger errors are not plotted."""
_ORIGINS = {
    "typed": "typed, not measured",
    "gait": "a share of the ankle moment of a gait",
    "measured": "recorded",
    "simulated": "simulated, not measured",
    "synthetic": "synthetic, not measured",
}
_READING = (
    "The chosen pressure is the lowest with which the smallest bottle suffices; the table also has the lowest pressure "
    "that keeps the error limit.",
    "Error margin: RMS error below its limit. Torque margin: torque at this pressure above the largest torque of the "
    "profile; below 0 the peak is cut off, as far as the error limit allows. "
    "Flow margin: possible reduction of the opening at a gauge pressure 10 % higher. Gas margin: usable gas in the "
    "bottle above the gas used, reserve included.",
    "Error and gas cover all repetitions that were simulated, including the first filling of the chambers. What the "
    "file does not say of a valve, friction, leak, dead volumes and sensors are the scenario's.",
)


@checked
def design(
    problem: DesignLike,
    *,
    profile: Annotated[str | Path, Word("PROFILE")] | None = None,
    threads: Threads | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Sizing]:
    """Find valve, supply pressure, gains and bottle for a torque profile.

    Arguments:
        problem: name of a design file, or a .toml file
        profile: torque profile in place of the file's: a recording, or a share of the ankle moment of a wearer, such
            as 'gait:falisse2019-subject1,mass=72.6 kg,share=0.05'
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is the sizing: every valve that was tried, and the one suggested

    Raises:
        StudyError: a problem or profile that cannot be used, and a valve with which every run fails
        ParameterError: a parameter set or a bottle that cannot be used

    >>> from dataclasses import replace
    >>> import ppafo
    >>> problem = ppafo.load_design("push-off")
    >>> ppafo.design(replace(problem, gain_factors=(1.0,), largest_error=1.0)).found.choice.bottle.name
    'paper-co2-9oz'
    """
    name_plugins(plugins)
    from ppafo.analyses.design.problem import load_design
    from ppafo.analyses.design.search import size_for_profile

    if isinstance(problem, str | Path):
        problem = load_design(problem, profile=profile)
    elif profile is not None:
        raise StudyError("a loaded design takes no profile; give it to load_design")
    return finding_of(size_for_profile(problem, threads, progress or report_nothing))


@in_units(lambda sizing: sizing.problem.scenario.device.shown)
def finding_of(sizing: Sizing) -> Finding[Sizing]:
    """Return a sizing study as a finding; not passed if there is no suggestion."""
    from ppafo.analyses.design.search import TORQUE
    from ppafo.report.finding import Finding, Section
    from ppafo.report.kind import TIME
    from ppafo.storage.comma_separated import marked_csv_bytes

    problem, profile = sizing.problem, sizing.problem.profile
    sizing = replace(sizing, summary=suggestion_sentence(sizing))
    knots = f", {profile.knot_times.size} knots, to {TORQUE.text(profile.table_error)}" if profile.table_error else ""
    requirements = (
        f"profile of {TIME.text(profile.period, '.3g')} with up to {TORQUE.text(profile.largest)} "
        f"({_ORIGINS[profile.kind]}{knots}); {problem.repetitions:.0f} repetitions ({problem.hours:.2g} h), RMS error "
        f"at most {TORQUE.text(problem.largest_error)}, {100 * problem.reserve:.0f} % of the gas as reserve"
    )
    remarks = [f"{sized.valve.name}: {sized.remark}" for sized in sizing.valves if sized.remark]
    return Finding(
        name="design",
        kicker="Sizing study",
        title=problem.name,
        said=[*([problem.description] if problem.description and not problem.asked_profile else []), requirements],
        parts=(
            *_tables(sizing),
            Section(remarks=(sizing.summary, *remarks)),
            Section(
                "Error and gas over pressure",
                panels=partial(_pressure_panels, sizing),
                name="profile",
                caption="Every valve over supply pressure; each dot has the gains that use least gas within the error "
                "limit. Rings mark the chosen pressures.",
                across=2,
                size=(3.0, 2.7),
                is_detail=True,
            ),
            Section(
                "The torque",
                panels=partial(_torque_panels, sizing),
                name="torque",
                caption="The prescribed torque and the suggestion's.",
                size=(5.8, 2.5),
                is_detail=True,
            ),
            Section("How to read it", said=_READING, is_detail=True),
        ),
        found=sizing,
        passed=sizing.choice is not None,
        files={} if sizing.recording is None else {"suggested.csv": partial(marked_csv_bytes, sizing.recording)},
    )


def _tables(sizing: Sizing) -> tuple[Section, Section]:
    """Return the table of all valves, and the table of margins and gains of the valves that work."""
    from ppafo.analyses.design.search import PRESSURE, TORQUE
    from ppafo.control.catalog import CONTROLLERS
    from ppafo.report.finding import Section, columns_of
    from ppafo.report.kind import Kind

    gas, fraction = Kind("", "kg", "gas mass", ".3g"), Kind(quantity="fraction", form=".0f")
    quantities = CONTROLLERS[sizing.problem.scenario.controller.kind].quantities
    units = {f"controller.{quantity.name}": quantity.unit for quantity in quantities}
    rows, margins, marked = list[Any](), list[Any](), (list[int](), list[int]())
    for row, sized in enumerate(sizing.valves):
        if not sized.works:
            error = f"{TORQUE.number(sized.error)} at best"
            rows.append((sized.valve.name, None, None, error, *(None,) * 3, sized.limit))
            continue
        if sized is sizing.choice:
            marked = ([row], [len(margins)])
        bottle = "none" if sized.bottle is None else sized.bottle.name
        found = (sized.pressure, sized.lowest_pressure, sized.error, sized.gas, sized.gas_in_all)
        rows.append((sized.valve.name, *found, bottle, sized.limit))
        gains = (
            f"{path.rpartition('.')[2].replace('_', ' ')} {gain:.3g} {units[path]}"
            for path, gain in sized.gains.items()
        )
        margins.append((sized.valve.name, *sized.margins.values(), ", ".join(gains) or "none to choose"))
    pressures, gases = (("pressure", PRESSURE), ("lowest", PRESSURE)), (("gas per repetition", gas), ("total gas", gas))
    head = ("valve", *pressures, ("RMS error", TORQUE), *gases, "bottle", "limited by")
    fractions = [(f"{name} margin", fraction) for name in ("error", "torque", "flow", "gas")]
    return (
        Section("Valves", columns_of(head, rows), marked=marked[0]),
        Section("Margins" if margins else "", columns_of(("valve", *fractions, "gains"), margins), marked=marked[1]),
    )


def suggestion_sentence(sizing: Sizing) -> str:
    """Return a sentence with the suggestion and its reason, or the reason why there is none."""
    import numpy as np

    from ppafo.analyses.design.search import LIMITS, PRESSURE, TORQUE

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
    from ppafo.analyses.design.search import PRESSURE, TORQUE, ceiling

    problem, largest = sizing.problem, sizing.problem.profile.largest
    most = ceiling(problem, sized.pressure)
    if (cut := 1.0 - most / largest) <= _WHOLE_PEAK or sized.error != sized.error:
        return ""
    whole = problem.atmosphere + largest / problem.torque_constant
    higher = " and a higher pressure.highest" * (whole >= problem.highest_pressure)
    needs = f"pressure.lowest = '{PRESSURE.text(whole)}'{higher}"
    at_most = f"at most {TORQUE.text(most)} of {TORQUE.text(largest)}; the whole peak statically needs {needs}"
    return f", with {100.0 * cut:.0f} % of the peak cut off ({at_most})"


def _colours(sizing: Sizing) -> dict[str, str]:
    """Return the colour of each valve's curves by name."""
    from ppafo.report.style import COLOURS

    return {sized.valve.name: colour for sized, colour in zip(sizing.valves, cycle(COLOURS), strict=False)}


def _pressure_panels(sizing: Sizing) -> list[Panel]:
    """Return panels of error and gas over supply pressure, with a ring at the pressure chosen for each valve."""
    from ppafo.analyses.design.search import PRESSURE, TORQUE
    from ppafo.report.kind import Kind
    from ppafo.report.panels import Mark, Panel
    from ppafo.report.style import BLACK, GREY

    limit, colours = sizing.problem.largest_error, _colours(sizing)
    dotted = {"marker": ".", "markersize": 4}
    ringed = {"linestyle": "", "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4}
    errors, gases = [Mark("level", (), limit, colour=BLACK, style={"linewidth": 1.0, "linestyle": "--"})], list[Mark]()
    rings = list[Mark]()
    for sized in sizing.valves:
        (pressure, error, gas), colour = sized.curve, colours[sized.valve.name]
        keeps = error <= limit
        errors.append(Mark("line", pressure, error, (), sized.valve.name, colour, dotted))
        gases.append(Mark("line", pressure[keeps], gas[keeps], colour=colour, style=dotted))
        if sized.works:
            label = "" if rings else "chosen pressure"
            rings.append(Mark("line", [sized.pressure], [sized.error], (), label, colour, ringed))
            gases.append(Mark("line", [sized.pressure], [sized.gas], colour=colour, style=ringed))
    error_kind, gas_kind = replace(TORQUE, words="RMS error"), Kind("Gas per repetition", "kg", "gas mass", ".3g")
    highest = float(error_kind.values(_MAXIMUM_OF_LIMIT * limit))

    def set_gas(axes: Axes) -> None:
        # Valves differ by some per cent: an axis from 0 would lay their curves on each other.
        axes.margins(y=0.15)
        if not any(sized.works for sized in sizing.valves):
            axes.text(0.5, 0.5, "no valve keeps the limit", transform=axes.transAxes, ha="center", color=GREY)

    def set_error(axes: Axes) -> None:
        axes.set_ylim(0.0, highest)

    return [
        Panel(PRESSURE, error_kind, errors + rings, "RMS error, limit dashed", legend="figure", then=set_error),
        Panel(PRESSURE, gas_kind, gases, "Gas, within the limit", then=set_gas),
    ]


def _torque_panels(sizing: Sizing) -> list[Panel]:
    """Return the panel of the prescribed torque and of the suggestion's over time."""
    import numpy as np

    from ppafo.analyses.design.search import PRESSURE, TORQUE
    from ppafo.report.kind import TIME
    from ppafo.report.panels import Mark, Panel
    from ppafo.report.style import REFERENCE

    times, choice, recording = (
        np.linspace(0.0, sizing.problem.scenario.run.duration, 3001),
        sizing.choice,
        sizing.recording,
    )
    prescribed = {"linestyle": REFERENCE.line, "linewidth": 1.2}
    marks = [Mark("line", times, sizing.problem.profile.at(times), (), "prescribed", REFERENCE.colour, prescribed)]
    if choice is not None and recording is not None:
        label = f"{choice.valve.name} at {PRESSURE.number(choice.pressure, '.3g')} {PRESSURE.axis_unit}"
        colour = _colours(sizing)[choice.valve.name]
        marks.append(Mark("line", recording.time, recording["torque"], label=label, colour=colour))
    return [Panel(TIME, TORQUE, marks, then=lambda axes: axes.margins(x=0.0))]
