"""Which parts and settings does no other design beat in error, gas and mass?"""

from ppafo.questions.question import SEED, THREADS, Argument, Question

QUESTION = Question(
    name="design",
    summary="find Pareto-optimal parts and settings: error, gas and mass",
    group="decide",
    solve="ppafo.questions.design.solve:design",
    arguments=(
        Argument(("DESIGN",), "problem", "name of a design file, or a .toml file", "DESIGN", nargs="?"),
        SEED,
        THREADS,
    ),
    library="ppafo.questions.design.problem:FILE",
)
