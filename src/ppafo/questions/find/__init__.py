"""How low, or how high, may a value be so that a condition on a metric holds?"""

from ppafo.questions.question import SET, THREADS, Argument, Question, counting_number

QUESTION = Question(
    name="find",
    summary="find the lowest or highest value that meets a condition on a metric",
    group="decide",
    solve="ppafo.questions.find.solve:find",
    arguments=(
        Argument(("SCENARIO",), "scenario", "name of a scenario, or a .toml file", "SCENARIO"),
        Argument(
            ("--vary",),
            "vary",
            "a number of the scenario or its device, and its range, for example 'supply.pressure=20..90 psi_g'",
            metavar="PATH=LOW..HIGH",
            is_required=True,
        ),
        Argument(
            ("--such-that",),
            "such_that",
            "a metric, <= or >=, and a limit, for example 'final_error <= 0.3 N m'",
            metavar="CONDITION",
            is_required=True,
        ),
        Argument(("--lowest",), "highest", "find the lowest value (default)", action="store_false", default=False),
        Argument(("--highest",), "highest", "find the highest value", action="store_true", default=False),
        Argument(
            ("--grid",), "grid", "number of evenly spaced values to try first; default 64", "N", counting_number, 64
        ),
        SET,
        THREADS,
    ),
)
