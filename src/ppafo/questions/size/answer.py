"""The answer of a sizing study: the valves with pressure and bottle, their margins, the suggestion, the doubts."""

from dataclasses import asdict
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_value, quantity_text
from ppafo.control.catalog import CONTROLLERS
from ppafo.questions.parts.answer import doubts_data, doubts_sections, titles_section
from ppafo.questions.size.figure import sizing_figure
from ppafo.questions.size.file import SizingProblem
from ppafo.questions.size.search import LIMITS
from ppafo.questions.size.solve import SizedValve, Sizing
from ppafo.questions.size.volumes import other_sentences
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.version import __version__

_HEAD = (
    Column("valve"),
    Column("pressure", "pressure", ".3g"),
    Column("lowest", "pressure", ".3g"),
    Column("RMS error", "torque", ".3g"),
    Column("gas per repetition", "gas mass", ".3g"),
    Column("total gas", "gas mass", ".3g"),
    Column("bottle"),
    Column("mass", "part mass"),
    Column("limited by"),
)
_MARGINS = ("error", "torque", "flow", "gas")
_MARGIN_HEAD = (
    Column("valve"),
    *(Column(f"{name} margin", "fraction", ".0f") for name in _MARGINS),
    Column("gains"),
)
_ORIGINS = {
    "typed": "typed, not measured",
    "measured": "measured",
    "simulated": "simulated, not measured",
    "synthetic": "synthetic, not measured",
}
_CAPTION = (
    "A: the prescribed torque and that of the suggestion. B, C: every valve over supply pressure, each dot with the "
    "gains that use least gas within the limit; rings are the chosen pressures."
)
_READING = (
    "The pressure is the one with the lightest bottle, of these the lowest; the lowest pressure that keeps the "
    "error limit stands beside it.",
    "Error margin: how much smaller the RMS error is than its limit. Torque margin: how much more torque the "
    "pressure can hold than the profile requires; below 0 the peak is cut off, as far as the error limit allows. "
    "Flow margin: how much smaller the opening might be if the gauge pressure were a tenth higher. Gas margin: how "
    "much more the bottle has than is used, the reserve included.",
)


def answer_of(sizing: Sizing) -> Answer:
    """Return the answer of a sizing study; it has not passed where nothing can be suggested."""
    problem, recording = sizing.problem, sizing.recording
    suggestion = suggestion_sentence(sizing)
    return Answer(
        name="size",
        kicker="Sizing study",
        title=problem.name,
        lead=(*([problem.description] if problem.description else []), _profile_sentence(problem)),
        sections=(
            *_tables(sizing),
            Section(remarks=(suggestion, *other_sentences(sizing.others), *_remarks(sizing))),
            Section(
                "Error and gas over pressure",
                figure=Figure("size", _CAPTION, lambda: sizing_figure(sizing)),
                is_detail=True,
            ),
            *doubts_sections(sizing.doubtful),
            Section("How to read it", (*_READING, *_method(sizing)), is_detail=True),
            titles_section([item.valve for item in sizing.valves]),
        ),
        data=_data(sizing, suggestion),
        passed=sizing.choice is not None,
        files={} if recording is None else {"suggested.csv": lambda: marked_csv_bytes(recording)},
    )


def _tables(sizing: Sizing) -> list[Section]:
    marked = () if sizing.suggested is None else (sizing.suggested,)
    working = [place for place, item in enumerate(sizing.valves) if item.works]
    margins = tuple(_margin_row(sizing.problem, sizing.valves[place]) for place in working)
    sections = [Section("Valves", table=Table(_HEAD, tuple(map(_row, sizing.valves)), marked))]
    if margins:
        places = tuple(working.index(place) for place in marked)
        sections.append(Section("Margins", table=Table(_MARGIN_HEAD, margins, places)))
    return sections


def _profile_sentence(problem: SizingProblem) -> str:
    profile = problem.profile
    near = (
        f", {profile.knot_times.size} knots, to {quantity_text(profile.table_error, 'torque')}"
        if profile.table_error
        else ""
    )
    return (
        f"profile of {quantity_text(profile.period, 'time')} with up to {quantity_text(profile.largest, 'torque')} "
        f"({_ORIGINS[profile.kind]}{near}); {problem.repetitions:.0f} repetitions ({problem.hours:.2g} h), RMS error "
        f"at most {quantity_text(problem.largest_error, 'torque')}, {100 * problem.reserve:.0f} % of the gas as "
        "reserve"
    )


def _row(item: SizedValve) -> tuple[str | float | None, ...]:
    if not item.works:
        error = f"{display_value(item.error, 'torque'):.3g} at best"
        return item.valve.name, None, None, error, None, None, None, None, item.limit
    bottle = "none" if item.bottle is None else item.bottle.name
    lowest = item.lowest_pressure or item.pressure
    return item.valve.name, item.pressure, lowest, item.error, item.gas, item.gas_in_all, bottle, item.mass, item.limit


def _margin_row(problem: SizingProblem, item: SizedValve) -> tuple[str | float | None, ...]:
    margins = [None if item.margins is None else getattr(item.margins, name) for name in _MARGINS]
    return item.valve.name, *margins, _gains(problem, item)


def _gains(problem: SizingProblem, item: SizedValve) -> str:
    control = problem.scenario.control
    units = {f"controller.{quantity.name}": quantity.unit for quantity in CONTROLLERS[control.kind].quantities}
    gains = [
        f"{path.rpartition('.')[2].replace('_', ' ')} {value:.3g} {units[path]}" for path, value in item.gains.items()
    ]
    return ", ".join(gains) or "none to choose"


def suggestion_sentence(sizing: Sizing) -> str:
    """Return the suggestion with the reason, or why there is none."""
    item = sizing.choice
    if item is None:
        if any(valve.works for valve in sizing.valves):
            return "no suggestion: valves keep the limit, but no bottle is large enough for the use"
        return "no suggestion: no valve keeps the error limit at any of the pressures"
    bottle = "" if item.bottle is None else f" and {item.bottle.name}"
    return (
        f"suggested: {item.valve.name} at {quantity_text(item.pressure, 'pressure')}{bottle}, the lightest that meets "
        f"all requirements, {quantity_text(item.mass or 0.0, 'part mass', '.0f')}; a lower pressure is prevented by "
        f"{LIMITS[item.limit]}"
    )


def _remarks(sizing: Sizing) -> list[str]:
    failed = sum(sizing.failures.values())
    failures = f"{failed:,} failed; the first: {next(iter(sizing.failures))}" if failed else "none failed"
    remarks = [f"{item.valve.name}: {item.remark}" for item in sizing.valves if item.remark]
    if sizing.streams:
        remarks.append(
            f"sensors are noisy: every trial was run in the same {sizing.streams} noise streams; its error is the "
            "largest of them, its gas the mean"
        )
    return [*remarks, f"{sizing.runs:,} runs in {sizing.seconds:.0f} s; {failures}"]


def _method(sizing: Sizing) -> list[str]:
    problem = sizing.problem
    carried = [*problem.regulators, *([] if problem.actuator is None else [problem.actuator])]
    others = f" with {', '.join(part.title for part in carried)}" if carried else ""
    return [
        f"The mass is that of valve and full bottle{others}.",
        f"{problem.simulated} repetitions of the profile were simulated from the initial state of the scenario; "
        "error and gas cover all of them, including the first filling of the chambers. Friction, leak, dead volumes "
        "and sensors are those of the scenario; what the data sheet of a valve does not state is taken as ideal.",
        f"Made with: ppafo size {problem.file}",
    ]


def _data(sizing: Sizing, suggestion: str) -> dict[str, Any]:
    problem = sizing.problem
    return {
        "format": "ppafo sizing",
        "schema_version": 1,
        "name": problem.name,
        "description": problem.description,
        "file": problem.file,
        "units": "SI; pressures absolute, errors in N m, gas and mass in kg, margins as fractions",
        "scenario": problem.scenario.name,
        "profile": {
            "kind": problem.profile.kind,
            "period": problem.profile.period,
            "largest": problem.profile.largest,
            "table_error": problem.profile.table_error,
            "times": problem.profile.knot_times.tolist(),
            "torques": problem.profile.knot_values.tolist(),
        },
        "repetitions": problem.repetitions,
        "hours": problem.hours,
        "reserve": problem.reserve,
        "largest_error": problem.largest_error,
        "suggested": None if sizing.choice is None else sizing.choice.valve.name,
        "summary": suggestion,
        "valves": [_valve_data(item) for item in sizing.valves],
        "other_chambers": [asdict(one) for one in sizing.others],
        "noise_streams": sizing.streams,
        "runs": sizing.runs,
        "failures": [{"reason": reason, "runs": count} for reason, count in sizing.failures.items()],
        "doubtful": doubts_data(sizing.doubtful),
        "versions": {"ppafo": __version__},
    }


def _valve_data(item: SizedValve) -> dict[str, Any]:
    margins = item.margins
    return {
        "valve": item.valve.name,
        "works": item.works,
        "pressure": item.pressure,
        "lowest_pressure": item.lowest_pressure,
        "gains": dict(item.gains),
        "error": item.error,
        "gas_per_repetition": item.gas,
        "gas_in_all": item.gas_in_all,
        "bottle": None if item.bottle is None else item.bottle.name,
        "mass": item.mass,
        "margins": None if margins is None else {name: getattr(margins, name) for name in _MARGINS},
        "limited_by": item.limit,
        "limit": LIMITS[item.limit],
        "remark": item.remark,
    }
