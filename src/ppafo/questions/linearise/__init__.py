"""What is a scenario's plant near one point, as a linear model: A, B, C and D with names and units?"""

import argparse

from ppafo.questions.question import SET, Argument, Question, quantity


def point(text: str) -> float | str:
    """Return a time [s], or ``equilibrium``; ArgumentTypeError for any other text."""
    if text.strip() == "equilibrium":
        return "equilibrium"
    try:
        return quantity("s")(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: must be a time such as '1.5 s', or 'equilibrium'") from error


QUESTION = Question(
    name="linearise",
    summary="make a linear model of the plant near one point, for control design",
    group="decide",
    solve="ppafo.questions.linearise.solve:linearise",
    arguments=(
        Argument(("SCENARIO",), "scenario", "name of a scenario, or a .toml file", "SCENARIO"),
        Argument(
            ("--at",),
            "at",
            "a time of the run, such as '1.5 s', or 'equilibrium' (default): the steady state that holds the last "
            "value of the reference",
            metavar="TIME",
            type=point,
            default="equilibrium",
        ),
        SET,
    ),
)
