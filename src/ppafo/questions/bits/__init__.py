"""Does this computer give the numbers that every other one gives, to the last bit?"""

from ppafo.questions.question import THREADS, Argument, Question

QUESTION = Question(
    name="bits",
    summary="check that this computer finds the same numbers as every other, to the last bit",
    group="tools",
    solve="ppafo.questions.bits.solve:bits",
    arguments=(
        Argument(("NAME",), "names", "scenarios, walks and courses to run; default: some of them", "NAME", nargs="*"),
        Argument(("--all",), "everything", "all scenarios, walks and courses", action="store_true", default=False),
        THREADS,
    ),
)
