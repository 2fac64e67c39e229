"""How are the metrics of a study distributed over many runs, how do they depend on what varies?"""

from ppafo.questions.question import SEED, SET, THREADS, Argument, Question, counting_number, fraction

QUESTION = Question(
    name="sweep",
    summary="run a study: many runs, one row each, resumable; or a statistic to a wanted precision",
    group="decide",
    solve="ppafo.questions.sweep.solve:sweep_into_folder",
    arguments=(
        Argument(("STUDY",), "study", "name of a study, or a .toml file", "STUDY", nargs="?"),
        Argument(
            ("--out",), "out", "folder or address for the results; default out/NAME with the name of the study", "DIR"
        ),
        SET,
        Argument(
            ("--draws",),
            "draws",
            "number of draws, instead of the number in the file; of a statistic the maximum, default 1,048,576",
            "N",
            counting_number,
        ),
        SEED,
        THREADS,
        Argument(
            ("--scheduler",), "scheduler", "address of a Dask scheduler whose workers compute the chunks", "ADDRESS"
        ),
        Argument(
            ("--yes",),
            "agreed",
            "start even if the results will fill much of the disk",
            action="store_true",
            default=False,
        ),
        Argument(
            ("--statistic",),
            "statistic",
            "draw until the interval of a statistic is narrow enough, and keep no rows: mean, 'quantile 0.95', "
            "'probability above 1.2 N m', 'probability below 0.5 g'",
            "WORDS",
        ),
        Argument(("--metric",), "metric", "with --statistic: name of a metric, such as rms_error", "NAME"),
        Argument(
            ("--width",),
            "width",
            "target width of the interval: '1 %%' of the value (default), or '0.01 N m'; of a probability, 0.02",
            "WIDTH",
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
            ("--first-draws",), "first_draws", "draws before the first estimate; default 256", "N", counting_number
        ),
        Argument(("--confidence",), "confidence", "confidence of the interval; default 95%%", "FRACTION", fraction),
        Argument(
            ("--maximum-failed",),
            "maximum_failed",
            "fraction of the runs that may fail before the statistic is refused; default 1%%",
            "FRACTION",
            fraction,
        ),
    ),
    library="ppafo.studies.loading:STUDY_FILES",
    listing="ppafo.questions.sweep.solve:studies_of_the_package",
    fills_folder=True,
)
