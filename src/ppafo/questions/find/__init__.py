"""How low, or how high, may a value be so that a condition on a metric holds?"""

from ppafo.questions.question import SET, THREADS, Argument, Question, counting_number

QUESTION = Question(
    solve="ppafo.questions.find.solve:find",
    arguments=(
        Argument(("SCENARIO",), "scenario", "a scenario: a name, or a .toml file", "SCENARIO"),
        Argument(
            ("--vary",),
            "vary",
            "the number of the scenario or its device, and its range, for example 'supply.pressure=20..90 psi_g'",
            metavar="PATH=LOW..HIGH",
            is_required=True,
        ),
        Argument(
            ("--such-that",),
            "such_that",
            "the condition: a metric, <= or >=, and a limit, for example 'final_error <= 0.3 N m'",
            metavar="CONDITION",
            is_required=True,
        ),
        Argument(("--lowest",), "highest", "the lowest value, as by default", action="store_false", default=False),
        Argument(("--highest",), "highest", "the highest value", action="store_true", default=False),
        Argument(
            ("--grid",), "grid", "values tried first, evenly over the range; default 64", "N", counting_number, 64
        ),
        SET,
        THREADS,
    ),
)
