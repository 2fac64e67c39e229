"""Which uncertain value matters? Sobol indices, Shapley effects, and the signed change of a metric."""

from ppafo.questions.question import CONFIDENCE, SEED, SET, THREADS, Argument, Question, maximum_failed, whole_number

QUESTION = Question(
    name="sensitivity",
    summary="rank uncertain values by their influence: Sobol or Shapley indices, signed changes",
    group="decide",
    solve="ppafo.questions.sensitivity.solve:sensitivity",
    arguments=(
        Argument(("STUDY",), "study", "a study with distributions: a name, or a .toml file", "STUDY"),
        Argument(
            ("--method",),
            "method",
            "default: sobol, or shapley if values are correlated",
            metavar="sobol|shapley",
        ),
        Argument(
            ("--metric",),
            "metrics",
            "metric to analyse, may be repeated; default: the metrics of the study",
            metavar="NAME",
            action="append",
            default=(),
        ),
        Argument(
            ("--samples",),
            "samples",
            "number of base points (sobol, default 8192) or orders (shapley, 2048)",
            metavar="N",
            type=whole_number,
        ),
        Argument(("--configuration",), "configuration", "configuration of the study, needed if it has several", "NAME"),
        Argument(
            ("--independent",),
            "independent",
            "ignore the correlations of the study",
            action="store_true",
            default=False,
        ),
        SET,
        SEED,
        THREADS,
        CONFIDENCE,
        maximum_failed(0.02),
    ),
)
