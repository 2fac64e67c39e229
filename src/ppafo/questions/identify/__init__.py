"""What do bench recordings say about the device, and how surely?"""

from pathlib import Path

from ppafo.questions.question import Argument, Question

QUESTION = Question(
    name="identify",
    summary="identify a parameter set, with uncertainty, from bench recordings",
    group="from bench to model",
    solve="ppafo.questions.identify.solve:identify",
    arguments=(
        Argument(("PROBLEM",), "problem", "a problem file (.toml); see 'ppafo schema identification'", "PROBLEM", Path),
    ),
)
