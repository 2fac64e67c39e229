"""What a lower supply pressure costs in error and saves in gas: a run at each pressure."""

from collections.abc import Sequence
from dataclasses import dataclass

import ppafo
from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.questions.question import SET, Argument, Question, Solved

QUESTION = Question(
    name="pressures",
    summary="show what a lower supply pressure costs in error and saves in gas",
    group="decide",
    solve="my_questions.pressures:pressures",
    arguments=(
        Argument(("SCENARIO",), "scenario", "name of a scenario, or a .toml file", "SCENARIO"),
        Argument(
            ("--pressure",),
            "levels",
            "a supply pressure, for example '40 psi_g'; may be repeated",
            metavar="PRESSURE",
            action="append",
            default=(),
            is_required=True,
        ),
        SET,
    ),
)


@dataclass(frozen=True, slots=True, repr=False)
class Pressures(Solved):
    """A scenario at several supply pressures: how each run ended, its RMS error [N m] and its gas [kg]."""

    scenario: str
    levels: tuple[str, ...]
    ends: tuple[str, ...]
    errors: tuple[float | None, ...]
    gas: tuple[float | None, ...]


def pressures(scenario: str, levels: Sequence[str], overrides: Sequence[str] = ()) -> Pressures:
    """Return a scenario at supply pressures such as "40 psi_g". ScenarioError for bad input."""
    scenarios = [ppafo.load_scenario(scenario, [*overrides, f"supply.pressure={level}"]) for level in levels]
    runs = ppafo.simulate_many(scenarios)
    errors, gas = (
        tuple(run.metrics[name].value if name in run.metrics else None for run in runs)
        for name in ("rms_error", "gas_vented")
    )
    return Pressures(scenarios[0].name, tuple(levels), tuple(run.status.kind for run in runs), errors, gas)


def answer_of(found: Pressures) -> Answer:
    """Return the answer: one row for each pressure, and the error over the gas."""
    head = (Column("supply"), Column("run"), Column("RMS error", "torque"), Column("gas vented", "gas mass"))
    rows = tuple(zip(found.levels, found.ends, found.errors, found.gas, strict=True))
    drawn = Figure("pressures", "RMS error over gas; one point for each supply pressure.", lambda: draw(found))
    return Answer(
        name="pressures",
        kicker="Supply pressure",
        title=f"{found.scenario} at {len(rows)} supply pressures",
        lead=(f"{found.ends.count('completed')} of {len(rows)} runs were completed",),
        sections=(Section("Error and gas", table=Table(head, rows), figure=drawn),),
        data={
            "scenario": found.scenario,
            "runs": [dict(zip(("supply", "status", "rms_error", "gas_vented"), row, strict=True)) for row in rows],
        },
        passed=found.ends.count("completed") == len(rows),
    )


def draw(found: Pressures):
    """Return the figure; Matplotlib is loaded only here."""
    from ppafo.answers.style import BLUE, Margins, figure_of_panels, house_style, mark_kind

    grams = [None if gas is None else 1e3 * gas for gas in found.gas]
    with house_style():
        figure, ((axes,),) = figure_of_panels((7.0, 3.8), Margins(0.85, 0.25, 0.4, 0.55, 0.0), 1)
        axes.scatter(grams, found.errors, color=BLUE)
        axes.set_xlabel("gas vented (g)")
        axes.set_ylabel("RMS error (N m)")
        mark_kind(figure, "simulated")
        return figure
