"""The questions. Package ``ppafo.questions.NAME`` declares each one as ``QUESTION``; to add one: one line here."""

import importlib

from ppafo.questions.question import Question

QUESTIONS: dict[str, str] = {
    "reproduce": "reproduce the paper's experiments and check its claims",
    "unreported": "find what the paper's results imply about settings that it does not report",
    "sweep": "run a study: many runs, one row each, resumable",
    "compare": "compare configurations, also over an uncertain device",
    "sensitivity": "rank uncertain values by their influence: Sobol, Shapley or Morris indices",
    "montecarlo": "draw until the interval of a statistic is narrow enough",
    "find": "find the lowest or highest value that meets a condition on a metric",
    "linearise": "make a linear model of the plant near one point, for control design",
    "identify": "identify a parameter set, with uncertainty, from bench recordings",
    "validate": "compare a parameter set with recordings, channel by channel",
    "walk": "simulate walking with the device, without it, and healthy",
    "timing": "find how far a controller is off in time, and what the slap of the foot comes from",
    "endurance": "compute how long a bottle of gas lasts, and why it ends",
    "design": "find Pareto-optimal parts and settings: error, gas and mass",
    "size": "find the smallest valve, pressure and bottle for a torque profile and hours of use",
    "parts": "list real parts with the origin of every figure",
    "bits": "check that this computer finds the same numbers as every other, to the last bit",
    "tune": "tune gains for an objective under constraints, optionally robust",
    "league": "rank every controller on a task against what is possible at best",
}
"""Name of the command to what it does, in the order of the help."""


def question(name: str) -> Question:
    """Return the declaration of a question."""
    declared = importlib.import_module(f"ppafo.questions.{name}").QUESTION
    assert isinstance(declared, Question)
    return declared
