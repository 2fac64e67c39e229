"""The questions. Package ``ppafo.questions.NAME`` declares each one as ``QUESTION``; to add one: one line here."""

import importlib

from ppafo.questions.question import Question

QUESTIONS: dict[str, str] = {
    "reproduce": "run the paper's experiments and report against its claims",
    "unreported": "what the paper's results imply about the settings that it does not print",
    "sweep": "run a study: many runs, a row for each, resumable",
    "compare": "compare configurations, over an uncertain device too",
    "sensitivity": "say which uncertain value matters: Sobol, Shapley or Morris indices",
    "montecarlo": "draw until a statistic is known well enough",
    "find": "the lowest or highest value of a number that meets a condition on a metric",
    "identify": "bench recordings in, parameter set with uncertainty out",
    "validate": "compare a parameter set with recordings, channel by channel",
    "walk": "walk with the device, without it, and as the healthy gait would have it",
    "endurance": "how long a bottle of gas lasts for a gas use, and why it ends",
    "design": "find the parts and settings that no others beat in error, gas and mass",
    "size": "torque profile and hours of use in, smallest valve, pressure and bottle out",
    "parts": "list real parts with the origin of every figure",
    "tune": "search gains for a goal under constraints, robust where requested",
    "league": "rank every controller on a task, with the best that is possible",
}
"""Name of the command to what it does, in the order of the help."""


def question(name: str) -> Question:
    """Return the declaration of a question."""
    declared = importlib.import_module(f"ppafo.questions.{name}").QUESTION
    assert isinstance(declared, Question)
    return declared
