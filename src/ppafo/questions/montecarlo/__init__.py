"""How sure is a number, and how many runs does it take?"""

from ppafo.questions.question import CONFIDENCE, SEED, SET, THREADS, Argument, Question, maximum_failed, whole_number

QUESTION = Question(
    name="montecarlo",
    summary="draw until the interval of a statistic is narrow enough",
    group="decide",
    solve="ppafo.questions.montecarlo.solve:monte_carlo",
    arguments=(
        Argument(("STUDY",), "study", "a study with distributions: a name, or a .toml file", "STUDY"),
        Argument(("--metric",), "metric", "name of a metric, such as rms_error", "NAME", is_required=True),
        Argument(
            ("--statistic",),
            "statistic",
            "mean (default), 'quantile 0.95', 'probability above 1.2 N m', 'probability below 0.5 g'",
            metavar="WORDS",
            default="mean",
        ),
        Argument(
            ("--width",),
            "width",
            "target width of the interval: '1 %%' of the value (default), or '0.01 N m'; of a probability, 0.02",
            metavar="WIDTH",
        ),
        Argument(
            ("--also",),
            "also",
            "a further metric, whose mean over the same draws is given; may be repeated",
            metavar="NAME",
            action="append",
            default=(),
        ),
        Argument(("--configuration",), "configuration", "configuration of the study, needed if it has several", "NAME"),
        Argument(
            ("--first-draws",), "first_draws", "draws before the first estimate; default 256", "N", whole_number, 256
        ),
        Argument(("--draws",), "draws", "maximum number of draws; default 1,048,576", "N", whole_number, 2**20),
        SET,
        SEED,
        THREADS,
        CONFIDENCE,
        maximum_failed(0.01),
    ),
)
