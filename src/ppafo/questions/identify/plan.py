"""The next experiments as people use them: what they promise, a bench file and requests to the virtual rig."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers import Column, Section, Table
from ppafo.answers.style import BLUE, GREY, VERMILION, house_style
from ppafo.errors import DataError
from ppafo.identification.trajectory.doubt import title_of
from ppafo.identification.trajectory.next_experiment import NextExperiments
from ppafo.rig.experiments import FORMAT, RIG_FILE
from ppafo.storage.result_folder import read_json
from ppafo.units import percentage

if TYPE_CHECKING:
    import matplotlib.figure

PLAN_FIGURE = "next-experiments"
_OF_THE_DEVICE = (
    "gas.",
    "actuator.",
    "friction.",
    "foot_plate.",
    "valve.",
    "valves.",
    "flow.",
    "effects.",
    "rig.valve.",
)
"""Sections of changes that are of the device; all others are of the experiment."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The next experiments, the problem file that they belong to, the new set, its valve, and the sample rate.

    ``planted`` is the device on which the virtual rig made the earlier recordings, a set and its changes, where it did.
    """

    following: NextExperiments
    problem_file: str
    set_file: str
    valve: str | None
    rate: str
    planted: "PlantedDevice | None" = None


@dataclass(frozen=True, slots=True)
class PlantedDevice:
    """The device of a synthetic recording: its set, and what was changed in it."""

    parameter_set: str
    overrides: tuple[str, ...]


def planted_device(recordings: Iterable[Path]) -> PlantedDevice | None:
    """Return the device that the virtual rig recorded all of these on, as its file beside them says; else None.

    DataError where the file is the rig's and says it in another form.
    """
    found = set()
    for recording in recordings:
        notes = recording.parent / RIG_FILE
        document = read_json(notes) if notes.is_file() else None
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            return None
        try:
            made = document["recordings"].get(recording.name)
            if made is None:
                return None
            changes = tuple(str(item) for item in made["overrides"] if str(item).startswith(_OF_THE_DEVICE))
            found.add(PlantedDevice(str(made["parameter_set"]), changes))
        except (LookupError, TypeError, AttributeError) as error:
            raise DataError(f"{notes}: does not state how '{recording.name}' was recorded") from error
    return found.pop() if len(found) == 1 else None


def plan_section(plan: Plan) -> Section:
    """Return what was chosen and what it promises, beside three at random."""
    found = plan.following
    number = len(found.chosen)
    if not number:
        text = (
            f"next experiment: none of {found.candidates} candidates can be relied upon: all are rough or bend too much"
        )
        return Section(paragraphs=(text,))
    head = ("", "now", f"with {'it' if number == 1 else f'these {number}'}", "three at random")
    widths = [(one.name, *(_share(value) for value in (one.now, one.after, one.at_random))) for one in found.widths]
    seen = [
        (f"{title_of(one.name)}, {one.size}", *(f"{value:.1f} SE" for value in (one.now, one.after, one.at_random)))
        for one in found.visibility
    ]
    return Section(
        f"next experiment{'s' if number > 1 else ''}, of {found.candidates} candidates ({found.dropped} left out: "
        "rough, or bent by a harmful size of an effect):",
        table=Table(tuple(Column(title) for title in head), (*widths, *seen)),
        remarks=(
            *(f"{one.label}: {one.scenario}: {', '.join(one.overrides)}" for one in found.chosen),
            "promised half widths of intervals, and standard errors of each effect at the smallest size that would "
            "move a number by half its interval",
        ),
    )


def _share(value: float) -> str:
    return percentage(value, 2) if value < 10.0 else "unknown"


def bench_file(plan: Plan) -> str:
    """Return the tables [[trajectory.experiments]] of the recordings to be made, for the end of the problem."""
    lines = [
        f"# Put at the end of {plan.problem_file} once the recordings are there: what was chosen, word for word.",
        "# A recording needs columns for angle, both pressures and, where its command is followed, the command.",
    ]
    for one in plan.following.chosen:
        lines += [
            "",
            "[[trajectory.experiments]]",
            f'label = "{one.label}"',
            f'recording = "{one.label}/{one.rig_experiment}.csv"',
            f'scenario = "{one.scenario}"',
            f"overrides = [{', '.join(_quoted(item) for item in one.overrides)}]",
        ]
        lines += ['inputs = ["command"]'] if one.follows_command else []
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return f'"{text}"'


def rig_requests(plan: Plan) -> str:
    """Return the commands with which the virtual rig records what was chosen, all of it synthetic.

    It does so on the device of earlier synthetic recordings, so that all of them are of one device. Else it takes the
    set that was found.
    """
    lines = [
        f"# Run this in the folder of {plan.problem_file}: bash identified/next-rig.sh, if that is where it is.",
        "# The virtual rig in place of the bench: what it records is synthetic.",
    ]
    if plan.planted is None:
        lines.append("# The device is the one that was identified. It is not quite that of earlier recordings.")
        device, changes_of_device = f'"$(dirname "$0")/{plan.set_file}"', ""
    else:
        lines.append("# The device is that of the earlier recordings, as their rig.json says.")
        device = plan.planted.parameter_set
        changes_of_device = "".join(f' --set "{item}"' for item in plan.planted.overrides)
    valve = "" if plan.valve is None else f" --valve {plan.valve}"
    for number, one in enumerate(plan.following.chosen, start=1):
        changes = " ".join(f'--set "{item}"' for item in one.overrides)
        lines.append(
            f"ppafo rig simulate {one.rig_experiment} --preset ideal-laboratory --device {device}{valve} "
            f'--seed {100 + number} --set "rig.sampling.rate={plan.rate}"{changes_of_device} {changes} '
            f"--out {one.label}"
        )
    return "\n".join(lines) + "\n"


def plan_figure(plan: Plan) -> "matplotlib.figure.Figure":
    """Return half widths and visibilities now, with what was chosen, and with three at random, on log axes."""
    import matplotlib.figure

    found = plan.following
    rows = max(len(found.widths), len(found.visibility), 1)
    with house_style():
        figure = matplotlib.figure.Figure(figsize=(9.6, 1.5 + 0.36 * rows), layout="constrained")
        left, right = figure.subplots(1, 2)
        for axes, promises, scale, title in (
            (left, found.widths, 100.0, "Half width of the interval (%)"),
            (right, found.visibility, 1.0, "Visibility of an effect (standard errors)"),
        ):
            names = [one.name if axes is left else title_of(one.name).split(" (")[0] for one in promises]
            places = np.arange(len(promises))
            for label, colour, marker, values in (
                ("now", GREY, "o", [one.now for one in promises]),
                ("three at random", BLUE, "s", [one.at_random for one in promises]),
                ("chosen", VERMILION, "D", [one.after for one in promises]),
            ):
                shown = np.maximum(scale * np.array(values), _LEAST)
                axes.plot(shown, places, marker, color=colour, label=label, markersize=5)
            axes.set_yticks(places, names)
            axes.set_ylim(len(promises) - 0.5, -0.5)
            axes.set_xscale("log")
            axes.set_title(title)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        return figure


_LEAST = 0.01
"""Percent, or standard errors, below which a figure shows no difference."""
