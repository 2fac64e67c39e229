"""How good is each controller on a task, and how far is it from the best that is possible?"""

from ppafo.questions.question import SET, Argument, Question, minutes, whole_number

QUESTION = Question(
    name="league",
    summary="rank every controller on a task against what is possible at best",
    group="decide",
    solve="ppafo.questions.league.solve:league",
    arguments=(
        Argument(
            ("SCENARIO",),
            "scenario",
            "name of a scenario, or a .toml file; default torque-task-proportional",
            metavar="SCENARIO",
            nargs="?",
        ),
        Argument(
            ("--walk",),
            "walk",
            "compare in walking: name of a walk configuration, or a .toml file; default proportional",
            metavar="CONFIG",
            nargs="?",
            const="proportional",
        ),
        Argument(("--gait",), "gait", "with --walk: name of a gait, or a gait file", metavar="GAIT"),
        Argument(("--minutes",), "minutes", "with --walk: how long to walk; default 0.2", metavar="N", type=minutes),
        SET,
        Argument(
            ("--draws",),
            "draws",
            "random devices (and wearers, with --walk) around those of the task; 0 for none; default 100",
            metavar="N",
            type=whole_number,
            default=100,
        ),
        Argument(
            ("--seed",), "seed", "random seed of the draws; default 20110301", "N", type=whole_number, default=20110301
        ),
    ),
)
