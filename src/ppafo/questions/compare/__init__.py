"""Which configuration is better, by how much, and how surely?"""

import argparse

from ppafo.questions.question import CONFIDENCE, SEED, SET, THREADS, Argument, Question, maximum_failed, whole_number


def _task(text: str) -> tuple[str, list[str]]:
    name, colon, overrides = (part.strip() for part in text.partition(":"))
    if not name or not colon or not overrides:
        raise argparse.ArgumentTypeError(
            f"{text}: is not of the form NAME:PATH=VALUE, for example 'slow:reference.ramp_time=2 s'"
        )
    return name, [item.strip() for item in overrides.split(",")]


QUESTION = Question(
    name="compare",
    summary="compare configurations, also over an uncertain device",
    group="decide",
    solve="ppafo.questions.compare.solve:compare",
    arguments=(
        Argument(
            ("SCENARIO",),
            "configurations",
            "names of scenarios or .toml files; default: the configurations of --study",
            "SCENARIO",
            nargs="*",
        ),
        Argument(
            ("--study",),
            "study",
            "study file that gives the distributions and, without SCENARIO, the configurations",
            "STUDY",
        ),
        Argument(
            ("--task",),
            "tasks",
            "a task for all configurations, for example 'slow:reference.ramp_time=2 s'; default: as the scenarios "
            "are written",
            metavar="NAME:PATH=VALUE[,PATH=VALUE]",
            type=_task,
            action="append",
            default=(),
        ),
        Argument(
            ("--baseline",), "baseline", "configuration that all others are compared with; default: the first", "NAME"
        ),
        Argument(("--draws",), "draws", "draws of the uncertain values; default 4096", "N", whole_number, 4096),
        SET,
        SEED,
        THREADS,
        CONFIDENCE,
        maximum_failed(0.01),
    ),
)
