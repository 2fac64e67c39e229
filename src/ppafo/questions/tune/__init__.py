"""Which gains are best? A search over bounds, for a weighted objective with constraints, robust where requested."""

from ppafo.questions.question import SEED, SET, THREADS, Argument, Question

QUESTION = Question(
    name="tune",
    summary="tune gains for an objective under constraints, optionally robust",
    group="decide",
    solve="ppafo.questions.tune.solve:tune",
    arguments=(
        Argument(("TUNING",), "tuning", "name of a tuning, or a .toml file", "TUNING", nargs="?"),
        SET,
        SEED,
        THREADS,
    ),
    library="ppafo.questions.tune.problem:TUNING",
)
