"""Which valve, supply pressure and bottle are just enough for a torque profile and hours of use?"""

from ppafo.questions.question import THREADS, Argument, Question

QUESTION = Question(
    name="size",
    summary="find the smallest valve, pressure and bottle for a torque profile and hours of use",
    group="decide",
    solve="ppafo.questions.size.answer:size",
    arguments=(
        Argument(("SIZING",), "problem", "name of a sizing file, or a .toml file", "SIZING", nargs="?"),
        THREADS,
    ),
    library="ppafo.questions.size.problem:FILE",
)
