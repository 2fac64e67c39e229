"""How well does a controller know the time in the stride, and what does it make of the slap of the foot?"""

from ppafo.questions.question import SET, Argument, Question, minutes

QUESTION = Question(
    name="timing",
    summary="find how far a controller is off in time, and what the slap of the foot comes from",
    group="walk",
    solve="ppafo.questions.timing.answer:event_timing",
    arguments=(
        Argument(
            ("WALK",),
            "configuration",
            "name of a walk configuration, or a .toml file; default solenoid",
            metavar="WALK",
            nargs="?",
            default="solenoid",
        ),
        Argument(("--gait",), "gait", "name of a gait, or a gait file; default: the gait of the configuration", "GAIT"),
        Argument(("--minutes",), "minutes", "time to walk in each way, at most 2; default 1", "N", minutes),
        SET,
    ),
)
