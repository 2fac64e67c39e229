"""Which settings of its torque task does the paper imply, and how firm is its conclusion?"""

from dataclasses import replace

from ppafo.questions.question import SEED, Argument, Question, whole_number

QUESTION = Question(
    name="unreported",
    summary="find what the paper's results imply about settings that it does not report",
    group="the paper",
    solve="ppafo.questions.unreported.solve:infer_settings",
    arguments=(
        Argument(
            ("--draws",),
            "draws",
            "number of completions of the experiments; default 262144",
            "N",
            whole_number,
            262_144,
        ),
        replace(SEED, help="random seed; default 2011", default=2011),
    ),
)
